// Another denoiser's image for vlx-krige, given and made.

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"

namespace vlx {
namespace {

const std::string kSamples = VLX_TESTDATA "/dumps/tungsten_cornell.exr";

struct KrigeOpinion : testing::Test {
    ToolRun krige(std::vector<std::string> more) {
        more.insert(more.begin(), {kSamples, "-o", out, "--json", "--overwrite"});
        return runTool("vlx-krige", more);
    }
    nlohmann::json reportOf(const ToolRun& run) {
        EXPECT_EQ(run.exitCode, 0) << run.err;
        return run.exitCode == 0 ? nlohmann::json::parse(run.out)["secondOpinion"] : nlohmann::json();
    }
    /// A program in `folder`, first in PATH.
    void program(const std::string& name, const std::string& text) {
        std::ofstream(folder / name) << "#!/bin/sh\n" << text << "\n";
        ::chmod((folder / name).c_str(), 0755);
    }
    TemporaryFolder folder;
    std::string out = folder / "out.exr";
};

TEST_F(KrigeOpinion, ImagesAndHalvesOfAnyFormat) {
    ASSERT_EQ(runTool("vlx-pack", {"halves", kSamples, "-o", folder / "h"}).exitCode, 0);
    const auto report = reportOf(krige({"--denoised", folder / "h_color.pfm", "--denoised-halves",
                                        folder / "h_even_color.pfm" + "," + (folder / "h_odd_color.pfm")}));
    EXPECT_TRUE(report["validated"].get<bool>());
    EXPECT_GT(report["weight"].get<double>(), 0.8);  // the samples' own mean is no denoiser
    // What the kriging made, a layer of a file, is a good one.
    const Image kriged = readImage(out);
    Image layers = kriged.select({"R", "G", "B"});
    layers.channels = {"View.Denoised.R", "View.Denoised.G", "View.Denoised.B"};
    writeImage(folder / "layers.exr", layers);
    const auto alone = reportOf(krige({"--denoised", (folder / "layers.exr") + ":View.Denoised"}));
    EXPECT_FALSE(alone["validated"].get<bool>());
    EXPECT_EQ(alone["weight"].get<double>(), 0.5);
}

TEST_F(KrigeOpinion, WrongImagesAreErrors) {
    ASSERT_EQ(krige({}).exitCode, 0);
    const Image rgb = readImage(out).select({"R", "G", "B"});
    writeImage(folder / "rgb.exr", rgb);
    const auto expectError = [&](const Image& image, const std::string& text) {
        writeImage(folder / "wrong.exr", image);
        const ToolRun run = krige({"--denoised", folder / "wrong.exr"});
        EXPECT_EQ(run.exitCode, 1) << text;
        EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
    };
    Image moved = rgb;
    moved.data.x += 1;
    moved.display.x += 1;
    expectError(moved, "window");
    Image infinite = rgb;
    infinite.pixels[4] = std::numeric_limits<float>::infinity();
    expectError(infinite, "up to 2^50, found inf");
    EXPECT_EQ(krige({"--denoised", folder / "none.exr"}).exitCode, 1);
    EXPECT_EQ(krige({"--denoised", (folder / "wrong.exr") + ":Layer"}).exitCode, 1);
    EXPECT_EQ(krige({"--denoised", folder / "rgb.exr", "--denoised-halves", "one.exr"}).exitCode, 2);
    EXPECT_EQ(krige({"--denoised", folder / "rgb.exr", "--scale", "2"}).exitCode, 2);
    EXPECT_EQ(krige({"--denoised", folder / "rgb.exr", "--strength", "0.5"}).exitCode, 2);
    EXPECT_EQ(krige({"--denoised", folder / "rgb.exr", "--method", "paper"}).exitCode, 2);
}

TEST_F(KrigeOpinion, AnImageIsAssessed) {
    ASSERT_EQ(runTool("vlx-pack", {"halves", kSamples, "-o", folder / "h,1"}).exitCode, 0);
    const std::string image = folder / "h,1_color.pfm";
    const ToolRun run = krige({"--assess", image, "--assess-halves",
                               folder / "h,1_even_color.pfm" + "," + (folder / "h,1_odd_color.pfm")});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto report = nlohmann::json::parse(run.out);
    EXPECT_GT(report["high"].get<double>(), report["relMse"].get<double>());
    EXPECT_LT(report["low"].get<double>(), report["relMse"].get<double>());
    EXPECT_FALSE(report["byHalves"].is_null());
    const ToolRun again =
        runTool("vlx-krige", {kSamples, "-o", out, "--json", "--assess", image, "--assess-halves",
                              folder / "h,1_even_color.pfm" + "," + (folder / "h,1_odd_color.pfm")});
    EXPECT_EQ(again.out, run.out);  // finished, and its answer kept
    EXPECT_NE(again.err.find("skipped"), std::string::npos) << again.err;
    EXPECT_EQ(readImage(out).channels, (std::vector<std::string>{"confidence", "bias.R", "bias.G", "bias.B",
                                                                 "stddev.R", "stddev.G", "stddev.B"}));
    // The plain average's error, as its own samples tell it.
    ASSERT_EQ(krige({"--method", "mean"}).exitCode, 0);
    const Image mean = readImage(out);
    double own = 0;
    for (std::size_t p = 0; p < static_cast<std::size_t>(mean.data.pixels()); ++p)
        for (const char* c : {"R", "G", "B"}) {
            const auto width = static_cast<std::size_t>(mean.channelCount());
            const double x = mean.pixels[p * width + static_cast<std::size_t>(mean.channel(c))],
                         s = mean.pixels[p * width +
                                         static_cast<std::size_t>(mean.channel(std::string("stddev.") + c))];
            own += s * s / (x * x + 0.01) / 3 / static_cast<double>(mean.data.pixels());
        }
    EXPECT_NEAR(report["relMse"].get<double>() / own, 1, 0.5);
    const auto alone = krige({"--assess", image});
    ASSERT_EQ(alone.exitCode, 0) << alone.err;
    EXPECT_TRUE(nlohmann::json::parse(alone.out)["byHalves"].is_null());
    for (const std::vector<std::string>& bad :
         {std::vector<std::string>{"--assess", image, "--denoised", image},
          {"--assess-halves", "a,b"},
          {"--assess", image, "--assess-halves", "even"},
          {"--assess", image, "--band", "1/2"},
          {"--assess", image, "--max-memory", "1G"},
          {"--assess", image, "--method", "mean"}})
        EXPECT_EQ(krige(bad).exitCode, 2) << bad.back();
}

TEST_F(KrigeOpinion, ADenoiserIsRunOnAllThree) {
    program("copy it", "echo \"$1\" >> '" + (folder / "calls") + "'; cp \"$1\" \"$2\"");
    const auto report = reportOf(krige({"--denoiser", "'" + (folder / "copy it") + "' {color} {output}"}));
    EXPECT_TRUE(report["validated"].get<bool>());
    std::ifstream calls(folder / "calls");
    int count = 0;
    for (std::string line; std::getline(calls, line); ++count)
        EXPECT_FALSE(std::filesystem::exists(line)) << "the temporary folder is gone";
    EXPECT_EQ(count, 3);
    // Of one sample a pixel there are no halves.
    ASSERT_EQ(runTool("vlx-pack", {"subset", kSamples, "-o", folder / "one.exr", "--samples", "1"}).exitCode,
              0);
    const ToolRun one = runTool("vlx-krige", {folder / "one.exr", "-o", out, "--overwrite", "--denoiser",
                                              "'" + (folder / "copy it") + "' {color} {output}"});
    EXPECT_EQ(one.exitCode, 0) << one.err;
    std::ifstream more(folder / "calls");
    for (std::string line; std::getline(more, line);) --count;
    EXPECT_EQ(count, -1);
}

TEST_F(KrigeOpinion, WhatADenoiserDoesWrongIsTold) {
    program("fails", "echo 'no licence' >&2; exit 3");
    const ToolRun failed = krige({"--denoiser", (folder / "fails") + " {color} {output}"});
    EXPECT_EQ(failed.exitCode, 1);
    EXPECT_NE(failed.err.find("failed with exit code 3: no licence"), std::string::npos) << failed.err;
    const ToolRun missing = krige({"--denoiser", "no-such-denoiser {color} {output}"});
    EXPECT_EQ(missing.exitCode, 1);
    EXPECT_NE(missing.err.find("was not found in PATH"), std::string::npos) << missing.err;
    const ToolRun silent = krige({"--denoiser", "true {color} {output}"});
    EXPECT_EQ(silent.exitCode, 1);
    EXPECT_NE(silent.err.find("found no such file"), std::string::npos) << silent.err;
    const ToolRun open = krige({"--denoiser", "cp '{color} {output}"});
    EXPECT_EQ(open.exitCode, 2);
    for (const char* bad : {"cp {color}", "cp {colour} {output}", "cp {color} {output} {albedo", ""})
        EXPECT_EQ(krige({"--denoiser", bad}).exitCode, 2) << bad;
    EXPECT_NE(open.err.find("closing '"), std::string::npos) << open.err;
    EXPECT_FALSE(std::filesystem::exists(out));
}

TEST_F(KrigeOpinion, OidnGetsCleanFeatures) {
    // A stand-in that checks its arguments: features first, then the image with them.
    program("oidnDenoise", "echo \"$1 $3 $5 $7 $8\" >> '" + (folder / "calls") +
                               "'\nfor last; do :; done\n[ -f \"$2\" ] || exit 4\ncp \"$2\" \"$last\"");
    const std::string path = std::getenv("PATH");
    ::setenv("PATH", (folder / "." + ":" + path).c_str(), 1);
    const auto report = reportOf(krige({"--denoiser", "oidn"}));
    ::setenv("PATH", path.c_str(), 1);
    EXPECT_TRUE(report["validated"].get<bool>());
    std::ifstream calls(folder / "calls");
    std::vector<std::string> lines;
    for (std::string line; std::getline(calls, line);) lines.push_back(line);
    ASSERT_EQ(lines.size(), 9U);
    EXPECT_EQ(lines[0], "--alb -o   ");
    EXPECT_EQ(lines[1], "--nrm -o   ");
    EXPECT_EQ(lines[2], "--hdr --alb --nrm --clean_aux -o");
}

}  // namespace
}  // namespace vlx
