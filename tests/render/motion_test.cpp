#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "gltf_text.h"
#include "render/film/render.h"
#include "render/integrator/path_tracer.h"
#include "render/plan/plan.h"
#include "render/scene/frame_motion.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"

namespace vlx::render {
namespace {

constexpr int kSide = 48;
constexpr double kFrame = 0.1;
const double kFocal = kSide / 2 / std::tan(0.4);  // of GltfText's camera, in pixels
/// What the rounding of 32-bit floats leaves of places in a picture of this size.
constexpr float kRounding = 2e-4f;

const TemporaryFolder& folder() {
    static const TemporaryFolder f;
    return f;
}

Scene load(const GltfText& g, const Shutter& shutter) {
    writeText(folder() / "scene.gltf", g.text());
    return loadScene(folder() / "scene.gltf", {}, shutter);
}

/// Adds a mesh like the first one, with a material of its own.
int addMesh(GltfText& g, const nlohmann::json& material) {
    g.json["materials"].push_back(material);
    g.json["meshes"].push_back(g.json["meshes"][0]);
    g.json["meshes"].back()["primitives"][0]["material"] = g.json["materials"].size() - 1;
    return static_cast<int>(g.json["meshes"].size()) - 1;
}

void addNode(GltfText& g, int mesh, const std::vector<float>& translation, float scale = 1) {
    g.json["scenes"][0]["nodes"].push_back(g.json["nodes"].size());
    g.json["nodes"].push_back(
        {{"mesh", mesh}, {"translation", translation}, {"scale", {scale, scale, scale}}});
}

/// A frame, ready to be looked at through any place of the picture.
struct Shot {
    Shot(const GltfText& g, const Shutter& shutter)
        : scene(load(g, shutter)),
          accelerator(scene),
          view(scene.cameras[0], kSide, kSide),
          motion(scene, scene.cameras[0], kSide, kSide),
          tracer(scene, accelerator, view, options()) {}

    PathOptions options() const {
        PathOptions o;
        o.motion = &motion;
        return o;
    }

    struct Seen {
        std::optional<Hit> hit;
        float depth;  // along the axis of a camera that looks along -z
        Moved moved;
    };
    Seen at(float x, float y, float time = 0, Vec2 lens = {0.8f, 0.3f}) const {
        const Ray ray = view.ray(x, y, lens, time);
        const auto hit = accelerator.intersect(ray, 0);
        return {hit, hit ? hit->distance * -ray.direction.z : 0, tracer.along(ray, PathSampler(7, 0)).moved};
    }

    Scene scene;
    Accelerator accelerator;
    View view;
    FrameMotion motion;
    PathTracer tracer;
};

/// Calls visit(x, y) for places all over the picture, none of them at a pixel's centre.
template <class Visit>
void everywhere(Visit visit) {
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) visit(static_cast<float>(x) + 0.3f, static_cast<float>(y) + 0.6f);
}

TEST(FrameMotion, OfACameraThatPassesIsParallax) {
    GltfText g;
    addNode(g, 0, {0, 0, -3}, 4);
    animate(g, 1, "translation", {0, 1}, {0, 0, 3, 1, 0, 3}, "VEC3");
    const Shot shot(g, {0.5, 0.5, kFrame});
    int near = 0;
    everywhere([&](float x, float y) {
        const Shot::Seen seen = shot.at(x, y);
        ASSERT_TRUE(seen.hit);
        near += seen.depth < 4;
        const auto parallax = static_cast<float>(kFocal * kFrame / static_cast<double>(seen.depth));
        EXPECT_NEAR(seen.moved.before.x, parallax, kRounding);
        EXPECT_NEAR(seen.moved.after.x, -parallax, kRounding);
        EXPECT_NEAR(seen.moved.before.y, 0, kRounding);
        EXPECT_NEAR(seen.moved.after.y, 0, kRounding);
    });
    EXPECT_GT(near, 100);
    EXPECT_LT(near, kSide * kSide - 100);
}

/// Of an orthographic one it is the same at any distance, and what is at infinity stays.
TEST(FrameMotion, OfAnOrthographicCameraThatPassesIsItsOwn) {
    for (const double lens : {0.0, 0.1}) {
        GltfText g;
        g.json["cameras"][0] = {{"type", "orthographic"},
                                {"orthographic", {{"xmag", 3}, {"ymag", 3}, {"znear", 0.1}, {"zfar", 10}}}};
        g.json["nodes"][1]["extras"] = {{"lens_radius", lens}, {"focus_distance", 3}};
        addNode(g, 0, {1, 0, -3}, 2);
        animate(g, 1, "translation", {0, 1}, {0, 0, 3, 1, 0, 3}, "VEC3");
        const Shot shot(g, {0.5, 0.5, kFrame});
        int near = 0, far = 0, missed = 0;
        everywhere([&](float x, float y) {
            const Shot::Seen seen = shot.at(x, y);
            (!seen.hit ? missed : seen.depth < 4 ? near : far)++;
            if (!seen.hit && lens > 0) return;
            const float way = seen.hit ? static_cast<float>(kSide / 6.0 * kFrame) : 0;
            EXPECT_NEAR(seen.moved.before.x, way, kRounding);
            EXPECT_NEAR(seen.moved.after.x, -way, kRounding);
            EXPECT_NEAR(seen.moved.after.y, 0, kRounding);
        });
        EXPECT_GT(std::min({near, far, missed}), 100);
    }
}

TEST(FrameMotion, OfACameraThatTurnsIsTheSameAtAnyDistanceAndAtInfinity) {
    GltfText g;
    const double turn = 0.8, step = turn * kFrame;
    animate(
        g, 1, "rotation", {0, 1},
        {0, 0, 0, 1, 0, static_cast<float>(std::sin(turn / 2)), 0, static_cast<float>(std::cos(turn / 2))},
        "VEC4");
    const Shot shot(g, {0.2, 0.2, kFrame});
    int met = 0;
    everywhere([&](float x, float y) {
        const Shot::Seen seen = shot.at(x, y);
        met += seen.hit.has_value();
        const double across = (static_cast<double>(x) - kSide / 2) / kFocal,
                     down = (static_cast<double>(y) - kSide / 2) / kFocal;
        for (const bool after : {false, true}) {
            const double angle = after ? step : -step;
            const double ahead = std::cos(angle) - across * std::sin(angle);
            const Vec2 found = after ? seen.moved.after : seen.moved.before;
            const double right = (across * std::cos(angle) + std::sin(angle)) / ahead - across;
            EXPECT_NEAR(found.x, kFocal * right, kRounding);
            EXPECT_NEAR(found.y, kFocal * (down / ahead - down), kRounding);
        }
    });
    EXPECT_GT(met, 100);
    EXPECT_LT(met, kSide * kSide - 100);
}

/// The wall is a mirror that shows the moving square.
TEST(FrameMotion, OfAnObjectIsItsOwnAndTheMirrorBehindItStandsStill) {
    for (const bool instanced : {false, true})
        for (const bool open : {false, true})
            for (const bool lens : {false, true}) {
                GltfText g;
                animate(g, 0, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
                addNode(g, addMesh(g, {{"pbrMetallicRoughness", {{"roughnessFactor", 0}}}}), {0, 0, -1}, 5);
                if (instanced) addNode(g, 0, {0, 90, 0});
                if (lens) g.json["nodes"][1]["extras"] = {{"lens_radius", 0.1}, {"focus_distance", 2}};
                const Shot shot(g, open ? Shutter{0.4, 0.6, kFrame} : Shutter{0.5, 0.5, kFrame});
                const auto way = static_cast<float>(kFocal * kFrame / 3);
                int moving = 0;
                everywhere([&](float x, float y) {
                    const Shot::Seen seen = shot.at(x, y, 0.7f);
                    ASSERT_TRUE(seen.hit);
                    if (seen.depth > 3.5f) {
                        EXPECT_EQ(seen.moved.before, (Vec2{0, 0}));
                        EXPECT_EQ(seen.moved.after, (Vec2{0, 0}));
                        return;
                    }
                    ++moving;
                    EXPECT_NEAR(seen.moved.before.x, -way, kRounding);
                    EXPECT_NEAR(seen.moved.after.x, way, kRounding);
                    EXPECT_NEAR(seen.moved.after.y, 0, kRounding);
                });
                EXPECT_GT(moving, 100) << instanced << open << lens;
                EXPECT_LT(moving, kSide * kSide - 100);
            }
}

TEST(FrameMotion, OfASphereLightIsItsOwn) {
    GltfText g;
    g.json["nodes"][2]["extras"] = {{"radius", 0.2}};
    animate(g, 2, "translation", {0, 1}, {0, -0.25, 2, 0, 0.25, 2}, "VEC3");
    const Shot shot(g, {0.4, 0.6, kFrame});
    int light = 0;
    everywhere([&](float x, float y) {
        const Shot::Seen seen = shot.at(x, y, 0.1f);
        if (!seen.hit || seen.hit->light < 0) return;
        ++light;
        const auto way = static_cast<float>(kFocal * 0.5 * kFrame / static_cast<double>(seen.depth));
        EXPECT_NEAR(seen.moved.before.y, way, kRounding);
        EXPECT_NEAR(seen.moved.after.y, -way, kRounding);
        EXPECT_NEAR(seen.moved.after.x, 0, kRounding);
    });
    EXPECT_GT(light, 100);
}

TEST(FrameMotion, OfWhatIsBehindTheCameraIsNotKnown) {
    GltfText g;
    animate(g, 1, "translation", {0, 1}, {0, 0, 3, 0, 0, -7}, "VEC3");
    const Shot shot(g, {0, 0, 0.5});
    const Moved moved = shot.at(20, 20).moved;
    EXPECT_EQ(moved.before, (Vec2{0, 0})) << "before the first key nothing moves";
    EXPECT_TRUE(std::isnan(moved.after.x) && std::isnan(moved.after.y));
}

TEST(FrameMotion, ThereAndBackIsNowhere) {
    GltfText g;
    const auto h = static_cast<float>(std::sqrt(0.5));
    animate(g, 0, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, h, h}, "VEC4");
    animate(g, 0, "translation", {0, 1}, {-0.5, 0, 0, 0.5, 0.2f, 0.5}, "VEC3");
    animate(g, 1, "translation", {0, 1}, {0, 0.3f, 3, 0.2f, 0, 2.5}, "VEC3");
    animate(g, 1, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0.1f, 0, 0.995f}, "VEC4");
    addNode(g, addMesh(g, {{"name", "wall"}}), {0, 0, -1}, 5);
    const Shot first(g, {0.3, 0.35, kFrame}), second(g, {0.3 + kFrame, 0.35 + kFrame, kFrame});
    int same = 0;
    everywhere([&](float x, float y) {
        const float time = std::fmod(x * 0.37f + y * 0.11f, 1.f);
        const Shot::Seen here = first.at(x, y, time);
        ASSERT_TRUE(here.hit);
        const Shot::Seen there = second.at(x + here.moved.after.x, y + here.moved.after.y, time);
        ASSERT_TRUE(there.hit);
        // Not where something else is in the way, or two triangles meet.
        if (there.hit->shape != here.hit->shape || there.hit->triangle != here.hit->triangle) return;
        ++same;
        EXPECT_NEAR(there.hit->u, here.hit->u, 1e-4f);
        EXPECT_NEAR(there.moved.before.x, -here.moved.after.x, 2 * kRounding);
        EXPECT_NEAR(there.moved.before.y, -here.moved.after.y, 2 * kRounding);
    });
    EXPECT_GT(same, kSide * kSide / 2);
}

Plan planOf(const Scene& s) { return planEffects(s, {0, kSide, kSide, 12, {}}); }

RenderOptions small() {
    RenderOptions options;
    options.width = 30;
    options.height = 22;
    options.spp = 4;
    return options;
}

SampleBand rendered(const Scene& scene, const RenderOptions& options, const std::string& name = "d.exr") {
    const Accelerator accelerator(scene);
    renderDump(scene, accelerator, folder() / name, options);
    const DumpReader reader(folder() / name);
    return reader.read(reader.header().data.y, reader.header().data.height);
}

TEST(RecordedMotion, IsThereWhereSomethingInSightMovesFromFrameToFrame) {
    GltfText still;
    addNode(still, 0, {0, 0, -1}, 5);
    GltfText moving = still, unseen = still, turning = still, even = still;
    animate(moving, 0, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
    addNode(unseen, addMesh(unseen, {{"name", "behind"}}), {0, 0, 9});
    animate(unseen, 4, "translation", {0, 1}, {0, 0, 9, 1, 0, 9}, "VEC3");
    animate(turning, 1, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0.1f, 0, 1}, "VEC4");
    animate(even, 0, "translation", {0, 0.3f, 0.7f, 1}, {0.1f, 0, 0, 0.1f, 0, 0, 0.1f, 0, 0, 0.1f, 0, 0},
            "VEC3");
    const Shutter frozen{0.5, 0.5, kFrame};
    for (const auto& [g, recorded, words] : {std::tuple{&still, false, "nothing moves"},
                                             {&even, false, "nothing moves"},
                                             {&unseen, false, "nothing in sight"},
                                             {&moving, true, "'square'"},
                                             {&turning, true, "camera 'eye'"}}) {
        const Scene scene = load(*g, frozen);
        const RecordedMotion motion = planOf(scene).motion;
        EXPECT_EQ(motion.recorded, recorded) << motion.reason;
        EXPECT_NE(motion.reason.find(words), std::string::npos) << motion.reason;
        const SampleBand band = rendered(scene, small());
        for (const std::string_view name : kMotionChannels)
            EXPECT_EQ(band.channel(name) >= 0, recorded) << name;
    }
    const RecordedMotion alone = planOf(load(moving, {0.5, 0.5})).motion;
    EXPECT_FALSE(alone.recorded);
    EXPECT_NE(alone.reason.find("sequence"), std::string::npos) << alone.reason;
}

/// Camera, lens and objects move; the picture has a part without anything.
GltfText lively() {
    GltfText g;
    animate(g, 0, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 0.6f, 0.8f}, "VEC4");
    animate(g, 1, "translation", {0, 1}, {0, 0.3f, 3, 0.2f, 0, 2.5}, "VEC3");
    addNode(g, addMesh(g, {{"name", "wall"}}), {0.5, 0, -1});
    g.json["nodes"][1]["extras"] = {{"lens_radius", 0.05}, {"focus_distance", 3}};
    return g;
}

TEST(RecordedMotion, IsTheSameForAnyNumberOfThreadsAndBandsAndChangesNothingElse) {
    const Scene scene = load(lively(), {0.5, 0.52, kFrame}), alone = load(lively(), {0.5, 0.52});
    for (const bool hierarchical : {false, true}) {
        RenderOptions options = small();
        options.hierarchical = hierarchical;
        options.refinement.levels = 3;
        const SampleBand whole = rendered(scene, options);
        ASSERT_GE(whole.channel("motionNext.y"), 0);
        for (const int threads : {1, 2, 8}) {
            const ThreadLimit limit(threads);
            expectSame(whole, rendered(scene, options));
        }
        int row = 0;
        for (int i = 0; i < 3; ++i) {
            options.band = {i, 3};
            const SampleBand band = rendered(scene, options, "band.exr");
            expectSame(rowsOf(whole, row, band.height), band);
            row += band.height;
        }
        EXPECT_EQ(row, options.height);
        options.band = {};
        const SampleBand without = rendered(alone, options);
        EXPECT_EQ(without.channel("motion.x"), -1);
        expectSame(channelsOf(whole, without.channels), without);
    }
}

TEST(RecordedMotion, OfSamplesThatAreAddedIsKnownInASequence) {
    const Scene scene = load(lively(), {0.5, 0.52, kFrame}), alone = load(lively(), {0.5, 0.52});
    rendered(scene, small(), "old.exr");
    const EarlierDump earlier(folder() / "old.exr");
    RenderOptions more = small();
    more.earlier = &earlier;
    for (const bool known : {true, false}) {
        const SampleBand both = rendered(known ? scene : alone, more);
        const auto& values = both.values.at(static_cast<std::size_t>(both.channel("motion.x")));
        for (std::size_t s = 0; s < values.size(); ++s)
            EXPECT_EQ(std::isfinite(values[s]), known || s % 8 < 4) << s;
    }
}

TEST(RecordedMotion, OfMotionThatIsLeftOutStaysInTheMiddleOfTheExposure) {
    GltfText g;
    animate(g, 1, "translation", {0, 1}, {0, 0, 3, 1, 0, 3}, "VEC3");
    Scene scene = load(g, {0.4, 0.6, kFrame});
    std::string broken;
    applyPlan(scene, planEffects(scene, {0, kSide, kSide, 12, *parseEffects("auto,-camera_motion", broken)}));
    const FrameMotion motion(scene, scene.cameras[0], kSide, kSide);
    const View view(scene.cameras[0], kSide, kSide);
    const Accelerator accelerator(scene);
    const Ray ray = view.ray(20, 20, {});
    const auto way = static_cast<float>(kFocal * kFrame / 3);
    EXPECT_NEAR(motion.of(ray, accelerator.intersect(ray, 0)).after.x, -way, kRounding);
}

}  // namespace
}  // namespace vlx::render
