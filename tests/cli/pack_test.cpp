#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

const std::string kDump = VLX_TESTDATA "/dumps/tungsten_cornell.exr";

ToolRun pack(const std::vector<std::string>& arguments) { return runTool("vlx-pack", arguments); }

std::vector<std::string> writeImages(const TemporaryFolder& folder, const std::string& layer = "") {
    std::vector<std::string> paths;
    for (int i = 0; i < 3; ++i) {
        Image image({0, 0, 5, 4}, {layer + "R", layer + "G", layer + "B"});
        for (std::size_t k = 0; k < image.pixels.size(); ++k)
            image.pixels[k] = static_cast<float>(k) + 100.0f * static_cast<float>(i);
        paths.push_back(folder / ("image" + std::to_string(i) + ".exr"));
        writeImage(paths.back(), image);
    }
    return paths;
}

TEST(VlxPack, HelpAndVersion) {
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"--help"}, {"info", "--help"}, {"stack", "--help"}, {"--version"}}) {
        const ToolRun run = pack(arguments);
        EXPECT_EQ(run.exitCode, 0);
        EXPECT_NE(run.out, "");
        EXPECT_EQ(run.err, "");
    }
    EXPECT_NE(pack({"--help"}).out.find("stack"), std::string::npos);
    for (const char* flag : {"--output", "--preset", "--map", "--renderer", "--compression"})
        EXPECT_NE(pack({"stack", "--help"}).out.find(flag), std::string::npos) << flag;
}

TEST(VlxPack, BadUsageIsExitTwoWithAMessage) {
    const TemporaryFolder folder;
    const std::string out = folder / "d.exr";
    const auto images = writeImages(folder);
    const int before = folder.entries();
    for (const std::vector<std::string>& arguments : {std::vector<std::string>{},
                                                      {"nonsense"},
                                                      {"info"},
                                                      {"info", kDump, "more"},
                                                      {"info", kDump, "--nonsense"},
                                                      {"stack"},
                                                      {"stack", "-o", out},
                                                      {"stack", images[0]},
                                                      {"stack", images[0], "-o"},
                                                      {"stack", images[0], "-o", out, "--preset"},
                                                      {"stack", images[0], "-o", out, "--preset", "1"},
                                                      {"stack", images[0], "-o", out, "--compression"},
                                                      {"stack", images[0], "-o", out, "--compression", "zip"},
                                                      {"stack", images[0], "-o", out, "--renderer"},
                                                      {"stack", images[0], "-o", out, "--map"},
                                                      {"stack", images[0], "-o", out, "--map", "R"},
                                                      {"stack", images[0], "-o", out, "--map", "=G"},
                                                      {"stack", images[0], "-o", out, "--map", "R="},
                                                      {"stack", images[0], "-o", images[0]}}) {
        const ToolRun run = pack(arguments);
        std::string line = "vlx-pack";
        for (const auto& argument : arguments) line += " " + argument;
        EXPECT_EQ(run.exitCode, 2) << line;
        EXPECT_EQ(run.out, "") << line;
        EXPECT_TRUE(run.err.starts_with("vlx-pack: ")) << line << "\n" << run.err;
    }
    EXPECT_EQ(folder.entries(), before);
}

TEST(VlxPack, FailuresAreExitOneAndNameTheFile) {
    const TemporaryFolder folder;
    std::ofstream(folder / "text.exr") << "not an image";
    const auto images = writeImages(folder);
    const int before = folder.entries();
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"info", folder / "no.exr"},
          {"info", folder / "text.exr"},
          {"info", images[0]},
          {"stack", images[0], folder / "no.exr", "-o", folder / "d.exr"},
          {"stack", kDump, "-o", folder / "d.exr"},
          {"stack", images[0], "-o", folder / "no/d.exr"},
          {"stack", images[0], "-o", folder / "d.exr", "--preset", "cycles"},
          {"stack", images[0], "-o", folder / "d.exr", "--map", "A=alpha"}}) {
        const ToolRun run = pack(arguments);
        EXPECT_EQ(run.exitCode, 1);
        EXPECT_EQ(run.out, "");
        EXPECT_TRUE(run.err.starts_with("vlx-pack: /")) << run.err;
        EXPECT_NE(run.err.find(".exr: "), std::string::npos) << run.err;
    }
    EXPECT_EQ(folder.entries(), before);
}

TEST(VlxPack, InfoForPeopleAndMachines) {
    const ToolRun text = pack({"info", kDump});
    EXPECT_EQ(text.exitCode, 0);
    EXPECT_EQ(text.err, "");
    for (const char* part : {"Tungsten", "20 x 20 pixels at (100, 120)", "256 x 256", "3200",
                             "sample.x (float)", "zips", "missing"})
        EXPECT_NE(text.out.find(part), std::string::npos) << part << " in\n" << text.out;

    const ToolRun run = pack({"info", kDump, "--json"});
    EXPECT_EQ(run.exitCode, 0);
    const auto json = nlohmann::json::parse(run.out);
    EXPECT_EQ(json["renderer"], "Tungsten");
    EXPECT_EQ(json["samples"]["total"], 3200);
    EXPECT_EQ(json["samples"]["min"], 8);
    EXPECT_EQ(json["samples"]["max"], 8);
    EXPECT_EQ(json["fileBytes"], std::filesystem::file_size(kDump));
    EXPECT_EQ(json["channels"].size(), 13u);
    EXPECT_FALSE(json["missing"].empty());
}

TEST(VlxPack, StackWithMapAndCompression) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder, "Combined.");
    const ToolRun run =
        pack({"stack", images[0], images[1], images[2], "-o", folder / "d.exr", "--map", "A=Combined.B",
              "--map", "G=Combined.R", "--compression", "none", "--renderer", "mine"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("G from Combined.R"), std::string::npos) << run.out;
    const DumpReader reader(folder / "d.exr");
    EXPECT_EQ(reader.header().renderer, "mine");
    EXPECT_EQ(reader.header().compression, DumpCompression::None);
    const SampleBand band = reader.read(3, 1, {"R", "G", "B", "A", "sample.replicate"});
    const auto last = static_cast<std::size_t>(3 * 4 + 2);  // third image's sample of the last pixel
    EXPECT_EQ(band.values[0][last], 257.0f);
    EXPECT_EQ(band.values[1][last], 257.0f);
    EXPECT_EQ(band.values[2][last], 259.0f);
    EXPECT_EQ(band.values[3][last], 259.0f);
    EXPECT_EQ(band.values[4][last], 2.0f);
}

TEST(VlxPack, SubsetsShareNoSamples) {
    const TemporaryFolder folder;
    std::vector<float> seen;
    for (const char* part : {"0", "1"}) {
        const ToolRun run = pack(
            {"subset", kDump, "-o", folder / "part.exr", "--samples", "4", "--part", part, "--seed", "3"});
        ASSERT_EQ(run.exitCode, 0) << run.err;
        const DumpReader reader(folder / "part.exr");
        const SampleBand band = reader.read(120, 1, {"sample.x"});
        EXPECT_EQ(band.samples(), 80u);
        seen.insert(seen.end(), band.values[0].begin(), band.values[0].end());
    }
    std::vector<float> all = DumpReader(kDump).read(120, 1, {"sample.x"}).values[0];
    std::sort(all.begin(), all.end());
    std::sort(seen.begin(), seen.end());
    EXPECT_EQ(seen, all);
    const ToolRun many = pack({"subset", kDump, "-o", folder / "no.exr", "--samples", "4", "--part", "2"});
    EXPECT_EQ(many.exitCode, 1);
    EXPECT_NE(many.err.find("expected at least 12 samples"), std::string::npos) << many.err;
    EXPECT_EQ(pack({"subset", kDump, "-o", folder / "no.exr"}).exitCode, 2);
    EXPECT_EQ(pack({"subset", kDump, "-o", folder / "no.exr", "--samples", "0"}).exitCode, 2);
    EXPECT_EQ(pack({"subset", kDump, "-o", kDump, "--samples", "1"}).exitCode, 2);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(VlxPack, FullDiskLeavesNothing) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder);
    const int before = folder.entries();
    const ToolRun run = runTool("vlx-pack", {"stack", images[0], images[1], "-o", folder / "d.exr"}, {2000});
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find("d.exr: writing failed"), std::string::npos) << run.err;
    EXPECT_EQ(folder.entries(), before);
}

}  // namespace
}  // namespace vlx
