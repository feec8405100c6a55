#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/simd.h"

/// Sums over windows under weights that are smooth to the border, which would show where much is summed.
namespace vlx {

/// g(d) = (1 - u^2)^2, u = d / (reach + 1): of what lies d pixels away along an axis, |d| <= reach.
inline float windowWeight(int d, int reach) {
    const double u = static_cast<double>(d) / (reach + 1), v = 1 - u * u;
    return static_cast<float>(v * v);
}

VLX_WIDE inline void addScaled(const float* __restrict in, float weight, int n, float* __restrict out) {
    for (int i = 0; i < n; ++i) out[i] += weight * in[i];
}

/// out[i] = sum over d of g(d) in[i + d], g squared where asked for; nothing lies beyond the row.
inline void sumAround(const std::vector<float>& in, int reach, bool squared, float* out) {
    const auto n = static_cast<int>(in.size());
    std::fill_n(out, n, 0.f);
    for (int d = -std::min(reach, n - 1); d <= std::min(reach, n - 1); ++d) {
        const float g = windowWeight(d, reach);
        const int first = std::max(0, -d), count = n - std::abs(d);
        addScaled(in.data() + first + d, squared ? g * g : g, count, out + first);
    }
}

}  // namespace vlx
