#include "reconstruct/drift/wild_values.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "reconstruct/drift/gram.h"

namespace vlx {

namespace {

constexpr double kWildVariances = 9;  // beyond three standard deviations a value may be wild
constexpr double kFew = 0.02;         // of the values: as many may be

}  // namespace

double forgetWild(const WeightedValues& of, float square, std::vector<float>& sorted) {
    float* const x = of.values;
    const int n = of.count;
    double sums[2];
    weightedSums(x, of.weights, of.padded, sums);
    double mean = sums[0] / of.total;
    const double variance = (sums[1] - sums[0] * mean) / of.total;
    const float far = farthest(x, of.weights, of.padded, static_cast<float>(mean));
    if (far <= square || static_cast<double>(far) <= kWildVariances * variance) return variance;
    sorted.clear();
    for (int i = 0; i < n; ++i)
        if (of.weights[i] > 0) sorted.push_back(x[i]);
    const auto few =
        std::max<std::ptrdiff_t>(2, static_cast<std::ptrdiff_t>(kFew * static_cast<double>(sorted.size())));
    if (static_cast<std::ptrdiff_t>(sorted.size()) <= 2 * few) return variance;
    std::nth_element(sorted.begin(), sorted.begin() + few, sorted.end());
    const float low = sorted[static_cast<std::size_t>(few)];
    std::nth_element(sorted.begin(), sorted.end() - 1 - few, sorted.end());
    const float high = *(sorted.end() - 1 - few);
    const float margin = std::max(std::sqrt(square), high - low);
    const auto wild = [&](int i) { return x[i] < low - margin || x[i] > high + margin; };
    double known = 0, sum = 0;
    for (int i = 0; i < n; ++i)
        if (!wild(i)) {
            known += static_cast<double>(of.weights[i]);
            sum += static_cast<double>(of.weights[i] * x[i]);
        }
    if (!(known > 0)) return variance;
    mean = sum / known;
    for (int i = 0; i < n; ++i)
        if (wild(i)) x[i] = static_cast<float>(mean);
    weightedSums(x, of.weights, of.padded, sums);
    return (sums[1] - sums[0] * sums[0] / of.total) / of.total;
}

}  // namespace vlx
