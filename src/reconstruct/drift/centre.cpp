#include "reconstruct/drift/centre.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/drift/gram.h"

namespace vlx {

namespace {

constexpr double kLeastFeatureSpread = 1e-8;  // squared: less is a constant
constexpr double kLeastPositionSpread = 1e-12;
constexpr int kPriorIterations = 4;

constexpr double kWildVariances = 9;  // beyond three standard deviations a value may be wild
constexpr double kFew = 0.02;         // of the values: as many may be

/// A feature's values in a neighbourhood.
struct WeightedValues {
    float* values;
    const float* weights;
    int count, padded;  ///< whole vectors: beyond `count` both are 0
    double total;       ///< of the weights
};

/// Weighted variance of the values, once wild ones are forgotten: a few (2 %) that lie farther from the range
/// of all others than it is wide, and than `square` allows features to differ at all, would fix a coefficient
/// by themselves. They count as not known: as the mean of the others. `sorted`: scratch.
double forgetWild(const WeightedValues& of, float square, std::vector<float>& sorted) {
    float* const x = of.values;
    const int n = of.count;
    double sums[2];
    weightedSums(x, of.weights, of.padded, sums);
    double mean = sums[0] / of.total;
    const double variance = (sums[1] - sums[0] * mean) / of.total;
    const float far = farthest(x, of.weights, of.padded, static_cast<float>(mean));
    if (far <= square || static_cast<double>(far) <= kWildVariances * variance) return variance;
    const auto fewOf = [](auto count) {
        return std::max<std::ptrdiff_t>(2, static_cast<std::ptrdiff_t>(kFew * static_cast<double>(count)));
    };
    // A wild value is farther from the others' range than that is wide, so more than half as far from a mean
    // within it: only a few on either side can be. This spares most neighbourhoods the sorting.
    if (countBeyond(x, of.weights, of.padded, static_cast<float>(mean), far / 4) > 2 * fewOf(n))
        return variance;
    sorted.clear();
    for (int i = 0; i < n; ++i)
        if (of.weights[i] > 0) sorted.push_back(x[i]);
    const auto few = fewOf(sorted.size());
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

}  // namespace

void Centre::krige(const TilePlanes& tile, int at, const Surroundings& around, const float* alike,
                   float* sums, NeighbourhoodCounts& counts) {
    begin(tile, at, around);
    select(around, alike);
    if (total_ <= 0) return;
    ++counts.neighbourhoods;
    stackFunctions();
    stackRadiance();
    weighted_.resize(rows_.size());
    gram_.resize(static_cast<std::size_t>(gramRows_ * gramRows_));
    weightedGram(rows_.data(), weights_.data(), gramRows_, stride_, padded(), weighted_.data(), gram_.data());
    const RandomDrift drift = fit();
    counts.features += static_cast<std::int64_t>(varying_.size());
    counts.failed += !drift.ok;
    counts.effective += drift.effective;
    predict(drift, sums);
}

void Centre::begin(const TilePlanes& tile, int at, const Surroundings& around) {
    tile_ = tile;
    centre_ = static_cast<std::size_t>(at);
    reach_ = around.reach;
    constexpr int kRoom = 8;  // gather() writes whole vectors
    stride_ = around.size() + kRoom;
    const int most = 1 + kPositionFunctions + tile.featureCount + tile.radiance + kBlockRows;
    rows_.resize(static_cast<std::size_t>(most * stride_));
    errors_.resize(static_cast<std::size_t>((tile.featureCount + 1) * stride_));
    runs_.resize(static_cast<std::size_t>(around.size() / 8));
    for (auto* of : {&weights_, &predicted_}) of->resize(static_cast<std::size_t>(stride_));
}

void Centre::list(const float* plane, float about, float* values) const {
    gather(plane, runs_.data(), runCount_, about, values);
    std::fill(values + count_, values + padded(), 0.f);
}

/// The data, their weights and places.
void Centre::select(const Surroundings& around, const float* alike) {
    const DataCounts found = selectData(around, alike, kLeastWeight, static_cast<int>(centre_), kTileSide,
                                        runs_.data(), predicted_.data(), row(1), row(2));
    count_ = found.data;
    runCount_ = found.runs;
    for (float* of : {predicted_.data(), row(1), row(2)}) std::fill(of + count_, of + padded(), 0.f);
    float *const counts = row(3), *const errors = row(4);
    list(tile_.counts, 0, counts);
    list(tile_.errors, 0, errors);
    const float own = samplesIn(tile_.counts[centre_]);
    const DataWeights sums = weighData(counts, errors, own, kLeastCountRatio, kMostCountRatio, padded(),
                                       predicted_.data(), weights_.data());
    total_ = sums.total;
    noise_ = sums.noise;
    gaps_ = sums.gaps;
}

/// The constant, positions, and the features about the centre's. Features that are constant here explain
/// nothing: they have no row.
void Centre::stackFunctions() {
    const int n = padded();
    std::fill_n(row(0), n, 1.f);
    multiply(row(1), row(1), n, row(3));
    multiply(row(2), row(2), n, row(4));
    multiply(row(1), row(2), n, row(5));
    varying_.clear();
    for (int f = 0; f < tile_.featureCount; ++f) {
        const float* values = tile_.features + TilePlanes::plane(f);
        const auto next = static_cast<int>(varying_.size());
        float* const x = row(1 + kPositionFunctions + next);
        list(values, values[centre_], x);
        if (forgetWild({x, weights_.data(), count_, n, total_}, kFarthest * kFeatureWidth2, sorted_) <
            kLeastFeatureSpread)
            continue;
        float* const errors = errors_.data() + next * stride_;
        list(tile_.features + TilePlanes::plane(FeaturePlanes{tile_.featureCount}.error(f)), 0, errors);
        double sums[2];
        weightedSums(errors, weights_.data(), n, sums);
        featureNoise_[varying_.size()] = sums[0];
        varying_.push_back(f);
    }
    functions_ = kPositionFunctions + static_cast<int>(varying_.size());
}

/// Radiance about the centre's; the rest of the rows is 0.
void Centre::stackRadiance() {
    const int used = 1 + functions_ + tile_.radiance;
    gramRows_ = (used + kBlockRows - 1) / kBlockRows * kBlockRows;
    for (int c = 0; c < tile_.radiance; ++c) {
        const float* values = tile_.means + TilePlanes::plane(c);
        list(values, values[centre_], row(1 + functions_ + c));
    }
    for (int r = used; r < gramRows_; ++r) std::fill_n(row(r), padded(), 0.f);
}

/// The normal equations about the weighted means, of functions that are standardised; constant ones are left
/// out.
RandomDrift Centre::fit() {
    double spread = 0, level = 0;
    for (int c = 0; c < 3; ++c) {
        const int z = 1 + functions_ + c;
        const double value = tile_.means[TilePlanes::plane(c) + centre_] + gram(z, 0) / total_;
        spread += std::max(0.0, centred(z, z)) / total_ / 3;
        level += value * value;
    }
    variance_ = std::max(noise_ / total_, 1e-10 * level + kLeastSquare);
    used_.clear();
    group_.clear();
    for (int j = 0; j < functions_; ++j) {
        const double square = centred(1 + j, 1 + j) / total_;
        const int f = j - kPositionFunctions;  // which of varying_
        if (!(square > (f < 0 ? kLeastPositionSpread : kLeastFeatureSpread))) continue;
        unit_[used_.size()] = 1 / std::sqrt(square);
        used_.push_back(1 + j);
        group_.push_back(
            f < 0 ? tile_.groups + (j >= 2)
                  : (*tile_.group)[static_cast<std::size_t>(varying_[static_cast<std::size_t>(f)])]);
    }
    const auto p = static_cast<Eigen::Index>(used_.size());
    DriftMoments moments;
    moments.normal.resize(p, p);
    moments.right.resize(p, tile_.radiance);
    moments.fitted = 3;
    moments.start = 1 / std::max(spread, variance_);
    for (Eigen::Index a = 0; a < p; ++a) {
        const auto i = static_cast<std::size_t>(a);
        for (Eigen::Index b = 0; b <= a; ++b) {
            const auto j = static_cast<std::size_t>(b);
            moments.normal(a, b) = moments.normal(b, a) =
                centred(used_[i], used_[j]) * unit_[i] * unit_[j] / variance_;
        }
        if (used_[i] > kPositionFunctions)
            moments.normal(a, a) +=
                featureNoise_[static_cast<std::size_t>(used_[i] - 1 - kPositionFunctions)] * unit_[i] *
                unit_[i] / variance_;
        for (int c = 0; c < tile_.radiance; ++c)
            moments.right(a, c) = centred(used_[i], 1 + functions_ + c) * unit_[i] / variance_;
    }
    return fitRandomDrift(moments, group_, tile_.groups + 2, kPriorIterations);
}

/// No function is followed beyond the data: pixels without any take its nearest value among them. Few data
/// fix coefficients that hold between them, and are thousands of times too large elsewhere.
void Centre::limitFunctions() {
    const auto n = static_cast<std::size_t>(count_);
    for (int j = 1; j <= functions_; ++j) {
        float* const x = row(j);
        float least = std::numeric_limits<float>::infinity(), most = -least;
        for (std::size_t i = 0; i < n; ++i) {
            if (weights_[i] <= 0) continue;
            least = std::min(least, x[i]);
            most = std::max(most, x[i]);
        }
        for (std::size_t i = 0; i < n; ++i)
            if (weights_[i] <= 0) x[i] = std::clamp(x[i], least, most);
    }
}

void Centre::predict(const RandomDrift& drift, float* sums) {
    const EstimatePlanes out{tile_.radiance};
    const int n = padded();
    const auto plane = [&](int k) { return sums + TilePlanes::plane(k); };
    const auto add = [&](const float* values, int k) { scatter(values, runs_.data(), runCount_, plane(k)); };
    // Towards its border a neighbourhood counts less, else its border shows.
    const float edge = static_cast<float>(reach_) / static_cast<float>(reach_ + 1);
    taper(row(1), row(2), edge * edge, static_cast<float>(1 / variance_), n, predicted_.data());
    add(predicted_.data(), out.weight());
    if (gaps_) limitFunctions();
    estimates_.resize(static_cast<std::size_t>(6 * stride_));
    float *const about = estimates_.data(), *const sum = about + stride_, *const square = sum + stride_,
                 *const fromFeatures = square + stride_;
    // Kriging variance, on average over the data: the constant and each effective function cost one part in
    // as many as there are.
    const auto part = static_cast<float>((1 + drift.effective) / total_);
    const float krigingVariance = static_cast<float>(variance_) * part;
    for (int i = 0; i < n; ++i) {
        const auto k = static_cast<std::size_t>(i);
        sum[i] = predicted_[k] * krigingVariance;
        square[i] = predicted_[k] * std::min(1.f, weights_[k] * part);
    }
    add(sum, out.variance());
    add(square, out.leverage());
    sumFeatureErrors(drift, fromFeatures);
    for (int c = 0; c < tile_.radiance; ++c) {
        double offset = tile_.means[TilePlanes::plane(c) + centre_] + gram(1 + functions_ + c, 0) / total_;
        std::array<float, kMaxRandomDrift> coefficients;
        for (std::size_t i = 0; i < used_.size(); ++i) {
            const double b = drift.coefficients(static_cast<Eigen::Index>(i), c) * unit_[i];
            coefficients[i] = static_cast<float>(b);
            offset -= b * gram(used_[i], 0) / total_;
        }
        list(tile_.references + TilePlanes::plane(c), 0, about);
        predictChannel(
            {rows_.data(), stride_, static_cast<int>(used_.size()), used_.data(), coefficients.data()},
            static_cast<float>(offset), about, predicted_.data(), fromFeatures + std::min(c, 2) * n, n, sum,
            square);
        add(sum, out.sum(c));
        if (c < 3) add(square, out.square(c));
    }
}

/// What errors of the features make of R, G, B of each datum, sum over features of b^2 u: both halves have it
/// in common, so it counts twice in the mean of their variances. Three lists.
void Centre::sumFeatureErrors(const RandomDrift& drift, float* out) const {
    std::fill_n(out, 3 * padded(), 0.f);
    for (std::size_t j = 0; j < used_.size(); ++j) {
        const int f = used_[j] - 1 - kPositionFunctions;
        if (f < 0 || featureNoise_[static_cast<std::size_t>(f)] == 0) continue;
        float square[3];
        for (int c = 0; c < 3; ++c) {
            const double b = drift.coefficients(static_cast<Eigen::Index>(j), c) * unit_[j];
            square[c] = 2 * static_cast<float>(b * b);
        }
        addErrors(errors_.data() + f * stride_, square, padded(), out);
    }
}

}  // namespace vlx
