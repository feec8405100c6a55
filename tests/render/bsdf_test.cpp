#include "render/surface/bsdf.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "render/math/sampling.h"

namespace vlx::render {
namespace {

#ifdef VARIOLUX_SANITIZED
constexpr std::uint32_t kSamples = 1 << 12;
constexpr float kEnergyTolerance = 0.03f;  // fewer samples
#else
constexpr std::uint32_t kSamples = 1 << 15;
constexpr float kEnergyTolerance = 0.01f;
#endif

/// A surface to test, seen from one direction.
struct Case {
    SurfaceParameters surface;
    Vec3 wo;
    bool fromInside = false;
    std::string name;
};

const AlbedoTable& table(float ior) {
    static const AlbedoTable t15(1.5f), t133(1.33f), t2(2.f);
    return ior == 1.5f ? t15 : ior == 1.33f ? t133 : t2;
}

const GlassTable& glass(float ior) {
    static const GlassTable t15(1.5f), t133(1.33f), t2(2.f);
    return ior == 1.5f ? t15 : ior == 1.33f ? t133 : t2;
}

Bsdf bsdfOf(const Case& c) { return Bsdf(c.surface, c.wo, c.fromInside, table(1.5f)); }

Vec3 viewFrom(float cosTheta) {
    const float s = std::sqrt(1 - cosTheta * cosTheta);
    return {s * std::cos(0.7f), s * std::sin(0.7f), cosTheta};
}

std::string label(const Case& c) {
    const SurfaceParameters& s = c.surface;
    std::string text = "roughness " + std::to_string(s.roughness) + " metallic " +
                       std::to_string(s.metallic) + " transmission " + std::to_string(s.transmission) +
                       " coat " + std::to_string(s.clearcoat) + "/" + std::to_string(s.clearcoatRoughness) +
                       " ior " + std::to_string(s.ior) + " cos " + std::to_string(c.wo.z);
    return c.fromInside ? text + " from inside" : text;
}

/// White surfaces over the range of parameters.
std::vector<Case> whiteCases(const std::vector<float>& roughnesses = {0.f, 0.05f, 0.2f, 0.5f, 0.77f, 1.f},
                             const std::vector<float>& cosines = {0.08f, 0.5f, 0.99f}) {
    std::vector<Case> cases;
    for (const float roughness : roughnesses)
        for (const float metallic : {0.f, 0.5f, 1.f})
            for (const float transmission : {0.f, 0.6f, 1.f})
                for (const float coat : {0.f, 0.5f, 1.f})
                    for (const float ior : {1.33f, 1.5f, 2.f})
                        for (const float cosTheta : cosines)
                            for (const bool inside : {false, true}) {
                                if (inside && (transmission == 0 || coat > 0)) continue;
                                if (metallic == 1 && (transmission > 0 || ior != 1.5f)) continue;
                                if (coat > 0 && ior != 1.5f) continue;
                                Case c;
                                c.surface.roughness = roughness;
                                c.surface.metallic = metallic;
                                c.surface.transmission = transmission;
                                c.surface.clearcoat = coat;
                                c.surface.clearcoatRoughness = coat == 1 ? 0.f : 0.4f;
                                c.surface.ior = ior;
                                c.surface.albedoTable = &table(ior);
                                c.surface.glassTable = {&glass(ior)};
                                c.wo = viewFrom(cosTheta);
                                c.fromInside = inside;
                                cases.push_back(c);
                            }
    return cases;
}

/// The energy that leaves towards wo when every direction sends radiance 1: mean weight of samples.
Rgb furnace(const Case& c) {
    const Bsdf bsdf = bsdfOf(c);
    double sum[3] = {};
    for (std::uint32_t i = 0; i < kSamples; ++i) {
        const PathSampler sampler(42, i);
        const Rgb w = bsdf.sample(sampler.pair(0), sampler.pair(1).x).weight;
        sum[0] += w.x;
        sum[1] += w.y;
        sum[2] += w.z;
    }
    return {static_cast<float>(sum[0] / kSamples), static_cast<float>(sum[1] / kSamples),
            static_cast<float>(sum[2] / kSamples)};
}

/// White surfaces neither lose nor gain energy. The tolerance is the albedo tables' (their interpolation
/// where roughness and grazing angles meet) and that of 2^15 quasi-random samples.
TEST(WhiteFurnace, EveryWhiteSurfaceReturnsWhatItGets) {
    double worst = 0;
    for (const Case& c : whiteCases()) {
        const Rgb energy = furnace(c);
        worst = std::max(worst, std::abs(energy.y - 1.0));
        EXPECT_NEAR(energy.y, 1, kEnergyTolerance) << label(c);
    }
    RecordProperty("worst", std::to_string(worst));
}

TEST(WhiteFurnace, ColouredSurfacesGiveLessInEveryChannel) {
    for (Case c : whiteCases()) {
        c.surface.baseColour = {0.9f, 0.5f, 0.1f};
        c.surface.specularColour = {0.3f, 1, 3};  // rough glass is compensated for its untinted reflection
        const Rgb energy = furnace(c);
        EXPECT_LE(maxComponent(energy), 1 + 2 * kEnergyTolerance) << label(c);
        EXPECT_GE(energy.z, 0) << label(c);
    }
}

TEST(WhiteFurnace, BaseColourIsTheMeanDiffuseReflectanceBeneathTheReflection) {
    // Base colour 0 leaves the reflection; the difference is the diffuse part, averaged over directions.
    double difference = 0;
    constexpr int steps = 32;
    for (int k = 0; k < steps; ++k) {
        const float mu = std::sqrt((static_cast<float>(k) + 0.5f) / steps);  // density 2 mu
        Case c;
        c.surface.roughness = 0.4f;
        c.surface.albedoTable = &table(1.5f);
        c.wo = viewFrom(mu);
        c.surface.baseColour = Rgb(0.6f);
        difference += furnace(c).x;
        c.surface.baseColour = Rgb(0);
        difference -= furnace(c).x;
    }
    EXPECT_NEAR(difference / steps, 0.6, 0.004);
}

/// Cases whose lobes are wide enough for a histogram and the midpoint rule.
std::vector<Case> roughCases() {
    std::vector<Case> cases;
    for (Case c : whiteCases({0.4f, 0.6f, 1.f}, {0.25f, 0.97f})) {
        if (c.surface.ior == 1.33f) continue;
        if (c.surface.clearcoat == 0.5f && c.surface.transmission == 0.6f) continue;
        c.surface.baseColour = {0.8f, 0.6f, 0.3f};
        cases.push_back(c);
    }
    return cases;
}

/// Calls visit(direction, solid angle, i, j) for the midpoints of an n x 2n grid of polar angle and azimuth.
template <class Visit>
void forDirections(int n, Visit visit) {
    const double step = std::numbers::pi / n;
    for (int i = 0; i < n; ++i) {
        const double s = std::sin((i + 0.5) * step), z = std::cos((i + 0.5) * step);
        for (int j = 0; j < 2 * n; ++j) {
            const double phi = (j + 0.5) * step;
            visit(Vec3{static_cast<float>(s * std::cos(phi)), static_cast<float>(s * std::sin(phi)),
                       static_cast<float>(z)},
                  s * step * step, i, j);
        }
    }
}

constexpr int kBinsTheta = 16, kBinsPhi = 2 * kBinsTheta;

/// Integral of the density over each bin of (theta, phi), by the midpoint rule on `sub` x `sub` points a bin.
std::vector<double> integratedPdf(const Bsdf& bsdf, int sub) {
    std::vector<double> bins(kBinsTheta * kBinsPhi, 0);
    forDirections(kBinsTheta * sub, [&](const Vec3& wi, double solidAngle, int i, int j) {
        bins[static_cast<std::size_t>(i / sub * kBinsPhi + j / sub)] += bsdf.evaluate(wi).pdf * solidAngle;
    });
    return bins;
}

/// Pearson's chi-squared of observed against expected counts, bins of fewer than 5 expected joined; as a
/// standard normal variable by Wilson and Hilferty's cube root.
double chiSquaredScore(const std::vector<double>& expected, const std::vector<double>& observed) {
    double chi2 = 0, pooledExpected = 0, pooledObserved = 0;
    int cells = 0;
    for (std::size_t i = 0; i < expected.size(); ++i) {
        if (expected[i] < 5) {
            pooledExpected += expected[i];
            pooledObserved += observed[i];
            continue;
        }
        chi2 += (observed[i] - expected[i]) * (observed[i] - expected[i]) / expected[i];
        ++cells;
    }
    if (pooledExpected >= 5) {
        chi2 += (pooledObserved - pooledExpected) * (pooledObserved - pooledExpected) / pooledExpected;
        ++cells;
    }
    const double k = cells - 1;
    return (std::cbrt(chi2 / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
}

/// Directions come out with the density that evaluate() says. Over all cases together a false alarm has a
/// probability below 0.001 (score 5.2 in some 200 cases). Independent pseudo-random numbers: Sobol points are
/// more even than chi-squared allows for.
TEST(ChiSquared, SampledDirectionsFollowTheDensity) {
    const std::uint32_t samples = kSamples;
#ifdef VARIOLUX_SANITIZED
    const int sub = 6;
#else
    const int sub = 16;
#endif
    for (const Case& c : roughCases()) {
        const Bsdf bsdf = bsdfOf(c);
        std::vector<double> expected = integratedPdf(bsdf, sub);
        std::vector<double> observed(expected.size() + 1, 0);  // the last: delta lobes, paths that end
        for (std::uint32_t i = 0; i < samples; ++i) {
            const std::uint64_t a = hashOf(i, 1), b = hashOf(i, 2);
            const Vec2 u{unitFloat(static_cast<std::uint32_t>(a)),
                         unitFloat(static_cast<std::uint32_t>(a >> 32))};
            const BsdfSample s = bsdf.sample(u, unitFloat(static_cast<std::uint32_t>(b)));
            if (s.delta || s.pdf == 0) {
                ++observed.back();
                continue;
            }
            const float phi = std::atan2(s.wi.y, s.wi.x);
            const float theta = std::acos(std::clamp(s.wi.z, -1.f, 1.f));
            const auto bt = std::clamp(static_cast<int>(theta / kPi * kBinsTheta), 0, kBinsTheta - 1);
            const auto bp = std::clamp(
                static_cast<int>((phi < 0 ? phi + 2 * kPi : phi) / (2 * kPi) * kBinsPhi), 0, kBinsPhi - 1);
            ++observed[static_cast<std::size_t>(bt * kBinsPhi + bp)];
        }
        double total = 0;
        for (double& e : expected) {
            total += e;
            e *= samples;
        }
        ASSERT_LE(total, 1.01) << label(c);
        expected.push_back(std::max(0.0, 1 - total) * samples);
        EXPECT_LT(chiSquaredScore(expected, observed), 5.2) << label(c);
        // What is missing from the integral is what sample() refuses or sends along delta lobes.
        const double missing = observed.back() / samples;
        EXPECT_NEAR(1 - total, missing, 5 * std::sqrt((missing + 1e-4) / samples) + 0.004) << label(c);
    }
}

/// The integral of f |cos| over directions equals the mean weight of samples: the two halves of the BSDF
/// agree.
TEST(Bsdf, EvaluateIntegratesToWhatSamplesGive) {
    for (const Case& c : roughCases()) {
        if (c.surface.clearcoat == 1) continue;  // a delta lobe, which evaluate() leaves out
        const Bsdf bsdf = bsdfOf(c);
        double sum[3] = {};
        forDirections(200, [&](const Vec3& wi, double solidAngle, int, int) {
            const Rgb f = bsdf.evaluate(wi).value;
            sum[0] += f.x * solidAngle;
            sum[1] += f.y * solidAngle;
            sum[2] += f.z * solidAngle;
        });
        const Rgb sampled = furnace(c);
        EXPECT_NEAR(sampled.x, sum[0], kEnergyTolerance + 0.002f) << label(c);
        EXPECT_NEAR(sampled.y, sum[1], kEnergyTolerance + 0.002f) << label(c);
        EXPECT_NEAR(sampled.z, sum[2], kEnergyTolerance + 0.002f) << label(c);
    }
}

/// f(wo, wi) = f(wi, wo) for everything but the coat and rough glass, whose energy scaling follows the view.
TEST(Bsdf, IsReciprocalWithoutCoatAndRoughGlass) {
    for (Case c : roughCases()) {
        if (c.surface.clearcoat > 0 || c.surface.transmission > 0) continue;
        for (const float cosTheta : {0.1f, 0.4f, 0.9f}) {
            const float s = std::sqrt(1 - cosTheta * cosTheta);
            const Vec3 wi{-s * 0.6f, s * 0.8f, cosTheta};
            const Rgb there = bsdfOf(c).evaluate(wi).value / wi.z;
            Case turned = c;
            turned.wo = wi;
            const Rgb back = bsdfOf(turned).evaluate(c.wo).value / c.wo.z;
            EXPECT_NEAR(there.x, back.x, 1e-4f * (1 + there.x)) << label(c);
            EXPECT_NEAR(there.z, back.z, 1e-4f * (1 + there.z)) << label(c);
        }
    }
}

/// Single-scattering glass keeps Helmholtz's law for basic radiance across the boundary.
TEST(Bsdf, RoughGlassWithoutCompensationIsReciprocalAcrossTheBoundary) {
    for (const float roughness : {0.3f, 0.7f}) {
        SurfaceParameters s;
        s.roughness = roughness;
        s.transmission = 1;
        s.albedoTable = &table(1.5f);
        const Vec3 out = viewFrom(0.8f);
        const Vec3 in = normalized(Vec3{-0.2f, -0.3f, -0.9f});
        const Rgb outward = Bsdf(s, out, false, table(1.5f)).evaluate(in).value / std::abs(in.z);
        // From inside the frame is turned over.
        const Rgb inward =
            Bsdf(s, {in.x, in.y, -in.z}, true, table(1.5f)).evaluate({out.x, out.y, -out.z}).value /
            std::abs(out.z);
        // Basic radiance: df / n^2 is symmetric, with solid angles of either side.
        EXPECT_NEAR(outward.x / (1.5f * 1.5f), inward.x, 1e-3f * inward.x);
        EXPECT_GT(inward.x, 0.01f);
    }
}

/// Burley's formula, by the half vector.
TEST(Bsdf, RetroReflectingSurfacesFollowDisneysFormula) {
    SurfaceParameters s;
    s.baseColour = {0.6f, 0.4f, 0.2f};
    s.specular = 0;
    s.retro = true;
    s.albedoTable = &table(1.5f);
    for (const float roughness : {0.f, 0.4f, 1.f})
        for (const float cosO : {0.1f, 0.6f, 0.95f})
            for (const Vec3& wi : {viewFrom(0.2f), normalized(Vec3{-0.9f, 0.1f, 0.15f}), Vec3{0, 0, 1}}) {
                s.roughness = roughness;
                const Vec3 wo = viewFrom(cosO);
                const double toHalf = dot(wi, normalized(wi + wo));
                const double f90 = 0.5 + 2 * static_cast<double>(roughness) * toHalf * toHalf;
                const auto side = [&](double cosine) { return 1 + (f90 - 1) * std::pow(1 - cosine, 5); };
                const double expected = 0.6 / std::numbers::pi * wi.z * side(wi.z) * side(wo.z);
                const BsdfValue matte = BasicBsdf<kMatte>(s, wo, false, table(1.5f)).evaluate(wi);
                const BsdfValue whole = Bsdf(s, wo, false, table(1.5f)).evaluate(wi);
                EXPECT_NEAR(matte.value.x, expected, 1e-5 * expected);
                EXPECT_NEAR(whole.value.x, expected, 1e-5 * expected);
                EXPECT_NEAR(matte.pdf, wi.z * kInvPi, 1e-6f);
            }
}

TEST(Fresnel, KnownValues) {
    EXPECT_NEAR(dielectricFresnel(1.f, 1.5f), 0.04f, 1e-6f);
    EXPECT_NEAR(dielectricFresnel(1.f, 1 / 1.5f), 0.04f, 1e-6f);
    EXPECT_FLOAT_EQ(dielectricFresnel(0.5f, 1 / 1.5f), 1);  // beyond the critical angle of 41.8 degrees
    EXPECT_NEAR(dielectricFresnel(std::cos(std::atan(1.5f)), 1.5f), 0.0740f, 1e-4f);  // Brewster: s only
    EXPECT_NEAR(dielectricFresnel(0.3f, 1.f), 0, 1e-12f);
}

TEST(Refraction, ObeysSnell) {
    const Vec3 wo = viewFrom(0.6f), h{0, 0, 1};
    const Vec3 wi = refracted(wo, h, 1.5f);
    EXPECT_NEAR(length(wi), 1, 1e-6f);
    EXPECT_NEAR(std::hypot(wo.x, wo.y), 1.5f * std::hypot(wi.x, wi.y), 1e-6f);
    EXPECT_LT(wi.z, 0);
    EXPECT_NEAR(wo.x * wi.y - wo.y * wi.x, 0, 1e-6f);
    EXPECT_LT(wo.x * wi.x, 0);
}

TEST(Ggx, NormalsIntegrateToOneAndVisibleOnesFollowTheirDensity) {
    for (const float alpha : {0.05f, 0.3f, 1.f}) {
        const Ggx ggx{alpha};
        double projected = 0;
        constexpr int n = 4000;
        for (int i = 0; i < n; ++i) {  // t = tan^2 / alpha^2 / (1 + ...) makes the integrand flat
            const double u = (i + 0.5) / n;
            const double tan2 = alpha * alpha * u / (1 - u);
            const double z = 1 / std::sqrt(1 + tan2);
            const Vec3 h{static_cast<float>(std::sqrt(1 - z * z)), 0, static_cast<float>(z)};
            // dz/du from z = (1 + a^2 u/(1-u))^-1/2
            const double dzdu = 0.5 * z * z * z * alpha * alpha / ((1 - u) * (1 - u));
            projected += ggx.d(h) * z * dzdu * 2 * std::numbers::pi / n;
        }
        EXPECT_NEAR(projected, 1, 1e-3) << alpha;
    }
}

}  // namespace
}  // namespace vlx::render
