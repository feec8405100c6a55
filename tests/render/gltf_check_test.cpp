#include <gtest/gtest.h>

#include <cctype>
#include <optional>

#include "../base/temporary_folder.h"
#include "gltf_text.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/error.h"

/// Scenes of which a reader would take something in silence, or speak of something else.
namespace vlx::render {
namespace {

using nlohmann::json;

Scene load(const json& scene, const GltfText& g = {}) {
    static const TemporaryFolder folder;
    GltfText changed = g;
    changed.json = scene;
    writeText(folder / "scene.gltf", changed.text());
    return loadScene(folder / "scene.gltf");
}

std::string failure(const json& scene, const GltfText& g = {}) {
    try {
        load(scene, g);
    } catch (const Error& e) {
        return e.what();
    }
    return "no error";
}

/// The square with a textured material.
GltfText textured() {
    GltfText g;
    const int texture = g.texture({0x89, 'P', 'N', 'G'});
    g.json["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"]["index"] = texture;
    return g;
}

void expectFailureWith(const std::vector<std::string>& words, const json& scene, const GltfText& g = {}) {
    const std::string message = failure(scene, g);
    for (const std::string& word : words)
        EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
}

TEST(RequiredExtensions, AreRefusedFirstByNameAndWithARemedy) {
    for (const auto& [name, remedy] : {std::pair{"KHR_meshopt_compression", "gltf-transform copy"},
                                       {"KHR_texture_basisu", "ktxdecompress"},
                                       {"EXT_texture_avif", "gltf-transform png"},
                                       {"VENDOR_sparkle", "without"}}) {
        // Of all the faults of the file.
        GltfText g;
        g.json["extensionsRequired"] = {"KHR_lights_punctual", name};
        g.json["buffers"].push_back({{"byteLength", 60}, {"uri", "nowhere.bin"}});
        g.json["accessors"][0].erase("bufferView");
        g.json["meshes"][0]["primitives"][0]["indices"] = 77;
        g.json["scene"] = "first";
        expectFailureWith({std::string("requires the extension ") + name, remedy}, g.json, g);
    }
    GltfText g;
    g.json["extensionsRequired"] = {"KHR_meshopt_compression", "KHR_texture_basisu"};
    expectFailureWith({"KHR_meshopt_compression, KHR_texture_basisu", "copy", "ktxdecompress"}, g.json);
    g.json["extensionsRequired"] = {7};
    expectFailureWith({"extensionsRequired", "7"}, g.json);
    g.json["extensionsRequired"] = "KHR_texture_basisu";
    expectFailureWith({"extensionsRequired", "array", "KHR_texture_basisu"}, g.json);
}

TEST(CompressedData, ThatHasNoPlainFormIsRefusedByName) {
    GltfText m;
    m.json["buffers"].push_back(
        {{"byteLength", 60}, {"extensions", {{"KHR_meshopt_compression", {{"fallback", true}}}}}});
    expectFailureWith({"KHR_meshopt_compression", "gltf-transform copy"}, m.json, m);
}

TEST(CompressedData, ThatHasAPlainFormIsReadFromThere) {
    GltfText g;
    g.json["meshes"][0]["primitives"][0]["extensions"]["KHR_draco_mesh_compression"]["bufferView"] = 0;
    g.json["extensionsUsed"].push_back("KHR_draco_mesh_compression");
    EXPECT_EQ(load(g.json, g).triangleCount(), 2u);
}

TEST(Textures, WithoutASourceNameTheExtensionThatHasIt) {
    for (const char* extension : {"KHR_texture_basisu", "EXT_texture_avif"}) {
        GltfText g = textured();
        g.json["textures"][0] = {{"extensions", {{extension, {{"source", 0}}}}}};
        expectFailureWith({"texture 0", "no source", extension, "gltf-transform"}, g.json, g);
    }
    GltfText g = textured();
    g.json["textures"][0] = json::object();
    expectFailureWith({"texture 0", "no source"}, g.json, g);
}

/// Every reference by number: below 0, beyond what is there, no number at all.
TEST(References, OfAnyKindAreCheckedEverywhere) {
    GltfText g = textured();
    json& j = g.json;
    j["samplers"] = {json::object()};
    j["textures"][0]["sampler"] = 0;
    j["skins"] = {{{"joints", {0}}, {"inverseBindMatrices", 0}, {"skeleton", 0}}};
    j["nodes"][0]["skin"] = 0;
    j["nodes"][0]["children"] = {2};
    j["scenes"][0]["nodes"] = {0, 1};
    j["animations"] = {{{"samplers", {{{"input", 0}, {"output", 0}}}},
                        {"channels", {{{"sampler", 0}, {"target", {{"node", 0}, {"path", "weights"}}}}}}}};
    j["meshes"][0]["primitives"][0]["targets"] = {{{"POSITION", 0}}};
    j["materials"][0]["extensions"]["KHR_materials_clearcoat"]["clearcoatTexture"]["index"] = 0;
    j["accessors"][0]["sparse"] = {{"count", 0},
                                   {"indices", {{"bufferView", 0}, {"componentType", 5123}}},
                                   {"values", {{"bufferView", 0}}}};
    const std::vector<std::string> places = {
        "/scene",
        "/scenes/0/nodes/1",
        "/nodes/0/mesh",
        "/nodes/1/camera",
        "/nodes/0/skin",
        "/nodes/0/children/0",
        "/nodes/2/extensions/KHR_lights_punctual/light",
        "/meshes/0/primitives/0/attributes/POSITION",
        "/meshes/0/primitives/0/targets/0/POSITION",
        "/meshes/0/primitives/0/indices",
        "/meshes/0/primitives/0/material",
        "/accessors/0/bufferView",
        "/accessors/0/sparse/indices/bufferView",
        "/accessors/0/sparse/values/bufferView",
        "/bufferViews/0/buffer",
        "/images/0/bufferView",
        "/textures/0/source",
        "/textures/0/sampler",
        "/materials/0/pbrMetallicRoughness/baseColorTexture/index",
        "/materials/0/extensions/KHR_materials_clearcoat/clearcoatTexture/index",
        "/skins/0/joints/0",
        "/skins/0/skeleton",
        "/skins/0/inverseBindMatrices",
        "/animations/0/channels/0/target/node",
        "/animations/0/samplers/0/input",
        "/animations/0/samplers/0/output"};
    j["buffers"] = json::parse(g.text())["buffers"];
    for (const std::string& place : places)
        for (const json& bad : {json(-1), json(-7), json(99u), json("0"), json(0.5), json(true),
                                json(nullptr), json::array(), json(18446744073709551615u)}) {
            json changed = j;
            const json::json_pointer pointer(place);
            ASSERT_TRUE(changed.contains(pointer)) << place;
            changed[pointer] = bad;
            const std::string message = failure(changed, g);
            // Named as the file has it: nodes[0].mesh.
            const std::string name = pointer.parent_pointer().empty() ? pointer.back()
                                     : std::isdigit(static_cast<unsigned char>(pointer.back()[0]))
                                         ? "[" + pointer.back() + "]"
                                         : "." + pointer.back();
            EXPECT_NE(message.find(name), std::string::npos) << place << " " << bad << ": " << message;
            EXPECT_NE(message.find(bad.is_number_unsigned() ? "refers to" : "expected"), std::string::npos)
                << place << " " << bad << ": " << message;
        }
}

TEST(Values, OfTheWrongTypeAreRefused) {
    struct Case {
        const char* place;
        json bad;
    };
    for (const auto& [place, bad] :
         std::vector<Case>{{"/materials/0/pbrMetallicRoughness/metallicFactor", "0"},
                           {"/materials/0/pbrMetallicRoughness/roughnessFactor", "rough"},
                           {"/materials/0/pbrMetallicRoughness/baseColorFactor", {1, 1, 1}},
                           {"/materials/0/pbrMetallicRoughness/baseColorFactor", {1, 1, "1", 1}},
                           {"/materials/0/pbrMetallicRoughness", 5},
                           {"/materials/0/emissiveFactor", "white"},
                           {"/materials/0/alphaMode", 1},
                           {"/materials/0/doubleSided", 1},
                           {"/materials/0/normalTexture", 0},
                           {"/materials/0/normalTexture", json::object()},
                           {"/materials/0/extensions/KHR_materials_ior/ior", "1.5"},
                           {"/materials/0/extensions/KHR_materials_specular/specularColorFactor", {1}},
                           {"/materials/0", "paint"},
                           {"/materials", 3},
                           {"/nodes/0/translation", {0, 0}},
                           {"/nodes/0/rotation", {0, 0, 0, "1"}},
                           {"/nodes/0/scale", 2},
                           {"/nodes/0/matrix", {1, 0, 0, 0}},
                           {"/nodes/0/children", 0},
                           {"/nodes/0", nullptr},
                           {"/nodes", json::object()},
                           {"/scenes/0/nodes", "all"},
                           {"/meshes/0/primitives", json::object()},
                           {"/meshes/0/primitives/0/attributes", json::array()},
                           {"/meshes/0/primitives/0/mode", "TRIANGLES"},
                           {"/accessors/0/count", "4"},
                           {"/accessors/0/count", -4},
                           {"/accessors/0/byteOffset", -12},
                           {"/accessors/0/normalized", 1},
                           {"/accessors/0/componentType", "FLOAT"},
                           {"/bufferViews/0/byteLength", "48"},
                           {"/bufferViews/0/byteOffset", -1},
                           {"/bufferViews/0/byteStride", -12},
                           {"/cameras/0/type", 1},
                           {"/cameras/0/perspective", "wide"},
                           {"/cameras/0/perspective/yfov", "0.8"},
                           {"/cameras/0/perspective/aspectRatio", "1"},
                           {"/extensions/KHR_lights_punctual/lights/0/intensity", "bright"},
                           {"/extensions/KHR_lights_punctual/lights/0/color", "red"},
                           {"/extensions/KHR_lights_punctual/lights", 1},
                           {"/extensionsUsed", "KHR_lights_punctual"},
                           {"/asset", "2.0"}}) {
        GltfText g;
        const json::json_pointer pointer(place);
        g.json[pointer] = bad;
        const std::string message = failure(g.json, g);
        EXPECT_NE(message.find("expected"), std::string::npos) << place << " " << bad << ": " << message;
        EXPECT_NE(message.find(std::string(place).substr(1, 4)), std::string::npos) << message;
    }
}

TEST(Values, OutOfRangeAreTakenAsTheNearestAndToldOf) {
    GltfText g;
    g.json["materials"][0]["pbrMetallicRoughness"] = {
        {"baseColorFactor", {5, -1, 0.5, 1}}, {"metallicFactor", 0}, {"roughnessFactor", 1.5}};
    g.json["nodes"][0]["rotation"] = {0, 0, 0, 2};
    const Scene s = load(g.json, g);
    EXPECT_EQ(s.materials[0].baseColour, (Rgb{1, 0, 0.5f}));
    EXPECT_EQ(s.materials[0].roughness, 1);
    EXPECT_EQ(s.boundsMax.x, 1);
    EXPECT_EQ(
        s.report.warnings,
        (std::vector<std::string>{
            "nodes[0].rotation: expected a quaternion of length 1, found [0,0,0,2]: it is normalised",
            "materials[0].pbrMetallicRoughness.baseColorFactor: expected numbers from 0 to 1, found "
            "[5,-1,0.5,1]: the nearest are taken",
            "materials[0].pbrMetallicRoughness.roughnessFactor: expected 0 to 1, found 1.5: the nearest is "
            "taken"}));
    g.json["materials"].clear();
    for (int i = 0; i < 12; ++i)
        g.json["materials"].push_back({{"pbrMetallicRoughness", {{"metallicFactor", 2}}}});
    EXPECT_EQ(load(g.json, g).report.warnings.back(), "and 3 values more that are out of range");
}

TEST(Values, BelowNothingAreTakenAsNothingAndToldOf) {
    GltfText g;
    g.json["materials"][0]["emissiveFactor"] = {-1, 0.5, 7};
    g.json["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"] =
        g.floats({-1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, "VEC3");
    const Scene s = load(g.json, g);
    EXPECT_EQ(s.materials[0].emission, (Rgb{0, 0.5f, 7}));
    EXPECT_EQ(s.colours[0].rgb, (Rgb{0, 1, 1}));
    EXPECT_EQ(s.report.warnings,
              (std::vector<std::string>{"materials[0].emissiveFactor: expected numbers of 0 or more, found "
                                        "[-1,0.5,7]: the nearest are taken",
                                        "mesh 0 'square': COLOR_0 has values below 0: 0 is taken"}));
}

TEST(Json, ThatIsNestedTooDeepIsRefused) {
    const TemporaryFolder folder;
    for (const int depth : {250, 200000}) {
        GltfText g;
        std::string text = g.text();
        text.insert(text.rfind('}'), ", \"extras\": " + std::string(static_cast<std::size_t>(depth), '[') +
                                         std::string(static_cast<std::size_t>(depth), ']'));
        writeText(folder / "deep.gltf", text);
        for (const auto& read : {+[](const std::string& path) { return loadScene(path); },
                                 +[](const std::string& path) { return loadCameras(path); }}) {
            try {
                read(folder / "deep.gltf");
                ADD_FAILURE() << depth;
            } catch (const Error& e) {
                EXPECT_NE(std::string(e.what()).find("up to 200 deep"), std::string::npos) << e.what();
            }
        }
    }
    GltfText quoted;
    quoted.json["asset"]["generator"] = std::string(500, '[') + "\"" + std::string(500, '{');
    EXPECT_EQ(failure(quoted.json, quoted), "no error");
}

TEST(Values, OfSeveralWordsAreOneOfThem) {
    GltfText g;
    g.json["meshes"][0]["primitives"][0]["mode"] = 9;
    expectFailureWith({"meshes[0].primitives[0].mode: expected a whole number of 0 to 6, found 9"}, g.json,
                      g);
    GltfText alpha;
    alpha.json["materials"][0]["alphaMode"] = "CLIP";
    expectFailureWith({"materials[0].alphaMode: expected one of OPAQUE, MASK, BLEND, found \"CLIP\""},
                      alpha.json, alpha);
}

TEST(Version, OtherThanTwoIsRefused) {
    const auto of = [](const json& asset) {
        GltfText g;
        g.json["asset"] = asset;
        return failure(g.json, g);
    };
    EXPECT_EQ(of({{"version", "2.0"}}), "no error");
    EXPECT_EQ(of({{"version", "2.1"}, {"minVersion", "2.0"}}), "no error");
    EXPECT_NE(of({{"version", "1.0"}}).find("expected glTF 2.0, found 1.0; turn it into 2.0"),
              std::string::npos);
    EXPECT_NE(of({{"version", "3.0"}}).find("expected glTF 2.0, found 3.0"), std::string::npos);
    EXPECT_NE(of({{"version", "2.1"}, {"minVersion", "2.1"}}).find("found a need for 2.1"),
              std::string::npos);
    EXPECT_NE(of({{"version", 2}}).find("asset.version: expected a string, found 2"), std::string::npos);
    EXPECT_NE(of(json()).find("JSON without `asset`"), std::string::npos);
}

TEST(Files, OfBuffersMustBeThere) {
    const TemporaryFolder folder;
    const auto of = [&](const std::string& uri) {
        GltfText g;
        g.json["buffers"] = {{{"byteLength", 60}, {"uri", uri}}};
        writeText(folder / "scene.gltf", g.json.dump());
        try {
            loadScene(folder / "scene.gltf");
        } catch (const Error& e) {
            return std::string(e.what());
        }
        return std::string("no error");
    };
    const auto expectWord = [&](const std::string& uri, const std::string& word) {
        const std::string message = of(uri);
        EXPECT_NE(message.find("buffers[0].uri: expected "), std::string::npos) << message;
        EXPECT_NE(message.find(word), std::string::npos) << word << " in: " << message;
        EXPECT_LT(message.size(), 250u) << message;
    };
    expectWord("gone.bin", "'gone.bin', found no such file");
    expectWord(".", "found a folder");
    expectWord("/dev/zero", "found a pipe or device");
    expectWord("data:model/other;base64," + std::string(10000, 'A'), "found data:model/other;base64");
    expectWord("data:" + std::string(10000, 'A'), "found data:AAA");
    expectWord("data:application/octet-stream;base64," + std::string(100000, 'A'),
               "expected 60 bytes (its byteLength), found 75000");
    std::filesystem::create_directory(folder / "a.glb");
    try {
        loadScene(folder / "a.glb");
        ADD_FAILURE() << "a folder was read";
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("expected a glTF file, found a folder"), std::string::npos)
            << e.what();
    }
}

TEST(Files, OfImagesAreNoFoldersOrDevices) {
    for (const auto& [uri, found] : {std::pair{".", "a folder"}, {"/dev/zero", "a pipe or device"}}) {
        GltfText g = textured();
        g.json["images"][0] = {{"uri", uri}};
        expectFailureWith({"images[0].uri: expected a file beside it", found}, g.json, g);
    }
}

TEST(Places, BeyondWhatFloatsCanTurnAreRefused) {
    for (const double scale : {1e10, 1e18, 1e30}) {
        GltfText g;
        g.json["nodes"][0]["scale"] = {scale, scale, scale};
        expectFailureWith({"m from the origin, expected at most 1e9 m", "scales"}, g.json, g);
    }
    GltfText far;
    far.poke(0, -2e18f);
    expectFailureWith({"reaches 2e+18 m from the origin"}, far.json, far);
    GltfText light;
    light.json["nodes"][2]["translation"] = {0, 0, 1e19};
    light.json["nodes"][2]["extras"]["radius"] = 1;
    expectFailureWith({"node 2", "the light is more than 1e9 m from the origin"}, light.json, light);
    GltfText camera;
    camera.json["nodes"][1]["translation"] = {0, 0, 1e19};
    EXPECT_EQ(load(camera.json, camera).cameras[0].unusable, "it is more than 1e9 m from the origin");
    GltfText fine;
    fine.json["nodes"][0]["scale"] = {1e8, 1e8, 1e8};
    EXPECT_EQ(failure(fine.json, fine), "no error");
}

TEST(Nodes, InALongChainAreRead) {
    constexpr int kLength = 100000;
    GltfText g;
    json& nodes = g.json["nodes"];
    for (int i = 0; i < kLength; ++i)
        nodes.push_back({{"children", {i + 1 < kLength ? 4 + i : 0}}, {"translation", {1e-5, 0, 0}}});
    g.json["scenes"][0]["nodes"] = {1, 2, 3};
    EXPECT_NEAR(load(g.json, g).boundsMax.x, 2, 1e-5);
}

TEST(Values, ThatNoDoubleHoldsAreRefused) {
    GltfText g;
    std::string text = g.text();
    text.replace(text.find("0.8"), 3, "1e999");
    static const TemporaryFolder folder;
    writeText(folder / "huge.gltf", text);
    EXPECT_THROW(loadScene(folder / "huge.gltf"), Error);
}

/// A file with cameras of these properties, each in a node of its own.
GltfText withCameras(const std::vector<json>& cameras) {
    GltfText g;
    g.json["cameras"] = json::array();
    g.json["scenes"][0]["nodes"] = {0, 2};
    for (const json& camera : cameras) {
        g.json["cameras"].push_back(camera);
        g.json["nodes"].push_back({{"camera", g.json["cameras"].size() - 1}, {"translation", {0, 0, 3}}});
        g.json["scenes"][0]["nodes"].push_back(g.json["nodes"].size() - 1);
    }
    g.json["nodes"][1].erase("camera");
    return g;
}

json perspective(double yfov, std::optional<double> aspect = {}) {
    json p = {{"yfov", yfov}, {"znear", 0.1}};
    if (aspect) p["aspectRatio"] = *aspect;
    return {{"type", "perspective"}, {"perspective", p}};
}

json orthographic(double xmag, double ymag) {
    return {{"type", "orthographic"},
            {"orthographic", {{"xmag", xmag}, {"ymag", ymag}, {"znear", 0.1}, {"zfar", 10}}}};
}
const json kFlat = orthographic(1, 0);

TEST(DefaultCamera, IsTheFirstThatCanBeUsed) {
    const GltfText g = withCameras({kFlat, perspective(0), perspective(0.6)});
    const Scene s = load(g.json, g);
    EXPECT_EQ(s.activeCamera, 2u);
    EXPECT_EQ(s.wantedCamera, 0u);
    GltfText marked = withCameras({perspective(0.6), kFlat});
    marked.json["nodes"][4]["extras"]["active"] = 1;
    const Scene t = load(marked.json, marked);
    EXPECT_EQ(t.activeCamera, 0u);
    EXPECT_EQ(t.wantedCamera, 1u);
}

void expectFault(const std::vector<std::string>& words, const GltfText& g) {
    const std::string fault = load(g.json, g).cameraFault;
    for (const std::string& word : words)
        EXPECT_NE(fault.find(word), std::string::npos) << word << ": " << fault;
}

TEST(DefaultCamera, WithoutAUsableOneSaysWhyEachIsNot) {
    for (const json& bad :
         {kFlat, orthographic(-1, 1), orthographic(1, 1e39), orthographic(1e-30, 1), perspective(0),
          perspective(-1), perspective(4), perspective(1e-30), perspective(0.6, 0), perspective(0.6, -1),
          perspective(0.6, 2e-8), perspective(0.6, 1e30), perspective(0.6, -0.0)}) {
        expectFault({"no camera that can be used", "camera 0", "camera 1"}, withCameras({bad, kFlat}));
        // A usable one after it is taken.
        const GltfText good = withCameras({bad, perspective(0.6)});
        EXPECT_EQ(load(good.json, good).activeCamera, 1u) << bad;
    }
    for (const json& place : {json{{"scale", {0, 1, 1}}}, json{{"translation", {1e300, 0, 0}}}}) {
        GltfText g = withCameras({perspective(0.6)});
        g.json["nodes"][3].update(place);
        expectFault({"no camera that can be used", "camera 0"}, g);
    }
}

TEST(DefaultCamera, ThatIsElsewhereIsNamed) {
    GltfText g = withCameras({perspective(0.6)});
    g.json["scenes"] = {{{"nodes", {0, 2}}}, {{"nodes", {3}}}};
    g.json["nodes"][3]["name"] = "far";
    expectFault({"scene 0", "node 3 'far'", "`scene`"}, g);
    g.json.erase("scene");
    expectFault({"scene 0", "node 3 'far'"}, g);
    g.json["scene"] = 1;
    g.json["nodes"][3]["children"] = {2};
    g.json["scenes"][0]["nodes"] = {0};
    expectFailureWith({"no triangles"}, g.json, g);
    g.json.erase("scene");
    g.json["scenes"] = json::array();
    expectFailureWith({"no scene"}, g.json, g);
}

}  // namespace
}  // namespace vlx::render
