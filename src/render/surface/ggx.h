#pragma once

#include "render/math/vec.h"

namespace vlx::render {

/// Below this GGX alpha a microfacet surface is taken as perfectly smooth (its directions are delta
/// functions): 4e-4 radians of spread are beyond any pixel, and float cannot resolve the peak.
inline constexpr float kSmoothAlpha = 4e-4f;

/// The GGX microfacet distribution, isotropic (Walter et al., "Microfacet models for refraction through rough
/// surfaces", 2007), in a local frame whose z axis is the macroscopic normal. alpha >= kSmoothAlpha.
struct Ggx {
    float alpha;

    /// Density of microfacet normals: integral of d(h) h.z over the hemisphere is 1. Uses x and y for
    /// sin^2: 1 - z^2 would cancel near the peak.
    float d(const Vec3& h) const {
        const float a2 = alpha * alpha;
        const float t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
        return a2 * kInvPi / (t * t);
    }

    /// Smith's auxiliary function of a direction on either side.
    float lambda(const Vec3& v) const {
        const float tan2 = (v.x * v.x + v.y * v.y) / (v.z * v.z);
        return 0.5f * (std::sqrt(1 + alpha * alpha * tan2) - 1);
    }

    /// A microfacet normal among those visible from `wo` (wo.z > 0), density g1(wo) d(h) wo.h / wo.z (Dupuy,
    /// Benyoub, "Sampling visible GGX normals with spherical caps", 2023).
    Vec3 sampleVisible(const Vec3& wo, Vec2 u) const {
        const Vec3 stretched = normalized({wo.x * alpha, wo.y * alpha, wo.z});
        const float z = (1 - u.y) * (1 + stretched.z) - stretched.z;
        const float sinTheta = std::sqrt(std::max(0.f, 1 - z * z));
        const float phi = 2 * kPi * u.x;
        const Vec3 h = Vec3{sinTheta * std::cos(phi), sinTheta * std::sin(phi), z} + stretched;
        return normalized({h.x * alpha, h.y * alpha, std::max(h.z, 1e-7f)});
    }
};

/// Mirror image of `wo` about `h`.
inline Vec3 reflected(const Vec3& wo, const Vec3& h) { return h * (2 * dot(wo, h)) - wo; }

/// Schlick's weight (1 - cos)^5.
inline float schlickWeight(float cosTheta) {
    const float m = std::clamp(1 - cosTheta, 0.f, 1.f);
    const float m2 = m * m;
    return m2 * m2 * m;
}

/// Reflectance of a dielectric boundary for unpolarised light; cosTheta >= 0 on the incident side, eta =
/// index of the far side over the near side's. 1 under total internal reflection.
inline float dielectricFresnel(float cosTheta, float eta) {
    const float sin2 = (1 - cosTheta * cosTheta) / (eta * eta);
    if (sin2 >= 1) return 1;
    const float cosT = std::sqrt(1 - sin2);
    const float parallel = (eta * cosTheta - cosT) / (eta * cosTheta + cosT);
    const float perpendicular = (cosTheta - eta * cosT) / (cosTheta + eta * cosT);
    return 0.5f * (parallel * parallel + perpendicular * perpendicular);
}

/// The direction of `wo` refracted at `h` (wo.h > 0) into the far side; only when there is no total internal
/// reflection (dielectricFresnel < 1).
inline Vec3 refracted(const Vec3& wo, const Vec3& h, float eta) {
    const float cosO = dot(wo, h);
    const float cosT = std::sqrt(std::max(0.f, 1 - (1 - cosO * cosO) / (eta * eta)));
    return h * (cosO / eta - cosT) - wo * (1 / eta);
}

}  // namespace vlx::render
