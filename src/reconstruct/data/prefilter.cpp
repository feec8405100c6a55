#include "reconstruct/data/prefilter.h"

#include <algorithm>
#include <cmath>

#include "base/simd.h"
#include "reconstruct/common/window_sum.h"

namespace vlx {

namespace {

using simd::Eight;
using simd::load;
using simd::store;

constexpr float kFeatureFloor = 1e-6f;  // differences of a thousandth of a feature's scale are none
// Standard errors by which residuals that both halves show must exceed chance; every window is looked at.
constexpr float kReturnSignificance = 3;

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

/// What the pixels (dx, dy) away add to the sums of a tile: w, w z and w^2 v of each channel, w =
/// nearExp(max(0, distance)), 0 where `inside`, of columns from the tile's first, says that there is none;
/// none lies outside the rows `top` to `bottom`.
template <int Channels>
[[gnu::always_inline]] inline void accumulate(const PatchTile& half, int dx, int dy, const float* distances,
                                              const float* inside, int top, int bottom, WeightedSums& sums) {
    for (int row = std::max(0, top - dy); row < std::min(kTile, bottom - dy); ++row)
        for (int column = 0; column < kTile; column += 8) {
            const int here = row * kTile + column;
            const int there = (row + dy + kTileMargin) * kTileSide + column + dx + kTileMargin;
            const Eight weight = simd::nearExp(simd::maximum(load<Eight>(distances + here), Eight{})) *
                                 load<Eight>(inside + column + dx);
            const auto add = [&](float* to, Eight value) __attribute__((always_inline)) {
                store(to + here, load<Eight>(to + here) + value);
            };
            add(sums.total(), weight);
            for (int c = 0; c < Channels; ++c) {
                add(sums.value(c), weight * load<Eight>(half.values(c) + there));
                add(sums.variance(c), weight * weight * load<Eight>(half.variances(c) + there));
            }
        }
}

VLX_WIDE void accumulate(const PatchTile& half, int dx, int dy, const float* distances, const float* inside,
                         int top, int bottom, WeightedSums& sums) {
    switch (half.channels) {
        case 1:
            return accumulate<1>(half, dx, dy, distances, inside, top, bottom, sums);
        case 2:
            return accumulate<2>(half, dx, dy, distances, inside, top, bottom, sums);
        default:
            return accumulate<3>(half, dx, dy, distances, inside, top, bottom, sums);
    }
}

/// F sum w T^2 / (sum w T)^2; 0 where nothing scatters, or so much that squares of it are no numbers.
double rarityOf(double scatter, double squares, double freedom) {
    const double rarity = freedom * squares / (scatter * scatter);
    return scatter > 0 && std::isfinite(rarity) ? rarity : 0;
}

/// out = the mean of each value and of the up to eight around it.
void averageAround(const std::vector<float>& in, std::vector<float>& out) {
    constexpr int kSide = kTileSide;
    float column[kSide];
    for (int row = 0; row < kSide; ++row) {
        const int top = std::max(0, row - 1), rows = std::min(kSide - 1, row + 1) - top + 1;
        std::copy_n(in.data() + top * kSide, kSide, column);
        for (int r = 1; r < rows; ++r)
            for (int i = 0; i < kSide; ++i) column[i] += in[static_cast<std::size_t>((top + r) * kSide + i)];
        float* const to = out.data() + row * kSide;
        const float three = 1.f / static_cast<float>(3 * rows), two = 1.f / static_cast<float>(2 * rows);
        for (int i = 1; i < kSide - 1; ++i) to[i] = (column[i - 1] + column[i] + column[i + 1]) * three;
        to[0] = (column[0] + column[1]) * two;
        to[kSide - 1] = (column[kSide - 2] + column[kSide - 1]) * two;
    }
}

/// The features [first, first + channels) of a tile as each half has them: twice the error variance of both,
/// averaged with that of the 3 x 3 pixels around; a pixel of one sample is its own in both. Whether any has
/// noise.
bool splitFeatures(const RowRing& raw, const FeaturePlanes& planes, int first, int channels,
                   const std::vector<float>& counts, int width, int height, PatchTile* halves) {
    std::vector<float> value(kTileSide * kTileSide), error(value.size()), difference(value.size()),
        around(value.size());
    for (int h = 0; h < 2; ++h) halves[h].resize(channels);
    for (int c = 0; c < channels; ++c) {
        const auto copy = [&](int plane, std::vector<float>& out) {
            copyTile(raw, plane, halves[0].x, halves[0].y, width, height, out.data());
        };
        copy(planes.value(first + c), value);
        copy(planes.error(first + c), error);
        copy(planes.difference(first + c), difference);
        averageAround(error, around);
        for (int h = 0; h < 2; ++h) {
            float *const values = halves[h].values(c), *const variances = halves[h].variances(c);
            const float sign = h == 0 ? 1.f : -1.f;
            for (std::size_t i = 0; i < value.size(); ++i) {
                values[i] = value[i] + sign * difference[i];
                variances[i] = (counts[i] <= 1 ? 0.5f : 1.f) * (error[i] + around[i]);
            }
        }
    }
    for (int h = 0; h < 2; ++h) halves[h].setScale(kFeatureFloor);
    return std::any_of(halves[0].noise.begin(), halves[0].noise.end(), [](float v) { return v > 0; });
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
                       const SampleLayout& layout, int reach, int x, int y, int width, int height,
                       RowRing& features, RowRing& residuals) {
    const int right = std::min(width, x + kTile), bottom = std::min(height, y + kTile);
    const FeaturePlanes planes{layout.features};
    const ResidualPlanes residual{layout.groups};
    PatchTile halves[2];
    for (PatchTile& half : halves) {
        half.x = x;
        half.y = y;
    }
    std::vector<float> counts(kTileSide * kTileSide), scratch, distances(kTile * kTile),
        inside(kTile + 2 * kMostFeatureReach);
    copyTile(data, dataPlanes.count(), x, y, width, height, counts.data());
    for (int i = 0; i < kTile + 2 * kMostFeatureReach; ++i) {
        const int column = x + i - kMostFeatureReach;
        inside[static_cast<std::size_t>(i)] = column >= 0 && column < width ? 1 : 0;
    }
    for (int first = 0; first < layout.features;) {
        const int group = layout.group[static_cast<std::size_t>(first)];
        int last = first;
        while (last < layout.features && layout.group[static_cast<std::size_t>(last)] == group) ++last;
        const int channels = last - first;
        const bool noisy =
            splitFeatures(raw, planes, first, channels, counts, width, height, halves) && reach > 0;
        WeightedSums sums[2] = {WeightedSums(channels), WeightedSums(channels)};
        for (int dy = -reach; noisy && dy <= reach; ++dy)
            for (int dx = -reach; dx <= reach; ++dx)
                for (int h = 0; h < 2; ++h) {
                    patchDistances(halves[1 - h], dx, dy, scratch, distances.data());
                    accumulate(halves[h], dx, dy, distances.data(), inside.data() + kMostFeatureReach, -y,
                               height - y, sums[h]);
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
    const auto w = static_cast<std::size_t>(width);
    std::vector<float> sums(SquaresPlanes::kChannels * w);
    sumAlike(
        features, featureCount, kVarianceReach, SquaresPlanes::kChannels,
        [&](int row, int c, float* q) { std::copy_n(squares.row(c, row), w, q); }, y, width, height,
        sums.data());
    for (std::size_t i = 0; i < w; ++i) {
        const auto sum = [&](int plane) {
            return static_cast<double>(sums[static_cast<std::size_t>(plane) * w + i]);
        };
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
