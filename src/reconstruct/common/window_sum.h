#pragma once

#include <algorithm>
#include <functional>
#include <vector>

#include "base/simd.h"
#include "reconstruct/common/row_ring.h"

/// Sums over windows: under weights that are smooth to the border, which would show where much is summed, and
/// under weights that say how alike pixels are.
namespace vlx {

/// g(d) = (1 - u^2)^2, u = d / (reach + 1): of what lies d pixels away along an axis, |d| <= reach.
inline float windowWeight(int d, int reach) {
    const double u = static_cast<double>(d) / (reach + 1), v = 1 - u * u;
    return static_cast<float>(v * v);
}

VLX_WIDE inline void addScaled(const float* __restrict in, float weight, int n, float* __restrict out) {
    for (int i = 0; i < n; ++i) out[i] += weight * in[i];
}

VLX_WIDE inline void addScaled(const float* __restrict in, double weight, std::size_t n,
                               double* __restrict out) {
    for (std::size_t i = 0; i < n; ++i) out[i] += weight * static_cast<double>(in[i]);
}

/// out[i] = sum over d of g(d) in[i + d], g squared where asked for; nothing lies beyond the row. From a
/// reach of 128 on by blocks of 8 pixels, which changes 0.1 % of it.
void sumAround(const std::vector<float>& in, int reach, bool squared, float* out);

/// Square of the difference that makes pixels unlike: a tenth of a feature's scale.
inline constexpr float kAlikeFeatures2 = 0.01f;

/// Sums over the pixels within `reach` of those of row y, of what they are alike:
///     out[c * width + i] = sum w q_c,    w = nearExp(sum over features of (f' - f)^2 / (0.1^2 + 2 u)),
/// f and u a pixel's features and their error variances (FeaturePlanes), f' those of the other.
/// `fill(row, c, q)` writes what is summed of a row of the picture, c < channels <= 6.
void sumAlike(const RowRing& features, int featureCount, int reach, int channels,
              const std::function<void(int row, int c, float* q)>& fill, int y, int width, int height,
              float* out);

}  // namespace vlx
