#pragma once

#include <array>

#include "render/math/vec.h"

namespace vlx::render {

/// BRDF of sheen of colour 1 (KHR_materials_sheen): Charlie's distribution of fibres (Estevez, Kulla,
/// "Production friendly microfacet sheen BRDF", 2017) with Ashikhmin's visibility term. Local directions
/// above the surface.
float charlieSheen(const Vec3& wo, const Vec3& wi, float roughness);

/// Directional albedo of charlieSheen: what a coat of sheen takes from the layers beneath. Above 1 at grazing
/// angles: the visibility term keeps no energy there.
class SheenTable {
  public:
    SheenTable();
    float albedo(float cosTheta, float roughness) const;

  private:
    static constexpr std::size_t kSize = 16;
    /// Nodes at roughness i / (kSize - 1) and cosines (j / (kSize - 1))^2.
    std::array<std::array<float, kSize>, kSize> cells_;
};

}  // namespace vlx::render
