#include "reconstruct/drift/finishing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "base/simd.h"
#include "reconstruct/drift/prefilter.h"
#include "reconstruct/drift/stacking.h"

namespace vlx {

namespace {

constexpr double kKnown = 4;       // (standard errors of lost light that are none)^2
constexpr int kLightColumns = 16;  // columns
constexpr int kWide = 256;         // columns: the first of the wide scales

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

/// Of a pixel `d` columns or rows away: smooth to the window's border, which would show where much light
/// comes back.
double lightWeight(int d) {
    constexpr double kSide = Finishing::kLightReach + 1;
    const double u = 1 - d * d / (kSide * kSide);
    return u * u;
}

/// Calls f(col, row) for the up to eight neighbours of a pixel.
template <class F>
void forNeighbours(int x, int y, int width, int height, F f) {
    for (int row = std::max(0, y - 1); row <= std::min(height - 1, y + 1); ++row)
        for (int col = std::max(0, x - 1); col <= std::min(width - 1, x + 1); ++col)
            if (col != x || row != y) f(col, row);
}

}  // namespace

Finishing::Finishing(const SampleLayout& layout, double strength, int scale, const PictureScale& picture,
                     const LevelRows& level, const RowRing& combined, RowRing& clean, RowRing& light)
    : layout_(layout),
      planes_{layout.radiance},
      combinedPlanes_{layout.radiance},
      strength_(strength),
      scale_(scale),
      width_(level.width),
      height_(level.height),
      radiance_(layout.radiance),
      picture_(picture),
      data_(level.data),
      features_(level.features),
      variances_(level.variances),
      combined_(combined),
      clean_(clean),
      light_(light) {
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
        const double n = std::max(1.f, data_.row(planes_.count(), y)[x]);
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

void Finishing::lightRow(int y) {
    const float* const counts = data_.row(planes_.count(), y);
    for (int x = 0; x < width_; ++x) {
        double square = 0, noise = 0;
        for (int c = 0; c < 3; ++c) {
            const double lost = data_.row(planes_.removed() + c, y)[x], value = clean_.row(c, y)[x];
            square += lost * lost;
            const bool datum = counts[x] > 0;
            if (datum) noise += static_cast<double>(variances_.row(c, y)[x] / counts[x]);
            light_.row(LightPlanes::lost(c), y)[x] = static_cast<float>(lost);
            light_.row(LightPlanes::apart(c), y)[x] =
                datum ? static_cast<float>(plainMean(data_, planes_, c, x, y) - value) : 0;
            light_.row(LightPlanes::light(c), y)[x] = static_cast<float>(std::max(0.0, value));
        }
        light_.row(LightPlanes::kLostSquare, y)[x] = static_cast<float>(square);
        light_.row(LightPlanes::kNoise, y)[x] = static_cast<float>(square + noise);
    }
}

/// LightPlanes of the rows around y, under lightWeight(): variances by the square of it.
std::vector<double> Finishing::lightAround(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<double> sums(LightPlanes::kChannels * w);
    for (int row = std::max(0, y - kLightReach); row <= std::min(height_ - 1, y + kLightReach); ++row)
        for (int k = 0; k < LightPlanes::kChannels; ++k) {
            const double weight = lightWeight(row - y);
            const bool variance = k == LightPlanes::kLostSquare || k == LightPlanes::kNoise;
            const double by = variance ? weight * weight : weight;
            const float* in = light_.row(k, row);
            double* sum = sums.data() + static_cast<std::size_t>(k) * w;
            for (std::size_t i = 0; i < w; ++i) sum[i] += by * static_cast<double>(in[i]);
        }
    return sums;
}

/// By what share R, G, B and all of them grow, pixel by pixel of row y, so that the light that the estimate
/// lacks is given back in proportion to the light that is there, at the scale at which it is known. First
/// what fireflies lost in kLightReach columns around, by (1 - 4 sum r^2 / |sum r|^2)+: nothing within two
/// standard errors. Last, the variance of what was lost, sum r^2, as a share of the light's square.
std::vector<double> Finishing::returned(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    const std::vector<double> around = lightAround(y);
    const auto plane = [&](int k) { return around.data() + static_cast<std::size_t>(k) * w; };
    std::vector<double> shares(5 * w);
    for (int x = 0; x < width_; ++x) {
        double lost[3] = {}, light[3] = {}, squares = 0;
        for (int col = std::max(0, x - kLightReach); col <= std::min(width_ - 1, x + kLightReach); ++col) {
            const double weight = lightWeight(col - x);
            for (int c = 0; c < 3; ++c) {
                lost[c] += weight * plane(LightPlanes::lost(c))[col];
                light[c] += weight * plane(LightPlanes::light(c))[col];
            }
            squares += weight * weight * plane(LightPlanes::kLostSquare)[col];
        }
        const auto i = static_cast<std::size_t>(x);
        const double all = light[0] + light[1] + light[2];
        if (all <= 0) continue;
        const double square = lost[0] * lost[0] + lost[1] * lost[1] + lost[2] * lost[2];
        const double known = shrinkage(square, kKnown * squares);
        for (std::size_t c = 0; c < 3; ++c)
            if (light[c] > 0) shares[c * w + i] = known * lost[c] / light[c];
        shares[3 * w + i] = known * (lost[0] + lost[1] + lost[2]) / all;
        shares[4 * w + i] = 3 * squares / (all * all);
    }
    widen(around, shares);
    return shares;
}

/// What is not given back yet, of what fireflies lost and what the estimate differs from the samples by: at
/// wider and wider scales along the row, (1 - variance / square)+ of what the one before left, in blocks of
/// columns, linear between them.
void Finishing::widen(const std::vector<double>& around, std::vector<double>& shares) const {
    const auto w = static_cast<std::size_t>(width_);
    const auto plane = [&](int k) { return around.data() + static_cast<std::size_t>(k) * w; };
    struct Light {
        double left[3] = {}, light[3] = {}, noise = 0, share[3] = {}, shareOfAll = 0;
    };
    const int blocks = (width_ + kLightColumns - 1) / kLightColumns;
    std::vector<Light> row(static_cast<std::size_t>(blocks));
    for (std::size_t i = 0; i < w; ++i) {
        Light& block = row[i / kLightColumns];
        for (std::size_t c = 0; c < 3; ++c) {
            const int colour = static_cast<int>(c);
            const double light = plane(LightPlanes::light(colour))[i];
            block.left[c] += plane(LightPlanes::lost(colour))[i] + plane(LightPlanes::apart(colour))[i] -
                             shares[c * w + i] * light;
            block.light[c] += light;
        }
        block.noise += plane(LightPlanes::kNoise)[i];
    }
    for (int reach = kWide / kLightColumns;; reach *= 4) {
        std::vector<Light> next = row;
        for (int b = 0; b < blocks; ++b) {
            Light sum;
            for (int k = std::max(0, b - reach); k <= std::min(blocks - 1, b + reach); ++k) {
                const double u = static_cast<double>(k - b) / (reach + 1), weight = (1 - u * u) * (1 - u * u);
                const Light& at = row[static_cast<std::size_t>(k)];
                for (int c = 0; c < 3; ++c) {
                    sum.left[c] += weight * at.left[c];
                    sum.light[c] += weight * at.light[c];
                }
                sum.noise += weight * weight * at.noise;
            }
            const double all = sum.light[0] + sum.light[1] + sum.light[2];
            if (all <= 0) continue;
            double square = 0, left = 0;
            for (const double of : sum.left) {
                square += of * of;
                left += of;
            }
            const double known = shrinkage(square, sum.noise);
            Light& to = next[static_cast<std::size_t>(b)];
            for (int c = 0; c < 3; ++c) {
                const double share = sum.light[c] > 0 ? known * sum.left[c] / sum.light[c] : 0;
                to.share[c] += share;
                to.left[c] -= share * to.light[c];
            }
            to.shareOfAll += known * left / all;
        }
        row = std::move(next);
        if (reach >= blocks) break;
    }
    for (int x = 0; x < width_; ++x) {
        const double at = std::clamp((x + 0.5) / kLightColumns - 0.5, 0.0, blocks - 1.0);
        const auto b = static_cast<std::size_t>(at);
        const Light &here = row[b], &there = row[std::min(b + 1, row.size() - 1)];
        const double part = at - static_cast<double>(b);
        const auto i = static_cast<std::size_t>(x);
        for (std::size_t c = 0; c < 3; ++c)
            shares[c * w + i] += here.share[c] + part * (there.share[c] - here.share[c]);
        shares[3 * w + i] += here.shareOfAll + part * (there.shareOfAll - here.shareOfAll);
    }
}

Finishing::Counts Finishing::outputRow(int y, float* out) const {
    const std::vector<double> shares = returned(y);
    Counts counts;
    for (int x = 0; x < width_; ++x, out += radiance_ + 3) {
        const double n = data_.row(planes_.count(), y)[x];
        const bool exact = isExact(x, y);
        counts.exact += exact;
        double shared[3];
        sharedVariance(x, y, shared);
        const double gap = data_.row(planes_.gap(), y)[x];
        const double strength = n > 0 ? strength_ : 1;
        const double leverage = combined_.row(combinedPlanes_.leverage(), y)[x];
        const bool twoHalves =
            data_.row(planes_.halfCount(0), y)[x] > 0 && data_.row(planes_.halfCount(1), y)[x] > 0;
        double back[3] = {};
        for (int c = 0; c < radiance_; ++c) {
            const double mean = plainMean(data_, planes_, c, x, y);
            double value = clean_.row(c, y)[x];
            // Light is not negative. Parts of light must add up: they are left as they come.
            if (c == layout_.alpha) {
                value = coverage(value);
            } else {
                const int colour = colour_[static_cast<std::size_t>(c)];
                const double more =
                    value * shares[static_cast<std::size_t>((colour < 0 ? 3 : colour) * width_ + x)];
                value += more;
                if (c < 3 && !exact) back[c] = strength * more;
                if (radiance_ == 3 + (layout_.alpha >= 0) && mean >= 0) value = std::max(0.0, value);
            }
            const double chosen = exact ? mean : value;
            out[c] = static_cast<float>(mean + strength * (chosen - mean));
            if (c >= 3) continue;
            // The noise of the halves' common data is estimated twice, by what the halves differ in and by
            // the kriging variance: half of each.
            double variance =
                shared[c] / 2 + static_cast<double>(combined_.row(combinedPlanes_.variance() + c, y)[x]);
            variance += value * value * shares[static_cast<std::size_t>(4 * width_ + x)];
            if (gap > 0) variance += picture_.semivarianceAt(c, gap / scale_);
            const double meanVariance = static_cast<double>(variances_.row(c, y)[x]) / std::max(1.0, n);
            // A pixel's own scatter beyond two standard deviations raises its variance, by as much as the
            // pixel itself is in its estimate.
            if (twoHalves) {
                const double apart = static_cast<double>(data_.row(planes_.mean(0) + c, y)[x]) -
                                     static_cast<double>(data_.row(planes_.mean(1) + c, y)[x]);
                variance += leverage * leverage * std::max(0.0, apart * apart / 4 - 4 * meanVariance);
            }
            out[radiance_ + c] = static_cast<float>(
                exact ? 0 : std::sqrt(strength * variance + (1 - strength) * meanVariance));
        }
        counts.returned += n * luminance(back);
    }
    return counts;
}

/// Whether the dump states that the pixel, and every one that its error variance was pooled over, has none.
bool Finishing::isExact(int x, int y) const {
    if (data_.row(planes_.stated(), y)[x] == 0) return false;
    for (int c = 0; c < 3; ++c)
        if (variances_.row(c, y)[x] > 0) return false;
    return true;
}

/// How alike the features of two pixels are, 0 to 1.
float Finishing::likeness(int x, int y, int col, int row) const {
    float d = 0;
    for (int f = 0; f < layout_.features; ++f) {
        const float apart = features_.row(f, row)[col] - features_.row(f, y)[x];
        d += apart * apart /
             (kAlikeFeatures2 + 2 * features_.row(FeaturePlanes{layout_.features}.error(f), y)[x]);
    }
    return simd::nearExp(d);
}

/// Variance of R, G, B of the mean of the two halves' estimates, from their difference, over the pixels of
/// alike features around.
void Finishing::sharedVariance(int x, int y, double* variance) const {
    double total = 0;
    std::fill_n(variance, 3, 0.0);
    for (int row = std::max(0, y - kAlikeReach); row <= std::min(height_ - 1, y + kAlikeReach); ++row)
        for (int col = std::max(0, x - kAlikeReach); col <= std::min(width_ - 1, x + kAlikeReach); ++col) {
            const auto alike = static_cast<double>(likeness(x, y, col, row));
            if (alike == 0) continue;
            total += alike;
            for (int c = 0; c < 3; ++c) {
                const double d = static_cast<double>(combined_.row(combinedPlanes_.half(0) + c, row)[col]) -
                                 static_cast<double>(combined_.row(combinedPlanes_.half(1) + c, row)[col]);
                variance[c] += alike * d * d / 4;
            }
        }
    for (int c = 0; c < 3; ++c) variance[c] /= total;
}

}  // namespace vlx
