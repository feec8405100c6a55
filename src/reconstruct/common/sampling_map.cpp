#include "variolux/reconstruct/sampling_map.h"

#include <cassert>
#include <cmath>

namespace vlx {

Image samplingMap(const Image& estimate) {
    constexpr double kEpsilon = 0.01;  // of relMSE
    int value[3], stddev[3];
    const char* const names[] = {"R", "G", "B"};
    for (int c = 0; c < 3; ++c) {
        value[c] = estimate.channel(names[c]);
        stddev[c] = estimate.channel(std::string("stddev.") + names[c]);
        assert(value[c] >= 0 && stddev[c] >= 0);
    }
    Image map(estimate.data, {"sampling.density"});
    map.display = estimate.display;
    double sum = 0;
    for (int row = 0; row < map.data.height; ++row)
        for (int col = 0; col < map.data.width; ++col) {
            const float* pixel = estimate.at(col, row);
            double squares = 0;
            for (int c = 0; c < 3; ++c) {
                const auto z = static_cast<double>(pixel[value[c]]),
                           s = static_cast<double>(pixel[stddev[c]]);
                squares += s * s / (z * z + kEpsilon) / 3;
            }
            sum += std::sqrt(squares);
            *map.at(col, row) = static_cast<float>(std::sqrt(squares));
        }
    const double mean = sum / static_cast<double>(map.data.pixels());
    for (float& density : map.pixels)
        density = mean > 0 ? static_cast<float>(static_cast<double>(density) / mean) : 1.f;
    return map;
}

}  // namespace vlx
