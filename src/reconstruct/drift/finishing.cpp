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

constexpr double kKnown = 4;  // (standard errors of lost light that are none)^2

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
    const auto w = static_cast<std::size_t>(width_);
    std::vector<double> in(LightPlanes::kChannels * w);
    for (std::size_t i = 0; i < w; ++i)
        for (std::size_t c = 0; c < 3; ++c) {
            const double lost = data_.row(planes_.removed() + static_cast<int>(c), y)[i];
            in[c * w + i] = lost;
            in[3 * w + i] += lost * lost;
            in[(4 + c) * w + i] = std::max(0.f, clean_.row(static_cast<int>(c), y)[i]);
        }
    for (int k = 0; k < LightPlanes::kChannels; ++k)
        for (int x = 0; x < width_; ++x) {
            double sum = 0;
            for (int col = std::max(0, x - kLightReach); col <= std::min(width_ - 1, x + kLightReach);
                 ++col) {
                const double weight = lightWeight(col - x);
                sum += (k == 3 ? weight * weight : weight) *
                       in[static_cast<std::size_t>(k) * w + static_cast<std::size_t>(col)];
            }
            light_.row(k, y)[x] = static_cast<float>(sum);
        }
}

/// By what share R, G, B and all of them grow, pixel by pixel of row y, so that what fireflies lost around is
/// given back in proportion to the light there, by how much of it is no accident of a few samples:
/// (1 - 4 sum r^2 / (sum r)^2)+, nothing within two standard errors. Last, the variance of what was lost, sum
/// r^2, as a share of the light's square.
std::vector<double> Finishing::returned(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<double> sums(LightPlanes::kChannels * w), shares(5 * w);
    for (int row = std::max(0, y - kLightReach); row <= std::min(height_ - 1, y + kLightReach); ++row) {
        const double weight = lightWeight(row - y);
        for (int k = 0; k < LightPlanes::kChannels; ++k) {
            const float* in = light_.row(k, row);
            double* sum = sums.data() + static_cast<std::size_t>(k) * w;
            for (std::size_t i = 0; i < w; ++i) sum[i] += (k == 3 ? weight * weight : weight) * in[i];
        }
    }
    for (std::size_t i = 0; i < w; ++i) {
        double square = 0, lost = 0, light = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            square += sums[c * w + i] * sums[c * w + i];
            lost += sums[c * w + i];
            light += sums[(4 + c) * w + i];
        }
        const double known = shrinkage(square, kKnown * sums[3 * w + i]);
        for (std::size_t c = 0; c < 3; ++c)
            if (sums[(4 + c) * w + i] > 0)
                shares[c * w + i] = known * sums[c * w + i] / sums[(4 + c) * w + i];
        if (light <= 0) continue;
        shares[3 * w + i] = known * lost / light;
        shares[4 * w + i] = 3 * sums[3 * w + i] / (light * light);
    }
    return shares;
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
                    std::max(0.0, value) *  // as where the shares come from: what is negative is no light
                    shares[static_cast<std::size_t>((colour < 0 ? 3 : colour) * width_ + x)];
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
