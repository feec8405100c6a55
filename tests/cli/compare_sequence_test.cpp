// vlx-compare sequence from the command line.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/writer.h"

namespace vlx {
namespace {

using Json = nlohmann::json;

ToolRun sequence(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "sequence");
    return runTool("vlx-compare", arguments);
}

/// Frames 1 to 3 of 32 x 20 pixels: references of 0.5, results 0.25 too bright in columns that move by one to
/// the right, and motion as an image and as a dump. A result's alternative is too bright and too dark by
/// turns.
class SequenceTool : public testing::Test {
  protected:
    SequenceTool() {
        for (int frame = 1; frame <= 3; ++frame) {
            const std::string number = std::to_string(frame) + ".exr";
            Image reference(kWindow, {"R", "G", "B"});
            for (float& pixel : reference.pixels) pixel = 0.5f;
            Image image = reference, other = reference;
            for (int row = 0; row < kWindow.height; ++row)
                for (int col = 0; col < kWindow.width; ++col)
                    for (int c = 0; c < 3; ++c) {
                        image.at(col, row)[c] += (col - frame + 8) % 4 == 0 ? 0.25f : 0;
                        other.at(col, row)[c] += frame % 2 == 0 ? 0.25f : -0.25f;
                    }
            writeImage(folder_ / ("ref_0" + number), reference);
            writeImage(folder_ / ("out_0" + number), image);
            writeImage(folder_ / ("other_0" + number), other);
            Image motion(kWindow, {"motion.x", "motion.y", "motionNext.x"});
            for (std::size_t i = 0; i < motion.pixels.size(); i += 3) motion.pixels[i] = -1;
            writeImage(folder_ / ("motion_0" + number), motion);
            writeDump(folder_ / ("dump_0" + number));
        }
    }

    // Two samples a pixel with a motion of -1 in the mean, and one whose motion is not known.
    static void writeDump(const std::string& path) {
        DumpHeader header;
        header.data = header.display = kWindow;
        for (const char* name : {"R", "G", "B", "motion.x", "motion.y"})
            header.channels.push_back({name, ChannelType::Float});
        SampleBand band;
        band.x = kWindow.x;
        band.y = kWindow.y;
        band.width = kWindow.width;
        band.height = kWindow.height;
        band.channels = {"R", "G", "B", "motion.x", "motion.y"};
        band.values.resize(5);
        for (std::size_t p = 0; p <= band.pixels(); ++p) band.offsets.push_back(3 * p);
        for (std::size_t p = 0; p < band.pixels(); ++p)
            for (const float x : {-0.5f, -1.5f, NAN}) {
                for (std::size_t c = 0; c < 3; ++c) band.values[c].push_back(0.5f);
                band.values[3].push_back(x);
                band.values[4].push_back(x * 0);
            }
        DumpWriter writer(path, header);
        writer.write(std::move(band));
        writer.close();
    }

    static constexpr Window kWindow{2, 3, 32, 20};
    const TemporaryFolder folder_;
    const std::string ref_ = folder_ / "ref_##.exr", out_ = folder_ / "out_##.exr",
                      other_ = folder_ / "other_##.exr";
};

TEST_F(SequenceTool, TableHoldsErrorsOfFramesAndFlicker) {
    const ToolRun run = sequence({ref_, out_, other_, "--motion", folder_ / "motion_##.exr"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.err, "");
    EXPECT_TRUE(run.out.starts_with("3 frames (1 to 3) of 32 x 20 pixels, against ")) << run.out;
    std::vector<std::string> words;
    std::istringstream stream(run.out.substr(run.out.find("\n\n")));
    for (std::string word; stream >> word;) words.push_back(word);
    const std::vector<std::string> expected = {"relMSE", "of",   "frame", "out_##", "other_##", "1",
                                               "0.0601", "0.24", "2",     "0.0601", "0.24"};
    ASSERT_GT(words.size(), expected.size());
    EXPECT_TRUE(std::equal(expected.begin(), expected.end(), words.begin())) << run.out;
    EXPECT_NE(run.out.find("flicker along motion "), std::string::npos) << run.out;
}

TEST_F(SequenceTool, JsonHoldsExactNumbers) {
    for (const char* motion : {"motion_##.exr", "dump_##.exr"}) {
        const ToolRun run = sequence({ref_, out_, other_, "--json", "--motion", folder_ / motion});
        ASSERT_EQ(run.exitCode, 0) << run.err;
        const Json json = Json::parse(run.out), &out = json["sequences"][0], &other = json["sequences"][1];
        EXPECT_EQ(json["motion"], folder_ / motion);
        EXPECT_EQ(json["window"], Json({2, 3, 32, 20}));
        EXPECT_EQ(out["name"], "out_##");
        EXPECT_NEAR(out["relmse"]["value"], 0.0625 / 0.26 / 4, 1e-12);
        EXPECT_NEAR(out["flicker"]["value"], 0.0625 / 0.26 / 2, 1e-12);
        EXPECT_EQ(out["flicker_along_motion"]["value"], 0);
        EXPECT_NEAR(other["flicker"]["value"], 0.25 / 0.26, 1e-12);
        EXPECT_NEAR(other["flicker"]["lower"], 0.25 / 0.26, 1e-12);  // the same everywhere
        EXPECT_NEAR(other["flicker_along_motion"]["value"], 0.25 / 0.26, 1e-12);
        ASSERT_EQ(out["frames"].size(), 3u);
        EXPECT_TRUE(out["frames"][0]["flicker"].is_null());
        EXPECT_EQ(out["frames"][2]["frame"], 3);
        EXPECT_NEAR(other["frames"][1]["metrics"]["rmse"], 0.25, 1e-12);
    }
}

TEST_F(SequenceTool, FramesCanBeChosen) {
    const ToolRun run = sequence({ref_, out_, "--frames", "3,1", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const Json json = Json::parse(run.out);
    EXPECT_EQ(json["sequences"][0]["frames"][0]["frame"], 1);
    EXPECT_TRUE(json["sequences"][0]["flicker"]["value"].is_null());
    EXPECT_TRUE(json["motion"].is_null());
    EXPECT_EQ(sequence({ref_, out_, "--frames", "1"}).out.find("NaN"), std::string::npos);
}

TEST_F(SequenceTool, FilesOfLayersAreComparedByTheirCombined) {
    for (int frame = 1; frame <= 3; ++frame) {
        const std::string number = std::to_string(frame) + ".exr";
        Image image = readImage(folder_ / ("out_0" + number));
        image.channels = {"V.Combined.R", "V.Combined.G", "V.Combined.B"};
        writeImage(folder_ / ("layers_0" + number), image);
    }
    const auto run = [&](const std::vector<std::string>& more) {
        std::vector<std::string> arguments = {ref_, folder_ / "layers_##.exr", "--json"};
        arguments.insert(arguments.end(), more.begin(), more.end());
        return sequence(arguments);
    };
    const ToolRun found = run({});
    ASSERT_EQ(found.exitCode, 0) << found.err;
    EXPECT_NEAR(Json::parse(found.out)["sequences"][0]["relmse"]["value"], 0.0625 / 0.26 / 4, 1e-12);
    const ToolRun none = run({"--layer", "W"});
    EXPECT_EQ(none.exitCode, 1);
    EXPECT_NE(none.err.find("found the layers R, G, B, V.Combined"), std::string::npos) << none.err;
}

TEST_F(SequenceTool, ReportIsOnePage) {
    const std::string page = folder_ / "page.html";
    const ToolRun run = sequence({ref_, out_, "--report", page, "--quiet"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.out, "");
    const std::string html = contentsOf(page);
    EXPECT_NE(html.find("<title>ref_##.exr: frames and flicker</title>"), std::string::npos);
    EXPECT_EQ(html.find("@DATA@"), std::string::npos);
    EXPECT_EQ(html.find("http://"), html.find("http://www.w3.org/2000/svg"));  // a name, not an address
}

TEST_F(SequenceTool, WhatIsWrongIsSaid) {
    const auto expectError = [&](const std::vector<std::string>& arguments, int code,
                                 const std::string& text) {
        const ToolRun run = sequence(arguments);
        EXPECT_EQ(run.exitCode, code) << run.err;
        EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
        EXPECT_EQ(run.out, "");
    };
    expectError({folder_ / "ref_01.exr", out_}, 2, "REFERENCE: expected #### in the file's name");
    expectError({ref_, folder_ / "out_01.exr"}, 2, "IMAGE: expected #### in the file's name");
    expectError({ref_, out_, "--motion", folder_ / "motion_01.exr"}, 2, "--motion: expected ####");
    expectError({ref_}, 2, "IMAGE");
    expectError({ref_, out_, "--frames", "one"}, 2, "--frames: expected frames such as 1-100x2");
    expectError({ref_, out_, "--frames", "1,3", "--motion", folder_ / "motion_##.exr"}, 2,
                "--motion: expected frames that follow each other");
    expectError({ref_, out_, "--report", folder_ / "out_02.exr"}, 2, "--report");
    expectError({folder_ / "none_##.exr", out_}, 1, "none_##.exr: expected files with a number of 2 digits");
    expectError({ref_, out_, "--frames", "1-5"}, 1,
                "ref_##.exr: expected all of the 5 frames that are compared (--frames says which), found 2 "
                "missing, the "
                "first " +
                    (folder_ / "ref_04.exr"));
    expectError({ref_, out_, "--layer", "diffuse"}, 1, "diffuse: expected a layer of this name");
    expectError({ref_, out_, "--motion", out_}, 1,
                "out_02.exr: expected channels motion.x, motion.y, found R, G, B");

    std::filesystem::remove(folder_ / "out_02.exr");
    expectError({ref_, out_}, 1, "found 1 missing, the first " + (folder_ / "out_02.exr"));
    writeImage(folder_ / "out_02.exr", Image({0, 0, 32, 20}, {"R", "G", "B"}));
    expectError({ref_, out_}, 1, "out_02.exr: expected the reference's data window");
    writeImage(folder_ / "motion_03.exr", Image({0, 0, 32, 20}, {"motion.x", "motion.y"}));
    expectError({ref_, other_, "--motion", folder_ / "motion_##.exr"}, 1,
                "motion_03.exr: expected the reference's data window");
    writeImage(folder_ / "ref_02.exr", Image({2, 3, 32, 24}, {"R", "G", "B"}));
    writeImage(folder_ / "other_02.exr", Image({2, 3, 32, 24}, {"R", "G", "B"}));
    expectError({ref_, other_}, 1, "other_02.exr: expected the data window of the frame before");
}

TEST_F(SequenceTool, HelpAndManualPage) {
    const ToolRun help = sequence({"--help"});
    EXPECT_EQ(help.exitCode, 0);
    EXPECT_NE(help.out.find("flicker along motion"), std::string::npos);
    EXPECT_TRUE(sequence({"--help-man"}).out.starts_with(".TH VLX\\-COMPARE\\-SEQUENCE 1"));
}

}  // namespace
}  // namespace vlx
