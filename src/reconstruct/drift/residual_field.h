#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "reconstruct/drift/level.h"
#include "variolux/reconstruct/reconstruction.h"

/// What the drift leaves is a random field: its variograms, region by region. METHOD.md 7.10.
namespace vlx {

/// Residuals of the two halves, r_h = z_h - K_h in units of their noise, have noise that is independent, so
/// that it cancels in their products: with C(h) the mean of r_A(p) r_B(p + h) over pairs of a region of 32 x
/// 32 pixels (both orders, along rows and columns, R, G and B),
///     gamma(h) = C(0) - C(h),    standard error^2 = sum q^2 / N^2 of C(0) and of C(h), q the products
/// is the semivariance of what the estimate lacks, times the region's mean noise variance. The stable model
/// is fitted to it; the nugget, what single pixels lack less what the weights of one half know of the other's
/// noise (METHOD.md 7.5), may be negative. sillTest() says whether there is any structure.
class ResidualField {
  public:
    static constexpr int kSide = 32;

    /// `combined`: CombinedPlanes. Of pixels in `inspect` (from 0) the regions' classes and models are kept.
    ResidualField(int width, int height, const Window& image, std::vector<std::pair<int, int>> inspect,
                  const LevelRows& level, const RowRing& combined, int radiance);

    /// The next row, from 0 on.
    void addRow(int y, DriftReport& report);

  private:
    void finishRegions(DriftReport& report);
    double product(std::size_t p, std::size_t q) const;

    int width_, height_, first_ = 0;  // row of the regions at hand
    Window image_;
    std::vector<std::pair<int, int>> inspect_;
    const RowRing &data_, &variances_, &combined_;
    DataPlanes planes_;
    CombinedPlanes combinedPlanes_;
    // kSide rows: residuals of A and B, R, G, B each, in units of noise (not a number: no datum); noise
    // variance.
    std::vector<float> residuals_[2][3], noise_[3];
};

}  // namespace vlx
