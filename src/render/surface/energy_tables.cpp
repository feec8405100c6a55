#include "render/surface/energy_tables.h"

#include <numbers>

#include "variolux/base/parallel.h"
#include "variolux/base/sobol.h"

namespace vlx::render {
namespace {

constexpr std::uint32_t kPoints = 512;

/// Cosine of node `j` of `size`; never quite 0, where directions lie in the surface.
float nodeCosine(std::size_t j, std::size_t size) {
    return std::max(1e-3f, square(static_cast<float>(j) / static_cast<float>(size - 1)));
}

Vec3 directionAt(float cosTheta) { return {std::sqrt(std::max(0.f, 1 - square(cosTheta))), 0, cosTheta}; }

/// Point k of the quadrature, at the middle of its elementary intervals.
Vec2 quadraturePoint(std::uint32_t k) {
    const SobolPoint p = sobolPoint(k);
    constexpr float half = 0.5f / kPoints;
    return {unitFloat(p.x) + half, unitFloat(p.y) + half};
}

Albedo integrateReflection(float cosTheta, float roughness, float ior) {
    const Ggx ggx{square(roughness)};
    const float f0 = normalReflectance(ior);
    if (ggx.alpha < kSmoothAlpha) return {1, schlickWeight(cosTheta), dielectricWeight(cosTheta, ior, f0)};
    const Vec3 wo = directionAt(cosTheta);
    const float lambdaO = ggx.lambda(wo);
    double whole = 0, conductor = 0, dielectric = 0;
    for (std::uint32_t k = 0; k < kPoints; ++k) {
        const Vec3 h = ggx.sampleVisible(wo, quadraturePoint(k));
        const Vec3 wi = reflected(wo, h);
        if (wi.z <= 0) continue;
        const float weight = (1 + lambdaO) / (1 + lambdaO + ggx.lambda(wi));  // G2 / G1
        const float cosH = dot(wo, h);
        whole += weight;
        conductor += weight * schlickWeight(cosH);
        dielectric += weight * dielectricWeight(cosH, ior, f0);
    }
    return {static_cast<float>(whole / kPoints), static_cast<float>(conductor / kPoints),
            static_cast<float>(dielectric / kPoints)};
}

/// Part of the directions at a cosine to the normal that is above a plane tilted against it.
double partAbove(double cosine, double cosTilt) {
    const double across = std::sqrt((1 - cosine * cosine) * (1 - cosTilt * cosTilt));
    const double limit = -cosine * cosTilt;  // of across x the cosine of the azimuth
    return across > -limit ? std::acos(limit / across) / std::numbers::pi : 1;
}

float integrateGlass(float cosTheta, float roughness, float eta) {
    const Ggx ggx{square(roughness)};
    if (ggx.alpha < kSmoothAlpha) return 1;
    const Vec3 wo = directionAt(cosTheta);
    const float lambdaO = ggx.lambda(wo);
    double kept = 0;
    for (std::uint32_t k = 0; k < kPoints; ++k) {
        const Vec3 h = ggx.sampleVisible(wo, quadraturePoint(k));
        const auto weight = [&](const Vec3& wi) { return (1 + lambdaO) / (1 + lambdaO + ggx.lambda(wi)); };
        const float fresnel = dielectricFresnel(dot(wo, h), eta);
        const Vec3 mirror = reflected(wo, h);
        if (mirror.z > 0) kept += fresnel * weight(mirror);
        if (fresnel >= 1) continue;
        const Vec3 through = refracted(wo, h, eta);
        if (through.z < 0) kept += (1 - fresnel) * weight(through);
    }
    return static_cast<float>(kept / kPoints);
}

}  // namespace

AlbedoTable::AlbedoTable(float ior) : ior_(ior) {
    parallelFor(0, static_cast<std::int64_t>(kSize), [&](std::int64_t row) {
        const auto i = static_cast<std::size_t>(row);
        const float roughness = static_cast<float>(i) / static_cast<float>(kSize - 1);
        for (std::size_t j = 0; j < kSize; ++j)
            cells_[i][j] = integrateReflection(nodeCosine(j, kSize), roughness, ior);
        // Mean = 2 integral of albedo mu dmu = 4 integral of albedo(s^2) s^3 ds, s = sqrt(mu), of the table's
        // own piecewise linear interpolant: three-point Gauss is exact (degree 4 in s).
        constexpr std::array<std::array<double, 2>, 3> gauss{
            {{0.1127016653792583, 5.0 / 18}, {0.5, 8.0 / 18}, {0.8872983346207417, 5.0 / 18}}};
        for (std::size_t k = 0; k < kTilts; ++k) {
            const double cosTilt = static_cast<double>(k) / (kTilts - 1);
            Albedo sum{0, 0, 0};
            double total = 0;
            for (std::size_t j = 0; j + 1 < kSize; ++j) {
                for (const auto& [t, w] : gauss) {
                    const double s = (static_cast<double>(j) + t) / (kSize - 1);
                    const auto share = static_cast<float>(t);
                    const double weight = 4 * s * s * s * w / (kSize - 1) * partAbove(s * s, cosTilt);
                    sum = sum + (cells_[i][j] * (1 - share) + cells_[i][j + 1] * share) *
                                    static_cast<float>(weight);
                    total += weight;
                }
            }
            means_[i][k] = sum * static_cast<float>(1 / total);
        }
    });
    constexpr int steps = 512;
    double sum = 0;
    for (int k = 0; k < steps; ++k) {
        const float mu = (static_cast<float>(k) + 0.5f) / steps;
        sum += 2 * mu * dielectricWeight(mu, ior, normalReflectance(ior)) / steps;
    }
    meanWeight_ = static_cast<float>(sum);
}

GlassTable::GlassTable(float ior) : ior_(ior) {
    parallelFor(0, static_cast<std::int64_t>(kSize), [&](std::int64_t row) {
        const auto i = static_cast<std::size_t>(row);
        const float roughness = static_cast<float>(i) / static_cast<float>(kSize - 1);
        for (std::size_t j = 0; j < kSize; ++j) {
            sides_[0][i][j] = integrateGlass(nodeCosine(j, kSize), roughness, ior);
            sides_[1][i][j] = integrateGlass(nodeCosine(j, kSize), roughness, 1 / ior);
        }
    });
}

float GlassTable::kept(float cosTheta, float roughness, bool fromInside) const {
    const Side& side = sides_[fromInside ? 1 : 0];
    const auto [i, s] = tablePosition(roughness, kSize);
    const auto [j, t] = tablePosition(std::sqrt(std::max(0.f, cosTheta)), kSize);
    const auto along = [&](std::size_t r) { return side[r][j] * (1 - t) + side[r][j + 1] * t; };
    return along(i) * (1 - s) + along(i + 1) * s;
}

}  // namespace vlx::render
