#include "render/integrator/bidirectional.h"

#include <gtest/gtest.h>

#include "render/film/region_sampling.h"
#include "test_scene.h"
#include "variolux/base/hash.h"

namespace vlx::render {
namespace {

constexpr int kSide = 8;  // pixels
#ifdef VARIOLUX_SANITIZED
// Student's t of 7 degrees of freedom goes beyond 9 once in 20,000 times.
constexpr int kBlocks = 8, kSamples = 2;
constexpr double kSigmas = 9;
#else
// Of 23 degrees: beyond 4 once in 1,800 times; the seeds are fixed.
constexpr int kBlocks = 24, kSamples = 16;
constexpr double kSigmas = 4;
#endif

/// Mean and standard error, from independent blocks of samples, of each quarter of a picture.
struct Quarters {
    std::array<double, 4> mean{};
    std::array<double, 4> error{};
};

Quarters quarters(const Integrator& integrator, int samples = kSamples) {
    Quarters q;
    std::vector<Splat> splats;
    std::array<double, 4> squares{};
    for (int block = 0; block < kBlocks; ++block) {
        std::array<double, 4> sum{};
        const auto add = [&](float x, float y, const Rgb& v) {
            const std::size_t quarter = (x >= kSide / 2 ? 1 : 0) + (y >= kSide / 2 ? 2 : 0);
            sum[quarter] += luminance(v) * 4.0 / (kSide * kSide * samples);
        };
        for (int pixel = 0; pixel < kSide * kSide; ++pixel)
            for (int i = 0; i < samples; ++i) {
                const CameraSample sample = sampleInPixel(
                    pixel % kSide, pixel / kSide, hashOf(block, pixel, 11), static_cast<std::uint32_t>(i));
                add(sample.x, sample.y, integrator.trace(sample, splats).radiance);
                // Sums over all light subpaths, kSide^2 for each camera sample of a pixel.
                for (const Splat& s : splats) add(s.x, s.y, s.radiance / (kSide * kSide));
                splats.clear();
            }
        for (std::size_t i = 0; i < 4; ++i) {
            q.mean[i] += sum[i] / kBlocks;
            squares[i] += sum[i] * sum[i] / kBlocks;
        }
    }
    for (std::size_t i = 0; i < 4; ++i)
        q.error[i] = std::sqrt(std::max(0.0, squares[i] - q.mean[i] * q.mean[i]) / (kBlocks - 1));
    return q;
}

struct Setting {
    explicit Setting(TestScene& t, const PathOptions& o = {})
        : scene(t.finish()), accelerator(scene), view(scene.cameras[0], kSide, kSide), options(o) {}

    Quarters byPath(int samples = kSamples) const {
        return quarters(PathTracer(scene, accelerator, view, options), samples);
    }
    Quarters bidirectional(Strategies strategies = Strategies::All) const {
        return quarters(
            BidirectionalTracer(scene, accelerator, view, {0, 0, kSide, kSide}, options, strategies));
    }

    Scene scene;
    Accelerator accelerator;
    View view;
    PathOptions options;
};

void expectEqual(const Quarters& a, const Quarters& b) {
    for (std::size_t i = 0; i < 4; ++i)
        EXPECT_NEAR(a.mean[i], b.mean[i],
                    kSigmas * std::hypot(a.error[i], b.error[i]) + 1e-5 * (1 + std::abs(a.mean[i])))
            << "quarter " << i << ", errors " << a.error[i] << " and " << b.error[i];
}

/// Both integrators on a scene.
void expectAgreement(TestScene& t, const PathOptions& options = {}) {
    const Setting s(t, options);
    const Quarters a = s.byPath(4 * kSamples), b = s.bidirectional();
    expectEqual(a, b);
    double light = 0;
    for (const double m : a.mean) light += m;
    EXPECT_GT(light, 0);
}

/// A room open to the camera: floor, back wall, one coloured wall.
void room(TestScene& t) {
    const auto grey = t.material(TestScene::matte(Rgb(0.6f)));
    const auto red = t.material(TestScene::matte({0.7f, 0.2f, 0.1f}));
    t.quad(grey, {-1, 0, 1}, {1, 0, 1}, {1, 0, -1}, {-1, 0, -1});
    t.quad(grey, {-1, 0, -1}, {1, 0, -1}, {1, 2, -1}, {-1, 2, -1});
    t.quad(red, {-1, 0, 1}, {-1, 0, -1}, {-1, 2, -1}, {-1, 2, 1});
    t.camera({0.2f, 1, 4}, {0, 0.8f, 0}, 0.6f);
}

void lamp(TestScene& t, const Rgb& radiance = Rgb(12)) {
    t.quad(t.material(TestScene::emitter(radiance)), {-0.2f, 1.9f, -0.2f}, {0.2f, 1.9f, -0.2f},
           {0.2f, 1.9f, 0.2f}, {-0.2f, 1.9f, 0.2f});
}

Light pointLight(LightType type = LightType::Point) {
    Light l;
    l.type = type;
    l.intensity = {3, 2, 1};
    l.position = {0.1f, 1.6f, 0.2f};
    l.direction = normalized(Vec3{0.1f, -1, -0.2f});
    if (type == LightType::Spot) {
        l.coneScale = 1 / (0.95f - 0.7f);
        l.coneOffset = -0.7f * l.coneScale;
        l.coneStep = l.coneCosine = 1;  // Cycles'
    }
    if (type == LightType::Sphere) l.radius = 0.1f;
    return l;
}

TEST(BidirectionalStrategies, EachAloneGivesTheWholePicture) {
    TestScene t;
    room(t);
    lamp(t);
    PathOptions options;
    options.maxBounces = 4;
    const Setting s(t, options);
    const Quarters mis = s.bidirectional();
    expectEqual(mis, s.bidirectional(Strategies::Chance));
    expectEqual(mis, s.bidirectional(Strategies::DirectLight));
    expectEqual(mis, s.bidirectional(Strategies::Splatting));
    // Connections lack what scattered once.
    PathOptions once = options;
    once.maxBounces = 1;
    TestScene u;
    room(u);
    lamp(u);
    const Quarters direct = Setting(u, once).bidirectional(Strategies::DirectLight);
    Quarters connected = s.bidirectional(Strategies::Connection);
    TestScene v;
    room(v);
    lamp(v);
    PathOptions none;
    none.maxBounces = 0;
    const Quarters seen = Setting(v, none).bidirectional();
    for (std::size_t i = 0; i < 4; ++i) {
        connected.mean[i] += direct.mean[i] - seen.mean[i];
        connected.error[i] = std::hypot(connected.error[i], direct.error[i], seen.error[i]);
    }
    expectEqual(mis, connected);
}

TEST(Bidirectional, FurnaceIsExact) {
    // Walls emit E and reflect rho: radiance E / (1 - rho) everywhere.
    TestScene t;
    const Rgb rho{0.5f, 0.2f, 0.7f}, emission{1, 2, 0.5f};
    t.box(t.material(TestScene::emitter(emission, rho)), {-1, -1, -1}, {1, 1, 1});
    t.camera({0, 0, 0.5f}, {0, 0.1f, 0}, 1);
    PathOptions options;
    options.maxBounces = 60;
    const Quarters q = Setting(t, options).bidirectional();
    const double expected = luminance(emission / (Rgb(1) - rho));
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_NEAR(q.mean[i], expected, kSigmas * q.error[i]);
        EXPECT_LT(q.error[i], 0.02 * expected);
    }
}

TEST(BidirectionalLights, Agree) {
    for (const LightType type :
         {LightType::Point, LightType::Spot, LightType::Sphere, LightType::Directional, LightType::Mesh}) {
        SCOPED_TRACE(static_cast<int>(type));
        TestScene t;
        room(t);
        if (type == LightType::Mesh)
            lamp(t);
        else
            t.light(pointLight(type));
        if (type == LightType::Point) t.light(pointLight(LightType::Spot));  // of two, one is chosen
        expectAgreement(t);
    }
}

TEST(BidirectionalLights, EnvironmentsAgree) {
    for (const bool image : {false, true}) {
        SCOPED_TRACE(image);
        TestScene t;
        room(t);
        std::vector<Rgb> pixels(8 * 4, Rgb(0.1f));
        pixels[8 + 5] = {20, 10, 5};
        t.environment(image ? Environment(8, 4, pixels) : Environment(Rgb(1)));
        expectAgreement(t);
    }
}

TEST(BidirectionalSurfaces, GlassAgrees) {
    for (const float roughness : {0.f, 0.3f}) {
        SCOPED_TRACE(roughness);
        TestScene t;
        room(t);
        Material glass = TestScene::glass(1.5f, roughness);
        glass.absorption = {0.2f, 1, 2};
        t.sphere(t.material(glass), {0, 0.8f, 0.2f}, 0.5f, 12);
        lamp(t);
        expectAgreement(t);
    }
}

TEST(BidirectionalSurfaces, LayersAgree) {
    TestScene t;
    room(t);
    Material coated = TestScene::matte({0.6f, 0.3f, 0.2f});
    coated.specular = 1;
    coated.roughness = 0.4f;
    coated.clearcoat = 1;
    coated.sheenColour = {0.3f, 0.3f, 0.5f};
    coated.sheenRoughness = 0.5f;
    t.sphere(t.material(coated), {-0.4f, 0.5f, 0.2f}, 0.4f, 6);
    Material metal = TestScene::matte({0.9f, 0.8f, 0.5f});
    metal.specular = 1;
    metal.metallic = 1;
    metal.roughness = 0;
    metal.clearcoat = 0.7f;
    t.sphere(t.material(metal), {0.5f, 0.5f, 0.2f}, 0.4f, 6);
    t.light(pointLight(LightType::Sphere));
    lamp(t, Rgb(4));
    expectAgreement(t);
}

TEST(BidirectionalSurfaces, ShadingNormalsFarFromTheTrueOnesAgree) {
    // Of a few triangles: much is reflected into the surface, refracted out of it, and folded back.
    for (const auto& [metallic, roughness, transmission] :
         {std::array{1.f, 0.f, 0.f}, {1.f, 0.2f, 0.f}, {0.f, 0.2f, 0.f}, {0.f, 0.f, 1.f}, {0.f, 0.3f, 1.f}}) {
        SCOPED_TRACE(::testing::Message() << metallic << ", " << roughness << ", " << transmission);
        TestScene t;
        room(t);
        Material m = TestScene::glass(1.5f, roughness);
        m.transmission = transmission;
        m.metallic = metallic;
        const auto material = t.material(m);
        t.sphere(material, {-0.4f, 0.5f, 0.2f}, 0.5f, 3);
        t.sphere(material, {0.5f, 0.5f, 0.3f}, 0.4f, 2);
        t.light(pointLight(LightType::Sphere));
        lamp(t, Rgb(4));
        expectAgreement(t);
    }
}

TEST(BidirectionalSurfaces, SingleSidedAndHalfTransparentOnesAgree) {
    TestScene t;
    room(t);
    Material veil = TestScene::matte(Rgb(0.8f));
    veil.alphaMode = AlphaMode::Blend;
    veil.opacity = 0.4f;
    t.quad(t.material(veil), {-0.6f, 1.5f, 0.5f}, {0.3f, 1.5f, 0.5f}, {0.3f, 1.4f, -0.6f},
           {-0.6f, 1.4f, -0.6f});
    // One that light comes through from its front, and one that it does not come through from behind.
    Material single = TestScene::matte(Rgb(0.5f));
    single.doubleSided = false;
    const auto m = t.material(single);
    t.quad(m, {0.1f, 0.6f, 0.6f}, {0.9f, 0.6f, 0.6f}, {0.9f, 0.6f, -0.4f}, {0.1f, 0.6f, -0.4f});
    t.quad(m, {-0.9f, 0.5f, -0.4f}, {-0.3f, 0.5f, -0.4f}, {-0.3f, 0.5f, 0.6f}, {-0.9f, 0.5f, 0.6f});
    lamp(t);
    expectAgreement(t);
}

TEST(BidirectionalCamera, LensAgrees) {
    TestScene t;
    room(t);
    t.scene().cameras[0].lensRadius = 0.2f;
    t.scene().cameras[0].focusDistance = 3;
    lamp(t);
    expectAgreement(t);
}

TEST(BidirectionalCamera, ProjectsItsOwnRays) {
    TestScene t;
    room(t);
    Camera camera = t.scene().cameras[0];
    for (const float radius : {0.f, 0.3f}) {
        camera.lensRadius = radius;
        camera.focusDistance = 2;
        const View view(camera, 60, 40);
        for (const Vec2 at : {Vec2{3.25f, 7.5f}, Vec2{30, 20}, Vec2{59, 39}}) {
            const Vec2 lens{0.3f, 0.8f};
            const Ray ray = view.ray(at.x, at.y, lens);
            const View::Projection p = view.project(ray.origin + ray.direction * 1.7f, lens);
            EXPECT_NEAR(p.x, at.x, 1e-3);
            EXPECT_NEAR(p.y, at.y, 1e-3);
            EXPECT_NEAR(length(p.origin - ray.origin), 0, 1e-6);
            // The solid angle of a small piece of a pixel.
            const float e = 0.02f;
            const Vec3 dx = view.ray(at.x + e, at.y, lens).direction - ray.direction;
            const Vec3 dy = view.ray(at.x, at.y + e, lens).direction - ray.direction;
            EXPECT_NEAR(p.density * length(cross(dx, dy)) / (e * e), 1, 2e-2);
            EXPECT_EQ(view.project(ray.origin - ray.direction, lens).density, 0);
        }
    }
}

TEST(BidirectionalCamera, OrthographicOnesAgree) {
    for (const float lens : {0.f, 0.15f}) {
        TestScene t;
        room(t);
        lamp(t);
        t.light(pointLight());
        t.scene().cameras[0].orthographicHeight = 2.2f;
        t.scene().cameras[0].lensRadius = lens;
        t.scene().cameras[0].focusDistance = 3;
        expectAgreement(t);
    }
}

/// A lamp of one by one before a camera that sees two by two, four pixels to a side: the four in the middle
/// hold all of it, and nothing else is lit; beside it a floor whose light is known.
TEST(BidirectionalCamera, OrthographicOnesSeeWhatIsThereInItsSize) {
    TestScene t;
    t.quad(t.material(TestScene::emitter(Rgb(3))), {-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0},
           {-0.5f, 0.5f, 0});
    t.camera({0, 0, 7}, {0, 0, 0}, 1);
    t.scene().cameras[0].orthographicHeight = 2;
    const Scene scene = t.finish();
    const Accelerator accelerator(scene);
    const View view(scene.cameras[0], 4, 4);
    const PathTracer path(scene, accelerator, view, {});
    const BidirectionalTracer both(scene, accelerator, view, {0, 0, 4, 4}, {});
    std::vector<Splat> splats;
    for (int pixel = 0; pixel < 16; ++pixel)
        for (std::uint32_t i = 0; i < 16; ++i) {
            const CameraSample s = sampleInPixel(pixel % 4, pixel / 4, hashOf(pixel, 7), i);
            const bool inside = pixel % 4 % 3 != 0 && pixel / 4 % 3 != 0;
            for (const Integrator* integrator :
                 {static_cast<const Integrator*>(&path), static_cast<const Integrator*>(&both)})
                EXPECT_EQ(integrator->trace(s, splats).radiance, Rgb(inside ? 3.f : 0.f)) << pixel;
        }
    EXPECT_TRUE(splats.empty());
}

/// Light on a floor of which the camera sees four square metres: splats alone add up to what there is.
TEST(BidirectionalCamera, OrthographicSplatsAddUpToTheLightThereIs) {
    TestScene t;
    t.quad(t.material(TestScene::matte(Rgb(0.5f))), {-3, -3, 0}, {3, -3, 0}, {3, 3, 0}, {-3, 3, 0});
    Light sun;
    sun.type = LightType::Directional;
    sun.intensity = Rgb(2);
    sun.direction = normalized(Vec3{1, 0, -1});
    t.light(sun);
    t.camera({4, 0, 4}, {0, 0, 0}, 1);  // aslant
    t.scene().cameras[0].orthographicHeight = 2;
    const double expected = 0.5 / kPi * 2 * std::sqrt(0.5);
    const Setting s(t);
    for (const Strategies strategies : {Strategies::Splatting, Strategies::DirectLight}) {
        const Quarters q = s.bidirectional(strategies);
        for (std::size_t i = 0; i < 4; ++i)
            EXPECT_NEAR(q.mean[i], expected, kSigmas * q.error[i] + 1e-5) << static_cast<int>(strategies);
    }
}

TEST(Bidirectional, WithoutLightsIsBlack) {
    TestScene t;
    room(t);
    Light dark = pointLight();
    dark.intensity = {};
    t.light(dark);
    const Quarters q = Setting(t).bidirectional();
    for (const double m : q.mean) EXPECT_EQ(m, 0);
}

TEST(Bidirectional, FewerBouncesAgree) {
    for (const int bounces : {0, 1, 2, 3}) {
        TestScene t;
        room(t);
        lamp(t);
        PathOptions options;
        options.maxBounces = bounces;
        expectAgreement(t, options);
    }
}

}  // namespace
}  // namespace vlx::render
