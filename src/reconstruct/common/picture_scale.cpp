#include "reconstruct/common/picture_scale.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "reconstruct/common/rebin.h"

namespace vlx {

namespace {

constexpr int kRows = 16;

/// Sums over rows of pixels.
class Sums {
  public:
    explicit Sums(int width) {
        for (int lag = 1; lag < width; lag *= 2) lags_.push_back(lag);
        pairs_.resize(lags_.size());
        for (auto* sums : {products_, squaredProducts_})
            for (int c = 0; c < 3; ++c) sums[c].resize(lags_.size());
    }

    void add(const RowRing& row, const GatheredPlanes& planes, int width) {
        const auto at = [&](int plane, int x) { return static_cast<double>(row.row(plane, 0)[x]); };
        const auto half = [&](int h, int c, int x) {  // a half without samples has the other's mean
            const bool own = at(planes.halfCount(h), x) > 0;
            return at(planes.mean(own ? h : 1 - h) + c, x);
        };
        for (int x = 0; x < width; ++x) {
            const double n = at(planes.count(), x);
            if (n == 0) continue;
            samples_ += n;
            freedom_ += at(planes.freedom(), x);
            for (int c = 0; c < 3; ++c) {
                radiance_[c] += at(planes.halfCount(0), x) * at(planes.mean(0) + c, x) +
                                at(planes.halfCount(1), x) * at(planes.mean(1) + c, x);
                if (at(planes.freedom(), x) > 0) squares_[c] += at(planes.squares() + c, x);
            }
            for (std::size_t k = 0; k < lags_.size(); ++k) {
                const int to = x + lags_[k];
                if (to >= width || at(planes.count(), to) == 0) continue;
                ++pairs_[k];
                for (int c = 0; c < 3; ++c) {
                    const double product =
                        (half(0, c, to) - half(0, c, x)) * (half(1, c, to) - half(1, c, x)) / 2;
                    products_[c][k] += product;
                    squaredProducts_[c][k] += product * product;
                }
            }
        }
    }

    bool light() const { return std::max({radiance_[0], radiance_[1], radiance_[2]}) > 0; }

    PictureScale scale() const {
        PictureScale scale;
        if (light()) scale.level = std::max({radiance_[0], radiance_[1], radiance_[2]}) / samples_;
        const bool paired = std::any_of(pairs_.begin(), pairs_.end(), [](double pairs) { return pairs > 0; });
        for (int c = 0; c < 3; ++c) {
            if (!paired) {  // how neighbours differ is not known: as much as the light itself
                scale.semivariance[c].assign(1, scale.level * scale.level);
                scale.variance[c] =
                    std::max(unseenVariance(samples_, scale.level),
                             freedom_ > 0 ? squares_[c] / freedom_ : scale.level * scale.level);
                continue;
            }
            double most = 0;
            for (std::size_t k = 0; k < lags_.size(); ++k) {
                // Few pairs may be alike by chance: not less than a standard error. None: the light itself.
                const double known =
                    pairs_[k] > 0 ? std::max(products_[c][k], std::sqrt(squaredProducts_[c][k])) / pairs_[k]
                                  : scale.level * scale.level;
                most = std::max(most, known);
                scale.semivariance[c].push_back(most);
            }
            double variance = 0;
            if (freedom_ > 0)
                variance = squares_[c] / freedom_;
            else
                for (std::size_t k = 0; k < lags_.size() && variance == 0; ++k)
                    variance = scale.semivariance[c][k];
            scale.variance[c] = std::max(variance, unseenVariance(samples_, scale.level));
        }
        return scale;
    }

  private:
    std::vector<int> lags_;
    std::vector<double> pairs_, products_[3], squaredProducts_[3];
    double radiance_[3] = {}, squares_[3] = {}, samples_ = 0, freedom_ = 0;
};

struct Measured {
    Sums sums;
    RadianceRange range;
};

/// Radiance in units of 2^exponent.
void scaleRadiance(SampleBand& band, const SampleLayout& layout, int exponent) {
    for (std::size_t c = 0; c < 3; ++c) {
        for (float& value : band.values[c]) value = std::ldexp(value, -exponent);
        if (layout.variance < 0) continue;
        for (float& value : band.values[static_cast<std::size_t>(layout.variance) + c])
            value = std::ldexp(value, -2 * exponent);
    }
}

/// Rows spread evenly; all where these hold no light. With an exponent above 0 that of R, G, B only.
Measured measureRows(const SampleSource& dump, const SampleLayout& layout, int exponent) {
    const DumpHeader& header = dump.header();
    const GatheredPlanes planes{layout.radiance, layout.features};
    RowRing ring(header.data.width, planes.channels(), 1);
    const auto measured = [&](int rows) {
        Measured of{Sums(header.data.width), {}};
        for (int i = 0; i < rows; ++i) {
            const auto row =
                static_cast<int>((2 * i + 1) * static_cast<std::int64_t>(header.data.height) / (2 * rows));
            SampleBand band = readRows(dump, layout, 1, row, 1);
            if (exponent > 0) scaleRadiance(band, layout, exponent);
            of.range.add(gatherRow(band, layout, planes, 0, 0, ring, 0).range);
            of.sums.add(ring, planes, header.data.width);
        }
        return of;
    };
    const Measured some = measured(std::min(kRows, header.data.height));
    const bool enough = some.sums.light() || some.range.exceeded() || header.data.height <= kRows;
    return enough ? some : measured(header.data.height);
}

}  // namespace

double PictureScale::agreedDeviation(double value, double samples) const {
    return std::sqrt(unseenVariance(samples, std::max(std::abs(value), level)) / std::max(1.0, samples));
}

double PictureScale::unknownDeviation(int c) const {
    return std::sqrt(level * level + semivariance[c].back());
}

double PictureScale::semivarianceAt(int c, double pixels) const {
    const std::vector<double>& values = semivariance[c];
    const double place = std::log2(std::max(1.0, pixels));
    const auto below = std::min(values.size() - 1, static_cast<std::size_t>(place));
    const auto above = std::min(values.size() - 1, below + 1);
    const double share = std::min(1.0, place - static_cast<double>(below));
    return (1 - share) * values[below] + share * values[above];
}

PictureScale measurePictureScale(const SampleSource& dump) {
    const SampleLayout layout = chooseSampleLayout(dump, {.standardFeatures = false});
    const Measured measured = measureRows(dump, layout, 0);
    if (!measured.range.exceeded()) return measured.sums.scale();
    const int exponent = std::ilogb(measured.range.most) + 1 - std::ilogb(kMostRadiance);
    PictureScale picture = measureRows(dump, layout, exponent).sums.scale();
    picture.level = std::ldexp(picture.level, exponent);
    for (int c = 0; c < 3; ++c) {
        picture.variance[c] = std::ldexp(picture.variance[c], 2 * exponent);
        for (double& value : picture.semivariance[c]) value = std::ldexp(value, 2 * exponent);
    }
    return picture;
}

PictureScale measurePictureScale(const SampleSource& dump, const SampleLayout& layout) {
    const Measured measured = measureRows(dump, layout, 0);
    measured.range.require(dump.path(), "in rows spread over the picture");
    return measured.sums.scale();
}

}  // namespace vlx
