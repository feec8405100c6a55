#pragma once

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/row_ring.h"
#include "reconstruct/drift/patch_similarity.h"
#include "reconstruct/drift/pixel_data.h"

/// What kriging needs besides the means: features without noise, error variances without noise or bias.
namespace vlx {

/// Square of the difference that makes pixels unlike where error variances are pooled: a tenth of a feature's
/// scale.
inline constexpr float kAlikeFeatures2 = 0.01f;
inline constexpr int kFeatureReach = 5;   ///< pixels around a pixel that its features are averaged over
inline constexpr int kVarianceReach = 5;  ///< and its error variance

/// Prefilters the features (`raw`: f of them, then the error variances of their means) of the rows
/// [y, y + kTile) at columns [x, x + kTile) (cut to the image): non-local means in each group, weights
/// exp(-d) of patch_similarity.h. Writes the features (planes 0 to f - 1) and their error variances (f to 2 f
/// - 1: sum w^2 v / (sum w)^2). A group without noise is copied. The error variance that steers the weights
/// is averaged with that of the 3 x 3 pixels around.
void prefilterFeatures(const RowRing& raw, const SampleLayout& layout, int x, int y, int width, int height,
                       RowRing& features);

/// Variance of one sample of R, G, B for the pixels of row y: sum w S / sum w (n - 1) over the pixels within
/// kVarianceReach, S their sums of squares and n their counts (`squares`: kSquaresPlanes),
///     w = exp(-sum over features of df^2 / (0.1^2 + 2 v)),   v the pixel's own feature error variance.
/// Where they agree (within the rounding of half floats) and the dump does not state so, unseenVariance() of
/// their sum w n samples and of the pixel's own mean or the picture's, whichever is larger; where no pixel
/// has two samples, the picture's counts as two more pixels; where none has a neighbour to compare it with,
/// it stands alone. Writes planes 0 to 2: above 0 but where the dump states 0.
void smoothVariances(const RowRing& squares, const RowRing& data, const DataPlanes& planes,
                     const RowRing& features, int featureCount, const PictureScale& picture, int y, int width,
                     int height, RowRing& variances);

}  // namespace vlx
