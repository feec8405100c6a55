// vlx-pack's importers from the command line: what they print, and how they fail.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "../dump/renderer_files.h"
#include "../dump/test_dumps.h"
#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

ToolRun pack(const std::vector<std::string>& arguments) { return runTool("vlx-pack", arguments); }

struct Sources {
    Sources() {
        writeBytes(folder / "s.raw", bcdRawBytes({}));
        SbmcTileFile tile;
        for (const auto& [x, y] : {std::pair{0, 0}, {4, 0}, {0, 4}, {4, 4}}) {
            tile.x = x;
            tile.y = y;
            writeBytes(folder / ("t" + std::to_string(x) + std::to_string(y) + ".bin"), sbmcTileBytes(tile));
        }
        const auto value = [](int c, int x, int y) { return static_cast<float>(c + x + y); };
        writeImage(folder / "a_0001.exr", imageOf({0, 0, 4, 3}, {"R", "G", "B"}, value));
        writeImage(folder / "a_0002.exr", imageOf({0, 0, 4, 3}, {"R", "G", "B", "A"}, value));
        writeImage(folder / "mse.exr",
                   imageOf({0, 0, 4, 3}, {"R", "G", "B", "mse.R", "mse.G", "mse.B"}, value));
    }
    const TemporaryFolder folder;
    const std::string out = folder / "d.exr";
};

TEST(VlxPackImport, EachCommandSaysWhatItTookAndWhatIsMissing) {
    const Sources s;
    const std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>> cases = {
        {{"stack", s.folder / "a_####.exr", "-o", s.out}, {"2 images", "R from R", "lacks albedo"}},
        {{"stack", s.folder / "a_####.exr", "-o", s.out, "--map", "motion.x=-1*G", "--map", "motion.y=0.5*B"},
         {"motion.x from -1*G", "motion.y from 0.5*B", "nothing about motionNext.x, motionNext.y"}},
        {{"buffers", s.folder / "a_0001.exr", s.folder / "a_0002.exr", "-o", s.out},
         {"two half-buffers", "lacks variances"}},
        {{"moments", s.folder / "mse.exr", "-o", s.out},
         {"variance.R from mse.R", "the variance of the mean", "lacks single samples"}},
        {{"bcd", s.folder / "s.raw", "-o", s.out}, {"3 samples in each pixel", "lacks sample positions"}},
        {{"sbmc", s.folder / "t00.bin", s.folder / "t40.bin", s.folder / "t04.bin", s.folder / "t44.bin",
          "-o", s.out},
         {"4 tiles of SBMC", "left out: the reference", "A from hasHit"}}};
    for (const auto& [arguments, parts] : cases) {
        const ToolRun run = pack(arguments);
        EXPECT_EQ(run.exitCode, 0) << run.err;
        EXPECT_EQ(run.err, "");
        for (const std::string& part : parts)
            EXPECT_NE(run.out.find(part), std::string::npos) << part << run.out;
        EXPECT_NO_THROW(DumpReader(s.out).header());
        EXPECT_EQ(pack({"info", s.out}).exitCode, 0);
    }
}

TEST(VlxPackImport, BadUsageAndFailures) {
    const Sources s;
    const std::string raw = s.folder / "s.raw", image = s.folder / "mse.exr";
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"bcd", raw, raw, "-o", s.out},
          {"bcd", image, "-o", s.out},
          {"bcd", raw},
          {"moments", image, "-o", s.out, "--variance-is", "big"},
          {"moments", image, "-o", s.out, "--samples", "0"},
          {"moments", image, "-o", image},
          {"moments", image, "-o", s.out, "--map", "R"},
          {"stack", image, "-o", s.out, "--map", "Z=x*G"},
          {"stack", image, "-o", s.out, "--map", "Z=*G"},
          {"stack", image, "-o", s.out, "--map", "Z=2*"},
          {"stack", image, "-o", s.out, "--map", "Z=0*G"},
          {"stack", image, "-o", s.out, "--map", "Z=nan*G"},
          {"stack", image, "-o", s.out, "--map", "Z=1e99*G"},
          {"buffers", image, "-o", s.out},
          {"bcd", raw, "-o", s.out, "--samples", "4"},
          {"bcd", raw, "-o", s.out, "--single"},
          {"bcd", raw, "-o", s.out, "--seed", "4"},
          {"moments", image, "-o", s.out, "--single", "--seed", "4"},
          {"sbmc", "-o", s.out},
          {"merge", image},
          {"merge", image, "-o", s.out, "--log", "loud"}}) {
        const ToolRun run = pack(arguments);
        EXPECT_EQ(run.exitCode, 2) << run.err;
        EXPECT_TRUE(run.err.starts_with("vlx-pack: ")) << run.err;
    }
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"bcd", s.folder / "t00.bin", "-o", s.out},
          {"sbmc", raw, "-o", s.out},
          {"sbmc", s.folder / "t00.bin", s.folder / "t44.bin", "-o", s.out},
          {"stack", s.folder / "b_####.exr", "-o", s.out},
          {"moments", s.folder / "a_0001.exr", "-o", s.out},
          {"moments", image, "-o", s.out, "--preset", "mitsuba"},
          {"merge", s.folder / "none.exr", "-o", s.out}}) {
        const ToolRun run = pack(arguments);
        EXPECT_EQ(run.exitCode, 1) << run.err;
        EXPECT_TRUE(run.err.starts_with("vlx-pack: /")) << run.err;
    }
    EXPECT_FALSE(std::filesystem::exists(s.out));
}

TEST(VlxPackMerge, BandsBecomeOneFile) {
    const Sources s;
    for (int i = 0; i < 2; ++i) {
        Image band({0, 2 * i, 4, 2}, {"R", "G", "B"});
        band.display = {0, 0, 4, 4};
        writeImage(s.folder / ("band_000" + std::to_string(i) + ".exr"), band);
    }
    EXPECT_EQ(pack({"merge", s.folder / "band_####.exr", "-o", s.out}).exitCode, 0);
    EXPECT_EQ(readImage(s.out).data, (Window{0, 0, 4, 4}));
    const ToolRun missing = pack({"merge", s.folder / "band_0001.exr", "-o", s.out});
    EXPECT_EQ(missing.exitCode, 1);
    EXPECT_NE(missing.err.find("no part holds rows 0 to 1"), std::string::npos) << missing.err;
}

TEST(ToolLog, JsonLinesOnStandardErrorAndOpenJdOnStandardOutput) {
    const Sources s;
    const ToolRun json = pack({"stack", s.folder / "a_0001.exr", "-o", s.out, "--log", "json"});
    EXPECT_EQ(json.exitCode, 0);
    std::vector<nlohmann::json> records;
    std::istringstream lines(json.err);
    for (std::string line; std::getline(lines, line);) records.push_back(nlohmann::json::parse(line));
    ASSERT_GE(records.size(), 2u);
    EXPECT_EQ(records.front()["event"], "progress");
    EXPECT_EQ(records.front()["task"], "stacking");
    EXPECT_EQ(records[records.size() - 2]["fraction"], 1.0);
    EXPECT_EQ(records.back()["event"], "end");
    EXPECT_EQ(records.back()["exitCode"], 0);

    const ToolRun failed = pack({"--log", "json", "stack", s.folder / "no.exr", "-o", s.out});
    EXPECT_EQ(failed.exitCode, 1);
    const auto end = nlohmann::json::parse(failed.err);
    EXPECT_EQ(end["exitCode"], 1);
    EXPECT_NE(end["message"].get<std::string>().find("no.exr: expected an image"), std::string::npos);

    const ToolRun openjd =
        pack({"stack", s.folder / "a_0001.exr", "-o", s.out, "--log", "openjd", "--overwrite"});
    EXPECT_NE(openjd.out.find("openjd_progress: 100.0\n"), std::string::npos) << openjd.out;
    EXPECT_EQ(openjd.err, "");
}

TEST(ToolHelp, EndsWithTheExitCodesAndKnowsItsManualPage) {
    EXPECT_NE(pack({"--help"}).out.find("Exit codes: 0 done; 1"), std::string::npos);
    const ToolRun page = pack({"--help-man"});
    EXPECT_EQ(page.exitCode, 0);
    EXPECT_TRUE(page.out.starts_with(".TH VLX\\-PACK 1")) << page.out.substr(0, 80);
    EXPECT_NE(page.out.find(".SS vlx\\-pack moments"), std::string::npos);
}

// Two frames of two images each, f_0001_sA.exr and so on, as Blender would write them.
struct Shot {
    Shot() {
        const std::vector<std::string> names = {"L.Combined.R",     "L.Combined.G",    "L.Combined.B",
                                                "L.Combined.A",     "L.Mist.Z",        "L.Combined_key.R",
                                                "L.Combined_key.G", "L.Combined_key.B"};
        ImageWriteOptions write;
        write.attributes["cycles.L.samples"] = "4";
        for (const int frame : {1, 2})
            for (const char seed : {'A', 'B'})
                writeImage(
                    folder / ("f_000" + std::to_string(frame) + "_s" + seed + ".exr"),
                    imageOf({0, 0, 4, 3}, names,
                            [&](int c, int x, int y) {
                                return static_cast<float>(frame * 100 + seed + x + y + (c == 4 ? 1 : 0));
                            }),
                    write);
    }
    std::vector<std::string> stack(const std::vector<std::string>& more) const {
        std::vector<std::string> arguments = {"stack", folder / "f_####_s?.exr", "-o", folder / "d_####.exr"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return arguments;
    }
    const TemporaryFolder folder;
};

TEST(VlxPackStack, FramesAreStackedOneByOne) {
    const Shot shot;
    ToolRun run =
        pack(shot.stack({"--frames", "1-3", "--groups", "auto", "--passes", shot.folder / "p_####.exr"}));
    EXPECT_EQ(run.exitCode, 1);  // there is no frame 3
    EXPECT_NE(run.err.find("frame 3: "), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("1 of 3 frames failed: 3"), std::string::npos) << run.err;
    EXPECT_NE(run.out.find("2 images of 4 samples each"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("Light groups add up to the light"), std::string::npos) << run.out;
    for (const int frame : {1, 2}) {
        const std::string number = "000" + std::to_string(frame);
        const SampleBand band = DumpReader(shot.folder / ("d_" + number + ".exr")).read(0, 1, {"R"});
        EXPECT_EQ(band.values[0][1], static_cast<float>(frame * 100 + 'B'));
        EXPECT_EQ(readImage(shot.folder / ("p_" + number + ".exr")).at(0, 0)[0],
                  static_cast<float>(frame * 100) + 65.5f);
    }
    run = pack(shot.stack({"--frames", "1,2", "--groups", "auto", "--passes", shot.folder / "p_####.exr"}));
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find("d_0002.exr: is finished"), std::string::npos) << run.err;
    EXPECT_NE(pack({"info", shot.folder / "d_0001.exr"}).out.find("the mean of 4 samples of the renderer"),
              std::string::npos);
}

TEST(VlxPackStack, NamesWithoutAPlaceForTheFrameAreBadUsage) {
    const Shot shot;
    const std::string one = shot.folder / "f_0001_sA.exr", out = shot.folder / "d.exr";
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{"stack", one, "-o", shot.folder / "d_####.exr", "--frames", "1"},
          {"stack", shot.folder / "f_####_s?.exr", "-o", out, "--frames", "1"},
          shot.stack({"--frames", "1", "--append", one}),
          shot.stack({"--frames", "1", "--passes", one}),
          shot.stack({"--frames", "1", "--groups", "all"})}) {
        const ToolRun run = pack(arguments);
        EXPECT_EQ(run.exitCode, 2) << run.out;
    }
    const ToolRun both = pack({"stack", shot.folder / "f_####_s?.exr", "-o", out});
    EXPECT_EQ(both.exitCode, 1);
    EXPECT_NE(both.err.find("with --frames LIST"), std::string::npos) << both.err;
}

TEST(VlxPackStack, TheNamedViewLayerIsTakenWithItsFeatures) {
    const TemporaryFolder folder;
    std::vector<std::string> names;
    for (const char* layer : {"L.", "M."})
        for (const char* pass : {"Combined.R", "Combined.G", "Combined.B", "Combined.A", "Combined_key.R",
                                 "Combined_key.G", "Combined_key.B", "Denoising Depth.Z"})
            names.push_back(std::string(layer) + pass);
    ImageWriteOptions write;
    write.attributes["cycles.M.samples"] = "4";
    const std::string image = folder / "i.exr", out = folder / "d.exr";
    writeImage(image, imageOf({0, 0, 2, 2}, names, [](int c, int, int) { return static_cast<float>(c); }),
               write);
    const ToolRun first = pack({"stack", image, "-o", out});
    EXPECT_NE(first.out.find("  left out: 8 channels of M.Combined, M.Combined_key, M.Denoising Depth\n"),
              std::string::npos)
        << first.out;
    const ToolRun run =
        pack({"stack", image, "-o", out, "--layer", "M", "--groups", "auto", "--passes", folder / "p.exr"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("of 4 samples each"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("--radiance 'M.Combined_key'"), std::string::npos) << run.out;
    const SampleBand band = DumpReader(out).read(0, 1, {"R", "Z", "M.Combined_key.G"});
    EXPECT_EQ(band.values[0][0], 8);
    EXPECT_EQ(band.values[1][0], 15);
    EXPECT_EQ(band.values[2][0], 13);
    EXPECT_EQ(pack({"stack", image, "-o", out, "--layer", "M.Combined_key"}).exitCode, 0);
    EXPECT_EQ(DumpReader(out).read(0, 1, {"R"}).values[0][0], 12);
    const ToolRun none = pack({"stack", image, "-o", out, "--layer", "N"});
    EXPECT_EQ(none.exitCode, 1);
    EXPECT_NE(none.err.find("expected a layer N of colours"), std::string::npos) << none.err;
}

TEST(VlxPackStack, AnEarlierDumpIsNotOverwritten) {
    const Shot shot;
    const std::string a = shot.folder / "f_0001_sA.exr", b = shot.folder / "f_0001_sB.exr";
    const std::string first = shot.folder / "a.exr", both = shot.folder / "b.exr";
    const ToolRun one = pack({"stack", a, "-o", first});
    EXPECT_EQ(one.exitCode, 0);
    EXPECT_TRUE(one.out.starts_with(first + ": 1 image\n")) << one.out;
    EXPECT_EQ(one.out.find("samples had a depth"), std::string::npos) << one.out;
    EXPECT_NE(one.out.find("  left out: L.Combined_key.R, L.Combined_key.G, L.Combined_key.B, L.Mist.Z\n"),
              std::string::npos)
        << one.out;
    EXPECT_EQ(pack({"stack", b, "-o", first, "--append", first}).exitCode, 2);
    EXPECT_EQ(pack({"stack", b, "-o", both, "--passes", both}).exitCode, 2);
    const ToolRun run = pack({"stack", b, "-o", both, "--append", first});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_TRUE(run.out.starts_with(both + ": 1 image added to " + first + "\n")) << run.out;
    EXPECT_NE(run.out.find("the 1 sample a pixel of " + first + ", which makes 2;"), std::string::npos)
        << run.out;
    EXPECT_EQ(DumpReader(both).read(0, 1, {"R"}).values[0],
              (std::vector<float>{165, 166, 166, 167, 167, 168, 168, 169}));
    EXPECT_NE(pack({"stack", b, "-o", both, "--append", first}).err.find("is finished"), std::string::npos);
    EXPECT_EQ(pack({"stack", b, "-o", both, "--append", both + "/no"}).exitCode, 1);
}

}  // namespace
}  // namespace vlx
