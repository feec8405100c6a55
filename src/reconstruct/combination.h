#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "picture_scale.h"
#include "pixel_data.h"
#include "row_ring.h"

/// From the models' estimates of the halves to the image and its error: drift_kriging.h, 5 and 6.
namespace vlx {

inline constexpr int kStackReach = 10;  ///< pixels: triangular window of 21 x 21 pixels

/// Candidates are the models and, last, the plain mean. Refers to its rings. Rows may be worked on at the
/// same time.
class Combination {
  public:
    /// `data`: pixel_data.h; `features`: prefilter.h; `variances`: of one sample of R, G, B; `estimates`, of
    /// each model: of halves A and B, and the error variance of the mean of both of R, G, B; `moments`:
    /// momentPlanes(). `alpha`: its radiance channel or -1.
    Combination(int radiance, int alpha, double strength, int scale, int width, int height,
                const PictureScale& picture, const RowRing& data, const RowRing& features, int featureCount,
                const RowRing& variances, const std::vector<RowRing>& estimates, RowRing& moments)
        : radiance_(radiance),
          planes_{radiance},
          alpha_(alpha),
          strength_(strength),
          scale_(scale),
          width_(width),
          height_(height),
          picture_(picture),
          data_(data),
          features_(features),
          featureCount_(featureCount),
          variances_(variances),
          estimates_(estimates),
          moments_(moments) {}

    /// Planes of the moments of stacking for a number of models.
    static int momentPlanes(int models) { return models * (models + 1) / 2 + 2 * models; }
    /// Moments of the pixels of row y, each by itself.
    void momentsRow(int y);
    /// Row y of the image: radiance channels and stddev of R, G, B, interleaved. Moments of kStackReach rows
    /// around it are there. How many of its pixels are exact.
    std::int64_t combineRow(int y, float* out) const;

  private:
    int candidates() const { return static_cast<int>(estimates_.size()); }
    float estimate(int j, int half, int c, int x, int y) const;
    double halfVariance(int x, int y) const;
    bool store(int x, int y, const Eigen::VectorXd& weights, float* out) const;
    bool isExact(int x, int y) const;
    float likeness(int x, int y, int col, int row) const;
    std::array<double, 3> sharedVariance(const Eigen::VectorXd& weights, int x, int y) const;

    int radiance_;
    DataPlanes planes_;
    int alpha_;
    double strength_;
    int scale_, width_, height_;
    const PictureScale& picture_;
    const RowRing &data_, &features_;
    int featureCount_;
    const RowRing& variances_;
    const std::vector<RowRing>& estimates_;
    RowRing& moments_;
};

}  // namespace vlx
