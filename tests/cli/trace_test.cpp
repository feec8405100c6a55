#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "../render/gltf_text.h"
#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

const std::string kScene = VLX_TESTDATA "/scenes/interior.glb";

ToolRun trace(const std::vector<std::string>& arguments) { return runTool("vlx-trace", arguments); }

TEST(VlxTrace, SameBytesOfSamplesForAnyNumberOfThreads) {
    const TemporaryFolder folder;
    for (const bool hierarchical : {false, true}) {
        SampleBand first;
        for (const char* threads : {"1", "2", "8"}) {
            std::vector<std::string> arguments = {kScene,     "-o", folder / "a.exr", "--width", "24",
                                                  "--height", "20", "--threads",      threads};
            arguments.push_back(hierarchical ? "--hierarchical" : "--spp=3");
            const ToolRun run = trace(arguments);
            ASSERT_EQ(run.exitCode, 0) << run.err;
            const SampleBand band = DumpReader(folder / "a.exr").read(0, 20);
            if (first.offsets.empty()) first = band;
            EXPECT_EQ(band.offsets, first.offsets) << threads;
            EXPECT_EQ(band.values, first.values) << threads;
            std::filesystem::remove(folder / "a.exr");
        }
    }
}

TEST(VlxTrace, CropIsPartOfThePicture) {
    const TemporaryFolder folder;
    ASSERT_EQ(trace({kScene, "-o", folder / "a.exr", "--width", "32", "--height", "32", "--spp", "1",
                     "--crop", "8,4,10,6"})
                  .exitCode,
              0);
    const DumpReader dump(folder / "a.exr");
    EXPECT_EQ(dump.header().data, (Window{8, 4, 10, 6}));
    EXPECT_EQ(dump.header().display, (Window{0, 0, 32, 32}));
}

TEST(VlxTrace, BadUsageIsExitTwo) {
    const TemporaryFolder folder;
    const std::string out = folder / "a.exr";
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                      {kScene},
                                                      {kScene, "-o"},
                                                      {kScene, "-o", out, "--spp", "0"},
                                                      {kScene, "-o", out, "--spp"},
                                                      {kScene, "-o", out, "--width", "x"},
                                                      {kScene, "-o", out, "--crop", "1,2,3"},
                                                      {kScene, "-o", out, "--tolerance", "0.1"},
                                                      {kScene, "-o", out, "--compression", "zip"},
                                                      {kScene, "-o", out, "--effects", "some"},
                                                      {kScene, "-o", out, "--look-at", "1,2"},
                                                      {kScene, "-o", out, "--look-at", "1,2,nan"},
                                                      {kScene, "-o", out, "--camera-position", "1,inf,2"},
                                                      {kScene, "-o", out, "--fov", "180"},
                                                      {kScene, "-o", out, "--fov", "0"},
                                                      {kScene, "-o", out, "--light-units", "lumens"},
                                                      {kScene, "--list-cameras", "--fov", "30"},
                                                      {kScene, "-o", out, "--effects", "auto,-fog"},
                                                      {kScene, "-o", out, "--effects"},
                                                      {kScene, "--explain=xml"},
                                                      {kScene, "--explain", "-o", out},
                                                      {kScene, "--explain", "--json"},
                                                      {kScene, "--list-cameras", "-o", out},
                                                      {kScene, "--list-cameras", "--explain"},
                                                      {kScene, "--list-cameras", "--spp", "4"},
                                                      {kScene, "-o", out, "--shutter", "1"},
                                                      {kScene, "-o", out, "--shutter", "1,0"},
                                                      {kScene, "-o", out, "--time", "0"},
                                                      {kScene, "-o", out, "--time", "1", "--spp", "4"},
                                                      {kScene, "-o", out, "--target-error", "-1"},
                                                      {kScene, "-o", out, "--append"},
                                                      {kScene, "-o", out, "--sample-map"},
                                                      {kScene, "-o", out, "--nonsense"}}) {
        const ToolRun run = trace(arguments);
        std::string line;
        for (const auto& argument : arguments) line += " " + argument;
        EXPECT_EQ(run.exitCode, 2) << line << "\n" << run.err;
        EXPECT_TRUE(run.err.starts_with("vlx-trace: ")) << line << "\n" << run.err;
    }
    EXPECT_EQ(folder.entries(), 0);
}

TEST(VlxTrace, FailuresAreExitOneNameTheFileAndLeaveNoOutput) {
    const TemporaryFolder folder;
    const TemporaryFolder target;
    std::ofstream(folder / "text.glb") << "not a scene";
    std::ofstream(folder / "truncated.glb", std::ios::binary) << contentsOf(kScene).substr(0, 100000);
    std::ofstream(folder / "nocamera.gltf")
        << R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]})";
    std::ofstream(folder / "nobuffer.gltf")
        << R"({"asset": {"version": "2.0"}, "buffers": [{"byteLength": 36, "uri": "gone.bin"}]})";
    for (const char* name : {"missing.glb", "text.glb", "truncated.glb", "nocamera.gltf", "nobuffer.gltf"}) {
        const ToolRun run = trace({folder / name, "-o", target / "out.exr", "--width", "8"});
        EXPECT_EQ(run.exitCode, 1) << name;
        EXPECT_NE(run.err.find(name), std::string::npos) << run.err;
        EXPECT_EQ(target.entries(), 0) << name;
    }
    const std::vector<std::string> small = {kScene, "-o", target / "out.exr", "--width", "16", "--spp", "2"};
    EXPECT_EQ(runTool("vlx-trace", small, {.fileSizeLimit = 4000}).exitCode, 1);
    EXPECT_EQ(target.entries(), 0);
    EXPECT_EQ(trace({kScene, "-o", target / "no/out.exr", "--width", "8"}).exitCode, 1);
    EXPECT_EQ(trace({kScene, "-o", target / "out.exr", "--camera", "nobody"}).exitCode, 1);
    EXPECT_EQ(target.entries(), 0);
}

TEST(VlxTrace, BidirectionalDumpsHaveSplats) {
    const TemporaryFolder folder;
    const std::string out = folder / "a.exr";
    const ToolRun run = trace({kScene, "-o", out, "--width", "24", "--height", "20", "--spp", "4",
                               "--integrator", "bidirectional"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.err.find("integrator bidirectional: asked for"), std::string::npos) << run.err;
    const DumpReader dump(out);
    EXPECT_EQ(dump.header().splatReplicates, 4);
    EXPECT_EQ(dump.header().extra.at("integrator"), "bidirectional: asked for");
    EXPECT_EQ(runTool("vlx-krige", {out, "-o", folder / "b.exr"}).exitCode, 0);
    for (const std::vector<std::string>& more :
         {std::vector<std::string>{"--append", out}, {"--target-error", "0.1"}}) {
        std::vector<std::string> arguments = {kScene, "-o",           folder / "c.exr", "--width",
                                              "24",   "--integrator", "bidirectional"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        const ToolRun refused = trace(arguments);
        EXPECT_EQ(refused.exitCode, 2) << more[0] << refused.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "c.exr"));
    }
}

TEST(VlxTrace, ExplainsWhatTheSceneCallsFor) {
    const ToolRun run = trace({kScene, "--explain=json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto j = nlohmann::json::parse(run.out);
    ASSERT_EQ(j["effects"].size(), 21u);
    EXPECT_TRUE(j["integrator"]["chosen"] == "path" || j["integrator"]["chosen"] == "bidirectional");
    EXPECT_NE(j["integrator"]["reason"].get<std::string>().find("caustics"), std::string::npos);
    std::map<std::string, nlohmann::json> byName;
    for (const auto& e : j["effects"]) byName[e["name"]] = e;
    EXPECT_TRUE(byName["clearcoat"]["planned"].get<bool>());
    EXPECT_NE(byName["clearcoat"]["reason"].get<std::string>().find("'dark_wood'"), std::string::npos);
    EXPECT_GE(byName["indirect"]["share"].get<double>(), 0);
    EXPECT_FALSE(byName["depth_of_field"]["planned"].get<bool>());
    EXPECT_FALSE(byName["depth_of_field"].contains("share"));
    double met = 0;
    for (const auto& kernel : j["hits"]) met += kernel["share"].get<double>();
    EXPECT_NEAR(met, 1, 0.01);
    EXPECT_EQ(j["hits"][0]["kernel"], "reflecting");

    const ToolRun text = trace({kScene, "--explain"});
    ASSERT_EQ(text.exitCode, 0) << text.err;
    EXPECT_NE(text.out.find("sphere_lights      no"), std::string::npos) << text.out;
    EXPECT_NE(text.out.find(" % reflecting; "), std::string::npos) << text.out;
}

TEST(VlxTrace, EffectsLeftOutAreWarnedOfAndInTheHeader) {
    const TemporaryFolder folder;
    const ToolRun run = trace({kScene, "-o", folder / "a.exr", "--width", "8", "--spp", "1", "--effects",
                               "auto,-caustics,-depth_of_field", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.err.find("warning: the image is biased: caustics left out"), std::string::npos) << run.err;
    EXPECT_EQ(run.err.find("depth_of_field left out"), std::string::npos) << run.err;
    const DumpHeader header = DumpReader(folder / "a.exr").header();
    EXPECT_EQ(std::ranges::count(header.effects, "caustics"), 0);
    EXPECT_EQ(std::ranges::count(header.effects, "clearcoat"), 1);
    EXPECT_EQ(header.extra.at("effectsLeftOut"), "caustics");
    EXPECT_EQ(nlohmann::json::parse(run.out)["effects"], nlohmann::json(header.effects));
}

TEST(VlxTrace, TimeAndErrorChooseTheSamples) {
    const TemporaryFolder folder;
    const auto samples = [&](const std::string& option, const std::string& value) {
        const ToolRun run = trace(
            {kScene, "-o", folder / "a.exr", "--width", "8", "--json", option, value, "--replicates", "2"});
        EXPECT_EQ(run.exitCode, 0) << run.err;
        const auto j = nlohmann::json::parse(run.out);
        const int spp = j["samplesPerPixel"];
        EXPECT_EQ(spp % 2, 0);
        EXPECT_EQ(j["samples"], spp * 64);
        return spp;
    };
    EXPECT_GE(samples("--time", "0.2"), 2);
    EXPECT_LT(samples("--target-error", "1"), samples("--target-error", "0.05"));
}

TEST(VlxTrace, FramesHoldMotionWhereSomethingMoves) {
    const TemporaryFolder folder;
    render::GltfText scene;  // moves by 2 in the second second only
    render::animate(scene, 0, "translation", {1, 2}, {0, 0, 0, 2, 0, 0}, "VEC3");
    render::writeText(folder / "a.gltf", scene.text());
    const auto traced = [&](const std::string& frames, const std::string& name) {
        const ToolRun run = trace({folder / "a.gltf", "-o", folder / name, "--width", "16", "--spp", "2",
                                   "--frames", frames, "--fps", "10", "--json"});
        EXPECT_EQ(run.exitCode, 0) << run.err;
        return run;
    };
    const ToolRun moving = traced("15", "a_##.exr"), still = traced("2", "a_##.exr");
    const auto motion = nlohmann::json::parse(moving.out)["motion"];
    EXPECT_TRUE(motion["recorded"].get<bool>());
    EXPECT_NE(moving.err.find("motion is recorded: " + motion["reason"].get<std::string>()),
              std::string::npos)
        << moving.err;
    EXPECT_FALSE(nlohmann::json::parse(still.out)["motion"]["recorded"].get<bool>());
    EXPECT_EQ(still.err.find("motion"), std::string::npos) << still.err;

    const ToolRun info = runTool("vlx-pack", {"info", folder / "a_15.exr", "--json"});
    const auto report = nlohmann::json::parse(info.out)["motion"];
    EXPECT_EQ(report["before"]["known"], report["before"]["samples"]);
    const double way = 16 / 2 / std::tan(0.4) * 0.2 / 3;  // of the square; what is beside it is at rest
    EXPECT_NEAR(report["before"]["largest"].get<double>(), way, 1e-3);
    EXPECT_NEAR(report["next"]["largest"].get<double>(), way, 1e-3);
    EXPECT_GT(report["next"]["still"].get<int>(), 0);
    EXPECT_EQ(report["next"]["warning"], "");
    EXPECT_NE(runTool("vlx-pack", {"info", folder / "a_15.exr"}).out.find("motion, next"), std::string::npos);
    EXPECT_FALSE(nlohmann::json::parse(runTool("vlx-pack", {"info", folder / "a_02.exr", "--json"}).out)
                     .contains("motion"));
}

TEST(VlxTrace, AppendsNothingOfAnotherPicture) {
    const TemporaryFolder folder;
    const std::string out = folder / "a.exr", more = folder / "more.exr";
    const auto run = [&](std::vector<std::string> options) {
        options.insert(options.begin(), {kScene, "-o", more, "--width", "12", "--spp", "2", "--append", out});
        return trace(options);
    };
    ASSERT_EQ(trace({kScene, "-o", out, "--width", "12", "--spp", "2"}).exitCode, 0);
    const std::string before = contentsOf(out);
    for (const auto& [options, words] : std::vector<std::pair<std::vector<std::string>, std::string>>{
             {{"--max-bounces", "1"}, "most bounces: 12, not 1;"},
             {{"--env-constant", "1,1,1"}, "environment: "},
             {{"--light-units", "photometric"}, "light units: radiometric, not photometric"},
             {{"--effects", "auto,-diffuse"}, "effects left out: none, not -diffuse"}}) {
        const ToolRun other = run(options);
        EXPECT_EQ(other.exitCode, 1) << other.err;
        EXPECT_NE(other.err.find("expected samples of the picture that is traced, found others: "),
                  std::string::npos)
            << other.err;
        EXPECT_NE(other.err.find(words), std::string::npos) << other.err;
        EXPECT_FALSE(std::filesystem::exists(more));
    }
    const ToolRun same = run({"--seed", "7", "--effects", "all", "--integrator", "path"});
    EXPECT_EQ(same.exitCode, 0) << same.err;
}

TEST(VlxTrace, AppendsToADump) {
    const TemporaryFolder folder;
    ASSERT_EQ(
        trace({kScene, "-o", folder / "a.exr", "--width", "16", "--spp", "2", "--crop", "2,3,8,6"}).exitCode,
        0);
    const ToolRun run = trace({kScene, "-o", folder / "b.exr", "--append", folder / "a.exr", "--spp", "3"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const DumpReader dump(folder / "b.exr");
    EXPECT_EQ(dump.header().data, (Window{2, 3, 8, 6}));
    EXPECT_EQ(dump.header().samples, 5);
    EXPECT_EQ(dump.counts(3, 6), std::vector<std::uint32_t>(48, 5));
    EXPECT_EQ(trace({kScene, "-o", folder / "a.exr", "--append", folder / "a.exr"}).exitCode, 2);
    EXPECT_EQ(trace({kScene, "-o", folder / "c.exr", "--append", folder / "a.exr", "--width", "17"}).exitCode,
              1);
    EXPECT_EQ(trace({kScene, "-o", folder / "c.exr", "--append", kScene}).exitCode, 1);
    EXPECT_EQ(trace({kScene, "-o", folder / "c.exr", "--sample-map", folder / "none.exr"}).exitCode, 1);
    EXPECT_EQ(folder.entries(), 2);
}

/// A scene of cameras alone: nothing to see, no light, an image that is missing.
std::string camerasOnly(const std::string& path, const std::string& cameras) {
    nlohmann::json scene = {{"asset", {{"version", "2.0"}}},
                            {"images", {{{"uri", "gone.png"}}}},
                            {"cameras", nlohmann::json::parse(cameras)},
                            {"nodes", nlohmann::json::array()}};
    for (std::size_t i = 0; i < scene["cameras"].size(); ++i) {
        scene["nodes"].push_back({{"camera", i}, {"name", "cam" + std::to_string(i)}});
        scene["scenes"][0]["nodes"].push_back(i);
    }
    std::ofstream(path) << scene;
    return path;
}

const std::string kFlat =
    R"({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 0, "znear": 0.1, "zfar": 9}})";

std::string perspective(const std::string& aspect) {
    return R"({"type": "perspective", "perspective": {"yfov": 0.6, "znear": 0.1, "aspectRatio": )" + aspect +
           "}}";
}

TEST(VlxTrace, ListsTheCamerasOfAnyScene) {
    const TemporaryFolder folder;
    const ToolRun run = trace({camerasOnly(folder / "a.gltf", "[" + kFlat + "," + perspective("1") + "," +
                                                                  perspective("2e-8") + "]"),
                               "--list-cameras"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.out,
              "0  cam0  unusable: its ymag is 0, expected more than 0\n"
              "1  cam1  (active)\n"
              "2  cam2  unusable: its aspectRatio is 2e-08, expected 2^-20 to 2^20\n");
    const ToolRun none = trace({camerasOnly(folder / "b.gltf", "[" + kFlat + "]"), "--list-cameras"});
    EXPECT_EQ(none.exitCode, 0) << none.err;
    EXPECT_EQ(none.out, "0  cam0  unusable: its ymag is 0, expected more than 0\n");
    EXPECT_NE(none.err.find("no camera that can be used"), std::string::npos) << none.err;
    std::ofstream(folder / "c.gltf")
        << R"({"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}]})";
    const ToolRun empty = trace({folder / "c.gltf", "--list-cameras"});
    EXPECT_EQ(empty.exitCode, 0) << empty.err;
    EXPECT_EQ(empty.out, "");
    EXPECT_NE(empty.err.find("no camera"), std::string::npos) << empty.err;
}

TEST(VlxTrace, TakesTheFirstUsableCameraAndSaysSo) {
    const TemporaryFolder folder;
    const std::string scene = camerasOnly(folder / "a.gltf", "[" + kFlat + "," + perspective("2") + "]");
    const ToolRun run =
        trace({scene, "-o", folder / "a.exr", "--env-constant", "1,1,1", "--width", "8", "--spp", "1"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.err.find("'cam0' cannot be used"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("camera 1 'cam1'"), std::string::npos) << run.err;
    EXPECT_EQ(DumpReader(folder / "a.exr").header().display.height, 4);
    const ToolRun chosen = trace({scene, "-o", folder / "b.exr", "--env-constant", "1,1,1", "--width", "8",
                                  "--spp", "1", "--camera", "cam1"});
    EXPECT_EQ(chosen.err.find("cannot be used"), std::string::npos) << chosen.err;
    const ToolRun asked = trace({scene, "-o", folder / "c.exr", "--env-constant", "1,1,1", "--camera", "0"});
    EXPECT_NE(asked.exitCode, 0);
    EXPECT_NE(asked.err.find("its ymag is 0"), std::string::npos) << asked.err;
}

TEST(VlxTrace, WhatIsWrongWithTheViewIsToldBeforeTheSceneIsRead) {
    const TemporaryFolder folder;
    const std::string dark = camerasOnly(folder / "dark.gltf", "[" + perspective("1") + "]");
    const auto ends = [&](const std::vector<std::string>& options, int code, const std::string& words) {
        std::vector<std::string> arguments = {dark, "-o", folder / "a.exr"};
        arguments.insert(arguments.end(), options.begin(), options.end());
        const ToolRun run = trace(arguments);
        EXPECT_EQ(run.exitCode, code) << words << run.err;
        EXPECT_NE(run.err.find(words), std::string::npos) << words << "\n" << run.err;
        EXPECT_EQ(run.err.find("--env"), std::string::npos) << run.err;
        EXPECT_EQ(folder.entries(), 1);
    };
    ends({"--camera", "7"}, 1, "has no camera '7'; it has 0 'cam0'");
    ends({"--crop", "0,0,9,9", "--width", "8"}, 2, "found --crop 0,0,9,9");
    ends({"--width", "1048576"}, 2, "at most 4294967296 pixels to trace, found 1048576 x 1048576");
    ends({"--width", "1048576"}, 2, "--crop or --band");
    ends({"--width", "131072", "--crop", "0,0,131072,65536"}, 2, "found 131072 x 65536");
    EXPECT_NE(trace({dark, "-o", folder / "a.exr"}).err.find("--env"), std::string::npos);
    // A part of a large picture is traced.
    EXPECT_EQ(trace({dark, "-o", folder / "a.exr", "--env-constant", "1,1,1", "--spp", "1", "--width",
                     "1048576", "--crop", "500000,500000,8,8"})
                  .exitCode,
              0);
    // What no memory holds is not begun.
    const ToolRun wide = trace({dark, "-o", folder / "b.exr", "--env-constant", "1,1,1", "--width", "1048576",
                                "--height", "4", "--spp", "16777216", "--integrator", "path"});
    EXPECT_EQ(wide.exitCode, 1) << wide.err;
    EXPECT_NE(wide.err.find("a smaller --width, --crop or --spp"), std::string::npos) << wide.err;
}

TEST(VlxTrace, PicturesOfACamerasAspectAreOfASizeThereIs) {
    const TemporaryFolder folder;
    for (const char* aspect : {"2e-8", "1e30", "0", "-1", "-1e30", "1e-300"}) {
        const ToolRun run = trace({camerasOnly(folder / "a.gltf", "[" + perspective(aspect) + "]"), "-o",
                                   folder / "a.exr", "--env-constant", "1,1,1", "--spp", "1"});
        EXPECT_EQ(run.exitCode, 1) << aspect;
        EXPECT_NE(run.err.find("aspectRatio"), std::string::npos) << run.err;
    }
    // An aspect that a picture may have, but not at this size.
    for (const auto& [aspect, given, missing] :
         {std::array{"1e-4", "--width", "--height"}, {"1e4", "--height", "--width"}}) {
        const std::string scene = camerasOnly(folder / "a.gltf", "[" + perspective(aspect) + "]");
        const ToolRun run =
            trace({scene, "-o", folder / "a.exr", "--env-constant", "1,1,1", "--spp", "1", given, "512"});
        EXPECT_EQ(run.exitCode, 1) << run.err;
        EXPECT_NE(run.err.find(std::string("give ") + missing), std::string::npos) << run.err;
        EXPECT_EQ(trace({scene, "-o", folder / "b.exr", "--env-constant", "1,1,1", "--spp", "1", given, "8",
                         missing, "4", "--overwrite"})
                      .exitCode,
                  0);
    }
}

}  // namespace
}  // namespace vlx
