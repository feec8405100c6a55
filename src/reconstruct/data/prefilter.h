#pragma once

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/data/pixel_data.h"
#include "reconstruct/drift/patch_similarity.h"

/// What kriging needs besides the means: features without noise, error variances without noise or bias.
namespace vlx {

inline constexpr int kMostFeatureReach = 5;  ///< pixels around a pixel that its features are averaged over
inline constexpr int kVarianceReach = 5;     ///< and its error variance
inline constexpr int kReturnReach = 11;      ///< that tell what smoothing its features took away

/// Prefilters the features (FeaturePlanes, as `features`) of the rows [y, y + kTile) at columns
/// [x, x + kTile) (cut to the image): non-local means in each group of each half f_h, with weights exp(-d),
/// d the patch_similarity.h of the *other* half, so that they are independent of what they weigh:
///     F_h = sum w f_h / sum w,    F = (F_A + F_B) / 2,    u = (U_A + U_B) / 4,
///     U_h = sum w^2 u_h / (sum w)^2.
/// The error variances u_h are averaged with those of the 3 x 3 pixels around. A pixel of one sample is
/// the same in both: it steers its own weights, and u = (U_A + U_B) / 2. A tile whose group has no
/// noise is copied; with `reach`, at most kMostFeatureReach pixels around, of 0 all are. Writes
/// ResidualPlanes too (0 of pixels of one sample).
void prefilterFeatures(const RowRing& raw, const RowRing& data, const DataPlanes& dataPlanes,
                       const SampleLayout& layout, int reach, int x, int y, int width, int height,
                       RowRing& features, RowRing& residuals);

/// Gives back to the prefiltered features of row y what both halves show of what was taken off, r = f - F:
///     F <- F + q (f - F),    q = (sum g r_A r_B - 3 sqrt(sum g^2 (r_A r_B)^2)) / sum g ((r_A + r_B) / 2)^2,
/// 0 <= q <= 1, g of window_sum.h over the pixels within kReturnReach: the least squares of an image that
/// both halves have in common, in whose product noise cancels, less three standard errors. Errors of
/// f and F count as one; texture that is not given back is not in them.
void returnResiduals(const RowRing& raw, const RowRing& residuals, const SampleLayout& layout, int y,
                     int width, int height, RowRing& features);

/// Variance of one sample of R, G, B for the pixels of row y: V = sum w S / F, F = sum w (n - 1), over the
/// pixels within kVarianceReach, S their sums of squares and n their counts (SquaresPlanes),
///     w = exp(-sum over features of df^2 / (0.1^2 + 2 v)),   v the pixel's own feature error variance.
///
/// What scatters may be rare. r = F sum w T^2 / (sum w T)^2, T a pixel's S over R, G and B, is in how many
/// degrees of freedom it is met once (where noise is alike everywhere, those of one pixel). `wide` (null:
/// none) holds V' and r' of the level of half the resolution, whose windows are twice as wide. Where the
/// samples of the own window agree (within the rounding of half floats) though F / r' meetings were expected,
/// what was met there is not denied here, as far as chance explains it:
///     V = R V' / (F + R),    R = r' / (1 + 2 F / r'):  2 F / r' is the deviance of none (Poisson).
///
/// If `unseen`, unseenVariance() of the sum w n samples is added, of the picture's level; where samples
/// agree, of their own if that is larger. Where no pixel has two samples, the picture's variance counts as
/// two more pixels; where none has a neighbour to compare it with, it stands alone. Where the dump states the
/// variances, nothing is added to them. Writes VariancePlanes: the variances, above 0 but where the dump
/// states 0, and r (0: nothing scatters).
void smoothVariances(const RowRing& squares, const RowRing& data, const DataPlanes& planes,
                     const RowRing& features, int featureCount, const PictureScale& picture, bool unseen,
                     const RowRing* wide, int y, int width, int height, RowRing& variances);

}  // namespace vlx
