#include "reconstruct/drift/prefilter.h"

#include <algorithm>
#include <cmath>

#include "base/simd.h"
#include "reconstruct/common/window_sum.h"

namespace vlx {

namespace {

constexpr float kFeatureFloor = 1e-6f;  // differences of a thousandth of a feature's scale are none
// Standard errors by which residuals that both halves show must exceed chance; every window is looked at.
constexpr float kReturnSignificance = 3;

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

/// Of a tile: sums of weights, and of what is weighted and its variance.
class WeightedSums {
  public:
    explicit WeightedSums(int channels) : sums_(static_cast<std::size_t>(2 * channels + 1) * kTile * kTile) {}
    float* total() { return sums_.data(); }
    float* value(int channel) { return sums_.data() + (1 + 2 * channel) * kTile * kTile; }
    float* variance(int channel) { return sums_.data() + (2 + 2 * channel) * kTile * kTile; }

  private:
    std::vector<float> sums_;
};

/// The features [first, first + channels) of a tile as each half has them: twice the error variance of both,
/// averaged with that of the 3 x 3 pixels around; a pixel of one sample is its own in both. Whether any has
/// noise.
bool splitFeatures(const RowRing& raw, const FeaturePlanes& planes, int first, int channels,
                   const std::vector<float>& counts, int width, int height, PatchTile* halves) {
    std::vector<float> value(kTileSide * kTileSide), error(value.size()), difference(value.size());
    bool noisy = false;
    for (int h = 0; h < 2; ++h) {
        halves[h].resize(channels);
    }
    for (int c = 0; c < channels; ++c) {
        const auto copy = [&](int plane, std::vector<float>& out) {
            copyTile(raw, plane, halves[0].x, halves[0].y, width, height, out.data());
        };
        copy(planes.value(first + c), value);
        copy(planes.error(first + c), error);
        copy(planes.difference(first + c), difference);
        for (int row = 0; row < kTileSide; ++row)
            for (int i = 0; i < kTileSide; ++i) {
                float sum = 0;
                int count = 0;
                for (int r = std::max(0, row - 1); r <= std::min(kTileSide - 1, row + 1); ++r)
                    for (int k = std::max(0, i - 1); k <= std::min(kTileSide - 1, i + 1); ++k) {
                        sum += error[static_cast<std::size_t>(r * kTileSide + k)];
                        ++count;
                    }
                const auto at = static_cast<std::size_t>(row * kTileSide + i);
                const float both = 0.5f * (error[at] + sum / static_cast<float>(count));
                noisy = noisy || error[at] > 0;
                for (int h = 0; h < 2; ++h) {
                    halves[h].values(c)[at] = value[at] + (h == 0 ? difference[at] : -difference[at]);
                    halves[h].variances(c)[at] = counts[at] <= 1 ? both : 2 * both;
                }
            }
    }
    for (int h = 0; h < 2; ++h) halves[h].setScale(kFeatureFloor);
    return noisy;
}

VLX_WIDE void addResiduals(const float* __restrict products, const float* __restrict squares, float weight,
                           int n, float* __restrict sum, float* __restrict sumOfSquares,
                           float* __restrict square) {
    for (int i = 0; i < n; ++i) {
        sum[i] += weight * products[i];
        sumOfSquares[i] += weight * weight * products[i] * products[i];
        square[i] += weight * squares[i];
    }
}

}  // namespace

void prefilterFeatures(const RowRing& raw, const RowRing& data, const DataPlanes& dataPlanes,
                       const SampleLayout& layout, bool clean, int x, int y, int width, int height,
                       RowRing& features, RowRing& residuals) {
    const int right = std::min(width, x + kTile), bottom = std::min(height, y + kTile);
    const FeaturePlanes planes{layout.features};
    const ResidualPlanes residual{layout.groups};
    PatchTile halves[2];
    for (PatchTile& half : halves) {
        half.x = x;
        half.y = y;
    }
    std::vector<float> counts(kTileSide * kTileSide), scratch, distances(kTile * kTile), weights(kTile);
    copyTile(data, dataPlanes.count(), x, y, width, height, counts.data());
    for (int first = 0; first < layout.features;) {
        const int group = layout.group[static_cast<std::size_t>(first)];
        int last = first;
        while (last < layout.features && layout.group[static_cast<std::size_t>(last)] == group) ++last;
        const int channels = last - first;
        const bool noisy =
            splitFeatures(raw, planes, first, channels, counts, width, height, halves) && clean;
        WeightedSums sums[2] = {WeightedSums(channels), WeightedSums(channels)};
        for (int dy = -kFeatureReach; noisy && dy <= kFeatureReach; ++dy)
            for (int dx = -kFeatureReach; dx <= kFeatureReach; ++dx)
                for (int h = 0; h < 2; ++h) {
                    patchDistances(halves[1 - h], dx, dy, scratch, distances.data());
                    for (int row = std::max(y, -dy); row < std::min(bottom, height - dy); ++row) {
                        const int begin = std::max(x, -dx), end = std::min(right, width - dx);
                        if (begin >= end) continue;
                        const int at = (row - y) * kTile + begin - x;
                        const int there =
                            (row - y + kTileMargin + dy) * kTileSide + begin - x + kTileMargin + dx;
                        const float *values[3] = {}, *variances[3] = {};
                        float *s[3] = {}, *q[3] = {};
                        for (int c = 0; c < channels; ++c) {
                            values[c] = halves[h].values(c) + there;
                            variances[c] = halves[h].variances(c) + there;
                            s[c] = sums[h].value(c) + at;
                            q[c] = sums[h].variance(c) + at;
                        }
                        accumulate(distances.data() + at, end - begin, values, variances, channels,
                                   weights.data(), sums[h].total() + at, s, q);
                    }
                }
        for (int row = y; row < bottom; ++row)
            for (int col = x; col < right; ++col) {
                const int at = (row - y) * kTile + col - x;
                const int here = (row - y + kTileMargin) * kTileSide + col - x + kTileMargin;
                const bool alone = counts[static_cast<std::size_t>(here)] <= 1;
                float product = 0, square = 0;
                for (int c = 0; c < channels; ++c) {
                    float value[2], error = 0, left[2];
                    for (int h = 0; h < 2; ++h) {
                        const float total = noisy ? sums[h].total()[at] : 1, own = halves[h].values(c)[here];
                        value[h] = noisy ? sums[h].value(c)[at] / total : own;
                        error +=
                            noisy ? sums[h].variance(c)[at] / (total * total) : halves[h].variances(c)[here];
                        left[h] = own - value[h];
                    }
                    features.row(planes.value(first + c), row)[col] = (value[0] + value[1]) / 2;
                    features.row(planes.error(first + c), row)[col] = error / (alone ? 2 : 4);
                    if (alone) continue;
                    product += left[0] * left[1];
                    square += (left[0] + left[1]) * (left[0] + left[1]) / 4;
                }
                residuals.row(residual.products(group), row)[col] = product;
                residuals.row(residual.squares(group), row)[col] = square;
            }
        first = last;
    }
}

void returnResiduals(const RowRing& raw, const RowRing& residuals, const SampleLayout& layout, int y,
                     int width, int height, RowRing& features) {
    const FeaturePlanes planes{layout.features};
    const ResidualPlanes residual{layout.groups};
    const auto w = static_cast<std::size_t>(width);
    std::vector<float> sums[3];  // down columns: of products, their squares, and squares
    std::vector<float> shares(static_cast<std::size_t>(layout.groups) * w), around[3];
    for (auto& a : around) a.resize(w);
    for (int g = 0; g < layout.groups; ++g) {
        for (auto& s : sums) s.assign(w, 0.f);
        for (int row = std::max(0, y - kReturnReach); row <= std::min(height - 1, y + kReturnReach); ++row)
            addResiduals(residuals.row(residual.products(g), row), residuals.row(residual.squares(g), row),
                         windowWeight(row - y, kReturnReach), width, sums[0].data(), sums[1].data(),
                         sums[2].data());
        for (int k = 0; k < 3; ++k) sumAround(sums[k], kReturnReach, k == 1, around[k].data());
        for (std::size_t i = 0; i < w; ++i) {
            const float known = around[0][i] - kReturnSignificance * std::sqrt(around[1][i]);
            shares[static_cast<std::size_t>(g) * w + i] =
                known > 0 ? std::min(1.f, known / around[2][i]) : 0.f;
        }
    }
    for (int f = 0; f < layout.features; ++f) {
        const float* share =
            shares.data() + static_cast<std::size_t>(layout.group[static_cast<std::size_t>(f)]) * w;
        const float *value = raw.row(planes.value(f), y), *error = raw.row(planes.error(f), y);
        float *to = features.row(planes.value(f), y), *toError = features.row(planes.error(f), y);
        for (std::size_t i = 0; i < w; ++i) {
            if (share[i] <= 0) continue;
            to[i] += share[i] * (value[i] - to[i]);
            const float from = std::sqrt(toError[i]);
            const float deviation = from + share[i] * (std::sqrt(error[i]) - from);
            toError[i] = deviation * deviation;
        }
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
