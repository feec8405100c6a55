#pragma once

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/drift/patch_similarity.h"
#include "reconstruct/drift/pixel_data.h"

/// What kriging needs besides the means: features without noise, error variances without noise or bias.
namespace vlx {

/// Square of the difference that makes pixels unlike where error variances are pooled: a tenth of a feature's
/// scale.
inline constexpr float kAlikeFeatures2 = 0.01f;
inline constexpr int kFeatureReach = 5;   ///< pixels around a pixel that its features are averaged over
inline constexpr int kVarianceReach = 5;  ///< and its error variance

/// Prefilters the features (FeaturePlanes, as `features`) of the rows
/// [y, y + kTile) at columns [x, x + kTile) (cut to the image): non-local means in each group, weights
/// exp(-d) of patch_similarity.h. The error variance of what is written is sum w^2 v / (sum w)^2. A group
/// without noise is copied. The error variance that steers the weights is averaged with that of the 3 x 3
/// pixels around. Not `clean`: all are copied, with that error variance.
void prefilterFeatures(const RowRing& raw, const SampleLayout& layout, bool clean, int x, int y, int width,
                       int height, RowRing& features);

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
