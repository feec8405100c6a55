// Skins, morph targets, instances, variants and compressed data, where pictures (gltf_kinds_test.cpp) do not
// tell enough: normals, motion blur, motion between frames, and what is malformed.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "../base/temporary_folder.h"
#include "gltf_text.h"
#include "render/integrator/path_tracer.h"
#include "render/plan/plan.h"
#include "render/scene/accelerator.h"
#include "render/scene/frame_motion.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/error.h"

namespace vlx::render {
namespace {

const TemporaryFolder& bendFolder() {
    static const TemporaryFolder f;
    return f;
}

Scene loadBent(const GltfText& g, const Shutter& shutter = {0, 0}, const std::string& variant = {}) {
    writeText(bendFolder() / "scene.gltf", g.text());
    return loadScene(bendFolder() / "scene.gltf", {}, shutter, {.variant = variant});
}

void expectFault(const std::string& words, const GltfText& g, const std::string& variant = {}) {
    std::string message = "no error";
    try {
        loadBent(g, {0, 0}, variant);
    } catch (const Error& e) {
        message = e.what();
    }
    EXPECT_NE(message.find(words), std::string::npos) << words << " in: " << message;
}

constexpr float kQuarter = 0.70710678f;

/// The square on a skin of two joints (nodes 3 and 4), the left corners on the first, the right on the
/// second.
struct Skinned : GltfText {
    explicit Skinned(std::vector<std::uint16_t> joints = {0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0},
                     std::vector<float> weights = {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0}) {
        json["accessors"].push_back({{"bufferView", view(joints)},
                                     {"componentType", 5123},
                                     {"count", joints.size() / 4},
                                     {"type", "VEC4"}});
        auto& attributes = json["meshes"][0]["primitives"][0]["attributes"];
        attributes["JOINTS_0"] = json["accessors"].size() - 1;
        attributes["WEIGHTS_0"] = floats(weights, "VEC4");
        json["nodes"].push_back({{"name", "left"}});
        json["nodes"].push_back({{"name", "right"}});
        json["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};
        json["skins"] = {{{"name", "bones"}, {"joints", {3, 4}}}};
        json["nodes"][0]["skin"] = 0;
    }
    /// 16 numbers a matrix.
    void bind(const std::vector<float>& matrices) {
        const int accessor = floats(matrices, "VEC4");
        json["accessors"][static_cast<std::size_t>(accessor)]["type"] = "MAT4";
        json["accessors"][static_cast<std::size_t>(accessor)]["count"] = matrices.size() / 16;
        json["skins"][0]["inverseBindMatrices"] = accessor;
    }
};

/// Adds a morph target of the square's four corners.
void addTarget(GltfText& g, const std::string& attribute, const std::vector<float>& differences) {
    g.json["meshes"][0]["primitives"][0]["targets"].push_back({{attribute, g.floats(differences, "VEC3")}});
}

TEST(Skins, NormalsGoWithTheJointsEvenWhereTheseScale) {
    Skinned g;
    g.json["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] =
        g.floats({0, 0.6f, 0.8f, 0, 0.6f, 0.8f, 0, 0.6f, 0.8f, 0, 0.6f, 0.8f}, "VEC3");
    for (const std::size_t joint : {3u, 4u}) g.json["nodes"][joint]["scale"] = {1, 2, 1};
    const Scene s = loadBent(g);
    ASSERT_EQ(s.vertices.size(), 4u);
    const Vec3 wanted = normalized(Vec3{0, 0.3f, 0.8f});  // by the inverse transpose
    for (const Vertex& v : s.vertices) EXPECT_NEAR(length(v.normal - wanted), 0, 1e-6f);
    EXPECT_EQ(s.boundsMax, (Vec3{1, 2, 0}));
}

TEST(Skins, MirroredJointsKeepTheFront) {
    Skinned g;
    for (const std::size_t joint : {3u, 4u}) g.json["nodes"][joint]["scale"] = {-1, 1, 1};
    const Scene s = loadBent(g);
    const Accelerator accelerator(s);
    EXPECT_TRUE(accelerator.intersect({{0.2f, 0.1f, 3}, {0, 0, -1}}, 0));
    EXPECT_FALSE(accelerator.intersect({{0.2f, 0.1f, -3}, {0, 0, 1}}, 0));
}

TEST(Skins, InverseBindMatricesComeFirst) {
    Skinned g;
    g.bind({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 0, 0, 1});
    for (const std::size_t joint : {3u, 4u}) g.json["nodes"][joint]["rotation"] = {0, 0, kQuarter, kQuarter};
    const Scene s = loadBent(g);  // 0 to 2 in x, then turned
    EXPECT_NEAR(s.boundsMin.y, 0, 1e-6f);
    EXPECT_NEAR(s.boundsMax.y, 2, 1e-6f);
    EXPECT_NEAR(s.boundsMax.x, 1, 1e-6f);
}

// The right side goes from 1 to 3 while the shutter is open: blur, and a plan that says so.
TEST(Skins, ThatMoveAreBlurred) {
    Skinned g;
    animate(g, 4, "translation", {0, 1}, {0, 0, 0, 4, 0, 0}, "VEC3");
    const Scene s = loadBent(g, {0, 0.5});
    ASSERT_EQ(s.deformations.size(), 1u);
    EXPECT_NEAR(s.boundsMax.x, 3, 1e-5f);
    const Plan plan = planEffects(s, {0, 32, 32, 12, {}});
    EXPECT_TRUE(plan.of(Effect::ObjectMotion).planned);
    EXPECT_NE(plan.of(Effect::ObjectMotion).reason.find("'right'"), std::string::npos);
    const Accelerator accelerator(s);
    for (const float time : {0.f, 0.3f, 0.99f}) {
        const float edge = 1 + 2 * time;
        const Ray ray{{edge - 0.1f, 0.4f, 3}, {0, 0, -1}, time};
        const auto hit = accelerator.intersect(ray, 0);
        ASSERT_TRUE(hit) << time;
        EXPECT_NEAR(length(surfaceAt(s, *hit, {0, 0, -1}, time).position - Vec3{edge - 0.1f, 0.4f, 0}), 0,
                    1e-4f);
        EXPECT_FALSE(accelerator.intersect({{edge + 0.1f, 0.4f, 3}, {0, 0, -1}, time}, 0)) << time;
    }
    // Left out, it stands as in the middle of the exposure.
    Scene frozen = s;
    std::string broken;
    applyPlan(frozen, planEffects(frozen, {0, 32, 32, 12, *parseEffects("auto,-object_motion", broken)}));
    const Accelerator still(frozen);
    EXPECT_TRUE(still.intersect({{1.9f, 0.4f, 3}, {0, 0, -1}, 0}, 0));
    EXPECT_FALSE(still.intersect({{2.1f, 0.4f, 3}, {0, 0, -1}, 1}, 0));
}

TEST(Skins, ThatTurnAreFollowedInSteps) {
    Skinned g;
    animate(g, 4, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 1, 0}, "VEC4");
    animate(g, 3, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, 1, 0}, "VEC4");
    const Scene s = loadBent(g, {0, 1});
    ASSERT_EQ(s.deformations.size(), 1u);
    EXPECT_GT(s.deformations[0].steps, 4u);
    const Accelerator accelerator(s);
    for (const float time : {0.1f, 0.37f, 0.8f}) {  // corners stay on their circle
        const float angle = kPi * time + kPi / 4, reach = std::sqrt(2.f);
        for (const float part : {0.98f, 1.02f}) {
            const Vec3 from{part * reach * std::cos(angle), part * reach * std::sin(angle), 3};
            EXPECT_EQ(accelerator.intersect({from, {0, 0, -1}, time}, 0).has_value(), part < 1) << time;
        }
    }
}

// A sequence: the right side moves by 0.4 a frame, what lies half way by half of that.
TEST(Bends, MotionBetweenFramesIsThatOfThePoint) {
    constexpr int kPixels = 48;
    for (const bool skinned : {false, true})
        for (const bool open : {false, true}) {
            GltfText g;
            if (skinned) {
                g = Skinned();
                animate(g, 4, "translation", {0, 1}, {0, 0, 0, 4, 0, 0}, "VEC3");
            } else {
                addTarget(g, "POSITION", {0, 0, 0, 4, 0, 0, 4, 0, 0, 0, 0, 0});
                animate(g, 0, "weights", {0, 1}, {0, 1}, "SCALAR");
            }
            const Scene s = loadBent(g, {0.5, open ? 0.52 : 0.5, 0.1});
            const Plan plan = planEffects(s, {0, kPixels, kPixels, 12, {}});
            EXPECT_TRUE(plan.motion.recorded);
            EXPECT_NE(plan.motion.reason.find("deforms"), std::string::npos) << plan.motion.reason;
            const Accelerator accelerator(s);
            const View view(s.cameras[0], kPixels, kPixels);
            const FrameMotion motion(s, s.cameras[0], kPixels, kPixels);
            const double focal = kPixels / 2 / std::tan(0.4);
            const float time = 0.4f;
            const double right = 1 + 4 * (0.5 + (open ? 0.4 * 0.02 : 0));
            int met = 0;
            for (int i = 0; i < kPixels; ++i) {
                const float x = static_cast<float>(i) + 0.3f;
                const Ray ray = view.ray(x, 25.1f, {}, time);
                const auto hit = accelerator.intersect(ray, 0);
                if (!hit) continue;
                ++met;
                const double world = (static_cast<double>(x) - kPixels / 2) / focal * 3;
                const double way = focal / 3 * 0.4 * (world + 1) / (right + 1);
                const Moved moved = motion.of(ray, hit);
                EXPECT_NEAR(moved.after.x, way, 2e-3) << skinned << open;
                EXPECT_NEAR(moved.before.x, -way, 2e-3) << skinned << open;
                EXPECT_NEAR(moved.after.y, 0, 2e-3);
            }
            EXPECT_GT(met, 20);
        }
    Skinned still;
    const Plan plan = planEffects(loadBent(still, {0, 0, 0.1}), {0, 32, 32, 12, {}});
    EXPECT_FALSE(plan.motion.recorded);
}

TEST(Morphs, NormalsAndTangentsAreMorphedToo) {
    GltfText g;
    auto& primitive = g.json["meshes"][0]["primitives"][0];
    primitive["attributes"]["NORMAL"] = g.floats({0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1}, "VEC3");
    primitive["attributes"]["TANGENT"] = g.floats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4");
    addTarget(g, "NORMAL", {1, 0, -1, 1, 0, -1, 1, 0, -1, 1, 0, -1});
    primitive["targets"][0]["TANGENT"] = g.floats({-1, 0, -1, -1, 0, -1, -1, 0, -1, -1, 0, -1}, "VEC3");
    g.json["meshes"][0]["weights"] = {0.5};
    const Scene s = loadBent(g);
    EXPECT_NEAR(length(s.vertices[0].normal - normalized(Vec3{1, 0, 1})), 0, 1e-6f);
    EXPECT_NEAR(length(s.tangents[0].direction - normalized(Vec3{1, 0, -1})), 0, 1e-6f);
}

TEST(Morphs, ThatStandStillAreInstancedAndMayShine) {
    GltfText g;
    addTarget(g, "POSITION", {0, 0, 0, 2, 0, 0, 2, 0, 0, 0, 0, 0});
    g.json["meshes"][0]["weights"] = {1};
    g.json["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, -1}}});
    g.json["nodes"].push_back({{"mesh", 0}, {"weights", {0}}, {"translation", {0, 0, -2}}});
    g.json["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};
    const Scene s = loadBent(g);
    EXPECT_EQ(s.instances.size(), 2u);
    EXPECT_EQ(s.worldShapes, 1u);
    EXPECT_EQ(s.boundsMax.x, 3);
    EXPECT_TRUE(s.deformations.empty());
    g.json["materials"][0]["emissiveFactor"] = {1, 1, 1};
    EXPECT_EQ(loadBent(g).lights.size(), 4u);
}

TEST(BadSkins, NameThePlace) {
    const float nan = std::numeric_limits<float>::quiet_NaN();
    const std::vector<std::uint16_t> joints(16, 0);
    expectFault("mesh 0 'square': vertex 1 refers to joint 2 in JOINTS_0, the skin has 2",
                Skinned({0, 0, 0, 0, 2, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}));
    expectFault("vertex 2 has a weight of nan in WEIGHTS_0",
                Skinned(joints, {1, 0, 0, 0, 1, 0, 0, 0, nan, 0, 0, 0, 1, 0, 0, 0}));
    expectFault("vertex 2 has a weight of -1",
                Skinned(joints, {1, 0, 0, 0, 1, 0, 0, 0, -1, 0, 0, 0, 1, 0, 0, 0}));
    expectFault("the weights of vertex 3 add up to 0",
                Skinned(joints, {1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}));
    expectFault("JOINTS_0 has 3 elements, POSITION 4", Skinned({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}));
    expectFault("WEIGHTS_0 has 1 elements", Skinned(joints, {1, 0, 0, 0}));
    Skinned g;
    g.json["meshes"][0]["primitives"][0]["attributes"].erase("WEIGHTS_0");
    expectFault("no WEIGHTS_0", g);
    Skinned few;
    few.bind({1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1});
    expectFault("skin 0 'bones' has 1 inverse bind matrices, expected 2", few);
    Skinned infinite;
    infinite.bind(std::vector<float>(32, std::numeric_limits<float>::infinity()));
    expectFault("inverse bind matrix 0 is not finite", infinite);
    Skinned wrong;
    wrong.json["skins"][0]["inverseBindMatrices"] = 0;
    expectFault("inverseBindMatrices: accessor 0 must have 16 components", wrong);
    Skinned floating;
    floating.json["meshes"][0]["primitives"][0]["attributes"]["JOINTS_0"] = 4;
    expectFault("must hold unsigned integers", floating);
    Skinned outside;
    outside.json["scenes"][0]["nodes"] = {0, 1, 2, 3};
    expectFault("node 4 'right', which is not in the scene", outside);
    Skinned circle;
    circle.json["nodes"][3]["children"] = {4};
    circle.json["nodes"][4]["children"] = {3};
    expectFault("node 3 'left' is below itself: it is a child of node 4 'right'", circle);
    const Scene halved =
        loadBent(Skinned(joints, {1, 0, 0, 0, 0.5f, 0, 0, 0, 1, 0, 0, 0, 0.5f, 0.25f, 0, 0}));
    ASSERT_EQ(halved.report.warnings.size(), 1u);
    EXPECT_EQ(
        halved.report.warnings[0],
        "mesh 0 'square': the weights of 2 of its 4 vertices do not add up to 1 (those of vertex 1 to 0.5): "
        "they are scaled to it");
    Skinned none;
    none.json["skins"][0]["joints"] = nlohmann::json::array();
    expectFault("has no joints", none);
    Skinned plain;  // a mesh without joints stays where its node is
    plain.json["meshes"][0]["primitives"][0]["attributes"].erase("JOINTS_0");
    plain.json["nodes"][0]["translation"] = {4, 0, 0};
    const Scene s = loadBent(plain);
    EXPECT_EQ(s.boundsMax.x, 5);
    ASSERT_EQ(s.report.warnings.size(), 1u);
    EXPECT_NE(s.report.warnings[0].find("JOINTS_0"), std::string::npos);
}

TEST(BadMorphs, NameThePlace) {
    GltfText few;
    addTarget(few, "POSITION", {0, 0, 0});
    expectFault("mesh 0 'square' target 0 POSITION has 1 elements, POSITION 4", few);
    GltfText wrong;
    wrong.json["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 1}}};
    expectFault("target 0 POSITION: accessor 1 must have 3 components", wrong);
    GltfText infinite;
    addTarget(infinite, "POSITION", std::vector<float>(12, std::numeric_limits<float>::infinity()));
    infinite.json["meshes"][0]["weights"] = {1};
    expectFault("vertex 0 is not finite", infinite);
    GltfText values;
    addTarget(values, "POSITION", std::vector<float>(12, 1));
    animate(values, 0, "weights", {0, 1}, {0, 1, 2}, "SCALAR");
    expectFault("3 values, expected 2", values);
    GltfText nothing;
    animate(nothing, 0, "weights", {0, 1}, {0, 1}, "SCALAR");
    const Scene s = loadBent(nothing);
    ASSERT_EQ(s.report.warnings.size(), 1u);
    EXPECT_NE(s.report.warnings[0].find("without morph targets"), std::string::npos);
}

nlohmann::json& instancing(GltfText& g) {
    g.json["extensionsUsed"].push_back("EXT_mesh_gpu_instancing");
    return g.json["nodes"][0]["extensions"]["EXT_mesh_gpu_instancing"]["attributes"];
}

TEST(Instancing, DoesNotCopyTrianglesButThoseThatShine) {
    GltfText g;
    instancing(g)["TRANSLATION"] = g.floats({0, 0, 0, 4, 0, 0, 8, 0, 0}, "VEC3");
    g.json["nodes"][0]["scale"] = {0.5, 1, 1};
    const Scene s = loadBent(g);
    EXPECT_EQ(s.triangles.size(), 2u);
    EXPECT_EQ(s.triangleCount(), 6u);
    EXPECT_EQ(s.boundsMax.x, 4.5f);  // 8 + 1, in the node's space
    g.json["materials"][0]["emissiveFactor"] = {1, 1, 1};
    EXPECT_EQ(loadBent(g).lights.size(), 4u);
    animate(g, 0, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
    EXPECT_EQ(loadBent(g, {0, 1}).motions.size(), 3u);
}

TEST(BadInstancing, NamesThePlace) {
    GltfText uneven;
    instancing(uneven)["TRANSLATION"] = uneven.floats({0, 0, 0, 4, 0, 0}, "VEC3");
    instancing(uneven)["SCALE"] = uneven.floats({1, 1, 1}, "VEC3");
    expectFault("SCALE has 1 elements, TRANSLATION 2", uneven);
    GltfText zero;
    instancing(zero)["ROTATION"] = zero.floats({0, 0, 0, 0}, "VEC4");
    expectFault("instance 0 has a rotation that is no quaternion", zero);
    GltfText wrong;
    instancing(wrong)["TRANSLATION"] = 1;
    expectFault("TRANSLATION: accessor 1 must have 3 components", wrong);
    GltfText none;
    instancing(none)["_ID"] = 0;
    expectFault("none of TRANSLATION", none);
    GltfText infinite;
    instancing(infinite)["SCALE"] = infinite.floats({1, std::numeric_limits<float>::infinity(), 1}, "VEC3");
    expectFault("not finite", infinite);
    GltfText many;
    many.json["accessors"].push_back({{"componentType", 5126}, {"count", 1 << 25}, {"type", "VEC3"}});
    instancing(many)["TRANSLATION"] = many.json["accessors"].size() - 1;
    expectFault("2^24", many);
    GltfText shining;
    instancing(shining)["TRANSLATION"] = shining.floats({0, 0, 0, 4, 0, 0}, "VEC3");
    shining.json["materials"][0]["emissiveFactor"] = {1, 1, 1};
    shining.json["accessors"][0]["count"] = (1 << 25) + 1;
    expectFault("2 instances of a mesh that shines, of 33554433 vertices", shining);
}

TEST(Variants, AreChosenByNameOrNumber) {
    GltfText g;
    expectFault("has no variants", g, "night");
    g.json["materials"].push_back({{"name", "other"}});
    g.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "1"}}, {{"name", "night"}}};
    g.json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"] = {
        {{"material", 1}, {"variants", {1}}}};
    EXPECT_EQ(loadBent(g).shapes[0].material, 0u);
    EXPECT_EQ(loadBent(g, {}, "night").shapes[0].material, 1u);
    EXPECT_EQ(loadBent(g, {}, "1").shapes[0].material, 0u) << "a name comes before a number";
    EXPECT_EQ(loadBent(g, {}, "0").shapes[0].material, 0u);
    expectFault("has no variant 'day'; it has '1', 'night'", g, "day");
    expectFault("has no variant '2'", g, "2");
    g.json["meshes"][0]["primitives"][0]["extensions"]["KHR_materials_variants"]["mappings"][0]["variants"] =
        {5};
    expectFault("refers to variant 5", g);
}

// A wall of an unlit material stands before a matte floor: it gives it no light, but hides the lamp from it.
TEST(Unlit, LightsNothingAndCastsShadows) {
    GltfText g;
    g.json["materials"][0]["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
    g.json["materials"][0]["doubleSided"] = true;
    g.json["materials"].push_back({{"pbrMetallicRoughness", {{"metallicFactor", 0}}}});
    g.json["meshes"].push_back(g.json["meshes"][0]);
    g.json["meshes"][1]["primitives"][0]["material"] = 1;
    g.json["nodes"].push_back(
        {{"mesh", 1}, {"translation", {0, 0, -1}}});  // behind the wall, seen from beside it
    g.json["scenes"][0]["nodes"] = {0, 1, 2, 3};
    const Scene s = loadBent(g);
    EXPECT_EQ(s.lights.size(), 1u);
    const Accelerator accelerator(s);
    const PathTracer tracer(s, accelerator, View(s.cameras[0], 8, 8), {});
    const auto seen = [&](const Vec3& from, const Vec3& to) {
        Rgb sum;
        for (std::uint64_t i = 0; i < 64; ++i)
            sum += tracer.along({from, normalized(to - from)}, PathSampler(hashOf(i, 3), 0)).radiance *
                   (1.f / 64);
        return sum;
    };
    EXPECT_EQ(seen({0, 0, 3}, {0, 0, 0}), (Rgb{1, 1, 1}));
    EXPECT_EQ(seen({3, 0, -0.5f}, {0, 0, -1}), (Rgb{0, 0, 0}));
    const Plan plan = planEffects(s, {0, 32, 32, 12, {}});
    EXPECT_TRUE(plan.of(Effect::Unlit).planned);
    EXPECT_FALSE(plan.of(Effect::EmissiveMeshes).planned) << plan.of(Effect::EmissiveMeshes).reason;
}

TEST(Unlit, HasItsColourAmongTheFeatures) {
    GltfText g;
    g.json["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {0.25, 0.5, 0.75, 1};
    g.json["materials"][0]["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
    g.json["scenes"][0]["nodes"] = {0, 1};  // without a lamp
    const Scene s = loadBent(g);
    const Accelerator accelerator(s);
    const PathTracer tracer(s, accelerator, View(s.cameras[0], 8, 8), {});
    const PathSample sample = tracer.along({{0, 0, 3}, {0, 0, -1}}, PathSampler(1, 0));
    EXPECT_EQ(sample.albedo, (Rgb{0.25f, 0.5f, 0.75f}));
    EXPECT_EQ(sample.radiance, sample.albedo);
    EXPECT_EQ(sample.normal, (Vec3{0, 0, 1}));
}

TEST(Compressed, DamagedDataIsAnError) {
    const std::vector<unsigned char> junk(64, 0x5a);
    GltfText d;
    d.json["accessors"][0].erase("bufferView");
    auto& draco = d.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"];
    draco = {{"bufferView", d.view(junk)}, {"attributes", {{"POSITION", 0}}}};
    expectFault("mesh 0 'square' primitive 0 KHR_draco_mesh_compression cannot be decoded", d);
    draco["bufferView"] = 99;
    expectFault("refers to bufferView 99", d);
    for (const auto& [mode, stride, count, filter, words] :
         {std::tuple{"ATTRIBUTES", 12, 4, "NONE", "damaged"},
          {"TRIANGLES", 2, 6, "NONE", "damaged"},
          {"INDICES", 4, 6, "NONE", "damaged"},
          {"ATTRIBUTES", 13, 4, "NONE", "multiple of 4"},
          {"TRIANGLES", 2, 5, "NONE", "count of 5"},
          {"ATTRIBUTES", 12, 1 << 30, "NONE", "count of"},
          {"LINES", 2, 6, "NONE", "the mode 'LINES'"},
          {"INDICES", 12, 6, "NONE", "2 or 4"}}) {
        GltfText m;
        const auto view = static_cast<std::size_t>(m.view(junk));
        nlohmann::json packed = m.json["bufferViews"][view];
        packed.update({{"mode", mode}, {"byteStride", stride}, {"count", count}, {"filter", filter}});
        m.json["bufferViews"][view]["extensions"]["EXT_meshopt_compression"] = packed;
        expectFault("bufferView " + std::to_string(view) + " EXT_meshopt_compression", m);
        expectFault(words, m);
    }
}

TEST(Extensions, ThatAreIgnoredSayWhatIsMissing) {
    GltfText g;
    g.json["extensionsUsed"] = {"KHR_materials_iridescence", "KHR_node_visibility"};
    const Scene s = loadBent(g);
    ASSERT_EQ(s.report.warnings.size(), 2u);
    EXPECT_NE(s.report.warnings[0].find("shimmer"), std::string::npos);
    EXPECT_NE(s.report.warnings[1].find("hidden nodes are shown"), std::string::npos);
}

}  // namespace
}  // namespace vlx::render
