#pragma once

#include "render/math/vec.h"

/// Formulas of microfacets and boundaries, for a float and for four side by side (lanes.h).
namespace vlx::render {

/// Below this GGX alpha a microfacet surface is taken as perfectly smooth (its directions are delta
/// functions): 4e-4 radians of spread are beyond any pixel, and float cannot resolve the peak.
inline constexpr float kSmoothAlpha = 4e-4f;

/// The GGX microfacet distribution, isotropic (Walter et al., "Microfacet models for refraction through rough
/// surfaces", 2007), in a local frame whose z axis is the macroscopic normal. alpha >= kSmoothAlpha.
template <class Real>
struct GgxOf {
    Real alpha;

    /// Density of microfacet normals: integral of d(h) h.z over the hemisphere is 1. Uses x and y for
    /// sin^2: 1 - z^2 would cancel near the peak.
    Real d(const Vec3Of<Real>& h) const {
        const Real a2 = alpha * alpha;
        const Real t = h.x * h.x + h.y * h.y + a2 * h.z * h.z;
        return a2 * kInvPi / (t * t);
    }

    /// Smith's auxiliary function of a direction on either side.
    Real lambda(const Vec3Of<Real>& v) const {
        const Real tan2 = (v.x * v.x + v.y * v.y) / (v.z * v.z);
        return 0.5f * (squareRoot(1.f + alpha * alpha * tan2) - 1.f);
    }

    /// A microfacet normal among those visible from `wo` (wo.z > 0), density g1(wo) d(h) wo.h / wo.z (Dupuy,
    /// Benyoub, "Sampling visible GGX normals with spherical caps", 2023).
    Vec3Of<Real> sampleVisible(const Vec3Of<Real>& wo, const Vec2Of<Real>& u) const {
        const Vec3Of<Real> stretched = normalized(Vec3Of<Real>{wo.x * alpha, wo.y * alpha, wo.z});
        const Real z = (1.f - u.y) * (1.f + stretched.z) - stretched.z;
        const Real sinTheta = squareRoot(larger(Real{}, 1.f - z * z));
        const Real phi = 2 * kPi * u.x;
        const Real cosine = each(phi, [](float v) { return std::cos(v); });
        const Real sine = each(phi, [](float v) { return std::sin(v); });
        const Vec3Of<Real> h = Vec3Of<Real>{sinTheta * cosine, sinTheta * sine, z} + stretched;
        return normalized(Vec3Of<Real>{h.x * alpha, h.y * alpha, larger(h.z, spread<Real>(1e-7f))});
    }
};
using Ggx = GgxOf<float>;

/// Mirror image of `wo` about `h`.
template <class Real>
Vec3Of<Real> reflected(const Vec3Of<Real>& wo, const Vec3Of<Real>& h) {
    return h * (2.f * dot(wo, h)) - wo;
}

/// Schlick's weight (1 - cos)^5.
template <class Real>
Real schlickWeight(Real cosTheta) {
    const Real m = clamped(1.f - cosTheta, Real{}, spread<Real>(1));
    const Real m2 = m * m;
    return m2 * m2 * m;
}

/// Reflectance of a dielectric boundary for unpolarised light; cosTheta >= 0 on the incident side, eta =
/// index of the far side over the near side's. 1 under total internal reflection.
template <class Real>
Real dielectricFresnel(Real cosTheta, Real eta) {
    const Real sin2 = (1.f - cosTheta * cosTheta) / (eta * eta);
    const Mask<Real> total = sin2 >= 1.f;
    if (all(total)) return spread<Real>(1);
    const Real cosT = squareRoot(1.f - sin2);
    const Real parallel = (eta * cosTheta - cosT) / (eta * cosTheta + cosT);
    const Real perpendicular = (cosTheta - eta * cosT) / (cosTheta + eta * cosT);
    const Real reflectance = 0.5f * (parallel * parallel + perpendicular * perpendicular);
    return total ? spread<Real>(1) : reflectance;
}

/// The direction of `wo` refracted at `h` (wo.h > 0) into the far side; only when there is no total internal
/// reflection (dielectricFresnel < 1).
template <class Real>
Vec3Of<Real> refracted(const Vec3Of<Real>& wo, const Vec3Of<Real>& h, Real eta) {
    const Real cosO = dot(wo, h);
    const Real cosT = squareRoot(larger(Real{}, 1.f - (1.f - cosO * cosO) / (eta * eta)));
    return h * (cosO / eta - cosT) - wo * (1.f / eta);
}

}  // namespace vlx::render
