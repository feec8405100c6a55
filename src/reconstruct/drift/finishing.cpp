#include "reconstruct/drift/finishing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>

#include "reconstruct/common/window_sum.h"
#include "reconstruct/drift/stacking.h"

namespace vlx {

namespace {

// Squares of what is smaller than 1e-19 are no floats: nobody is sure of it for that.
constexpr double kLeastVariance = std::numeric_limits<float>::min();

/// Alpha as compositing needs it: within 0 to 1, and what differs from either by rounding is that.
double coverage(double alpha) {
    constexpr double kRounding = 1e-5;
    if (alpha < kRounding) return 0;
    return alpha > 1 - kRounding ? 1 : alpha;
}

/// R, G and B, and channels of layers that end so: 0 to 2; others -1.
int colourOf(const std::string& channel) {
    const std::string last = channel.substr(channel.rfind('.') + 1);
    const std::size_t at = std::string("RGB").find(last);
    return last.size() == 1 && at != std::string::npos ? static_cast<int>(at) : -1;
}

/// Calls f(col, row) for the up to eight neighbours of a pixel.
template <class F>
void forNeighbours(int x, int y, int width, int height, F f) {
    for (int row = std::max(0, y - 1); row <= std::min(height - 1, y + 1); ++row)
        for (int col = std::max(0, x - 1); col <= std::min(width - 1, x + 1); ++col)
            if (col != x || row != y) f(col, row);
}

}  // namespace

Finishing::Finishing(const SampleLayout& layout, const Drift& options, const PictureScale& picture,
                     const LevelRows& level, const RowRing& combined, RowRing& clean, RowRing& light,
                     RowRing& common)
    : layout_(layout),
      planes_{layout.radiance},
      combinedPlanes_{layout.radiance},
      cleanPlanes_{layout.radiance},
      options_(options),
      width_(level.width),
      height_(level.height),
      radiance_(layout.radiance),
      picture_(picture),
      data_(level.data),
      features_(level.features),
      variances_(level.variances),
      combined_(combined),
      clean_(clean),
      light_(level.width, level.height, light),
      common_(level.width, level.height, common) {
    for (int c = 0; c < radiance_; ++c)
        colour_.push_back(c == layout.alpha ? -1 : colourOf(layout.names[static_cast<std::size_t>(c)]));
}

double Finishing::sampleVariance(int c, int x, int y) const {
    const double own = variances_.row(c, y)[x];
    double sum = own, count = 1;
    forNeighbours(x, y, width_, height_, [&](int col, int row) {
        sum += static_cast<double>(variances_.row(c, row)[col]);
        ++count;
    });
    return std::max(own, sum / count);
}

void Finishing::cleanRow(int y) {
    for (int c = 0; c < radiance_; ++c)
        std::copy_n(combined_.row(combinedPlanes_.value() + c, y), width_, clean_.row(c, y));
    if (!options_.steps.outliers) return;
    const auto value = [&](int c, int x, int row) {
        return static_cast<double>(combined_.row(combinedPlanes_.value() + c, row)[x]);
    };
    for (int x = 0; x < width_; ++x) {
        constexpr double kNone = std::numeric_limits<double>::infinity();
        double least[3] = {kNone, kNone, kNone}, most[3] = {-kNone, -kNone, -kNone}, beyond[3];
        forNeighbours(x, y, width_, height_, [&](int col, int row) {
            for (int c = 0; c < 3; ++c) {
                least[c] = std::min(least[c], value(c, col, row));
                most[c] = std::max(most[c], value(c, col, row));
            }
        });
        double excess = 0, variance = 0;
        for (int c = 0; c < 3; ++c) {
            const double own = value(c, x, y);
            beyond[c] = least[c] > most[c] ? 0 : std::clamp(own, least[c], most[c]) - own;
            excess += beyond[c] * beyond[c];
        }
        if (excess == 0) continue;
        const double leverage = combined_.row(combinedPlanes_.leverage(), y)[x];
        const double n = samplesIn(data_.row(planes_.count(), y)[x]);
        for (int c = 0; c < 3; ++c) variance += sampleVariance(c, x, y) / n;
        const double kept = shrinkage(excess, leverage * leverage * variance);
        if (kept >= 1) continue;
        double nearest = kNone, along = 0;
        int to[2] = {x, y};
        forNeighbours(x, y, width_, height_, [&](int col, int row) {
            double apart = 0, product = 0, square = 0;
            for (int c = 0; c < 3; ++c) {
                const double step = value(c, col, row) - value(c, x, y);
                apart += (step - beyond[c]) * (step - beyond[c]);
                product += step * beyond[c];
                square += step * step;
            }
            if (apart >= nearest || square == 0) return;
            nearest = apart;
            along = std::clamp(product / square, 0.0, 1.0);
            to[0] = col;
            to[1] = row;
        });
        const double moved = (1 - kept) * along;
        for (int c = 0; c < radiance_; ++c)
            clean_.row(c, y)[x] =
                static_cast<float>(value(c, x, y) + moved * (value(c, to[0], to[1]) - value(c, x, y)));
    }
}

void Finishing::errorRow(int y) {
    Light::Row row(width_);
    const auto w = static_cast<std::size_t>(width_);
    const std::vector<float> sums = sharedVariances(y);
    coverageRow(y);
    std::vector<float> unexplained(static_cast<std::size_t>(width_)), known(unexplained.size());
    for (int x = 0; x < width_; ++x) {
        const double n = data_.row(planes_.count(), y)[x];
        const double leverage = combined_.row(combinedPlanes_.leverage(), y)[x];
        const bool twoHalves =
            data_.row(planes_.halfCount(0), y)[x] > 0 && data_.row(planes_.halfCount(1), y)[x] > 0;
        const bool exact = isExact(x, y);
        double shared[3], inCommon[3];
        for (std::size_t c = 0; c < 3; ++c)
            shared[c] = static_cast<double>(sums[c * w + static_cast<std::size_t>(x)]) /
                        static_cast<double>(sums[3 * w + static_cast<std::size_t>(x)]);
        for (int c = 0; c < 3; ++c) {
            // The noise of the halves' common data is estimated twice, by what the halves differ in and by
            // the kriging variance: half of each.
            double variance =
                shared[c] / 2 + static_cast<double>(combined_.row(combinedPlanes_.variance() + c, y)[x]);
            variance += gapVariance(c, x, y);
            // A pixel's own scatter beyond two standard deviations raises its variance, by as much as the
            // pixel itself is in its estimate.
            if (twoHalves) {
                const double apart = static_cast<double>(data_.row(planes_.mean(0) + c, y)[x]) -
                                     static_cast<double>(data_.row(planes_.mean(1) + c, y)[x]);
                variance +=
                    leverage * leverage * std::max(0.0, apart * apart / 4 - 4 * meanVariance(c, x, y));
            }
            inCommon[c] = variance - shared[c];
            clean_.row(cleanPlanes_.variance() + c, y)[x] = static_cast<float>(exact ? 0 : variance);
            if (exact || n == 0) continue;  // nothing is missing, or nobody knows
            const auto i = static_cast<std::size_t>(x);
            const float lost = data_.row(planes_.removed() + c, y)[x], value = clean_.row(c, y)[x];
            row.value[c][i] = value;
            row.deviation[c][i] = static_cast<float>(std::sqrt(variance));
            row.lost[c][i] = lost;
            row.missing[c][i] = static_cast<float>(plainMean(data_, planes_, c, x, y)) + lost - value;
        }
        if (!twoHalves || exact) continue;
        if (const std::optional<double> more = commonError(x, y, inCommon)) {
            unexplained[static_cast<std::size_t>(x)] = static_cast<float>(*more);
            known[static_cast<std::size_t>(x)] = 1;
        }
    }
    light_.sumRow(y, row);
    common_.sumRow(y, unexplained, known);
}

/// What the product of the halves' residuals in units of noise, the mean over colours, has more than
/// `predicted`, the part of the error variance that the halves have in common. Nothing where the dump states
/// that there is no noise.
std::optional<double> Finishing::commonError(int x, int y, const double* predicted) const {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const auto residual = [&](int half) {
            return static_cast<double>(data_.row(planes_.mean(half) + c, y)[x]) -
                   static_cast<double>(combined_.row(combinedPlanes_.half(half) + c, y)[x]);
        };
        const double variance = meanVariance(c, x, y);
        if (!(variance > 0)) return {};
        sum += (residual(0) * residual(1) - predicted[c]) / variance / 3;
    }
    return sum;
}

Finishing::Counts Finishing::outputRow(int y, float* out) const {
    const Light::Shares shares = light_.shares(y);
    const std::vector<double> common = common_.shares(y);
    Counts counts;
    counts.neighbours = neighboursInRow(y);
    for (int x = 0; x < width_; ++x, out += radiance_ + 3) {
        const auto i = static_cast<std::size_t>(x);
        const double n = data_.row(planes_.count(), y)[x];
        const bool exact = isExact(x, y);
        counts.exact += exact;
        const double strength = n > 0 ? options_.strength : 1;
        // What the pixel takes of the light that is missing: of R, G, B, and of all of them.
        double moved[3] = {}, all = 0, light = 0;
        for (int c = 0; c < 3; ++c) {
            const double value = clean_.row(c, y)[x];
            // Not of what is not known for want of samples: those around have none of it.
            const double variance =
                static_cast<double>(clean_.row(cleanPlanes_.variance() + c, y)[x]) - gapVariance(c, x, y);
            if (options_.steps.light)
                moved[c] =
                    Light::step(shares.moved[c][i], value, variance, Light::lostVariance(shares, i, value));
            all += moved[c];
            light += std::max(0.0, value);
        }
        double image[3] = {};
        for (int c = 0; c < radiance_; ++c) {
            const double mean = plainMean(data_, planes_, c, x, y);
            double value = clean_.row(c, y)[x];
            // Light is not negative. Parts of light must add up: negative ones take their share, and stay so.
            if (c == layout_.alpha) {
                value = coverage(value);
            } else {
                const int colour = colour_[static_cast<std::size_t>(c)];
                const double whole = colour < 0 ? light : std::max(0.f, clean_.row(colour, y)[x]);
                if (whole > 0) value += value * (colour < 0 ? all : moved[colour]) / whole;
                if (radiance_ == 3 + (layout_.alpha >= 0) && mean >= 0) value = std::max(0.0, value);
            }
            const double chosen = exact ? mean : value;
            out[c] = static_cast<float>(mean + strength * (chosen - mean));
            if (c >= 3) continue;
            image[c] = out[c];
            const double variance = static_cast<double>(clean_.row(cleanPlanes_.variance() + c, y)[x]) +
                                    (n > 0 ? common[i] * meanVariance(c, x, y) : 0) + moved[c] * moved[c] +
                                    Light::lostVariance(shares, i, value);
            out[radiance_ + c] =
                static_cast<float>(exact ? 0
                                         : std::sqrt(strength * std::max(kLeastVariance, variance) +
                                                     (1 - strength) * meanVariance(c, x, y)));
        }
        if (n == 0) continue;
        if (!exact) counts.moved += n * strength * luminance(moved[0], moved[1], moved[2]);
        counts.image += n * luminance(image[0], image[1], image[2]);
        // Colours of a sample go together.
        const double noise = luminance(std::sqrt(meanVariance(0, x, y)), std::sqrt(meanVariance(1, x, y)),
                                       std::sqrt(meanVariance(2, x, y)));
        counts.noise += n * n * noise * noise;
    }
    return counts;
}

void NoiseCorrelation::add(const NoiseCorrelation& other) {
    products += other.products;
    squares += other.squares;
    chance += other.chance;
}

double NoiseCorrelation::standardError() const { return squares > 0 ? std::sqrt(chance) / squares : 0; }

/// The difference of the halves' means, summed over colours, in units of its standard deviation if colours
/// were independent; 0 where a half has no sample or nothing differs.
double Finishing::halvesApart(int x, int y) const {
    constexpr double kMost = 3;
    const double nA = data_.row(planes_.halfCount(0), y)[x], nB = data_.row(planes_.halfCount(1), y)[x];
    if (nA == 0 || nB == 0) return 0;
    double apart = 0, variance = 0;
    for (int c = 0; c < 3; ++c) {
        apart += static_cast<double>(data_.row(planes_.mean(0) + c, y)[x]) -
                 static_cast<double>(data_.row(planes_.mean(1) + c, y)[x]);
        variance += static_cast<double>(variances_.row(c, y)[x]) * (1 / nA + 1 / nB);
    }
    return variance > 0 ? std::clamp(apart / std::sqrt(variance), -kMost, kMost) : 0;
}

NoiseCorrelation Finishing::neighboursInRow(int y) const {
    NoiseCorrelation sums;
    double left = halvesApart(0, y);
    for (int x = 1; x < width_; ++x) {
        const double own = halvesApart(x, y);
        sums.products += own * left;
        sums.squares += (own * own + left * left) / 2;
        sums.chance += own * own * left * left;
        left = own;
    }
    return sums;
}

double Finishing::gapVariance(int c, int x, int y) const {
    const double gap = data_.row(planes_.gap(), y)[x];
    return gap > 0 ? picture_.semivarianceAt(c, gap / options_.scale) : 0;
}

double Finishing::meanVariance(int c, int x, int y) const {
    return static_cast<double>(variances_.row(c, y)[x]) / samplesIn(data_.row(planes_.count(), y)[x]);
}

/// Whether the dump states that the pixel, and every one that its error variance was pooled over, has none.
bool Finishing::isExact(int x, int y) const {
    if (data_.row(planes_.stated(), y)[x] == 0) return false;
    for (int c = 0; c < 3; ++c)
        if (variances_.row(c, y)[x] > 0) return false;
    return true;
}

/// Variances of R, G, B of the mean of the two halves' estimates, from their differences, over the pixels of
/// alike features around each pixel of row y: three rows, and one of weights.
std::vector<float> Finishing::sharedVariances(int y) const {
    std::vector<float> sums(4 * static_cast<std::size_t>(width_));
    sumAlike(
        features_, layout_.features, kAlikeReach, 4,
        [&](int row, int c, float* q) {
            if (c == 3) {
                std::fill_n(q, width_, 1.f);
                return;
            }
            const float* const a = combined_.row(combinedPlanes_.half(0) + c, row);
            const float* const b = combined_.row(combinedPlanes_.half(1) + c, row);
            for (int x = 0; x < width_; ++x) q[x] = (a[x] - b[x]) * (a[x] - b[x]) / 4;
        },
        y, width_, height_, sums.data());
    return sums;
}

/// Of a pixel's alpha: M, K, and (1 - h) v, the part of (K - M)^2 that the noise of M explains, where
/// v = (M_A - M_B)^2 n_A n_B / (n_A + n_B)^2 is the variance of M as the halves show it, h what M weighs in
/// K.
Finishing::Coverage Finishing::coverageAt(int x, int y) const {
    const double nA = data_.row(planes_.halfCount(0), y)[x], nB = data_.row(planes_.halfCount(1), y)[x];
    Coverage of;
    of.kriged = combined_.row(combinedPlanes_.value() + layout_.alpha, y)[x];
    of.mean = nA + nB > 0 ? plainMean(data_, planes_, layout_.alpha, x, y) : of.kriged;
    if (nA == 0 || nB == 0) return of;
    const double differ = static_cast<double>(data_.row(planes_.mean(0) + layout_.alpha, y)[x]) -
                          static_cast<double>(data_.row(planes_.mean(1) + layout_.alpha, y)[x]);
    const double leverage = std::clamp<double>(combined_.row(combinedPlanes_.leverage(), y)[x], 0, 1);
    of.noise = (1 - leverage) * differ * differ * nA * nB / ((nA + nB) * (nA + nB));
    return of;
}

void Finishing::coverageRow(int y) {
    if (layout_.alpha < 0) return;
    const int top = std::max(0, y - kReach), rows = std::min(height_ - 1, y + kReach) - top + 1;
    std::vector<Coverage> around(static_cast<std::size_t>(rows * width_));
    for (int row = 0; row < rows; ++row)
        for (int x = 0; x < width_; ++x)
            around[static_cast<std::size_t>(row * width_ + x)] = coverageAt(x, top + row);
    float* const alpha = clean_.row(cleanPlanes_.value() + layout_.alpha, y);
    for (int x = 0; x < width_; ++x) {
        const Coverage& own = around[static_cast<std::size_t>((y - top) * width_ + x)];
        const bool agree = coverage(own.mean) == 0 || coverage(own.mean) == 1;
        double apart = 0, noise = 0, expected = 0, found = 0;
        for (int row = 0; row < rows; ++row)
            for (int col = std::max(0, x - kReach); col <= std::min(width_ - 1, x + kReach); ++col) {
                const Coverage& there = around[static_cast<std::size_t>(row * width_ + col)];
                apart += (there.kriged - there.mean) * (there.kriged - there.mean);
                noise += there.noise;
                const double away = std::abs(there.kriged - own.mean);
                if (away > std::abs(own.kriged - own.mean)) continue;
                expected += away;
                found += std::abs(there.mean - own.mean);
            }
        const bool certain = agree && found < expected / 2;
        const double kept = certain ? 1 : shrinkage(apart, noise);
        alpha[x] = static_cast<float>(kept < 1 ? alpha[x] + kept * (own.mean - alpha[x]) : own.mean);
    }
}

}  // namespace vlx
