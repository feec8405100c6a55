#include "reconstruct/drift/prefilter.h"

#include <algorithm>
#include <cmath>

#include "base/simd.h"

namespace vlx {

namespace {

constexpr float kFeatureFloor = 1e-4f;  // differences of a hundredth of a feature's scale are none

/// weights[i] = simd::nearExp(max(0, d[i])), summed into `total`, and into sums of each value and variance.
VLX_WIDE void accumulate(const float* __restrict distances, int count, const float* const* values,
                         const float* const* variances, int channels, float* __restrict weights,
                         float* __restrict total, float* const* sums, float* const* squares) {
    for (int i = 0; i < count; ++i) {
        const float w = simd::nearExp(distances[i] > 0 ? distances[i] : 0.f);
        weights[i] = w;
        total[i] += w;
    }
    for (int c = 0; c < channels; ++c) {
        const float* __restrict z = values[c];
        const float* __restrict v = variances[c];
        float* __restrict s = sums[c];
        float* __restrict q = squares[c];
        for (int i = 0; i < count; ++i) {
            s[i] += weights[i] * z[i];
            q[i] += weights[i] * weights[i] * v[i];
        }
    }
}

VLX_WIDE void addWeighted(const float* const* there, const float* const* here, const float* const* scale,
                          int features, const float* const* squares, int first, int last, int dx,
                          float* __restrict weights, float* const* sums) {
    for (int i = first; i < last; ++i) weights[i] = 0;
    for (int f = 0; f < features; ++f) {
        const float* __restrict a = there[f];
        const float* __restrict b = here[f];
        const float* __restrict s = scale[f];
        for (int i = first; i < last; ++i) {
            const float d = a[i + dx] - b[i];
            weights[i] += d * d * s[i];
        }
    }
    for (int i = first; i < last; ++i) weights[i] = simd::nearExp(weights[i]);
    for (int c = 0; c < SquaresPlanes::kChannels; ++c) {
        const float* __restrict q = squares[c];
        float* __restrict s = sums[c];
        for (int i = first; i < last; ++i) s[i] += weights[i] * q[i + dx];
    }
}

/// F sum w T^2 / (sum w T)^2; 0 where nothing scatters, or so much that squares of it are no numbers.
double rarityOf(double scatter, double squares, double freedom) {
    const double rarity = freedom * squares / (scatter * scatter);
    return scatter > 0 && std::isfinite(rarity) ? rarity : 0;
}

}  // namespace

void prefilterFeatures(const RowRing& raw, const SampleLayout& layout, bool clean, int x, int y, int width,
                       int height, RowRing& features) {
    const int right = std::min(width, x + kTile), bottom = std::min(height, y + kTile);
    PatchTile tile{x, y, 0, {}, {}};
    std::vector<float> scratch, distances(kTile * kTile), weights(kTile), errors(kTileSide * kTileSide);
    for (int first = 0; first < layout.features;) {
        int last = first;
        while (last < layout.features &&
               layout.group[static_cast<std::size_t>(last)] == layout.group[static_cast<std::size_t>(first)])
            ++last;
        const int channels = last - first;
        tile.channels = channels;
        tile.value.resize(static_cast<std::size_t>(channels) * kTileSide * kTileSide);
        tile.variance.resize(tile.value.size());
        bool noisy = false;
        for (int c = 0; c < channels; ++c) {
            copyTile(raw, first + c, x, y, width, height, tile.values(c));
            copyTile(raw, FeaturePlanes{layout.features}.error(first + c), x, y, width, height,
                     errors.data());
            float* out = tile.variances(c);
            for (int row = 0; row < kTileSide; ++row)
                for (int i = 0; i < kTileSide; ++i) {
                    float sum = 0;
                    int count = 0;
                    for (int r = std::max(0, row - 1); r <= std::min(kTileSide - 1, row + 1); ++r)
                        for (int k = std::max(0, i - 1); k <= std::min(kTileSide - 1, i + 1); ++k) {
                            sum += errors[static_cast<std::size_t>(r * kTileSide + k)];
                            ++count;
                        }
                    const float own = errors[static_cast<std::size_t>(row * kTileSide + i)];
                    out[row * kTileSide + i] = 0.5f * (own + sum / static_cast<float>(count));
                    noisy = noisy || own > 0;
                }
        }
        std::vector<float> total(kTile * kTile), sums(static_cast<std::size_t>(2 * channels) * kTile * kTile);
        for (int dy = -kFeatureReach; noisy && clean && dy <= kFeatureReach; ++dy)
            for (int dx = -kFeatureReach; dx <= kFeatureReach; ++dx) {
                patchDistances(tile, dx, dy, kFeatureFloor, scratch, distances.data());
                for (int row = std::max(y, -dy); row < std::min(bottom, height - dy); ++row) {
                    const int begin = std::max(x, -dx), end = std::min(right, width - dx);
                    if (begin >= end) continue;
                    const int at = (row - y) * kTile + begin - x;
                    const int there = (row - y + kTileMargin + dy) * kTileSide + begin - x + kTileMargin + dx;
                    const float *values[3] = {}, *variances[3] = {};
                    float *s[3] = {}, *q[3] = {};
                    for (int c = 0; c < channels; ++c) {
                        values[c] = tile.values(c) + there;
                        variances[c] = tile.variances(c) + there;
                        s[c] = sums.data() + (2 * c) * kTile * kTile + at;
                        q[c] = sums.data() + (2 * c + 1) * kTile * kTile + at;
                    }
                    accumulate(distances.data() + at, end - begin, values, variances, channels,
                               weights.data(), total.data() + at, s, q);
                }
            }
        for (int c = 0; c < channels; ++c)
            for (int row = y; row < bottom; ++row)
                for (int col = x; col < right; ++col) {
                    const auto at = static_cast<std::size_t>((row - y) * kTile + col - x);
                    const int here = (row - y + kTileMargin) * kTileSide + col - x + kTileMargin;
                    float &value = features.row(first + c, row)[col],
                          &error = features.row(FeaturePlanes{layout.features}.error(first + c), row)[col];
                    value = tile.values(c)[here];
                    error = noisy ? tile.variances(c)[here] : 0;
                    if (!noisy || !clean) continue;
                    const auto plane = static_cast<std::size_t>(2 * c) * kTile * kTile;
                    value = sums[plane + at] / total[at];
                    error = sums[plane + kTile * kTile + at] / (total[at] * total[at]);
                }
        first = last;
    }
}

void smoothVariances(const RowRing& squares, const RowRing& data, const DataPlanes& planes,
                     const RowRing& features, int featureCount, const PictureScale& picture, bool unseen,
                     const RowRing* wide, int y, int width, int height, RowRing& variances) {
    const auto count = static_cast<std::size_t>(featureCount), w = static_cast<std::size_t>(width);
    std::vector<float> scales(count * w), sums(SquaresPlanes::kChannels * w), weights(w);
    std::vector<const float*> here(count), there(count), scale(count);
    for (std::size_t f = 0; f < count; ++f) {
        here[f] = features.row(static_cast<int>(f), y);
        const float* errors = features.row(FeaturePlanes{featureCount}.error(static_cast<int>(f)), y);
        for (std::size_t i = 0; i < w; ++i) scales[f * w + i] = 1 / (kAlikeFeatures2 + 2 * errors[i]);
        scale[f] = scales.data() + f * w;
    }
    float* out[SquaresPlanes::kChannels];
    for (std::size_t c = 0; c < SquaresPlanes::kChannels; ++c) out[c] = sums.data() + c * w;
    for (int row = std::max(0, y - kVarianceReach); row <= std::min(height - 1, y + kVarianceReach); ++row) {
        for (std::size_t f = 0; f < count; ++f) there[f] = features.row(static_cast<int>(f), row);
        const float* in[SquaresPlanes::kChannels];
        for (int c = 0; c < SquaresPlanes::kChannels; ++c) in[c] = squares.row(c, row);
        for (int dx = -kVarianceReach; dx <= kVarianceReach; ++dx)
            addWeighted(there.data(), here.data(), scale.data(), featureCount, in, std::max(0, -dx),
                        std::min(width, width - dx), dx, weights.data(), out);
    }
    for (std::size_t i = 0; i < w; ++i) {
        const auto sum = [&](int plane) { return static_cast<double>(out[plane][i]); };
        const auto around = [&](int plane) { return static_cast<double>(wide->row(plane, y / 2)[i / 2]); };
        const double freedom = sum(SquaresPlanes::kFreedom);
        variances.row(VariancePlanes::kRarity, y)[i] = static_cast<float>(
            rarityOf((sum(0) + sum(1) + sum(2)) * picture.unit(), sum(SquaresPlanes::kAllSquared), freedom));
        const bool stated = data.row(planes.stated(), y)[i] > 0;
        for (int c = 0; c < 3; ++c) {
            double variance = picture.variance[c];
            if (freedom > 0) {
                variance = sum(c) / freedom;
                const auto mean = [&](int half) {
                    return std::abs(static_cast<double>(data.row(planes.mean(half) + c, y)[i]));
                };
                const double own = std::max(mean(0), mean(1));
                const bool agree = variance <= kAgreement * kAgreement * own * own;
                const double rarity = agree && !stated && wide ? around(VariancePlanes::kRarity) : 0;
                if (rarity > 0) {
                    const double more = rarity / (1 + 2 * freedom / rarity);
                    variance = (sum(c) + more * around(c)) / (freedom + more);
                }
                if (!agree && !stated && freedom < 1) {  // a few pairs may be alike by chance
                    constexpr double kPicture = 2 * kBorrowedFreedom;
                    variance = (freedom * variance + kPicture * picture.variance[c]) / (freedom + kPicture);
                }
                if (!stated && unseen)
                    variance += unseenVariance(sum(SquaresPlanes::kSamples),
                                               agree ? std::max(own, picture.level) : picture.level);
            }
            variances.row(c, y)[i] = static_cast<float>(variance);
        }
    }
}

}  // namespace vlx
