#pragma once

#include <Eigen/Core>
#include <vector>

#include "reconstruct/common/row_ring.h"
#include "reconstruct/drift/pixel_data.h"

/// From the models' estimates of the halves to one estimate, with its variance: drift_kriging.h, 5.
namespace vlx {

inline constexpr int kStackReach = 10;  ///< pixels: triangular window of 21 x 21 pixels

/// What one model says of a pixel.
struct ModelPlanes {
    int radiance = 3;
    int half(int which) const { return which * radiance; }  ///< estimates of radiance channels from a half
    int variance() const { return 2 * radiance; }           ///< R, G, B: of the mean of both halves'
    int leverage() const { return 2 * radiance + 3; }       ///< what the pixel's datum weighs in its estimate
    int channels() const { return 2 * radiance + 4; }
};

/// What all models together say of a pixel.
struct CombinedPlanes {
    int radiance = 3;
    int value() const { return 0; }                             ///< radiance channels
    int half(int which) const { return radiance + 3 * which; }  ///< R, G, B from a half
    int variance() const { return radiance + 6; }               ///< R, G, B: but for what halves differ in
    int leverage() const { return radiance + 9; }
    int channels() const { return radiance + 10; }
};

/// Candidates are the models and, last, the plain mean. Refers to its rings. Rows may be worked on at the
/// same time.
class Combination {
  public:
    /// `data`: DataPlanes; `variances`: of one sample of R, G, B; `estimates`, of each model: ModelPlanes;
    /// `moments`: momentPlanes(); `combined`: CombinedPlanes.
    Combination(int radiance, int width, int height, const RowRing& data, const RowRing& variances,
                const std::vector<RowRing>& estimates, RowRing& moments, RowRing& combined)
        : planes_{radiance},
          models_{radiance},
          combinedPlanes_{radiance},
          width_(width),
          height_(height),
          data_(data),
          variances_(variances),
          estimates_(estimates),
          moments_(moments),
          combined_(combined) {}

    /// Planes of the moments of stacking for a number of models.
    static int momentPlanes(int models) { return models * (models + 1) / 2 + 2 * models; }
    /// Moments of the pixels of row y, each by itself.
    void momentsRow(int y);
    /// Row y of `combined`. Moments of kStackReach rows around it are there.
    void combineRow(int y);

  private:
    int candidates() const { return static_cast<int>(estimates_.size()); }
    float estimate(int j, int half, int c, int x, int y) const;
    double unit(int x, int y) const;
    void store(int x, int y, const Eigen::VectorXd& weights);

    DataPlanes planes_;
    ModelPlanes models_;
    CombinedPlanes combinedPlanes_;
    int width_, height_;
    const RowRing &data_, &variances_;
    const std::vector<RowRing>& estimates_;
    RowRing &moments_, &combined_;
};

}  // namespace vlx
