#include <gtest/gtest.h>

#include <functional>

#include "../base/temporary_folder.h"
#include "gltf_text.h"
#include "render/plan/plan.h"
#include "render/scene/accelerator.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/error.h"

namespace vlx::render {
namespace {

const TemporaryFolder& folder() {
    static const TemporaryFolder f;
    return f;
}

Scene load(const GltfText& g, const Shutter& shutter = {}) {
    writeText(folder() / "scene.gltf", g.text());
    return loadScene(folder() / "scene.gltf", {}, shutter);
}

std::string failure(const GltfText& g) {
    try {
        load(g);
    } catch (const Error& e) {
        return e.what();
    }
    return "no error";
}

Plan planOf(const Scene& s) { return planEffects(s, {0, 32, 32, 12, {}}); }

TEST(Animation, MovesANodeWhileTheShutterIsOpen) {
    GltfText g;
    animate(g, 0, "translation", {0, 1}, {0, 0, 0, 4, 0, 0}, "VEC3");
    const Scene s = load(g, {0.25, 0.75});
    ASSERT_EQ(s.instances.size(), 1u);
    ASSERT_EQ(s.motions.size(), 1u);
    ASSERT_EQ(s.motions[0].places.size(), 2u);
    EXPECT_NEAR(s.motions[0].places[0].m[0][3], 1, 1e-6);
    EXPECT_NEAR(s.motions[0].places[1].m[0][3], 3, 1e-6);
    EXPECT_NEAR(s.boundsMin.x, 0, 1e-5f);
    EXPECT_NEAR(s.boundsMax.x, 4, 1e-5f);
    const Plan plan = planOf(s);
    EXPECT_TRUE(plan.of(Effect::ObjectMotion).planned);
    EXPECT_NE(plan.of(Effect::ObjectMotion).reason.find("'play'"), std::string::npos);
    EXPECT_NE(plan.of(Effect::ObjectMotion).reason.find("'square'"), std::string::npos);
    const Accelerator accelerator(s);
    for (const float time : {0.f, 0.5f, 0.99f}) {
        const float centre = 1 + 2 * time;
        const auto hit = accelerator.intersect({{centre + 0.9f, 0, 3}, {0, 0, -1}, time}, 0);
        ASSERT_TRUE(hit) << time;
        EXPECT_NEAR(surfaceAt(s, *hit, {0, 0, -1}, time).position.x, centre + 0.9f, 1e-4f);
        EXPECT_FALSE(accelerator.intersect({{centre + 1.1f, 0, 3}, {0, 0, -1}, time}, 0)) << time;
    }
}

TEST(Animation, OutsideTheExposureNothingMovesAndThingsAreWhereTheirKeysPutThem) {
    GltfText g;
    animate(g, 0, "translation", {5, 6}, {1, 0, 0, 4, 0, 0}, "VEC3");
    for (const auto& [shutter, x] :
         {std::pair{Shutter{}, 1.f}, std::pair{Shutter{7, 8}, 4.f}, std::pair{Shutter{5.5, 5.5}, 2.5f}}) {
        const Scene s = load(g, shutter);
        EXPECT_TRUE(s.motions.empty());
        EXPECT_NEAR(s.boundsMax.x, x + 1, 1e-5f);
        const Plan plan = planOf(s);
        EXPECT_FALSE(plan.of(Effect::ObjectMotion).planned);
        EXPECT_NE(plan.of(Effect::ObjectMotion).reason.find("shutter"), std::string::npos);
    }
}

TEST(Animation, ParentsRotationsStepsAndSplines) {
    GltfText g;
    g.json["nodes"][0]["translation"] = {2, 0, 0};
    g.json["nodes"].push_back({{"children", {0}}, {"name", "arm"}});
    g.json["scenes"][0]["nodes"] = {3, 1, 2};
    const auto h = static_cast<float>(std::sqrt(0.5));
    animate(g, 3, "rotation", {0, 1}, {0, 0, 0, 1, 0, 0, h, h}, "VEC4");
    const Scene turned = load(g, {0.5, 0.5});  // an eighth of a turn about z
    EXPECT_NEAR(turned.boundsMax.y, 2 * h + std::sqrt(2.f), 1e-4f);
    EXPECT_EQ(load(g, {0, 1}).motions.size(), 1u);

    GltfText step;
    animate(step, 0, "scale", {0, 1}, {1, 1, 1, 3, 1, 1}, "VEC3", "STEP");
    EXPECT_NEAR(load(step, {0.9, 0.9}).boundsMax.x, 1, 1e-5f);
    EXPECT_NEAR(load(step, {1, 1}).boundsMax.x, 3, 1e-5f);

    GltfText spline;  // in-tangent, value, out-tangent: leaves at speed 4, arrives at rest
    animate(spline, 0, "translation", {0, 1}, {0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0}, "VEC3",
            "CUBICSPLINE");
    EXPECT_NEAR(load(spline, {0.5, 0.5}).boundsMax.x, 1 + 0.5 + 4.0 / 8, 1e-5f);
}

TEST(Animation, OfTheCameraIsCameraMotion) {
    GltfText g;
    animate(g, 1, "translation", {0, 1}, {0, 0, 3, 1, 0, 3}, "VEC3");
    const Scene s = load(g, {0, 1});
    ASSERT_TRUE(s.cameras[0].motion.moves());
    EXPECT_NEAR(s.cameras[0].toWorld.m[0][3], 0.5, 1e-6);
    const Plan plan = planOf(s);
    EXPECT_TRUE(plan.of(Effect::CameraMotion).planned);
    EXPECT_FALSE(plan.of(Effect::ObjectMotion).planned);
    const View view(s.cameras[0], 10, 10);
    EXPECT_NEAR(view.ray(5, 5, {}, 0.75f).origin.x, 0.75f, 1e-6f);
}

TEST(Animation, MovingEmittersShineWithoutBeingLights) {
    GltfText g;
    g.json["materials"][0]["emissiveFactor"] = {1, 1, 1};
    g.json["scenes"][0]["nodes"] = {0, 1};
    animate(g, 0, "translation", {0, 1}, {0, 0, 0, 1, 0, 0}, "VEC3");
    const Scene s = load(g, {0, 1});
    EXPECT_TRUE(s.lights.empty());
    EXPECT_TRUE(planOf(s).of(Effect::EmissiveMeshes).planned);
}

TEST(BadAnimation, IsAWarningOrAClearMessage) {
    GltfText none;
    animate(none, 0, "translation", {}, {}, "VEC3");
    const Scene s = load(none);
    ASSERT_EQ(s.report.warnings.size(), 1u);
    EXPECT_NE(s.report.warnings[0].find("no keys"), std::string::npos);
    EXPECT_NE(s.report.warnings[0].find("'square'"), std::string::npos);

    struct Case {
        const char* words;
        std::function<void(GltfText&)> change;
    };
    for (const Case& c : {
             Case{"refers to node 77",
                  [](GltfText& g) {
                      animate(g, 77, "translation", {0}, {0, 0, 0}, "VEC3");
                  }},
             Case{"ascend",
                  [](GltfText& g) {
                      animate(g, 0, "translation", {1, 0}, {0, 0, 0, 1, 0, 0}, "VEC3");
                  }},
             Case{"ascend",
                  [](GltfText& g) {
                      animate(g, 0, "translation", {std::nanf("")}, {0, 0, 0}, "VEC3");
                  }},
             Case{"expected 2 for 2 keys",
                  [](GltfText& g) {
                      animate(g, 0, "translation", {0, 1}, {0, 0, 0}, "VEC3");
                  }},
             Case{"not finite",
                  [](GltfText& g) {
                      animate(g, 0, "translation", {0}, {0, INFINITY, 0}, "VEC3");
                  }},
             Case{"sampler 9",
                  [](GltfText& g) {
                      animate(g, 0, "translation", {0}, {0, 0, 0}, "VEC3");
                      g.json["animations"][0]["channels"][0]["sampler"] = 9;
                  }},
             Case{"components",
                  [](GltfText& g) {
                      animate(g, 0, "rotation", {0}, {0, 0, 0}, "VEC3");
                  }},
         }) {
        GltfText g;
        c.change(g);
        EXPECT_NE(failure(g).find(c.words), std::string::npos) << failure(g);
    }
    GltfText weights;
    animate(weights, 0, "weights", {0, 1}, {0, 1}, "SCALAR");
    EXPECT_NE(load(weights).report.warnings.at(0).find("weights"), std::string::npos);
    GltfText flat;  // shrinks to nothing while the shutter is open
    animate(flat, 0, "scale", {0, 1}, {1, 1, 1, 0, 0, 0}, "VEC3");
    flat.json["nodes"].push_back({{"mesh", 0}, {"name", "still"}});
    flat.json["scenes"][0]["nodes"].push_back(3);
    const Scene rest = load(flat, {0, 1});
    EXPECT_NE(rest.report.warnings.at(0).find("without an inverse"), std::string::npos);
    EXPECT_EQ(rest.triangleCount(), 2u);
}

TEST(LoadMaterial, SheenAndVolume) {
    GltfText g;
    auto& e = g.json["materials"][0]["extensions"];
    e["KHR_materials_sheen"] = {{"sheenColorFactor", {0.5, 0.25, 2}}, {"sheenRoughnessFactor", 0.3}};
    e["KHR_materials_transmission"] = {{"transmissionFactor", 1}};
    e["KHR_materials_volume"] = {{"attenuationDistance", 2}, {"attenuationColor", {0.5, 1, 0}}};
    Scene s = load(g);
    EXPECT_EQ(s.materials[0].sheenColour, (Rgb{0.5f, 0.25f, 1}));
    EXPECT_EQ(s.sheenTables.size(), 1u);
    EXPECT_NEAR(s.materials[0].absorption.x, std::log(2) / 2, 1e-6);
    EXPECT_EQ(s.materials[0].absorption.y, 0);
    EXPECT_GT(s.materials[0].absorption.z, 5);  // black: nothing comes through, and nothing is infinite
    EXPECT_TRUE(std::isfinite(s.materials[0].absorption.z));
    EXPECT_TRUE(planOf(s).of(Effect::Absorption).planned);
    e["KHR_materials_volume"]["thicknessFactor"] = 0;  // thin: there is nothing inside
    EXPECT_FALSE(planOf(load(g)).of(Effect::Absorption).planned);
}

/// A PNG of one grey channel, its rows stored without compression.
std::vector<unsigned char> storedPng(std::uint32_t width, std::uint32_t height, unsigned char bits,
                                     const std::vector<unsigned char>& rows) {
    std::vector<unsigned char> out{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    const auto big = [](std::vector<unsigned char>& to, std::uint32_t v) {
        for (int shift = 24; shift >= 0; shift -= 8) to.push_back(static_cast<unsigned char>(v >> shift));
    };
    const auto chunk = [&](const char* name, std::vector<unsigned char> data) {
        big(out, static_cast<std::uint32_t>(data.size()));
        data.insert(data.begin(), name, name + 4);
        std::uint32_t crc = ~0u;
        for (const unsigned char byte : data) {
            crc ^= byte;
            for (int k = 0; k < 8; ++k) crc = (crc >> 1) ^ (crc & 1 ? 0xedb88320u : 0);
        }
        out.insert(out.end(), data.begin(), data.end());
        big(out, ~crc);
    };
    std::vector<unsigned char> header;
    big(header, width);
    big(header, height);
    header.insert(header.end(), {bits, 0, 0, 0, 0});
    chunk("IHDR", header);
    std::vector<unsigned char> data{0x78, 0x01, 0x01};
    const auto n = static_cast<unsigned int>(rows.size());
    for (const unsigned int v : {n & 255, n >> 8, ~n & 255, (~n >> 8) & 255})
        data.push_back(static_cast<unsigned char>(v));
    data.insert(data.end(), rows.begin(), rows.end());
    std::uint32_t a = 1, b = 0;
    for (const unsigned char byte : rows) {
        a = (a + byte) % 65521;
        b = (b + a) % 65521;
    }
    big(data, b << 16 | a);
    chunk("IDAT", data);
    chunk("IEND", {});
    return out;
}

TEST(BadTexture, SixteenBitsAreReadAndNoPixelsAreAnError) {
    GltfText g;
    // One row of a filter byte and two 16-bit pixels: 0x8000 and 0x0001.
    const int t = g.texture(storedPng(2, 1, 16, {0, 0x80, 0, 0, 1}));
    g.json["materials"][0]["pbrMetallicRoughness"]["metallicRoughnessTexture"] = {{"index", t}};
    const Scene s = load(g);
    EXPECT_NEAR(s.textures.at(0).lookup({0.25f, 0.5f}).rgb.y, 32768.0 / 65535, 1e-5);
    EXPECT_NEAR(s.textures.at(0).lookup({0.75f, 0.5f}).rgb.y, 1.0 / 65535, 1e-6);

    GltfText empty;
    const int none = empty.texture(storedPng(0, 0, 8, {}));
    empty.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {{"index", none}};
    EXPECT_NE(failure(empty).find("image 0"), std::string::npos) << failure(empty);
}

TEST(BadLight, WithoutPowerIsLeftOutOrTheSceneHasNone) {
    GltfText g;
    g.json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = 0;
    EXPECT_NE(failure(g).find("no light"), std::string::npos) << failure(g);
    g.json["extensions"]["KHR_lights_punctual"]["lights"].push_back({{"type", "point"}, {"intensity", 1}});
    g.json["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", 1}}}}}});
    g.json["scenes"][0]["nodes"].push_back(3);
    const Scene s = load(g);
    EXPECT_EQ(s.lights.size(), 1u);
    EXPECT_NE(s.report.warnings.at(0).find("no power"), std::string::npos);
}

TEST(Large, ManyInstancesOfAMesh) {
    GltfText g;
    constexpr int n = 20000;
    for (int i = 0; i < n; ++i) {
        g.json["nodes"].push_back({{"mesh", 0}, {"translation", {3 * (i % 200), 3 * (i / 200), -1}}});
        g.json["scenes"][0]["nodes"].push_back(3 + i);
    }
    Scene s = load(g);
    EXPECT_EQ(s.instances.size(), n + 1u);
    EXPECT_EQ(s.triangles.size(), 2u);
    EXPECT_TRUE(planOf(s).of(Effect::Diffuse).planned);
    const Accelerator accelerator(s);
    const auto hit = accelerator.intersect({{3 * 150 + 0.5f, 3 * 60 + 0.5f, 3}, {0, 0, -1}}, 0);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->instance, 1 + 60 * 200 + 150);
}

}  // namespace
}  // namespace vlx::render
