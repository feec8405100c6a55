#include "render/plan/plan.h"

#include <gtest/gtest.h>

#include <functional>
#include <span>

#include "../base/temporary_folder.h"
#include "render/film/append.h"
#include "render/film/render.h"
#include "render/plan/effect_counters.h"
#include "render/scene/camera.h"
#include "test_scene.h"

namespace vlx::render {
namespace {

constexpr int kSide = 20;
constexpr std::uint32_t kSamples = 8;

using enum Effect;

Light lamp() {
    Light light;
    light.name = "lamp";
    light.position = {0.5f, 2, 1};
    light.intensity = Rgb(5);
    return light;
}

/// A matte floor and wall under a point light: diffuse, punctual lights and indirect light.
TestScene corner() {
    TestScene t;
    const auto paint = t.material(TestScene::matte({0.7f, 0.6f, 0.5f}));
    t.quad(paint, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2});
    t.quad(paint, {-2, 0, -2}, {2, 0, -2}, {2, 3, -2}, {-2, 3, -2});
    t.light(lamp());
    t.camera({0, 1.2f, 4}, {0, 0.8f, 0}, 0.9f);
    t.scene().materials[paint].name = "paint";
    return t;
}

/// A square in the middle of the picture.
void add(TestScene& t, const Material& material) {
    t.quad(t.material(material), {-0.5f, 0.3f, 0.5f}, {0.5f, 0.3f, 0.5f}, {0.5f, 1.3f, 0.4f},
           {-0.5f, 1.3f, 0.4f});
}

Material named(Material m) {
    m.name = "special";
    return m;
}

Texture chequers(std::uint8_t alpha) {
    std::vector<std::uint8_t> texels;
    for (int i = 0; i < 16; ++i) {
        const auto v = static_cast<std::uint8_t>((i + i / 4) % 2 == 0 ? 250 : 60);
        texels.insert(texels.end(), {v, 128, v, i % 2 == 0 ? alpha : std::uint8_t{255}});
    }
    return {4, 4, texels, ColourSpace::Linear};
}

TextureRef textured(TestScene& t, std::uint8_t alpha = 255) {
    t.scene().textures.push_back(chequers(alpha));
    TextureRef ref;
    ref.texture = static_cast<int>(t.scene().textures.size()) - 1;
    return ref;
}

Transform movedBy(double x, double y, double z) {
    Transform t;
    t.m[0][3] = x;
    t.m[1][3] = y;
    t.m[2][3] = z;
    return t;
}

/// Turns the last shape into a group of one instance that moves.
void setInMotion(Scene& scene) {
    scene.groups.push_back({static_cast<std::uint32_t>(scene.shapes.size()) - 1, 1});
    scene.motions.push_back({{movedBy(-0.3, 0, 0), movedBy(0.3, 0, 0)}, "animation 0 'slide' moves node 3"});
    scene.instances.push_back({0, {}, 0});
    scene.worldShapes = static_cast<std::uint32_t>(scene.shapes.size()) - 1;
}

/// Completed, with instances kept out of the world's shapes.
Scene finished(TestScene& t) {
    const bool moves = !t.scene().motions.empty();
    const std::uint32_t world = t.scene().worldShapes;
    if (!moves) return t.finish();
    t.scene().name = "test";
    t.scene().worldShapes = world;
    completeScene(t.scene());
    return std::move(t.scene());
}

/// The least that calls for an effect, and what the reason must name.
struct Minimal {
    Scene scene;
    std::string cause;
};

Minimal minimal(Effect effect) {
    TestScene t = corner();
    std::string cause = "special";
    Material m = TestScene::matte({0.4f, 0.5f, 0.6f});
    switch (effect) {
        case Diffuse:
        case Indirect:
            cause = "paint";
            break;
        case PunctualLights:
            cause = "lamp";
            break;
        case Glossy:
            m.specular = 1;
            m.roughness = 0.4f;
            add(t, named(m));
            break;
        case Mirror:
            m.metallic = 1;
            m.roughness = 0;
            add(t, named(m));
            break;
        case Transmission:
            add(t, named(TestScene::glass(1.5f, 0)));
            break;
        case RoughTransmission:
            add(t, named(TestScene::glass(1.5f, 0.4f)));
            break;
        case Absorption:
            m = TestScene::glass(1.5f, 0);
            m.absorption = {0.1f, 1, 2};
            t.box(t.material(named(m)), {-0.5f, 0.3f, 0}, {0.5f, 1.3f, 0.5f});
            break;
        case Clearcoat:
            m.clearcoat = 0.8f;
            m.clearcoatRoughness = 0.2f;
            add(t, named(m));
            break;
        case Sheen:
            m.sheenColour = {0.5f, 0.4f, 0.3f};
            m.sheenRoughness = 0.5f;
            add(t, named(m));
            break;
        case Textures:
            m.baseColourTexture = textured(t);
            add(t, named(m));
            break;
        case NormalMaps:
            m.normalTexture = textured(t);
            add(t, named(m));
            break;
        case Alpha:
            m.alphaMode = AlphaMode::Blend;
            m.opacity = 0.5f;
            add(t, named(m));
            break;
        case EmissiveMeshes:
            add(t, named(TestScene::emitter(Rgb(2))));
            break;
        case Unlit:
            m = TestScene::emitter(Rgb(0.4f));
            m.unlit = true;
            add(t, named(m));
            break;
        case SphereLights: {
            Light sphere = lamp();
            sphere.name = "special";
            sphere.type = LightType::Sphere;
            sphere.radius = 0.2f;
            t.light(sphere);
            break;
        }
        case Environment:
            t.environment(render::Environment(Rgb(0.3f)));
            cause = "constant";
            break;
        case DepthOfField:
            t.scene().cameras[0].lensRadius = 0.05f;
            t.scene().cameras[0].focusDistance = 3;
            cause = "camera";
            break;
        case CameraMotion: {
            Camera& camera = t.scene().cameras[0];
            Transform after = camera.toWorld;
            after.m[0][3] += 0.2;
            camera.motion = {{camera.toWorld, after}, "animation 1 'dolly' moves node 1"};
            cause = "dolly";
            break;
        }
        case ObjectMotion:
            add(t, m);
            setInMotion(t.scene());
            cause = "slide";
            break;
        case Caustics:
            t.sphere(t.material(named(TestScene::glass(1.5f, 0))), {0, 0.7f, 0.5f}, 0.5f);
            add(t, TestScene::emitter(Rgb(3)));
            break;
    }
    return {finished(t), cause};
}

/// Scenes that lack an effect: the bare corner, or where it has the effect another one.
Scene lacking(Effect effect) {
    if (effect == Diffuse) {
        TestScene t;
        Material metal = TestScene::matte(Rgb(0.8f));
        metal.metallic = 1;
        metal.roughness = 0.3f;
        const auto m = t.material(metal);
        t.box(m, {-1, 0, -1}, {1, 1, 1});
        t.quad(m, {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2});
        t.light(lamp());
        t.camera({0, 1.5f, 4}, {0, 0.5f, 0}, 0.9f);
        return t.finish();
    }
    if (effect == Indirect) {
        TestScene t;
        t.quad(t.material(TestScene::matte(Rgb(0.5f))), {-2, 0, 2}, {2, 0, 2}, {2, 0, -2}, {-2, 0, -2});
        t.light(lamp());
        t.camera({0, 1.2f, 4}, {0, 0.8f, 0}, 0.9f);
        return t.finish();
    }
    if (effect == PunctualLights) {
        TestScene t = corner();
        t.scene().lights.clear();
        t.environment(render::Environment(Rgb(0.3f)));
        return t.finish();
    }
    TestScene t = corner();
    return t.finish();
}

EffectRequest request(const std::string& text) {
    std::string broken;
    const auto r = parseEffects(text, broken);
    EXPECT_TRUE(r) << broken;
    return r.value_or(EffectRequest{});
}

Plan planOf(const Scene& scene, const std::string& effects = "auto", int maxBounces = 6) {
    return planEffects(scene, {0, kSide, kSide, maxBounces, request(effects)});
}

struct Shot {
    std::vector<PathSample> samples;
    std::vector<Features> kernels;  ///< of the shapes
    std::array<std::uint64_t, kEffects> counts{};

    double mean() const {
        double sum = 0;
        for (const PathSample& s : samples) sum += s.radiance.x + s.radiance.y + s.radiance.z;
        return sum / 3 / static_cast<double>(samples.size());
    }
};

void expectSameBits(const PathSample& a, const PathSample& b, std::size_t i) {
    EXPECT_EQ(a.radiance, b.radiance) << i;
    EXPECT_EQ(a.albedo, b.albedo) << i;
    EXPECT_EQ(a.normal, b.normal) << i;
    EXPECT_EQ(a.depth, b.depth) << i;
    EXPECT_EQ(a.hit, b.hit) << i;
}

/// A small picture as renderDump takes it.
Shot shoot(Scene scene, const std::string& effects, std::uint64_t seed = 1,
           std::uint32_t samples = kSamples) {
    RenderOptions options;
    options.path.maxBounces = 6;
    const Plan plan = planOf(scene, effects);
    applyPlan(scene, plan);
    options.follow(plan);
    const Accelerator accelerator(scene, options.path.effects);
    const PathTracer tracer(scene, accelerator, View(scene.cameras[0], kSide, kSide), options.path);
    Shot shot;
    for (std::size_t i = 0; i < scene.shapes.size(); ++i) shot.kernels.push_back(tracer.featuresAt(i));
    for (auto& c : effectCounters) c = 0;
    std::vector<Splat> splats;
    std::vector<CameraSample> all;
    for (int i = 0; i < kSide * kSide; ++i)
        for (std::uint32_t s = 0; s < samples; ++s)
            all.push_back(sampleInPixel(i % kSide, i / kSide, hashOf(seed, i), s));
    shot.samples.resize(all.size());
    tracer.trace(all, shot.samples, splats);
    // Whatever it is traced with, a sample is the same.
    for (std::size_t i = 0; i < all.size(); ++i)
        expectSameBits(shot.samples[i], tracer.trace(all[i], splats), i);
    constexpr std::size_t kFew = 7;
    std::vector<PathSample> few(kFew);
    tracer.trace(std::span(all).last(kFew), few, splats);
    for (std::size_t i = 0; i < kFew; ++i)
        expectSameBits(shot.samples[all.size() - kFew + i], few[i], all.size() - kFew + i);
    for (std::size_t e = 0; e < kEffects; ++e) shot.counts[e] = effectCounters[e];
    return shot;
}

void expectSameBits(const Shot& a, const Shot& b) {
    ASSERT_EQ(a.samples.size(), b.samples.size());
    for (std::size_t i = 0; i < a.samples.size() && !testing::Test::HasFailure(); ++i)
        expectSameBits(a.samples[i], b.samples[i], i);
}

class EachEffect : public testing::TestWithParam<std::size_t> {
  protected:
    Effect effect() const { return static_cast<Effect>(GetParam()); }
};

TEST_P(EachEffect, IsPlannedWhereTheSceneCallsForItAndTheReasonNamesTheCause) {
    const Minimal m = minimal(effect());
    const Plan plan = planOf(m.scene);
    const PlannedEffect& e = plan.of(effect());
    EXPECT_TRUE(e.planned) << e.reason;
    EXPECT_NE(e.reason.find(m.cause), std::string::npos) << e.reason;
    EXPECT_EQ(e.effect, effect());
}

TEST_P(EachEffect, IsNotPlannedWhereTheSceneLacksIt) {
    const Plan plan = planOf(lacking(effect()));
    const PlannedEffect& e = plan.of(effect());
    EXPECT_FALSE(e.planned) << e.reason;
    EXPECT_FALSE(e.reason.empty());
}

TEST_P(EachEffect, RunsOnlyWherePlanned) {
    for (const Scene& scene : {minimal(effect()).scene, lacking(effect())}) {
        const Plan plan = planOf(scene);
        const Shot shot = shoot(scene, "auto");
        for (std::size_t i = 0; i < kEffects; ++i) {
            if (!plan.effects[i].planned) {
                EXPECT_EQ(shot.counts[i], 0u) << kEffectNames[i];
            } else if (plan.effects[i].effect != Caustics) {  // a kind of path, without code of its own
                EXPECT_GT(shot.counts[i], 0u) << kEffectNames[i];
            }
        }
    }
}

TEST_P(EachEffect, PlannedAndGeneralPicturesAreEqualBitForBit) {
    const Scene scene = minimal(effect()).scene;
    expectSameBits(shoot(scene, "auto"), shoot(scene, "all"));
    const Scene without = lacking(effect());
    expectSameBits(shoot(without, "auto"), shoot(without, "all"));
}

TEST_P(EachEffect, LeftOutIsSaidAndDone) {
    const Scene scene = minimal(effect()).scene;
    const std::string text = "auto,-" + std::string(nameOf(effect()));
    const Plan plan = planOf(scene, text);
    EXPECT_FALSE(plan.of(effect()).planned);
    EXPECT_TRUE(plan.leftOut.has(effect()));
    ASSERT_EQ(plan.warnings.size(), 1u);
    EXPECT_NE(plan.warnings[0].find("biased"), std::string::npos);
    const Shot with = shoot(scene, "auto"), without = shoot(scene, text);
    if (effect() != Caustics) {
        EXPECT_EQ(without.counts[GetParam()], 0u);
    }
    bool differs = false;
    for (std::size_t i = 0; i < with.samples.size(); ++i)
        differs = differs || with.samples[i].radiance != without.samples[i].radiance;
    EXPECT_TRUE(differs);
    // A scene that lacks it has nothing to leave out.
    EXPECT_TRUE(planOf(lacking(effect()), text).warnings.empty());
}

INSTANTIATE_TEST_SUITE_P(Effects, EachEffect, testing::Range<std::size_t>(0, kEffects),
                         [](const auto& each) { return std::string(kEffectNames[each.param]); });

TEST(Kernels, EachSurfaceHasTheSmallestThatServes) {
    const auto worksIn = [](Effect e, const Features& kernel) {
        const auto kernels = shoot(minimal(e).scene, "auto", 1, 1).kernels;
        return std::ranges::count(kernels, kernel);
    };
    for (const auto& [effect, kernel] : {std::pair{Textures, kMatteTextured},
                                         {Glossy, kReflecting},
                                         {Transmission, kLayered},
                                         {Clearcoat, kLayered},
                                         {ObjectMotion, kEveryFeature}})
        EXPECT_EQ(worksIn(effect, kernel), 1) << kEffectNames[static_cast<std::size_t>(effect)];
    // Whatever else there is: the walls are matte.
    for (const Effect e : {Diffuse, EmissiveMeshes, Textures, Glossy, Transmission, Clearcoat, ObjectMotion})
        EXPECT_GE(worksIn(e, kMatte), 1) << kEffectNames[static_cast<std::size_t>(e)];
    for (const Features& kernel : shoot(minimal(Diffuse).scene, "all", 1, 1).kernels)
        EXPECT_EQ(kernel, kEveryFeature);
}

TEST(Plan, UnusedMaterialsCallForNothing) {
    TestScene t = corner();
    Material m = TestScene::glass(1.5f, 0);
    m.name = "unused";
    t.material(m);
    t.material({});
    const Plan plan = planOf(t.finish());
    EXPECT_FALSE(plan.of(Transmission).planned);
    EXPECT_NE(plan.of(Transmission).reason.find("no path can meet material 'unused'"), std::string::npos)
        << plan.of(Transmission).reason;
}

TEST(Plan, WhereOnlyEmittersAreInSightNothingElseCounts) {
    TestScene t;
    add(t, TestScene::emitter(Rgb(2)));
    Material mirror = TestScene::matte(Rgb(0.9f));
    mirror.metallic = 1;
    mirror.roughness = 0;
    t.quad(t.material(mirror), {-9, -9, 9}, {9, -9, 9}, {9, 9, 9}, {-9, 9, 9});  // behind the camera
    t.camera({0, 0.8f, 4}, {0, 0.8f, 0}, 0.6f);
    const Plan plan = planOf(t.finish());
    EXPECT_EQ(plan.simulated(), std::vector<std::string>{"emissive_meshes"});
}

TEST(Plan, BouncesLimitWhatIsMet) {
    const Scene scene = minimal(Caustics).scene;
    EXPECT_FALSE(planOf(scene, "auto", 1).of(Indirect).planned);
    EXPECT_FALSE(planOf(scene, "auto", 1).of(Caustics).planned);
    EXPECT_FALSE(planOf(scene, "auto", 0).of(PunctualLights).planned);
}

TEST(Plan, LightsThatReachNothingAreIdle) {
    struct Case {
        const char* words;
        std::function<void(Light&)> change;
    };
    for (const Case& c : {Case{"no power", [](Light& l) { l.intensity = {}; }},
                          Case{"reaches no surface",
                               [](Light& l) {
                                   l.type = LightType::Spot;  // looks up
                                   l.direction = {0, 1, 0};
                                   l.coneScale = 10;
                                   l.coneOffset = -9;
                               }},
                          Case{"reaches no surface", [](Light& l) {
                                   l.position = {0, 50, 0};
                                   l.range = 5;
                               }}}) {
        TestScene t = corner();
        Light idle = lamp();
        idle.name = "idle";
        c.change(idle);
        t.scene().lights.assign(1, idle);
        Scene alone = t.finish();
        const Plan plan = planOf(alone);
        EXPECT_FALSE(plan.of(PunctualLights).planned);
        EXPECT_FALSE(plan.lit());
        ASSERT_EQ(plan.warnings.size(), 1u);
        EXPECT_NE(plan.warnings[0].find("--env-constant 1,1,1"), std::string::npos) << plan.warnings[0];
        EXPECT_NE(plan.of(PunctualLights).reason.find(c.words), std::string::npos)
            << plan.of(PunctualLights).reason;
        applyPlan(alone, plan);
        EXPECT_TRUE(alone.lights.empty());

        // Beside another light it changes nothing.
        TestScene both = corner();
        both.light(idle);
        const Scene scene = both.finish();
        expectSameBits(shoot(scene, "auto"), shoot(lacking(Sheen), "auto"));
    }
}

TEST(Plan, EmittersThatFaceAwayAreIdle) {
    TestScene t = corner();
    Material m = TestScene::emitter(Rgb(5));
    m.doubleSided = false;
    t.quad(t.material(m), {-1, 5, 1}, {1, 5, 1}, {1, 5, -1}, {-1, 5, -1});  // faces up, above everything
    const Plan plan = planOf(t.finish());
    EXPECT_FALSE(plan.of(EmissiveMeshes).planned);
    EXPECT_NE(plan.of(EmissiveMeshes).reason.find("faces away"), std::string::npos);
}

TEST(Plan, FeaturesAreRecordedWhereTheyVary) {
    const RecordedFeatures oneColour = planOf(corner().finish()).features;
    EXPECT_FALSE(oneColour.albedo);
    EXPECT_TRUE(oneColour.normalAndDepth);
    EXPECT_TRUE(planOf(corner().finish(), "all").features.albedo);
    EXPECT_TRUE(planOf(corner().finish(), "auto,-indirect").features.albedo) << "left out: nothing is sure";

    TestScene two = corner();
    add(two, TestScene::matte({0.7f, 0.6f, 0.4f}));
    EXPECT_TRUE(planOf(two.finish()).features.albedo);
    TestScene shining = corner();
    Material glowing = TestScene::matte({0.7f, 0.6f, 0.5f});
    glowing.emission = Rgb(1);
    add(shining, glowing);
    EXPECT_TRUE(planOf(shining.finish()).features.albedo) << "emitters are white in the dump";

    TestScene sky;
    sky.environment(render::Environment(Rgb(1)));
    sky.camera({0, 1, 4}, {0, 1, 0}, 0.9f);
    EXPECT_FALSE(planOf(sky.finish()).features.normalAndDepth);
}

TEST(Plan, FeaturesThatAreNotRecordedAreTheSameInAllSamplesThatHit) {
    const Shot shot = shoot(corner().finish(), "auto");
    std::size_t hits = 0;
    for (const PathSample& s : shot.samples) {
        if (!s.hit) continue;
        ASSERT_EQ(s.albedo, Rgb(0.7f, 0.6f, 0.5f));
        ++hits;
    }
    EXPECT_GT(hits, shot.samples.size() / 4);
}

TEST(Plan, TheDumpLacksWhatIsNotRecorded) {
    TemporaryFolder folder;
    Scene scene = corner().finish();
    RenderOptions options;
    options.width = options.height = kSide;
    options.spp = 2;
    renderDump(scene, Accelerator(scene), folder / "all.exr", options);
    options.follow(planOf(scene));
    renderDump(scene, Accelerator(scene), folder / "few.exr", options);
    const DumpReader all(folder / "all.exr"), few(folder / "few.exr");
    EXPECT_EQ(findChannel(few.header(), "albedo.G"), -1);
    const std::vector<std::string> kept = {"R",        "G",        "B",   "A",   "Z",
                                           "sample.x", "sample.y", "N.X", "N.Y", "N.Z"};
    EXPECT_EQ(few.header().channels.size(), kept.size());
    EXPECT_EQ(few.read(0, kSide, kept).values, all.read(0, kSide, kept).values);

    const EarlierDump earlier(folder / "few.exr");
    options.earlier = &earlier;
    renderDump(scene, Accelerator(scene), folder / "more.exr", options);
    EXPECT_EQ(DumpReader(folder / "more.exr").header().channels.size(), kept.size());
}

TEST(Plan, OpacityThatIsOneEverywhereCallsForNothing) {
    TestScene t = corner();
    Material m = TestScene::matte(Rgb(0.5f));
    m.alphaMode = AlphaMode::Blend;
    m.baseColourTexture = textured(t);
    add(t, m);
    EXPECT_FALSE(planOf(t.finish()).of(Alpha).planned);
    TestScene holes = corner();
    m.alphaMode = AlphaMode::Mask;
    m.baseColourTexture = textured(holes, 0);
    add(holes, m);
    const Scene scene = holes.finish();
    EXPECT_TRUE(planOf(scene).of(Alpha).planned);
    expectSameBits(shoot(scene, "auto"), shoot(scene, "all"));
}

TEST(Plan, CausticsWithoutCausticsIsTheRestOfTheLight) {
    const Scene scene = minimal(Caustics).scene;
    const double with = shoot(scene, "auto", 3, 64).mean(),
                 without = shoot(scene, "auto,-caustics", 3, 64).mean();
    EXPECT_LT(without, with);
    EXPECT_GT(without, 0.5 * with);
}

TEST(Plan, PointLightsCastNoCausticsThatAPathCouldFind) {
    TestScene t = corner();
    add(t, named(TestScene::glass(1.5f, 0)));
    const Plan plan = planOf(t.finish());
    EXPECT_FALSE(plan.of(Caustics).planned);
    EXPECT_NE(plan.of(Caustics).reason.find("no extent"), std::string::npos);
}

TEST(ParseEffects, ReadsWhatItSays) {
    EXPECT_FALSE(request("auto").all);
    EXPECT_TRUE(request("all").all);
    EXPECT_TRUE(request("auto,-caustics,-sheen").without.has(Sheen));
    for (const char* text :
         {"", "most", "auto,caustics", "auto,-fog", "all,-sheen", "auto,", "-sheen", "auto auto"}) {
        std::string broken;
        EXPECT_FALSE(parseEffects(text, broken)) << text;
        EXPECT_NE(broken.find("expected"), std::string::npos);
    }
}

TEST(Motion, AMovingSquareCoversPixelsForItsPartOfTheTime) {
    // From x in [-1.3, -0.3] to [0.3, 1.3] over the exposure, seen straight on against black.
    TestScene t;
    t.quad(t.material(TestScene::emitter(Rgb(1))), {-0.5f, -0.5f, 0}, {0.5f, -0.5f, 0}, {0.5f, 0.5f, 0},
           {-0.5f, 0.5f, 0});
    t.camera({0, 0, 5}, {0, 0, 0}, 0.6f);
    setInMotion(t.scene());
    t.scene().motions[0].places = {movedBy(-0.8, 0, 0), movedBy(0.8, 0, 0)};
    const Scene scene = finished(t);
    EXPECT_EQ(planOf(scene).simulated(), (std::vector<std::string>{"emissive_meshes", "object_motion"}));
    const Accelerator accelerator(scene);
    const PathTracer tracer(scene, accelerator, View(scene.cameras[0], kSide, kSide), {});
    for (const float x : {-1.2f, -0.8f, 0.f, 0.6f, 1.1f}) {
        double sum = 0;
        constexpr int n = 4096;
        for (int i = 0; i < n; ++i) {
            const float time = (static_cast<float>(i) + 0.5f) / n;
            sum += tracer.along({{x, 0.1f, 5}, {0, 0, -1}, time}, PathSampler(1, 0)).radiance.x;
        }
        // Covered while |x - (-0.8 + 1.6 t)| < 0.5.
        const double from = std::clamp((x - 0.5 + 0.8) / 1.6, 0.0, 1.0),
                     to = std::clamp((x + 0.5 + 0.8) / 1.6, 0.0, 1.0);
        EXPECT_NEAR(sum / n, to - from, 1e-3) << x;
    }
}

TEST(Motion, TurnsAreFollowedInAsFewStepsAsTheyNeed) {
    const auto turned = [](double angle) {
        Transform t;
        t.m[0] = {std::cos(angle), -std::sin(angle), 0, 0};
        t.m[1] = {std::sin(angle), std::cos(angle), 0, 0};
        return t;
    };
    EXPECT_FALSE(followed([&](double) { return turned(1); }).moves());
    EXPECT_EQ(followed([&](double t) { return movedBy(t, 2 * t, 0); }).places.size(), 2u);
    const Motion turn = followed([&](double t) { return turned(t * 3); });
    EXPECT_GT(turn.places.size(), 8u);
    for (int i = 0; i <= 100; ++i) {
        const Transform t = turn.at(static_cast<float>(i) / 100), truth = turned(3 * i / 100.0);
        EXPECT_NEAR(t.m[0][0], truth.m[0][0], 1e-3);
        EXPECT_NEAR(t.m[1][0], truth.m[1][0], 1e-3);
    }
    // There and back again is not standing still.
    EXPECT_TRUE(followed([&](double t) { return movedBy(t < 0.5 ? t : 1 - t, 0, 0); }).moves());
}

TEST(Absorption, FollowsBeersLawAlongTheWay) {
    TestScene t;
    Material m = TestScene::glass(1, 0);  // neither bends nor reflects
    m.absorption = {0.5f, 1, 3};
    t.box(t.material(m), {-1, -1, -0.5f}, {1, 1, 0.2f});
    t.environment(render::Environment(Rgb(2)));
    const Estimate e = estimate(t.finish(), {{0.1f, 0.2f, 3}, {0, 0, -1}}, 50);
    EXPECT_NEAR(e.mean[0], 2 * std::exp(-0.5 * 0.7), 1e-3);
    EXPECT_NEAR(e.mean[1], 2 * std::exp(-1 * 0.7), 1e-3);
    EXPECT_NEAR(e.mean[2], 2 * std::exp(-3 * 0.7), 1e-3);
}

TEST(SheenLobe, KeepsEnergyAndItsSamplesAgreeWithItsValues) {
    for (const float roughness : {0.2f, 0.5f, 1.f}) {
        TestScene t;
        Material m = TestScene::matte(Rgb(1));
        m.sheenColour = Rgb(1);
        m.sheenRoughness = roughness;
        t.box(t.material(m), {-1, -1, -1}, {1, 1, 1});
        t.environment(render::Environment(Rgb(1)));
        const Scene scene = t.finish();
        PathOptions options;
        for (const Vec3& d : {Vec3{0, 0, -1}, normalized(Vec3{-0.9f, -0.2f, -0.5f})}) {
            std::vector<Estimate> results;
            for (const Strategy strategy : {Strategy::Mis, Strategy::BsdfOnly, Strategy::LightsOnly}) {
                options.strategy = strategy;
                results.push_back(estimate(scene, {{0.3f, 0.2f, 3}, d}, 20000, options));
                EXPECT_NEAR(results.back().mean[0], results[0].mean[0],
                            4 * std::hypot(results.back().error[0], results[0].error[0]) + 1e-4);
            }
            EXPECT_NEAR(results[0].mean[0], 1, 0.03 + 4 * results[0].error[0]) << roughness;
        }
    }
}

}  // namespace
}  // namespace vlx::render
