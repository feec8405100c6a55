#include "reconstruct/drift/residual_field.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "variolux/base/parallel.h"
#include "variolux/geostat/variogram_fit.h"

namespace vlx {

namespace {

constexpr int kLags[] = {1, 2, 3, 4, 6, 8, 12, 16};  // pixels: half a region at most
constexpr int kClasses = static_cast<int>(std::size(kLags));
constexpr std::int64_t kFewestData = 100;
constexpr double kLeastExponent = 0.5;

/// A mean of products, and the variance of that mean were they independent.
struct MeanProduct {
    double sum = 0, squares = 0;
    std::int64_t pairs = 0;

    void add(double product) {
        if (!std::isfinite(product)) return;
        sum += product;
        squares += product * product;
        ++pairs;
    }
    double mean() const { return pairs > 0 ? sum / static_cast<double>(pairs) : 0; }
    double variance() const {
        const auto n = static_cast<double>(pairs);
        return pairs > 0 ? squares / (n * n) : 0;
    }
};

/// Of one region: means of products at lag 0 and at kLags, and the noise variance of a pixel, summed over R,
/// G, B.
struct ResidualProducts {
    MeanProduct none, lags[kClasses];
    double noise = 0;
};

/// gamma(h) in units of a pixel's noise times `unit`, with its null distribution: what all classes share is
/// C(0).
EmpiricalVariogram residualVariogram(const ResidualProducts& of, double unit) {
    EmpiricalVariogram variogram;
    std::vector<double> errors;
    for (int k = 0; k < kClasses; ++k) {
        const MeanProduct& lag = of.lags[k];
        if (lag.pairs == 0) continue;
        errors.push_back(unit * std::sqrt(of.none.variance() + lag.variance()));
        variogram.bins.push_back({.lower = k > 0 ? static_cast<double>(kLags[k - 1]) : 0,
                                  .upper = static_cast<double>(kLags[k]),
                                  .pairs = static_cast<double>(lag.pairs),
                                  .distance = static_cast<double>(kLags[k]),
                                  .semivariance = unit * (of.none.mean() - lag.mean()),
                                  .noise = 0,
                                  .standardError = errors.back()});
    }
    const auto classes = static_cast<Eigen::Index>(errors.size());
    variogram.data = of.none.pairs;
    variogram.nullError = Eigen::Map<const Eigen::VectorXd>(errors.data(), classes);
    variogram.nullCorrelation.resize(classes, classes);
    for (Eigen::Index a = 0; a < classes; ++a)
        for (Eigen::Index b = 0; b < classes; ++b)
            variogram.nullCorrelation(a, b) =
                a == b ? 1
                       : unit * unit * of.none.variance() / (variogram.nullError[a] * variogram.nullError[b]);
    return variogram;
}

/// The stable model. The fit knows no negative nugget: all classes are raised for it, which changes nothing
/// else.
VariogramFit fitResidualVariogram(EmpiricalVariogram variogram) {
    double shift = 0;
    for (const VariogramBin& bin : variogram.bins) shift = std::max(shift, -2 * bin.semivariance);
    for (VariogramBin& bin : variogram.bins) bin.semivariance += shift;
    FitOptions options;
    options.structures = {{.type = StructureType::Stable,
                           .maxRange = ResidualField::kSide,
                           .minShape = kLeastExponent,
                           .maxShape = 2}};
    options.search = FitSearch::Fast;
    VariogramFit fit = fitVariogram(variogram, options);
    fit.model.nugget -= shift;
    return fit;
}

/// What the variogram says, in `region`, and the variogram.
RegionInspection inspectProducts(const ResidualProducts& of, ResidualRegion& region) {
    RegionInspection inspection;
    inspection.neighbourhood = region.pixels;
    inspection.distance = "pixels";
    region.data = of.none.pairs;
    if (region.data < kFewestData) {
        inspection.fallbacks = {"too few pixels with samples in both halves and noise"};
        return inspection;
    }
    // ResidualProducts are sums over three colours.
    const EmpiricalVariogram variogram =
        residualVariogram(of, of.noise / static_cast<double>(region.data) / 3);
    for (const MeanProduct& lag : of.lags) region.pairs += lag.pairs;
    inspection.pairs = region.pairs;
    inspection.classes = variogram.bins;
    const VariogramFit fit = fitResidualVariogram(variogram);
    region.statistic = fit.sillTest.statistic;
    region.pValue = fit.sillTest.pValue;
    region.structure = fit.sillTest.significant;
    if (!fit.ok()) {
        inspection.fallbacks.push_back(fit.message());
        return inspection;
    }
    if (!region.structure)
        inspection.fallbacks.emplace_back("no structure: the variogram is flat but for noise");
    inspection.model = fit.model;
    const VariogramStructure& stable = fit.model.structures.front();
    region.nugget = fit.model.nugget;
    region.sill = stable.sill;
    region.range = stable.range;
    region.exponent = stable.shape;
    return inspection;
}

}  // namespace

ResidualField::ResidualField(int width, int height, const Window& image,
                             std::vector<std::pair<int, int>> inspect, const LevelRows& level,
                             const RowRing& combined, int radiance)
    : width_(width),
      height_(height),
      image_(image),
      inspect_(std::move(inspect)),
      data_(level.data),
      variances_(level.variances),
      combined_(combined),
      planes_{radiance},
      combinedPlanes_{radiance} {
    for (int c = 0; c < 3; ++c)
        for (auto* plane : {&residuals_[0][c], &residuals_[1][c], &noise_[c]})
            plane->resize(static_cast<std::size_t>(width) * kSide);
}

void ResidualField::addRow(int y, DriftReport& report) {
    const auto row = static_cast<std::size_t>(y - first_) * static_cast<std::size_t>(width_);
    for (int x = 0; x < width_; ++x)
        for (int c = 0; c < 3; ++c) {
            const std::size_t at = row + static_cast<std::size_t>(x);
            const double variance = variances_.row(c, y)[x];
            double noise = 0;
            for (int half = 0; half < 2; ++half) {
                const double n = data_.row(planes_.halfCount(half), y)[x];
                const double apart = static_cast<double>(data_.row(planes_.mean(half) + c, y)[x]) -
                                     static_cast<double>(combined_.row(combinedPlanes_.half(half) + c, y)[x]);
                const bool datum = n > 0 && variance > 0;
                noise += datum ? variance / n / 2 : std::numeric_limits<double>::quiet_NaN();
                residuals_[half][c][at] = datum ? static_cast<float>(apart / std::sqrt(variance / n))
                                                : std::numeric_limits<float>::quiet_NaN();
            }
            noise_[c][at] = static_cast<float>(noise);
        }
    if (y + 1 < std::min(height_, first_ + kSide)) return;
    finishRegions(report);
    first_ = y + 1;
}

void ResidualField::finishRegions(DriftReport& report) {
    const int rows = std::min(kSide, height_ - first_), regions = (width_ + kSide - 1) / kSide;
    std::vector<ResidualRegion> found(static_cast<std::size_t>(regions));
    std::vector<RegionInspection> inspections(found.size());
    parallelFor(0, regions, [&](std::int64_t number) {
        const auto at = static_cast<std::size_t>(number);
        const int left = static_cast<int>(number) * kSide, columns = std::min(kSide, width_ - left);
        found[at].pixels = {image_.x + left, image_.y + first_, columns, rows};
        const auto place = [&](int x, int y) {
            return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                   static_cast<std::size_t>(left + x);
        };
        ResidualProducts sums;
        for (int y = 0; y < rows; ++y)
            for (int x = 0; x < columns; ++x) {
                const std::size_t p = place(x, y);
                const double own = product(p, p);
                if (!std::isfinite(own)) continue;
                sums.none.add(own);
                for (int c = 0; c < 3; ++c) sums.noise += static_cast<double>(noise_[c][p]);
                for (int k = 0; k < kClasses; ++k) {
                    if (x + kLags[k] < columns) sums.lags[k].add(product(p, place(x + kLags[k], y)));
                    if (y + kLags[k] < rows) sums.lags[k].add(product(p, place(x, y + kLags[k])));
                }
            }
        inspections[at] = inspectProducts(sums, found[at]);
    });
    for (std::size_t i = 0; i < found.size(); ++i) {
        const Window& w = found[i].pixels;
        if (std::ranges::any_of(inspect_,
                                [&](const auto& pixel) { return w.contains(pixel.first, pixel.second); }))
            report.inspections[report.residuals.size()] = std::move(inspections[i]);
        report.residuals.push_back(found[i]);
    }
}

/// Of the halves' residuals in two pixels, both orders, summed over R, G, B.
double ResidualField::product(std::size_t p, std::size_t q) const {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
        const std::vector<float>&a = residuals_[0][c], &b = residuals_[1][c];
        sum += (static_cast<double>(a[p]) * static_cast<double>(b[q]) +
                static_cast<double>(a[q]) * static_cast<double>(b[p])) /
               2;
    }
    return sum;
}

}  // namespace vlx
