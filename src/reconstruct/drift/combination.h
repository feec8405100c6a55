#pragma once

#include <array>
#include <vector>

#include "reconstruct/data/pixel_data.h"
#include "reconstruct/drift/stacking.h"

/// From the models' estimates of the halves to one estimate, with its variance: drift.h, 5.
namespace vlx {

inline constexpr int kStackReach = 10;  ///< pixels: triangular window of 21 x 21 pixels

/// Candidates are the models and, last, the plain mean. Refers to its rings. Rows may be worked on at the
/// same time.
class Combination {
  public:
    /// `data`: DataPlanes; `variances`: VariancePlanes; `estimates`, of each model: ModelPlanes;
    /// `moments`: MomentPlanes; `combined`: CombinedPlanes.
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

    /// Moments of the pixels of row y, each by itself.
    void momentsRow(int y);
    /// Row y of `combined`; without `stacking` the first model alone. Moments of kStackReach rows around it
    /// are there.
    void combineRow(int y, bool stacking);

  private:
    int candidates() const { return static_cast<int>(estimates_.size()); }
    /// What is read of one row. estimate[j][half][c]: of a half by candidate j; the last is the half's plain
    /// mean.
    struct Rows {
        std::vector<std::array<std::vector<const float*>, 2>> estimate;
        std::vector<const float*> leverage, modelVariance[3];  // of models
        const float *halfCount[2], *count, *variance[3];
    };
    Rows rowsOf(int y) const;
    double unit(const Rows& rows, int x) const;
    void store(const Rows& rows, int x, const StackingVector& weights, float* const* out) const;

    DataPlanes planes_;
    ModelPlanes models_;
    CombinedPlanes combinedPlanes_;
    int width_, height_;
    const RowRing &data_, &variances_;
    const std::vector<RowRing>& estimates_;
    RowRing &moments_, &combined_;
};

}  // namespace vlx
