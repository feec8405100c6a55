#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "../render/gltf_text.h"
#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/dump/reader.h"

/// From where vlx-trace looks at scenes, and how bright it takes them to be.
namespace vlx {
namespace {

using render::GltfText;

/// A file of the square, without a camera, as other programs write it: in candela.
GltfText squareOnly() {
    GltfText g;
    g.json["scenes"][0] = {{"nodes", {0, 2}}};
    g.json["nodes"][1].erase("camera");
    g.json["cameras"] = nlohmann::json::array();
    g.json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = 683 * 5;
    return g;
}

struct Viewed {
    explicit Viewed(const GltfText& g) { render::writeText(folder / "scene.gltf", g.text()); }

    ToolRun run(std::vector<std::string> options, const std::string& output = "a.exr") const {
        options.insert(options.begin(), {folder / "scene.gltf", "-o", folder / output, "--width", "24",
                                         "--spp", "4", "--overwrite"});
        return runTool("vlx-trace", options);
    }
    SampleBand samples(const std::string& output = "a.exr") const {
        const DumpReader dump(folder / output);
        return dump.read(0, dump.header().data.height);
    }
    /// Share of the samples that hit something.
    double covered(const std::string& output = "a.exr") const {
        const SampleBand band = samples(output);
        double hits = 0;
        for (std::size_t c = 0; c < band.channels.size(); ++c)
            if (band.channels[c] == "A")
                for (const float v : band.values[c]) hits += static_cast<double>(v);
        return hits / static_cast<double>(band.samples());
    }

    TemporaryFolder folder;
};

bool says(const ToolRun& run, const std::string& words) { return run.err.find(words) != std::string::npos; }

/// The words from --camera-position on of the line that says what is made.
std::vector<std::string> optionsIn(const std::string& text) {
    std::istringstream in(text.substr(std::min(text.size(), text.find("--camera-position"))));
    std::vector<std::string> words(6);
    for (std::string& word : words) in >> word;
    return words;
}

TEST(MadeCamera, ShowsTheWholeSceneAndCanBeCopied) {
    const Viewed v(squareOnly());
    const ToolRun made = v.run({});
    ASSERT_EQ(made.exitCode, 0) << made.err;
    EXPECT_TRUE(says(made, "has no camera: one is made, --camera-position ")) << made.err;
    EXPECT_GT(v.covered(), 0.2);
    EXPECT_LT(v.covered(), 0.9);
    const ToolRun copied = v.run(optionsIn(made.err), "b.exr");
    ASSERT_EQ(copied.exitCode, 0) << copied.err;
    EXPECT_FALSE(says(copied, "one is made")) << copied.err;
    EXPECT_EQ(v.samples("b.exr").values, v.samples().values);
    const ToolRun close = v.run({"--fov", "20"}, "c.exr");  // from further away
    EXPECT_NEAR(v.covered("c.exr"), v.covered(), 0.1) << close.err;
    EXPECT_TRUE(says(close, "--fov 20")) << close.err;
    const ToolRun explained =
        runTool("vlx-trace", {v.folder / "scene.gltf", "--explain", "--look-at", "0,1,0", "--width", "8"});
    EXPECT_EQ(explained.exitCode, 0) << explained.err;
    const ToolRun list = runTool("vlx-trace", {v.folder / "scene.gltf", "--list-cameras"});
    EXPECT_EQ(list.exitCode, 0);
    EXPECT_EQ(list.out, "");
    EXPECT_TRUE(says(list, "has no camera: one is made")) << list.err;
    const ToolRun named = v.run({"--camera", "front"});
    EXPECT_EQ(named.exitCode, 1);
    EXPECT_TRUE(says(named, "has no camera 'front', and no other")) << named.err;
}

TEST(MadeCamera, IsOneForAllFrames) {
    GltfText g = squareOnly();
    render::animate(g, 0, "translation", {0, 1}, {0, 0, 0, 4, 0, 0}, "VEC3");
    const Viewed v(g);
    const ToolRun run = v.run({"--frames", "0-2", "--fps", "2"}, "a_#.exr");
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto view = [&](const char* name) { return DumpReader(v.folder / name).header().worldToCamera; };
    EXPECT_EQ(view("a_0.exr"), view("a_2.exr"));
    EXPECT_EQ(run.err.find("one is made"), run.err.rfind("one is made")) << run.err;
    // All that moves is in it, from the first frame to the last key.
    EXPECT_EQ(optionsIn(run.err), optionsIn(v.run({"--shutter", "0,1"}).err));
    EXPECT_NE(optionsIn(run.err), optionsIn(v.run({}).err));
    const ToolRun still = v.run({"--frames", "1", "--fps", "2", "--camera-position", "2,0,20"}, "b_#.exr");
    EXPECT_TRUE(says(still, "motion is recorded")) << still.err;
}

TEST(PlacedCamera, EachOptionAloneChangesTheFilesCamera) {
    GltfText g;
    render::animate(g, 1, "translation", {0, 1}, {0, 0, 3, 0, 0, 9}, "VEC3");
    const Viewed v(g);
    const auto forward = [&](const std::vector<std::string>& options) {
        const ToolRun run = v.run(options);
        EXPECT_EQ(run.exitCode, 0) << run.err;
        const std::vector<float> m = DumpReader(v.folder / "a.exr").header().worldToCamera.value();
        return std::array{-m[2], -m[6], -m[10]};  // row vectors: the third column is what z is made of
    };
    EXPECT_EQ(forward({}), (std::array{0.f, 0.f, -1.f}));
    EXPECT_EQ(forward({"--fov", "20"}), (std::array{0.f, 0.f, -1.f}));
    EXPECT_NEAR(forward({"--look-at", "3,0,0", "--shutter", "0,0"})[0], std::sqrt(0.5), 1e-5);
    // The middle of the scene by default.
    EXPECT_NEAR(forward({"--camera-position=-5,0,0"})[0], 1, 1e-6);
    EXPECT_NEAR(forward({"--camera-position", "0,4,0"})[1], -1, 1e-6);
    EXPECT_NEAR(forward({"--camera-position", "0,-4,0", "--look-at", "0,4,0"})[1], 1, 1e-6);
    // A camera that moves still does, unless it is placed.
    const auto plan = [&](const std::vector<std::string>& options) {
        std::vector<std::string> all = {
            v.folder / "scene.gltf", "--explain=json", "--width", "8", "--shutter", "0,0.5"};
        all.insert(all.end(), options.begin(), options.end());
        return runTool("vlx-trace", all).out;
    };
    EXPECT_NE(plan({"--look-at", "1,0,0"}).find("moves while the shutter is open"), std::string::npos);
    EXPECT_EQ(plan({"--camera-position", "1,0,4"}).find("moves while the shutter is open"),
              std::string::npos);
    const ToolRun same = v.run({"--camera-position", "1,2,3", "--look-at", "1,2,3"});
    EXPECT_EQ(same.exitCode, 2);
    EXPECT_TRUE(says(same, "--look-at: expected another place than the camera's, found 1,2,3")) << same.err;
}

TEST(PlacedCamera, WithoutAnythingToLookAtIsAnError) {
    GltfText g = squareOnly();
    g.json["scenes"][0]["nodes"] = {2};
    const Viewed v(g);
    EXPECT_TRUE(says(v.run({}), "has no triangles and no environment"));
    const ToolRun sky = v.run({"--env-constant", "1,1,1"});
    EXPECT_EQ(sky.exitCode, 1);
    EXPECT_TRUE(says(sky, "give --camera-position and --look-at")) << sky.err;
    EXPECT_EQ(v.run({"--env-constant", "1,1,1", "--camera-position", "0,0,0", "--look-at", "1,0,0"}).exitCode,
              0);
}

TEST(OrthographicCamera, GivesThePictureItsAspectAndSize) {
    GltfText g;
    g.json["cameras"][0] = {{"type", "orthographic"},
                            {"orthographic", {{"xmag", 4}, {"ymag", 2}, {"znear", 0.1}, {"zfar", 10}}}};
    const Viewed v(g);
    ASSERT_EQ(v.run({}).exitCode, 0);
    EXPECT_EQ(DumpReader(v.folder / "a.exr").header().display.height, 12);
    EXPECT_EQ(v.covered(), 4.0 / 32);  // of a square of 2 x 2 in 8 x 4: whole pixels
    ASSERT_EQ(v.run({"--integrator", "bidirectional"}).exitCode, 0);
    EXPECT_EQ(v.covered(), 4.0 / 32);
}

TEST(Light, ThatReachesNothingIsWarnedOf) {
    GltfText g;
    auto& light = g.json["extensions"]["KHR_lights_punctual"]["lights"][0];
    light["type"] = "spot";
    light["spot"] = nlohmann::json::object();
    g.json["nodes"][2]["rotation"] = {0, 1, 0, 0};  // looks away
    const Viewed v(g);
    const ToolRun dark = v.run({});
    EXPECT_EQ(dark.exitCode, 0);
    EXPECT_TRUE(says(dark, "no light reaches anything")) << dark.err;
    EXPECT_TRUE(says(dark, "--env-constant 1,1,1 or --env IMAGE")) << dark.err;
    EXPECT_FALSE(says(dark, "mean luminance")) << dark.err;
    EXPECT_FALSE(says(v.run({"--env-constant", "1,1,1"}), "no light reaches"));
}

TEST(Light, IsNotMissedWhereAllIsUnlit) {
    GltfText g;
    g.json["extensionsUsed"].push_back("KHR_materials_unlit");
    g.json["materials"][0]["extensions"]["KHR_materials_unlit"] = nlohmann::json::object();
    const Viewed v(g);
    EXPECT_FALSE(says(v.run({}), "no light reaches"));
}

TEST(Backs, ThatFillThePictureAreToldOf) {
    GltfText g;
    g.json["nodes"][0]["rotation"] = {0, 1, 0, 0};
    const Viewed v(g);
    const ToolRun back = v.run({});
    EXPECT_TRUE(says(back, "100 % of what is in the picture shows its back")) << back.err;
    EXPECT_TRUE(says(back, "doubleSided")) << back.err;
    g.json["materials"][0]["doubleSided"] = true;
    EXPECT_FALSE(says(Viewed(g).run({}), "shows its back"));
}

TEST(Light, OfUnlikelyUnitsIsWarnedOf) {
    GltfText strong = squareOnly();
    strong.json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = 683 * 50;  // candela
    const Viewed v(strong);
    const ToolRun right = v.run({});
    EXPECT_TRUE(says(right, "divided by 683 lm/W")) << right.err;
    EXPECT_FALSE(says(right, "mean luminance")) << right.err;
    const ToolRun bright = v.run({"--light-units", "radiometric"});
    EXPECT_FALSE(says(bright, "divided by 683 lm/W (")) << bright.err;
    EXPECT_TRUE(says(bright, "white on a screen: --light-units photometric")) << bright.err;
    GltfText g = squareOnly();
    g.json["extensions"]["KHR_lights_punctual"]["lights"][0]["intensity"] = 1;
    const Viewed w(g);
    const ToolRun dim = w.run({});
    EXPECT_TRUE(says(dim, "black on a screen: --light-units radiometric")) << dim.err;
    EXPECT_FALSE(says(w.run({"--light-units", "radiometric"}), "mean luminance"));
}

}  // namespace
}  // namespace vlx
