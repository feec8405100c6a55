#include "render/surface/sheen.h"

#include <algorithm>
#include <cmath>

namespace vlx::render {
namespace {

/// Least alpha: smoother sheen is too narrow a band of directions to be resolved.
constexpr float kLeastAlpha = 0.01f;

}  // namespace

float charlieSheen(const Vec3& wo, const Vec3& wi, float roughness) {
    const float inverse = 1 / std::max(square(roughness), kLeastAlpha);
    const Vec3 h = normalized(wo + wi);
    const float sine2 = std::max(0.f, 1 - h.z * h.z);
    const float d = (2 + inverse) * std::pow(sine2, 0.5f * inverse) * (0.5f * kInvPi);
    return d / (4 * (wo.z + wi.z - wo.z * wi.z));
}

SheenTable::SheenTable() {
    constexpr int n = 64;
    for (std::size_t i = 0; i < kSize; ++i) {
        const float roughness = static_cast<float>(i) / (kSize - 1);
        for (std::size_t j = 0; j < kSize; ++j) {
            const float cosine = std::max(1e-3f, square(static_cast<float>(j) / (kSize - 1)));
            const Vec3 wo{std::sqrt(1 - cosine * cosine), 0, cosine};
            double sum = 0;
            for (int a = 0; a < n; ++a) {
                for (int b = 0; b < n; ++b) {
                    const float z = (static_cast<float>(a) + 0.5f) / n;
                    const float phi = kPi * (static_cast<float>(b) + 0.5f) / n;  // symmetric
                    const float r = std::sqrt(1 - z * z);
                    sum += charlieSheen(wo, {r * std::cos(phi), r * std::sin(phi), z}, roughness) * z;
                }
            }
            cells_[i][j] = static_cast<float>(sum * 2 * std::numbers::pi / (n * n));
        }
    }
}

float SheenTable::albedo(float cosTheta, float roughness) const {
    const auto split = [](float position) {
        const auto low = std::min(static_cast<std::size_t>(position), kSize - 2);
        return std::pair(low, position - static_cast<float>(low));
    };
    const auto [i, s] = split(std::clamp(roughness, 0.f, 1.f) * (kSize - 1));
    const auto [j, t] = split(std::sqrt(std::clamp(cosTheta, 0.f, 1.f)) * (kSize - 1));
    const auto row = [&](std::size_t k) { return cells_[k][j] * (1 - t) + cells_[k][j + 1] * t; };
    return row(i) * (1 - s) + row(i + 1) * s;
}

}  // namespace vlx::render
