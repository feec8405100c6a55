#include "render/scene/scene_loader.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <iterator>
#include <limits>

#include "../base/temporary_folder.h"
#include "gltf_text.h"
#include "render/gltf/check/gltf_files.h"
#include "render/scene/accelerator.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"

namespace vlx::render {
namespace {

const TemporaryFolder& folder() {
    static const TemporaryFolder f;
    return f;
}

Scene load(const GltfText& g, const EnvironmentOptions& environment = {}) {
    writeText(folder() / "scene.gltf", g.text());
    return loadScene(folder() / "scene.gltf", environment);
}

/// The message with which loading fails.
std::string failure(const std::function<void(GltfText&)>& change) {
    GltfText g;
    change(g);
    try {
        load(g);
    } catch (const Error& e) {
        EXPECT_EQ(e.path(), folder() / "scene.gltf");
        return e.what();
    }
    return "no error";
}

void expectFailure(const std::string& words, const std::function<void(GltfText&)>& change) {
    const std::string message = failure(change);
    EXPECT_NE(message.find(words), std::string::npos) << "found: " << message;
}

/// A PNG file of the given 8-bit RGB pixels, as a program would write it.
std::vector<unsigned char> png(int width, int height, const std::vector<float>& rgb) {
    Image image({0, 0, width, height}, {"R", "G", "B"});
    image.pixels = rgb;
    writeImage(folder() / "texture.png", image);
    std::ifstream in(folder() / "texture.png", std::ios::binary);
    return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

TEST(LoadScene, ReadsTextAndBinaryAlike) {
    const GltfText g;
    const Scene text = load(g);
    writeText(folder() / "scene.glb", g.binary());
    const Scene binary = loadScene(folder() / "scene.glb");
    for (const Scene* s : {&text, &binary}) {
        EXPECT_EQ(s->triangleCount(), 2u);
        EXPECT_EQ(s->shapes.size(), 1u);
        ASSERT_EQ(s->cameras.size(), 1u);
        EXPECT_EQ(s->cameras[0].name, "eye");
        EXPECT_EQ(s->cameras[0].toWorld.m[2][3], 3);
        ASSERT_EQ(s->lights.size(), 1u);
        EXPECT_EQ(s->lights[0].intensity, (Rgb{5, 2.5f, 1.25f}));
        EXPECT_EQ(s->lights[0].position, (Vec3{0, 0, 2}));
        EXPECT_EQ(s->boundsMax, (Vec3{1, 1, 0}));
        EXPECT_TRUE(s->report.warnings.empty());
    }
}

TEST(LoadScene, NodeTransformsMultiplyDownTheTree) {
    GltfText g;
    g.json["nodes"][0]["translation"] = {0, 0, -1};
    g.json["nodes"][0]["scale"] = {2, 1, 1};
    g.json["nodes"].push_back({{"children", {0}},
                               {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}},
                               {"translation", {5, 0, 0}}});
    g.json["scenes"][0]["nodes"] = {3, 1, 2};
    const Scene s = load(g);
    // x doubled, then turned a quarter about z, then moved.
    EXPECT_NEAR(s.boundsMin.x, 4, 1e-5f);
    EXPECT_NEAR(s.boundsMax.y, 2, 1e-5f);
    EXPECT_NEAR(s.boundsMax.z, -1, 1e-5f);
    GltfText own;  // scale, rotation and translation of one node, in this order
    own.json["nodes"][0]["scale"] = {2, 1, 1};
    own.json["nodes"][0]["rotation"] = {0, 0, std::sqrt(0.5), std::sqrt(0.5)};
    own.json["nodes"][0]["translation"] = {5, 0, 0};
    const Scene turned = load(own);
    EXPECT_NEAR(turned.boundsMin.x, 4, 1e-5f);
    EXPECT_NEAR(turned.boundsMax.y, 2, 1e-5f);
    GltfText m;
    m.json["nodes"][0]["matrix"] = {1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1, 0, 7, 8, 9, 1};
    EXPECT_EQ(load(m).boundsMax, (Vec3{8, 11, 9}));
}

TEST(LoadScene, MirroredMeshesKeepTheirFront) {
    GltfText g;
    g.json["nodes"][0]["scale"] = {-1, 1, 1};
    const Scene s = load(g);
    const Accelerator accelerator(s);
    EXPECT_TRUE(accelerator.intersect({{0.2f, 0.1f, 3}, {0, 0, -1}}, 0).has_value());
    EXPECT_FALSE(accelerator.intersect({{0.2f, 0.1f, -3}, {0, 0, 1}}, 0).has_value());
}

TEST(LoadScene, MeshesUsedTwiceAreInstancedAndFoundWhereTheyAre) {
    GltfText g;
    g.json["nodes"].push_back({{"mesh", 0}, {"translation", {5, 0, 0}}, {"scale", {-2, 2, 2}}});
    g.json["scenes"][0]["nodes"] = {0, 1, 2, 3};
    const Scene s = load(g);
    EXPECT_EQ(s.worldShapes, 0u);
    EXPECT_EQ(s.instances.size(), 2u);
    EXPECT_EQ(s.triangleCount(), 4u);
    EXPECT_EQ(s.triangles.size(), 2u);
    EXPECT_EQ(s.boundsMax.x, 7);
    const Accelerator accelerator(s);
    const auto hit = accelerator.intersect({{6.5f, 1.5f, 3}, {0, 0, -1}}, 0);
    ASSERT_TRUE(hit);
    EXPECT_EQ(hit->instance, 1);
    const SurfacePoint p = surfaceAt(s, *hit, {0, 0, -1});
    EXPECT_NEAR(length(p.position - Vec3{6.5f, 1.5f, 0}), 0, 1e-5f);
    EXPECT_EQ(p.geometricNormal, (Vec3{0, 0, 1}));
    EXPECT_EQ(p.shadingNormal, (Vec3{0, 0, 1}));
    EXPECT_FALSE(p.fromBehind);
    EXPECT_FALSE(accelerator.intersect({{6.5f, 1.5f, -3}, {0, 0, 1}}, 0));
    EXPECT_FALSE(accelerator.intersect({{2, 0, 3}, {0, 0, -1}}, 0));
}

TEST(LoadScene, EmissiveMeshesBecomeLightsForEachUse) {
    GltfText g;
    g.json["materials"][0]["emissiveFactor"] = {1, 0.5, 0.25};
    g.json["materials"][0]["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"] = 8;
    g.json["nodes"].push_back({{"mesh", 0}, {"translation", {5, 0, 0}}});
    g.json["scenes"][0]["nodes"] = {0, 1, 3};
    const Scene s = load(g);
    EXPECT_TRUE(s.instances.empty());
    ASSERT_EQ(s.lights.size(), 2u);
    EXPECT_EQ(s.lights[0].type, LightType::Mesh);
    EXPECT_NEAR(s.lights[0].area, 4, 1e-5f);
    EXPECT_NEAR(s.lights[1].intensity.x, 8, 0.01f);
    EXPECT_EQ(s.lights[1].position, (Vec3{5, 0, 0}));
    EXPECT_EQ(s.shapes[1].light, 1);
}

TEST(LoadScene, MaterialsAndTheirExtensions) {
    GltfText g;
    g.json["materials"][0] = nlohmann::json::parse(R"({
        "alphaMode": "MASK", "alphaCutoff": 0.25, "doubleSided": true,
        "pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 0.4], "metallicFactor": 0.5,
                                 "roughnessFactor": 0.6},
        "extensions": {
            "KHR_materials_ior": {"ior": 1.33},
            "KHR_materials_specular": {"specularFactor": 0.7, "specularColorFactor": [1, 2, 3]},
            "KHR_materials_transmission": {"transmissionFactor": 0.8},
            "KHR_materials_clearcoat": {"clearcoatFactor": 0.9, "clearcoatRoughnessFactor": 0.11}}})");
    const Scene s = load(g);
    const Material& m = s.materials[0];
    EXPECT_EQ(m.baseColour, (Rgb{0.1f, 0.2f, 0.3f}));
    EXPECT_EQ(m.opacity, 0.4f);
    EXPECT_EQ(m.alphaMode, AlphaMode::Mask);
    EXPECT_EQ(m.alphaCutoff, 0.25f);
    EXPECT_TRUE(m.doubleSided);
    EXPECT_EQ(m.metallic, 0.5f);
    EXPECT_EQ(m.roughness, 0.6f);
    EXPECT_EQ(m.ior, 1.33f);
    EXPECT_EQ(m.specular, 0.7f);
    EXPECT_EQ(m.specularColour, (Rgb{1, 2, 3}));
    EXPECT_EQ(m.transmission, 0.8f);
    EXPECT_EQ(m.clearcoat, 0.9f);
    EXPECT_EQ(m.clearcoatRoughness, 0.11f);
    EXPECT_EQ(s.glassTables.size(), 1u);
    // The specification's default material: white, metallic 1, roughness 1.
    EXPECT_EQ(s.materials.back().metallic, 1);
    EXPECT_FALSE(s.materials.back().doubleSided);
}

TEST(LoadScene, TexturesAreDecodedWrappedAndTransformed) {
    GltfText g;
    // 2 x 1 texels: sRGB 0.5 grey, and red.
    const int texture = g.texture(png(2, 1, {128 / 255.f, 128 / 255.f, 128 / 255.f, 1, 0, 0}));
    g.json["samplers"].push_back({{"wrapS", 33071}, {"wrapT", 33648}, {"magFilter", 9728}});
    g.json["textures"][0]["sampler"] = 0;
    auto& info = g.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"];
    info["index"] = texture;
    info["extensions"]["KHR_texture_transform"] = {{"offset", {0.25, 0}}, {"scale", {0.5, 1}}};
    const Scene s = load(g);
    const TextureRef& ref = s.materials[0].baseColourTexture;
    ASSERT_EQ(s.textures.size(), 1u);
    const Texture& t = s.textures[0];
    EXPECT_TRUE(t.nearest);
    EXPECT_EQ(t.wrapU, Wrap::Clamp);
    EXPECT_EQ(t.wrapV, Wrap::Mirror);
    EXPECT_NEAR(t.lookup({0.2f, 0.5f}).rgb.x, 0.2158605f, 1e-5f);
    EXPECT_NEAR(t.lookup({7, 0.5f}).rgb.y, 0, 1e-6f);
    EXPECT_NEAR(t.lookup({-7, 0.5f}).rgb.y, 0.2158605f, 1e-5f);
    const Vec2 uv = ref.map({0.8f, 0.3f});
    EXPECT_NEAR(uv.x, 0.65f, 1e-6f);
    EXPECT_NEAR(uv.y, 0.3f, 1e-6f);
}

TEST(Texture, BilinearBetweenTexelCentresAndRepeating) {
    Texture t(2, 2, std::vector<float>{0, 0, 0, 1, 1, 0, 0, 1, 2, 0, 0, 1, 3, 0, 0, 1}, ColourSpace::Linear);
    EXPECT_FLOAT_EQ(t.lookup({0.25f, 0.25f}).rgb.x, 0);
    EXPECT_FLOAT_EQ(t.lookup({0.75f, 0.25f}).rgb.x, 1);
    EXPECT_FLOAT_EQ(t.lookup({0.5f, 0.5f}).rgb.x, 1.5f);
    EXPECT_FLOAT_EQ(t.lookup({0, 0.25f}).rgb.x, 0.5f);  // half of texel 1, around the corner
    EXPECT_FLOAT_EQ(t.lookup({1.25f, -0.75f}).rgb.x, 0);
    t.wrapU = Wrap::Mirror;
    EXPECT_FLOAT_EQ(t.lookup({0, 0.25f}).rgb.x, 0);
    EXPECT_FLOAT_EQ(t.lookup({1.25f, 0.25f}).rgb.x, 1);
    for (const float wild :
         {1e30f, -1e30f, std::numeric_limits<float>::infinity(), std::numeric_limits<float>::quiet_NaN()})
        EXPECT_TRUE(std::isfinite(t.lookup({wild, wild}).rgb.x));
}

TEST(LoadScene, NormalMapsTiltTheNormal) {
    for (const bool tangents : {false, true}) {
        GltfText g;
        // (1, 0.5, 0.5) decodes to +x of the tangent frame; green to up, against v.
        const int texture = g.texture(png(1, 1, {0.5f, 1, 0.5f}));
        g.json["materials"][0]["normalTexture"]["index"] = texture;
        if (tangents) {
            const int a = g.floats({1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1}, "VEC4");
            g.json["meshes"][0]["primitives"][0]["attributes"]["TANGENT"] = a;
        }
        const Scene s = load(g);
        const Accelerator accelerator(s);
        const Vec3 down = normalized(Vec3{0, 0.5f, -1});
        const auto hit = accelerator.intersect({{0.3f, -0.3f, 1}, down}, 0);
        ASSERT_TRUE(hit);
        const SurfacePoint p = surfaceAt(s, *hit, {0, -0.7f, -0.7f});
        EXPECT_GT(p.shadingNormal.y, 0.98f) << tangents;
        EXPECT_EQ(p.geometricNormal, (Vec3{0, 0, 1}));
    }
}

TEST(LoadScene, VertexColoursMultiplyTheBaseColour) {
    GltfText g;
    const int a = g.floats({1, 0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0}, "VEC3");
    g.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] = a;
    const Scene s = load(g);
    const Accelerator accelerator(s);
    const auto hit = accelerator.intersect({{0.3f, -0.3f, 1}, {0, 0, -1}}, 0);
    ASSERT_TRUE(hit);
    EXPECT_EQ(surfaceParameters(s, surfaceAt(s, *hit, {0, 0, -1})).baseColour, (Rgb{1, 0, 0}));
}

TEST(LoadScene, QuantisedAndSparseAccessors) {
    GltfText g;
    const int view = g.view(std::vector<std::int16_t>{-32767, -32767, 0, 0, 32767, -32767, 0, 0, 32767, 32767,
                                                      0, 0, -32767, 32767, 0, 0});
    g.json["bufferViews"][static_cast<std::size_t>(view)]["byteStride"] = 8;
    g.json["accessors"][0] = {
        {"bufferView", view}, {"componentType", 5122}, {"count", 4}, {"type", "VEC3"}, {"normalized", true}};
    const int where = g.view(std::vector<std::uint16_t>{2});
    const int with = g.view(std::vector<std::int16_t>{32767, 32767, 32767});
    g.json["accessors"][0]["sparse"] = {{"count", 1},
                                        {"indices", {{"bufferView", where}, {"componentType", 5123}}},
                                        {"values", {{"bufferView", with}}}};
    const Scene s = load(g);
    EXPECT_EQ(s.boundsMin, (Vec3{-1, -1, 0}));
    EXPECT_EQ(s.boundsMax, (Vec3{1, 1, 1}));
}

TEST(LoadScene, StripsAndFansAreTakenApart) {
    for (const int mode : {5, 6}) {
        GltfText g;
        g.json["accessors"][2] = g.json["accessors"][0];
        auto& primitive = g.json["meshes"][0]["primitives"][0];
        primitive.erase("indices");
        primitive["mode"] = mode;
        if (mode == 5) {  // corners in the order of a strip
            g.poke(6, -1);
            g.poke(9, 1);
        }
        const Scene s = load(g);
        EXPECT_EQ(s.triangleCount(), 2u);
        const Accelerator accelerator(s);
        for (const Vec3& p : {Vec3{0.5f, -0.6f, 1}, Vec3{-0.6f, 0.5f, 1}})
            EXPECT_TRUE(accelerator.intersect({p, {0, 0, -1}}, 0)) << mode;
    }
}

TEST(LoadScene, CamerasAndTheirExtras) {
    GltfText g;
    g.json["cameras"].push_back(
        {{"type", "perspective"}, {"perspective", {{"yfov", 1.0}, {"znear", 0.1}, {"aspectRatio", 1.5}}}});
    g.json["cameras"].push_back(
        {{"type", "orthographic"},
         {"orthographic", {{"xmag", 3}, {"ymag", 1.5}, {"zfar", 9}, {"znear", 0.1}}}});
    g.json["nodes"].push_back({{"camera", 1},
                               {"name", "second"},
                               {"scale", {3, 3, 3}},
                               {"extras", {{"lens_radius", 0.1}, {"focus_distance", 2.5}, {"active", 1}}}});
    g.json["nodes"].push_back({{"camera", 2}, {"name", "flat"}});
    g.json["scenes"][0]["nodes"] = {0, 1, 2, 3, 4};
    const Scene s = load(g);
    ASSERT_EQ(s.cameras.size(), 3u);
    EXPECT_EQ(s.activeCamera, 1u);
    EXPECT_EQ(s.cameras[1].lensRadius, 0.1f);
    EXPECT_EQ(s.cameras[1].focusDistance, 2.5f);
    EXPECT_EQ(s.cameras[1].aspect, 1.5f);
    EXPECT_NEAR(s.cameras[1].toWorld.determinant(), 1, 1e-9);
    EXPECT_EQ(s.cameras[1].orthographicHeight, 0);
    EXPECT_EQ(s.cameras[2].unusable, "");
    EXPECT_EQ(s.cameras[2].orthographicHeight, 3);
    EXPECT_EQ(s.cameras[2].aspect, 2);
}

TEST(LoadScene, SpotDirectionalAndSphereLights) {
    GltfText g;
    auto& lights = g.json["extensions"]["KHR_lights_punctual"]["lights"];
    lights[0]["type"] = "spot";
    lights[0]["spot"] = {{"innerConeAngle", 0.1}, {"outerConeAngle", 0.5}};
    lights.push_back({{"type", "directional"}, {"intensity", 3}});
    lights.push_back({{"type", "point"}, {"intensity", 0}});
    const auto node = [](int light) {
        return nlohmann::json{{"extensions", {{"KHR_lights_punctual", {{"light", light}}}}}};
    };
    g.json["nodes"].push_back(node(1));
    g.json["nodes"][3]["rotation"] = {-std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // -z to -y
    g.json["nodes"].push_back(node(2));
    g.json["nodes"].push_back(node(0));
    g.json["nodes"][5]["extras"]["radius"] = 0.25;
    g.json["scenes"][0]["nodes"] = {0, 1, 2, 3, 4, 5};
    const Scene s = load(g);
    ASSERT_EQ(s.lights.size(), 3u);
    EXPECT_EQ(s.lights[0].type, LightType::Spot);
    EXPECT_NEAR(s.lights[0].cone({0, 0, -1}), 1, 1e-6f);
    EXPECT_EQ(s.lights[0].cone(normalized(Vec3{0.6f, 0, -1})), 0);
    EXPECT_EQ(s.lights[1].type, LightType::Directional);
    EXPECT_NEAR(s.lights[1].direction.y, -1, 1e-6f);
    EXPECT_EQ(s.lights[2].type, LightType::Sphere);
    EXPECT_EQ(s.lights[2].radius, 0.25f);
    EXPECT_EQ(s.report.warnings.size(), 1u);  // the light without power
}

/// A scene of another program, with lights of these intensities.
GltfText exported(const std::string& generator, const std::vector<std::pair<std::string, double>>& lights) {
    GltfText g;
    g.json["asset"]["generator"] = generator;
    g.json["scenes"][0].erase("extras");
    auto& list = g.json["extensions"]["KHR_lights_punctual"]["lights"];
    list = nlohmann::json::array();
    g.json["nodes"].erase(2);
    for (const auto& [type, intensity] : lights) {
        g.json["nodes"].push_back({{"extensions", {{"KHR_lights_punctual", {{"light", list.size()}}}}}});
        g.json["scenes"][0]["nodes"] = {0, 1};
        list.push_back({{"type", type}, {"intensity", intensity}});
    }
    for (std::size_t i = 2; i < g.json["nodes"].size(); ++i) g.json["scenes"][0]["nodes"].push_back(i);
    return g;
}

TEST(LightUnits, AreJudgedByTheFile) {
    constexpr double kSphere = 4 * 3.14159265358979323846;
    const auto expect = [](const GltfText& g, float intensity, const std::string& told) {
        const Scene s = load(g);
        EXPECT_EQ(s.lights.at(0).intensity.x, intensity) << told;
        ASSERT_EQ(s.report.notes.size(), told.empty() ? 0 : 1) << told;
        if (told.empty()) return;
        EXPECT_NE(s.report.notes[0].find(told), std::string::npos) << s.report.notes[0];
        EXPECT_NE(s.report.notes[0].find("--light-units"), std::string::npos) << s.report.notes[0];
    };
    const std::string blender = "Khronos glTF Blender I/O v3.4.50";
    // Watts of 32 bits, as Blender has them.
    const double watts = 0.7f;
    expect(exported("", {{"point", 683}}), 1, "photometric, in candela");
    expect(exported("three.js", {{"directional", 3}}), static_cast<float>(3 / 683.0),
           "photometric, in candela");
    expect(exported(blender, {{"point", watts / kSphere}}), static_cast<float>(watts / kSphere),
           "radiometric");
    expect(exported(blender, {{"point", 683 * watts / kSphere}}), static_cast<float>(watts / kSphere),
           "photometric, and divided");
    expect(exported(blender, {{"directional", watts}}), static_cast<float>(watts), "radiometric");
    expect(exported(blender, {{"directional", 683 * watts}}), static_cast<float>(watts),
           "photometric, and divided");
    // Neither, or both: what the extension says.
    expect(exported(blender, {{"point", 0.123456789012}}), static_cast<float>(0.123456789012 / 683),
           "nothing shows");
    expect(exported(blender, {{"point", watts / kSphere}, {"directional", 683 * watts}}),
           static_cast<float>(watts / kSphere / 683), "nothing shows");
    // What the file says of itself.
    GltfText g = exported(blender, {{"point", 683}});
    g.json["scenes"][0]["extras"]["light_units"] = "photometric";
    expect(g, 1, "");
    g.json["scenes"][0]["extras"]["light_units"] = "radiometric";
    expect(g, 683, "");
    g.json["scenes"][0]["extras"] = {{"env_constant", {1, 1, 1}}};
    expect(g, 683, "");
    g.json["scenes"][0].erase("extras");
    g.json["nodes"][1]["extras"]["lens_radius"] = 0;
    expect(g, 683, "");
    g.json["scenes"][0]["extras"]["light_units"] = "candela";
    EXPECT_THROW(load(g), Error);
}

TEST(LightUnits, OfTheCommandLineDecide) {
    writeText(folder() / "scene.gltf", exported("", {{"point", 683}}).text());
    const auto with = [](LightUnits units) {
        return loadScene(folder() / "scene.gltf", {}, {}, {.lightUnits = units});
    };
    const Scene radiometric = with(LightUnits::Radiometric), photometric = with(LightUnits::Photometric);
    EXPECT_EQ(radiometric.lights[0].intensity.x, 683);
    EXPECT_EQ(photometric.lights[0].intensity.x, 1);
    EXPECT_TRUE(radiometric.report.notes.empty());
    EXPECT_EQ(photometric.report.lightUnits, LightUnits::Photometric);
}

/// Blender's spot of half the angle 0.5 and blend 0.3: by the smooth step of the cosine, up to version 3
/// times the cosine.
TEST(Spots, FadeAsTheFilesProgramMeansThem) {
    const double outer = 0.5, inner = 0.5 * (1 - 0.3);
    for (const auto& [generator, version] : {std::pair{"Khronos glTF Blender I/O v3.6.28", 3},
                                             {"Khronos glTF Blender I/O v4.1.62", 4},
                                             {"", 0}}) {
        GltfText g = exported(generator, {{"spot", 1}});
        g.json["extensions"]["KHR_lights_punctual"]["lights"][0]["spot"] = {{"innerConeAngle", inner},
                                                                            {"outerConeAngle", outer}};
        const Scene s = load(g);
        for (const double angle : {0.0, 0.2, 0.36, 0.4, 0.42, 0.45, 0.49, 0.51}) {
            const double cosine = std::cos(angle), edge = std::cos(outer);
            double expected = std::clamp((cosine - edge) / (std::cos(inner) - edge), 0.0, 1.0);
            expected *= expected;
            if (version > 0) {
                const double t = std::clamp((cosine - edge) / ((1 - edge) * 0.3), 0.0, 1.0);
                expected = t * t * (3 - 2 * t) * (version < 4 ? cosine : 1);
            }
            const Vec3 away{static_cast<float>(std::sin(angle)), 0, static_cast<float>(-cosine)};
            EXPECT_NEAR(s.lights[0].cone(away), expected, 2e-5) << generator << " " << angle;
        }
        EXPECT_EQ(s.materials[0].retro, version == 3);
    }
}

TEST(LoadScene, EnvironmentFromExtrasOptionsAndImages) {
    GltfText g;
    g.json["scenes"][0]["extras"]["env_constant"] = {0.1, 0.2, 0.3};
    EXPECT_EQ(load(g).environment.radiance({0, 1, 0}), (Rgb{0.1f, 0.2f, 0.3f}));
    EnvironmentOptions options;
    options.constant = Rgb{4, 5, 6};
    const Scene s = load(g, options);
    EXPECT_EQ(s.environment.radiance({0, 1, 0}), (Rgb{4, 5, 6}));
    EXPECT_EQ(s.lights.back().type, LightType::Environment);
    Image image({0, 0, 4, 2}, {"R", "G", "B"});
    image.pixels.assign(24, 0.5f);
    writeImage(folder() / "sky.exr", image);
    options.constant.reset();
    options.image = folder() / "sky.exr";
    EXPECT_EQ(load(g, options).environment.radiance({1, 0, 0}), Rgb(0.5f));
    image.pixels[7] = std::numeric_limits<float>::quiet_NaN();
    writeImage(folder() / "sky.exr", image);
    EXPECT_THROW(load(g, options), Error);
    options.image = folder() / "missing.exr";
    EXPECT_THROW(load(g, options), Error);
}

TEST(GltfFiles, AreTheFileAndWhatItNames) {
    const TemporaryFolder place;
    const std::string path = place / "a.gltf";
    std::ofstream(path) << R"({"buffers":[{"uri":"b%20c.bin"},{"uri":"data:;base64,AA=="},{}],
        "images":[{"uri":"textures/wood.png"},{"bufferView":0}]})";
    EXPECT_EQ(gltfFiles(path),
              (std::vector<std::string>{path, place / "b c.bin", place / "textures/wood.png"}));
    std::ofstream(path) << "{ no glTF";
    EXPECT_EQ(gltfFiles(path), std::vector<std::string>{path});
    EXPECT_EQ(gltfFiles(VLX_TESTDATA "/scenes/interior.glb").size(), 1u);
}

TEST(LoadScene, DropsAndCountsTrianglesWithoutArea) {
    GltfText g;
    const int indices = g.indices({0, 1, 2, 0, 0, 1, 3, 3, 3, 0, 2, 3});
    g.json["meshes"][0]["primitives"][0]["indices"] = indices;
    const Scene s = load(g);
    EXPECT_EQ(s.triangleCount(), 2u);
    EXPECT_EQ(s.report.degenerateTriangles, 2u);
    GltfText flat;
    flat.json["nodes"][0]["scale"] = {1, 0, 1};
    flat.json["nodes"].push_back({{"mesh", 0}, {"translation", {0, 0, -1}}});
    flat.json["scenes"][0]["nodes"] = {0, 1, 2, 3};
    const Scene t = load(flat);
    EXPECT_EQ(t.triangleCount(), 2u);
    EXPECT_EQ(t.report.warnings.size(), 1u);
}

TEST(LoadScene, SaysWhatItLeavesOut) {
    GltfText g;
    g.json["extensionsUsed"].push_back("VENDOR_sparkle");
    g.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 0}});
    const Scene s = load(g);
    ASSERT_EQ(s.report.warnings.size(), 2u);
    EXPECT_NE(s.report.warnings[0].find("VENDOR_sparkle"), std::string::npos);
    EXPECT_NE(s.report.warnings[1].find("points"), std::string::npos);
}

TEST(BadScene, FilesThatAreNone) {
    EXPECT_THROW(loadScene(folder() / "missing.glb"), Error);
    for (const std::string text :
         {"", "hello", "{}", "glTF", "glTF\2\0\0\0\xff\xff\xff\x7f", "{\"asset\":"}) {
        writeText(folder() / "bad.gltf", text);
        EXPECT_THROW(loadScene(folder() / "bad.gltf"), Error) << text;
    }
}

// Whatever else the file holds: in text and binary, with a camera that stands and one that moves.
TEST(LoadCameras, ReadsOnlyWhatTheyNeed) {
    const std::pair<const char*, std::function<void(GltfText&)>> broken[] = {
        {"nothing", [](GltfText&) {}},
        {"texture of no image",
         [](GltfText& g) {
             g.json["textures"] = {{{"source", 7}}};
         }},
        {"image that is none",
         [](GltfText& g) {
             g.texture({1, 2, 3});
         }},
        {"required Draco geometry",
         [](GltfText& g) {
             g.json["extensionsRequired"] = {"KHR_draco_mesh_compression"};
             g.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"] = {
                 {"bufferView", 0}, {"attributes", {{"POSITION", 0}}}};
         }},
        {"mesh that is not there", [](GltfText& g) { g.json["nodes"][0]["mesh"] = 4; }},
        {"light that is not there", [](GltfText& g) { g.json.erase("extensions"); }},
        {"animation of the mesh without accessors", [](GltfText& g) {
             g.json["animations"].push_back(
                 {{"samplers", {{{"input", 90}, {"output", 91}}}},
                  {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "scale"}}}}}}});
         }}};
    for (const bool moves : {false, true})
        for (const auto& [what, breakIt] : broken) {
            GltfText g;
            g.json["nodes"].push_back({{"children", {1}}, {"name", "dolly"}});
            g.json["scenes"][0]["nodes"] = {0, 2, 3};
            if (moves) {
                const int times = g.floats({0, 1}, "SCALAR"), places = g.floats({0, 0, 0, 8, 0, 0}, "VEC3");
                g.json["animations"].push_back(
                    {{"samplers", {{{"input", times}, {"output", places}}}},
                     {"channels", {{{"sampler", 0}, {"target", {{"node", 3}, {"path", "translation"}}}}}}});
            }
            breakIt(g);
            writeText(folder() / "cameras.gltf", g.text());
            writeText(folder() / "cameras.glb", g.binary());
            for (const char* name : {"cameras.gltf", "cameras.glb"}) {
                const Scene s = loadCameras(folder() / name, {0.5, 0.5});
                ASSERT_EQ(s.cameras.size(), 1u) << what << name;
                EXPECT_EQ(s.cameras[0].name, "eye") << what << name;
                EXPECT_EQ(s.cameras[0].unusable, "") << what << name;
                EXPECT_NEAR(s.cameras[0].toWorld.m[0][3], moves ? 4 : 0, 1e-6) << what << name;
                EXPECT_TRUE(s.report.warnings.empty()) << what << name;
            }
        }
    // Of a binary file that ends after its JSON there is enough.
    writeText(folder() / "cut.glb", GltfText().binary().substr(0, GltfText().binary().size() - 20));
    EXPECT_EQ(loadCameras(folder() / "cut.glb").cameras.size(), 1u);
    // A buffer that is missing is none of theirs, unless they move by it.
    GltfText g;
    g.json["buffers"] = {{{"byteLength", 100}, {"uri", "missing.bin"}}};
    writeText(folder() / "cameras.gltf", g.text());
    EXPECT_EQ(loadCameras(folder() / "cameras.gltf").cameras.size(), 1u);
    for (const char* text : {"", "{", "[]", "glTF"}) {
        writeText(folder() / "cameras.gltf", text);
        EXPECT_THROW(loadCameras(folder() / "cameras.gltf"), Error) << text;
    }
    EXPECT_THROW(loadCameras(folder() / "missing.gltf"), Error);
}

TEST(BadScene, EveryTruncationOfABinaryFileIsAnError) {
    const std::string whole = GltfText().binary();
    for (std::size_t size = 0; size < whole.size(); size += 7) {
        writeText(folder() / "cut.glb", whole.substr(0, size));
        EXPECT_THROW(loadScene(folder() / "cut.glb"), Error) << size;
    }
}

TEST(BadScene, ReferencesOutOfRange) {
    expectFailure("accessor 77",
                  [](GltfText& g) { g.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 77; });
    expectFailure("bufferView 55", [](GltfText& g) { g.json["accessors"][0]["bufferView"] = 55; });
    expectFailure("buffer 9", [](GltfText& g) { g.json["bufferViews"][0]["buffer"] = 9; });
    expectFailure("material 4", [](GltfText& g) { g.json["meshes"][0]["primitives"][0]["material"] = 4; });
    expectFailure("mesh 3", [](GltfText& g) { g.json["nodes"][0]["mesh"] = 3; });
    expectFailure("camera 3", [](GltfText& g) { g.json["nodes"][1]["camera"] = 3; });
    expectFailure("light 3",
                  [](GltfText& g) { g.json["nodes"][2]["extensions"]["KHR_lights_punctual"]["light"] = 3; });
    expectFailure("node 12", [](GltfText& g) { g.json["scenes"][0]["nodes"].push_back(12); });
    expectFailure("scene 5", [](GltfText& g) { g.json["scene"] = 5; });
    expectFailure("texture 6", [](GltfText& g) { g.json["materials"][0]["normalTexture"]["index"] = 6; });
    expectFailure("index 1 is 99", [](GltfText& g) {
        g.json["meshes"][0]["primitives"][0]["indices"] = g.indices({0, 99, 2});
    });
}

TEST(BadScene, DataThatIsTooShort) {
    expectFailure("needs 400 elements", [](GltfText& g) { g.json["accessors"][0]["count"] = 400; });
    expectFailure("needs", [](GltfText& g) { g.json["accessors"][0]["byteOffset"] = 40; });
    expectFailure("needs", [](GltfText& g) { g.json["accessors"][0]["byteOffset"] = 4000000000u; });
    expectFailure("its buffer has", [](GltfText& g) { g.json["bufferViews"][0]["byteLength"] = 100000; });
    expectFailure("no POSITION",
                  [](GltfText& g) { g.json["meshes"][0]["primitives"][0]["attributes"].erase("POSITION"); });
    expectFailure("has 3 elements", [](GltfText& g) { g.json["accessors"][1]["count"] = 3; });
    expectFailure("components", [](GltfText& g) { g.json["accessors"][0]["type"] = "VEC2"; });
    expectFailure("unsigned integers", [](GltfText& g) { g.json["accessors"][2]["componentType"] = 5126; });
}

TEST(BadScene, MissingBuffersAndImages) {
    EXPECT_NE(failure([](GltfText& g) {
                  g.json["buffers"].push_back({{"byteLength", 100}, {"uri", "nowhere.bin"}});
              }),
              "no error");
    expectFailure("nowhere.png", [](GltfText& g) {
        g.json["images"].push_back({{"uri", "nowhere.png"}});
        g.json["textures"].push_back({{"source", 0}});
        g.json["materials"][0]["normalTexture"]["index"] = 0;
    });
    expectFailure("neither PNG nor JPEG", [](GltfText& g) {
        g.json["materials"][0]["normalTexture"]["index"] = g.texture({1, 2, 3, 4, 5, 6, 7, 8});
    });
    // Not a broken PNG: OpenImageIO 2.4 leaks a string there (libpng leaves by longjmp).
    expectFailure("cannot be decoded", [](GltfText& g) {
        g.json["materials"][0]["normalTexture"]["index"] = g.texture({0xff, 0xd8, 0xff, 0xe0, 0, 1, 2, 3});
    });
}

TEST(BadScene, NumbersThatAreNone) {
    expectFailure("vertex 1 is not finite",
                  [](GltfText& g) { g.poke(4, std::numeric_limits<float>::quiet_NaN()); });
    expectFailure("vertex 0 is not finite",
                  [](GltfText& g) { g.poke(0, std::numeric_limits<float>::infinity()); });
    expectFailure("no quaternion", [](GltfText& g) { g.json["nodes"][0]["rotation"] = {0, 0, 0, 0}; });
    expectFailure(
        "ior", [](GltfText& g) { g.json["materials"][0]["extensions"]["KHR_materials_ior"]["ior"] = 0.5; });
    expectFailure("intensity", [](GltfText& g) {
        g.json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = -1;
    });
}

TEST(BadScene, NothingToSeeOrSeeBy) {
    expectFailure("no light", [](GltfText& g) { g.json["scenes"][0]["nodes"] = {0, 1}; });
    expectFailure("no triangles", [](GltfText& g) { g.json["scenes"][0]["nodes"] = {1, 2}; });
    expectFailure("node 0 'square' is below itself: it is a child of its own",
                  [](GltfText& g) { g.json["nodes"][0]["children"] = {0}; });
    expectFailure("more than one parent", [](GltfText& g) { g.json["nodes"][1]["children"] = {0}; });
    expectFailure("KHR_texture_basisu",
                  [](GltfText& g) { g.json["extensionsRequired"] = {"KHR_texture_basisu"}; });
}

TEST(LoadScene, NeedsNoCameraButSaysWhyThereIsNone) {
    GltfText g;
    g.json["scenes"][0]["nodes"] = {0, 2};
    EXPECT_NE(load(g).cameraFault.find("has no camera in its scene 0"), std::string::npos);
    g.json["nodes"][1].erase("camera");
    EXPECT_EQ(load(g).cameraFault, "has no camera");
    EXPECT_EQ(load(GltfText()).cameraFault, "");
}

/// Every byte of the JSON part damaged in turn: an error or a scene, never a crash.
TEST(BadScene, DamagedTextIsAnErrorOrAScene) {
    const std::string good = GltfText().text();
#ifdef VARIOLUX_SANITIZED
    const std::size_t step = 67;
#else
    const std::size_t step = 11;
#endif
    for (std::size_t i = 0; i < good.size(); i += step) {
        for (const char c : {'0', '9', '-', '}'}) {
            std::string bad = good;
            bad[i] = c;
            writeText(folder() / "damaged.gltf", bad);
            try {
                loadScene(folder() / "damaged.gltf");
            } catch (const Error&) {
            }
        }
    }
}

}  // namespace
}  // namespace vlx::render
