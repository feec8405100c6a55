#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

const std::string kScene = VLX_TESTDATA "/scenes/interior.glb";

ToolRun trace(const std::vector<std::string>& arguments) { return runTool("vlx-trace", arguments); }

std::string bytes(const std::string& path) {
    std::ifstream stream(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
}

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
    std::ofstream(folder / "truncated.glb", std::ios::binary) << bytes(kScene).substr(0, 100000);
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

}  // namespace
}  // namespace vlx
