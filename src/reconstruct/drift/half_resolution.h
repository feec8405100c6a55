#pragma once

#include "reconstruct/drift/combination.h"
#include "reconstruct/drift/level.h"

/// The picture kriged once more at half its resolution, and the two combined: drift.h, 6.
namespace vlx {

/// L - K, where L = K + up(C - down(K)) corrects the fine level's estimate K by the coarse one's C, and what
/// stacking needs of it. Refers to its levels and rings. Rows may be worked on at the same time.
class Correction {
  public:
    static constexpr int kReach = 3;  ///< triangular window of 7 x 7 pixels

    Correction(int radiance, const LevelRows& fine, const LevelRows& coarse, RowRing& differences,
               RowRing& corrected)
        : planes_{radiance},
          apart_{radiance},
          fine_(fine),
          coarse_(coarse),
          differences_(differences),
          corrected_(corrected) {}

    /// Row y of `differences` (DifferencePlanes): combined rows from y - 3 to y + 3 of the fine level, and
    /// from y / 2 - 1 to y / 2 + 1 of the coarse one, are there.
    void differenceRow(int y);
    /// Row y of `corrected` (CombinedPlanes): K + w (L - K), w the weight in 0 to 1 by which each half's
    /// correction predicts the other half's data best,
    ///     w = (sum u (L_A - K_A)(Z_B - K_A) + (A and B exchanged) + l / 2)
    ///         / (sum u ((L_A - K_A)^2 + (L_B - K_B)^2) + l),
    /// u one over the variance of a half's mean, l = 10: a prior of one half, since evidence in a window is
    /// too noisy to find the gain by itself, and strong enough to refuse it. Variance, where V_C is
    /// what C says of its own and V_K what K does: (1 - w)^2 V_K + (1 - (1 - w)^2) min(V_C, V_K)
    /// + w (1 - w) (L - K)^2: both krige the same data, so that the better one's error is what they share.
    /// Differences of kReach rows around y are there.
    void correctRow(int y);

  private:
    CombinedPlanes planes_;
    DifferencePlanes apart_;
    LevelRows fine_, coarse_;
    RowRing &differences_, &corrected_;
};

}  // namespace vlx
