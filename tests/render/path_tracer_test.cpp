#include "render/integrator/path_tracer.h"

#include <gtest/gtest.h>

#include "test_scene.h"

namespace vlx::render {
namespace {

#ifdef VARIOLUX_SANITIZED
constexpr int kFew = 2000, kMany = 5000;
#else
constexpr int kFew = 20000, kMany = 200000;
#endif

/// Four standard errors: one false alarm in 16,000 comparisons, seeds being fixed none at all.
constexpr double kSigmas = 4;

void expectRadiance(const Estimate& e, const Rgb& expected, double tolerance = 1e-5) {
    const std::array<double, 3> want{expected.x, expected.y, expected.z};
    for (std::size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(e.mean[c], want[c], kSigmas * e.error[c] + tolerance * (1 + want[c])) << "channel " << c;
}

const Ray kDown{{0.2f, 1, 0.1f}, {0, -1, 0}};

/// A matte floor at y = 0 below kDown.
void floorBelow(TestScene& t, const Rgb& colour = {0.5f, 0.25f, 1}, float half = 20) {
    t.quad(t.material(TestScene::matte(colour)), {-half, 0, half}, {half, 0, half}, {half, 0, -half},
           {-half, 0, -half});
}

/// Radiance of a matte surface under irradiance E.
Rgb lit(const Rgb& irradiance, const Rgb& colour = {0.5f, 0.25f, 1}) { return irradiance * colour * kInvPi; }

TEST(ClosedBox, HasTheRadiosityOfAnInfiniteSeriesOfBounces) {
    // Every wall emits E and reflects rho: L = E / (1 - rho).
    TestScene t;
    const Rgb rho{0.5f, 0.2f, 0.7f}, emission{1, 2, 0.5f};
    t.box(t.material(TestScene::emitter(emission, rho)), {-1, -1, -1}, {1, 2, 1});
    const Scene scene = t.finish();
    PathOptions options;
    options.maxBounces = 200;
    const Estimate e =
        estimate(scene, {{0.1f, 0.2f, 0.3f}, normalized(Vec3{0.3f, -0.5f, 0.8f})}, kMany / 4, options);
    expectRadiance(e, emission / (Rgb(1) - rho));
    EXPECT_LT(e.error[0], 0.02);
}

TEST(ClosedBox, MaxBouncesCutsTheSeries) {
    TestScene t;
    t.box(t.material(TestScene::emitter(Rgb(1), Rgb(0.5f))), {-1, -1, -1}, {1, 1, 1});
    const Scene scene = t.finish();
    double series = 0, term = 1;
    for (int bounces = 0; bounces <= 4; ++bounces) {
        series += term;
        term *= 0.5;
        PathOptions options;
        options.maxBounces = bounces;
        expectRadiance(estimate(scene, {{0, 0, 0}, normalized(Vec3{1, 0.3f, 0.2f})}, kFew, options),
                       Rgb(static_cast<float>(series)));
    }
}

TEST(PointLight, FollowsTheInverseSquareAndCosineLaws) {
    TestScene t;
    floorBelow(t);
    Light light;
    light.position = {1.2f, 2, 0.1f};
    light.intensity = {3, 5, 7};
    t.light(light);
    const float d2 = 1 + 4, cosine = 2 / std::sqrt(d2);
    expectRadiance(estimate(t.finish(), kDown, 100), lit(light.intensity * (cosine / d2)));
}

TEST(PointLight, CastsHardShadows) {
    TestScene t;
    floorBelow(t);
    const auto matte = t.material(TestScene::matte({0, 0, 0}));
    t.quad(matte, {0.5f, 1.5f, 0.5f}, {1.5f, 1.5f, 0.5f}, {1.5f, 1.5f, -0.5f}, {0.5f, 1.5f, -0.5f});
    Light light;
    light.position = {1.2f, 2, 0.1f};
    light.intensity = {3, 5, 7};
    t.light(light);
    expectRadiance(estimate(t.finish(), kDown, 100), {0, 0, 0});
}

TEST(PointLight, EndsAtItsRange) {
    for (const float range : {10.f, 2.f}) {
        TestScene t;
        floorBelow(t);
        Light light;
        light.position = {0.2f, 3, 0.1f};
        light.intensity = {3, 5, 7};
        light.range = range;
        t.light(light);
        const float window = range > 3 ? 1 - std::pow(3 / range, 4.f) : 0;
        expectRadiance(estimate(t.finish(), kDown, 100), lit(light.intensity * (window / 9)));
    }
}

TEST(SpotLight, HasFullIntensityInsideNothingOutsideAndTheReferenceFalloffBetween) {
    for (const float x : {0.2f, 0.9f, 1.1f, 1.5f, 2.2f}) {
        TestScene t;
        floorBelow(t);
        Light light;
        light.type = LightType::Spot;
        light.position = {x, 2, 0.1f};
        light.direction = {0, -1, 0};
        light.intensity = {4, 4, 4};
        const float inner = std::cos(0.3f), outer = std::cos(0.6f);
        light.coneScale = 1 / (inner - outer);
        light.coneOffset = -outer * light.coneScale;
        t.light(light);
        const float dx = x - 0.2f, d2 = 4 + dx * dx, cosine = 2 / std::sqrt(d2);
        const float fall = std::clamp((cosine - outer) / (inner - outer), 0.f, 1.f);
        expectRadiance(estimate(t.finish(), kDown, 100), lit(light.intensity * (cosine / d2 * fall * fall)));
    }
}

TEST(DirectionalLight, GivesItsIrradianceTimesTheCosine) {
    TestScene t;
    floorBelow(t);
    Light light;
    light.type = LightType::Directional;
    light.direction = normalized(Vec3{1, -2, 0.5f});
    light.intensity = {2, 3, 4};
    t.light(light);
    expectRadiance(estimate(t.finish(), kDown, 100), lit(light.intensity * -light.direction.y));
}

/// Irradiance of a sphere of intensity I at distance d wholly above the horizon: that of a point, I cos /
/// d^2.
TEST(SphereLight, LightsLikeAPointOfTheSameIntensity) {
    for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
        TestScene t;
        floorBelow(t);
        Light light;
        light.type = LightType::Sphere;
        light.position = {1.2f, 2, 0.1f};
        light.radius = 0.6f;
        light.intensity = {3, 5, 7};
        t.light(light);
        PathOptions options;
        options.strategy = strategy;
        options.maxBounces = 1;
        const Estimate e = estimate(t.finish(), kDown, kMany, options);
        expectRadiance(e, lit(light.intensity * (2 / std::sqrt(5.f) / 5)), 1e-3);
    }
}

TEST(SphereLight, IsSeenWithItsIntensitySpreadOverItsDisk) {
    TestScene t;
    Light light;
    light.type = LightType::Sphere;
    light.position = {0, 0, 0};
    light.radius = 0.5f;
    light.intensity = Rgb(2);
    t.light(light);
    const Estimate e = estimate(t.finish(), {{0, 0, 3}, {0, 0, -1}}, 10);
    EXPECT_NEAR(e.mean[0], 2 / (std::numbers::pi * 0.25), 1e-5);
}

/// Irradiance of a parallel rectangle's corner point, twice and mirrored: the analytic form factor.
double cornerFormFactor(double a, double b) {
    const double p = std::sqrt(1 + a * a), q = std::sqrt(1 + b * b);
    return (a / p * std::atan(b / p) + b / q * std::atan(a / q)) / (2 * std::numbers::pi);
}

TEST(AreaLight, AllStrategiesGiveTheAnalyticFormFactor) {
    for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
        TestScene t;
        floorBelow(t);
        // 2 x 3 at height 1.5 above the point (0.2, 0, 0.1): four corner rectangles of 1 x 1.5.
        const auto emitter = t.material(TestScene::emitter({1, 2, 3}));
        t.quad(emitter, {-0.8f, 1.5f, -1.4f}, {1.2f, 1.5f, -1.4f}, {1.2f, 1.5f, 1.6f}, {-0.8f, 1.5f, 1.6f});
        PathOptions options;
        options.strategy = strategy;
        options.maxBounces = 1;
        const auto form = static_cast<float>(4 * cornerFormFactor(1 / 1.5, 1.5 / 1.5));
        expectRadiance(estimate(t.finish(), kDown, kMany, options), lit(Rgb{1, 2, 3} * (form * kPi)));
    }
}

TEST(Environment, ConstantLightsAnOpenFloorWithPiTimesItsRadiance) {
    for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
        TestScene t;
        floorBelow(t, {0.5f, 0.25f, 1}, 1000);
        t.environment(Environment({1, 2, 3}));
        PathOptions options;
        options.strategy = strategy;
        expectRadiance(estimate(t.finish(), kDown, kFew, options), lit(Rgb{1, 2, 3} * kPi), 2e-3);
    }
}

/// An environment image with a bright patch and a gradient.
Environment patchyEnvironment() {
    const int w = 64, h = 32;
    std::vector<Rgb> pixels(w * h);
    for (int y = 0; y < h; ++y)
        for (int x = 0; x < w; ++x)
            pixels[static_cast<std::size_t>(y * w + x)] = (x > 20 && x < 25 && y > 5 && y < 9)
                                                              ? Rgb{50, 40, 30}
                                                              : Rgb(0.1f + 0.01f * static_cast<float>(y));
    return {w, h, pixels};
}

TEST(Environment, ImageStrategiesAgree) {
    std::vector<Estimate> results;
    for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
        TestScene t;
        floorBelow(t);
        t.environment(patchyEnvironment());
        PathOptions options;
        options.strategy = strategy;
        results.push_back(estimate(t.finish(), kDown, kMany, options));
    }
    for (std::size_t i = 1; i < 3; ++i)
        EXPECT_NEAR(results[i].mean[1], results[0].mean[1],
                    kSigmas * std::hypot(results[i].error[1], results[0].error[1]));
    EXPECT_LT(results[0].error[1], 0.5 * results[2].error[1]) << "importance sampling should help";
}

TEST(Environment, SamplesHaveTheDensityThatPdfSaysAndItIntegratesToOne) {
    const Environment env = patchyEnvironment();
    double integral = 0, radiance = 0;
    const int n = 400;
    for (int i = 0; i < n; ++i) {
        const double theta = (i + 0.5) * std::numbers::pi / n;
        for (int j = 0; j < 2 * n; ++j) {
            const double phi = (j + 0.5) * std::numbers::pi / n;
            const Vec3 d{static_cast<float>(std::sin(theta) * std::cos(phi)),
                         static_cast<float>(std::cos(theta)),
                         static_cast<float>(std::sin(theta) * std::sin(phi))};
            const double solidAngle = std::sin(theta) * std::pow(std::numbers::pi / n, 2);
            integral += env.pdf(d, {0, 1, 0}, false) * solidAngle;
            radiance += env.radiance(d).x * solidAngle / (4 * std::numbers::pi);
        }
    }
    EXPECT_NEAR(integral, 1, 0.01);
    EXPECT_NEAR(radiance, env.mean().x, 0.01 * radiance);
    for (int i = 0; i < 1000; ++i) {
        const Vec2 u = PathSampler(3, static_cast<std::uint32_t>(i)).pair(0);
        const Environment::Sample s = env.sample({0, 1, 0}, false, u);
        EXPECT_NEAR(length(s.direction), 1, 1e-5);
        EXPECT_NEAR(s.pdf, env.pdf(s.direction, {0, 1, 0}, false), 0.02 * s.pdf);
    }
}

TEST(Environment, ImageOrientation) {
    // Left to right: +z (edge), -x, -z (middle), +x; rows from +y down.
    std::vector<Rgb> pixels(8 * 4);
    for (int y = 0; y < 4; ++y)
        for (int x = 0; x < 8; ++x)
            pixels[static_cast<std::size_t>(y * 8 + x)] = {static_cast<float>(x), static_cast<float>(y), 0};
    const Environment env(8, 4, pixels);
    EXPECT_EQ(env.radiance(normalized(Vec3{0.1f, 0.1f, -1})), (Rgb{4, 1, 0}));
    EXPECT_EQ(env.radiance(normalized(Vec3{1, -0.1f, -0.1f})), (Rgb{5, 2, 0}));
    EXPECT_EQ(env.radiance(normalized(Vec3{-1, 0.1f, -0.1f})), (Rgb{2, 1, 0}));
    EXPECT_EQ(env.radiance(normalized(Vec3{0.01f, 1, 0})).y, 0);
}

/// A room with every kind of light and surface: the three strategies must agree.
Scene mixedRoom(bool deltaLights) {
    TestScene t;
    Material glossy = TestScene::matte({0.9f, 0.7f, 0.4f});
    glossy.metallic = 1;
    glossy.roughness = 0.3f;
    Material coated = TestScene::matte({0.2f, 0.4f, 0.6f});
    coated.specular = 1;
    coated.roughness = 0.5f;
    coated.clearcoat = 0.7f;
    coated.clearcoatRoughness = 0.15f;
    t.quad(t.material(coated), {-3, 0, 3}, {3, 0, 3}, {3, 0, -3}, {-3, 0, -3});
    t.sphere(t.material(glossy), {-0.8f, 0.6f, 0}, 0.6f);
    t.sphere(t.material(TestScene::glass(1.5f, 0.3f)), {0.8f, 0.6f, 0}, 0.6f);
    t.quad(t.material(TestScene::emitter({6, 5, 4})), {-1, 3, -1}, {1, 3, -1}, {1, 3, 1}, {-1, 3, 1});
    Light sphere;
    sphere.type = LightType::Sphere;
    sphere.position = {2, 2, 2};
    sphere.radius = 0.3f;
    sphere.intensity = Rgb(2);
    t.light(sphere);
    if (deltaLights) {
        Light point;
        point.position = {-2, 2, 1};
        point.intensity = Rgb(2);
        t.light(point);
    }
    t.environment(patchyEnvironment());
    return t.finish();
}

TEST(Strategies, AgreeOnEveryKindOfSurface) {
    const Scene scene = mixedRoom(false);
    const Vec3 eye{0, 1.5f, 4};
    for (const Vec3& target :
         {Vec3{-0.8f, 0.6f, 0.5f}, Vec3{0.8f, 0.6f, 0.5f}, Vec3{0.3f, 0, 1}, Vec3{-2, 0, -1}}) {
        std::vector<Estimate> results;
        for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
            PathOptions options;
            options.strategy = strategy;
            options.maxBounces = 3;
            results.push_back(estimate(scene, {eye, normalized(target - eye)}, kMany / 2, options));
        }
        for (std::size_t i = 1; i < 3; ++i)
            for (std::size_t c = 0; c < 3; ++c)
                EXPECT_NEAR(results[i].mean[c], results[0].mean[c],
                            kSigmas * std::hypot(results[i].error[c], results[0].error[c]))
                    << "strategy " << i << " channel " << c;
    }
}

TEST(Roulette, DoesNotChangeTheMean) {
    // A grey box lit by one wall: 40 bounces by roulette against the radiosity of the cut series.
    TestScene t;
    t.box(t.material(TestScene::emitter(Rgb(1), Rgb(0.9f))), {-1, -1, -1}, {1, 1, 1});
    const Scene scene = t.finish();
    PathOptions options;
    options.maxBounces = 40;
    const double expected = (1 - std::pow(0.9f, 41)) / (1 - 0.9f);
    expectRadiance(estimate(scene, {{0, 0, 0}, normalized(Vec3{1, 0.2f, 0.1f})}, kMany / 4, options),
                   Rgb(static_cast<float>(expected)));
}

TEST(WhiteFurnaceScene, ClosedSurfacesUnderAConstantSkyVanish) {
    struct Surface {
        const char* name;
        Material material;
    };
    Material metal = TestScene::matte(Rgb(1));
    metal.metallic = 1;
    metal.roughness = 0.6f;
    Material plastic = TestScene::matte(Rgb(1));
    plastic.specular = 1;
    plastic.roughness = 0.4f;
    plastic.clearcoat = 1;
    for (const Surface& s : {Surface{"matte", TestScene::matte(Rgb(1))}, Surface{"metal", metal},
                             Surface{"plastic", plastic}, Surface{"glass", TestScene::glass(1.5f, 0)},
                             Surface{"rough glass", TestScene::glass(1.5f, 0.5f)}}) {
        TestScene t;
        t.box(t.material(s.material), {-1, -1, -1}, {1, 1, 1});  // flat: no light is lost to shading normals
        t.environment(Environment(Rgb(1)));
        const Scene scene = t.finish();
        PathOptions options;
        options.maxBounces = 100;
        for (const Vec3& d : {Vec3{0, 0, -1}, normalized(Vec3{-0.9f, -0.2f, -1})}) {
            const Estimate e = estimate(scene, {{0.3f, 0.2f, 3}, d}, kFew, options);
            EXPECT_NEAR(e.mean[1], 1, kSigmas * e.error[1] + 0.01) << s.name;
        }
    }
}

TEST(Glass, ASlabShiftsButDoesNotBendAndLosesItsReflections) {
    // A slab without absorption: transmittance (1 - R) / (1 + R) for unpolarised light at normal incidence.
    TestScene t;
    t.box(t.material(TestScene::glass(1.5f, 0)), {-5, -5, 0}, {5, 5, 0.2f});
    t.quad(t.material(TestScene::emitter(Rgb(1))), {-5, -5, -1}, {5, -5, -1}, {5, 5, -1}, {-5, 5, -1});
    PathOptions options;
    options.maxBounces = 100;
    const Estimate e = estimate(t.finish(), {{0, 0, 3}, {0, 0, -1}}, kFew, options);
    EXPECT_NEAR(e.mean[0], (1 - 0.04) / (1 + 0.04), kSigmas * e.error[0]);
}

TEST(Features, AreTakenAtTheFirstHitThatIsNotSmooth) {
    TestScene t;
    t.box(t.material(TestScene::glass(1.5f, 0)), {-5, -5, 0}, {5, 5, 0.2f});
    t.quad(t.material(TestScene::matte({0.2f, 0.4f, 0.6f})), {-9, -9, -1}, {9, -9, -1}, {9, 9, -1},
           {-9, 9, -1});
    t.environment(Environment(Rgb(1)));
    const Scene scene = t.finish();
    const Accelerator accelerator(scene);
    const PathTracer tracer(scene, accelerator, View(Camera{}, 1, 1), {});
    int through = 0;
    for (std::uint32_t i = 0; i < 100; ++i) {
        const PathSample s = tracer.along({{0, 0, 3}, {0, 0, -1}}, PathSampler(i, 0));
        EXPECT_TRUE(s.hit);
        EXPECT_NEAR(s.depth, 2.8f, 1e-5f);  // of the glass
        if (s.normal == Vec3{}) {
            EXPECT_EQ(s.albedo, (Rgb{1, 1, 1}));  // reflected into the sky
            continue;
        }
        ++through;
        EXPECT_NEAR(s.albedo.x, 0.2f, 1e-3f);
        EXPECT_NEAR(s.albedo.z, 0.6f, 1e-3f);
        EXPECT_EQ(s.normal, (Vec3{0, 0, 1}));
    }
    EXPECT_GT(through, 80);
    const PathSample miss = tracer.along({{0, 0, 3}, {0, 0, 1}}, PathSampler(0, 0));
    EXPECT_FALSE(miss.hit);
    EXPECT_EQ(miss.depth, 0);
    EXPECT_EQ(miss.albedo, (Rgb{1, 1, 1}));
    EXPECT_EQ(miss.normal, Vec3{});
}

TEST(Opacity, BlendLetsItsPartThroughForEveryKindOfRay) {
    for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
        TestScene t;
        floorBelow(t, {0.5f, 0.25f, 1});
        Material veil = TestScene::matte({0, 0, 0});
        veil.alphaMode = AlphaMode::Blend;
        veil.opacity = 0.3f;
        t.quad(t.material(veil), {-9, 0.5f, 9}, {9, 0.5f, 9}, {9, 0.5f, -9}, {-9, 0.5f, -9});
        t.quad(t.material(TestScene::emitter({1, 2, 3})), {-0.8f, 1.5f, -1.4f}, {1.2f, 1.5f, -1.4f},
               {1.2f, 1.5f, 1.6f}, {-0.8f, 1.5f, 1.6f});
        PathOptions options;
        options.strategy = strategy;
        options.maxBounces = 1;
        const auto form = static_cast<float>(4 * cornerFormFactor(1 / 1.5, 1.5 / 1.5));
        const Scene scene = t.finish();
        // Through the veil twice: 0.7 of the camera rays, 0.7 of the light.
        expectRadiance(estimate(scene, kDown, kMany, options), lit(Rgb{1, 2, 3} * (form * kPi)) * 0.49f);
    }
}

TEST(Opacity, SingleSidedSurfacesAreNotThereFromBehind) {
    TestScene t;
    Material single = TestScene::matte({0.5f, 0.5f, 0.5f});
    single.doubleSided = false;
    t.quad(t.material(single), {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});  // faces +z
    t.environment(Environment(Rgb(2)));
    const Scene scene = t.finish();
    const Accelerator accelerator(scene);
    EXPECT_TRUE(accelerator.intersect({{0, 0.1f, 3}, {0, 0, -1}}, 0).has_value());
    EXPECT_FALSE(accelerator.intersect({{0, 0.1f, -3}, {0, 0, 1}}, 0).has_value());
    EXPECT_FALSE(accelerator.occluded({{0, 0.1f, -3}, {0, 0, 1}}, 10, 0));
}

TEST(ManyLights, ChoosingByPowerGivesTheSumOfThem) {
    TestScene t;
    floorBelow(t);
    Rgb irradiance;
    for (int i = 0; i < 200; ++i) {
        Light light;
        light.position = {static_cast<float>(i % 20) - 10, 3, static_cast<float>(i / 20) - 5};
        light.intensity = Rgb(0.1f + 0.01f * static_cast<float>(i));
        t.light(light);
        const Vec3 to = light.position - Vec3{0.2f, 0, 0.1f};
        irradiance += light.intensity * (3 / length(to) / lengthSquared(to));
    }
    expectRadiance(estimate(t.finish(), kDown, kMany), lit(irradiance));
}

}  // namespace
}  // namespace vlx::render
