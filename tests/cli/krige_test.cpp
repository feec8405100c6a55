#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/writer.h"

namespace vlx {
namespace {

const std::string kDump = VLX_TESTDATA "/dumps/tungsten_cornell.exr";

ToolRun krige(const std::vector<std::string>& arguments) { return runTool("vlx-krige", arguments); }

TEST(VlxKrige, DefaultsGiveAnImageWithItsError) {
    const TemporaryFolder folder;
    const ToolRun run = krige({kDump, "-o", folder / "out.exr"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.out, "");
    EXPECT_NE(run.err.find("neighbourhoods kriged"), std::string::npos) << run.err;
    const Image image = readImage(folder / "out.exr");
    for (const char* channel : {"R", "G", "B", "stddev.R", "stddev.G", "stddev.B"})
        EXPECT_GE(image.channel(channel), 0) << channel;
    for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value));
    EXPECT_EQ(folder.entries(), 1);
}

// Compression takes a tenth of a draft's time.
TEST(VlxKrige, ADraftIsNotCompressed) {
    const TemporaryFolder folder;
    const auto bytesOf = [&](const char* quality) {
        const std::string out = folder / (std::string(quality) + ".exr");
        EXPECT_EQ(krige({kDump, "-o", out, "--quality", quality, "-q"}).exitCode, 0);
        const Image image = readImage(out);
        const auto raw = static_cast<std::uintmax_t>(image.pixels.size() * sizeof(float));
        return std::pair(std::filesystem::file_size(out), raw);
    };
    const auto [draft, pixels] = bytesOf("draft");
    EXPECT_GE(draft, pixels);
    const auto [standard, samePixels] = bytesOf("standard");
    EXPECT_LT(standard, samePixels);
}

TEST(VlxKrige, SamePixelsForAnyNumberOfThreads) {
    const TemporaryFolder folder;
    for (const char* method : {"krige", "paper", "mean", "gaussian"}) {
        Image first;
        for (const char* threads : {"1", "2", "8"}) {
            ASSERT_EQ(krige({kDump, "-o", folder / "out.exr", "--method", method, "--threads", threads, "-q",
                             "--overwrite"})
                          .exitCode,
                      0);
            const Image image = readImage(folder / "out.exr");
            if (first.pixels.empty()) first = image;
            EXPECT_EQ(image.pixels, first.pixels) << method << " " << threads;
        }
    }
}

TEST(VlxKrige, DiagnosticsAreLayersAndJson) {
    const TemporaryFolder folder;
    const ToolRun run =
        krige({kDump, "-o", folder / "out.exr", "--method", "paper", "--diagnostics", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto report = nlohmann::json::parse(run.out);
    const auto document = nlohmann::json::parse(std::ifstream(folder / "out.exr.json"));
    EXPECT_EQ(document["report"]["samples"], report["samples"]);
    std::int64_t regions = 0;
    for (const auto& [outcome, count] : report["regions"].items()) regions += count.get<std::int64_t>();
    EXPECT_EQ(static_cast<std::int64_t>(document["regions"].size()), regions);
    const Image image = readImage(folder / "out.exr");
    for (const char* layer : {"nugget", "sill", "range", "exponent", "errorVariance", "outcome"})
        EXPECT_GE(image.channel(std::string("diagnostics.") + layer), 0) << layer;
}

TEST(VlxKrige, InspectedRegionsHaveTheirVariogram) {
    const TemporaryFolder folder;
    const ToolRun run = krige({kDump, "-o", folder / "out.exr", "--method", "paper", "--diagnostics",
                               "--inspect", "101,121", "--inspect", "119,139"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    std::ifstream file(folder / "out.exr.json");
    const auto json = nlohmann::json::parse(file);
    int inspected = 0;
    for (const auto& region : json["regions"]) {
        if (!region.contains("inspection")) continue;
        ++inspected;
        const auto& i = region["inspection"];
        EXPECT_EQ(i["neighbourhood"]["x"], region["x"]);
        EXPECT_LE(i["cloud"].size(), 800u);
        EXPECT_GE(i["pairs"].get<std::size_t>(), i["cloud"].size());
        double pairs = 0;
        for (const auto& c : i["classes"]) pairs += c["pairs"].get<double>();
        EXPECT_NEAR(pairs, i["pairs"].get<double>(), 1e-3 * pairs);  // the classes hold the whole cloud
        if (region["outcome"] != "kriged") continue;
        EXPECT_FALSE(i["model"]["curve"].empty());
        EXPECT_NEAR(i["model"]["nugget"].get<double>(), region["nugget"].get<double>(),
                    1e-4 * region["nugget"].get<double>());
        EXPECT_GT(i["crossValidation"]["meanSquareScore"].get<double>(), 0);
    }
    EXPECT_EQ(inspected, 2);
    // Looking does not change what is seen.
    ASSERT_EQ(krige({kDump, "-o", folder / "plain.exr", "--method", "paper"}).exitCode, 0);
    const Image plain = readImage(folder / "plain.exr"), looked = readImage(folder / "out.exr");
    for (int row = 0; row < plain.data.height; ++row)
        for (int col = 0; col < plain.data.width; ++col)
            for (const auto& channel : plain.channels)
                ASSERT_EQ(plain.at(col, row)[plain.channel(channel)],
                          looked.at(col, row)[looked.channel(channel)]);
}

TEST(VlxKrige, BandsAndTheMapOfSamples) {
    const TemporaryFolder folder;
    ASSERT_EQ(krige({kDump, "-o", folder / "whole.exr", "--sampling-map", folder / "map.exr", "-q"}).exitCode,
              0);
    ASSERT_EQ(krige({kDump, "-o", folder / "band.exr", "--band", "2/3", "-q"}).exitCode, 0);
    const Image whole = readImage(folder / "whole.exr"), band = readImage(folder / "band.exr"),
                map = readImage(folder / "map.exr");
    ASSERT_EQ(band.channels, whole.channels);
    const int first = band.data.y - whole.data.y;
    EXPECT_EQ(first, whole.data.height / 3);
    for (int row = 0; row < band.data.height; ++row)
        EXPECT_TRUE(std::equal(band.at(0, row), band.at(0, row) + band.data.width * band.channelCount(),
                               whole.at(0, first + row)));
    for (const char* filter : {"box", "gaussian", "blackman-harris"})
        EXPECT_EQ(krige({kDump, "-o", folder / "filtered.exr", "--filter", filter, "-q"}).exitCode, 0)
            << filter;
    const ToolRun doubled = krige({kDump, "-o", folder / "doubled.exr", "--scale", "2", "-q"});
    ASSERT_EQ(doubled.exitCode, 0) << doubled.err;
    EXPECT_EQ(readImage(folder / "doubled.exr").data.width, 2 * whole.data.width);
    EXPECT_EQ(map.data, whole.data);
    EXPECT_EQ(map.channels, std::vector<std::string>{"sampling.density"});
}

TEST(VlxKrige, BadUsageIsExitTwo) {
    const TemporaryFolder folder;
    const std::string out = folder / "out.exr";
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{},
          {kDump},
          {kDump, "-o"},
          {kDump, "-o", out, "--method"},
          {kDump, "-o", out, "--method", "magic"},
          {kDump, "-o", out, "--sigma", "0"},
          {kDump, "-o", out, "--sigma"},
          {kDump, "-o", out, "--method", "paper", "--region", "0"},
          {kDump, "-o", out, "--method", "paper", "--region", "8", "--whole-image"},
          {kDump, "-o", out, "--method", "mean", "--diagnostics"},
          {kDump, "-o", out, "--diagnostics", "--band", "1/2"},
          {kDump, "-o", out, "--quality", "best"},
          {kDump, "-o", out, "--fireflies"},
          {kDump, "-o", out, "--fireflies", "burn"},
          {kDump, "-o", out, "--fireflies", "clamp", "--clamp", "0"},
          {kDump, "-o", out, "--strength", "1.1"},
          {kDump, "-o", out, "--inspect", "1,1"},
          {kDump, "-o", out, "--method", "paper", "--diagnostics", "--inspect", "1"},
          {kDump, "-o", out, "--method", "paper", "--diagnostics", "--inspect", "1,x"},
          {kDump, "-o", out, "--threads", "-1"},
          {kDump, "-o", folder / "out.png"},
          {kDump, "-o", kDump},
          {kDump, "-o", out, "--nonsense"}}) {
        const ToolRun run = krige(arguments);
        std::string line;
        for (const auto& argument : arguments) line += " " + argument;
        EXPECT_EQ(run.exitCode, 2) << line;
        EXPECT_TRUE(run.err.starts_with("vlx-krige: ")) << line << "\n" << run.err;
    }
    EXPECT_EQ(folder.entries(), 0);
}

TEST(VlxKrige, FailuresAreExitOneNameTheFileAndLeaveNoOutput) {
    const TemporaryFolder folder;
    const TemporaryFolder target;
    std::ofstream(folder / "text.exr") << "not an image";
    Image flat({0, 0, 4, 4}, {"R", "G", "B"});
    writeImage(folder / "flat.exr", flat);
    std::filesystem::copy_file(kDump, folder / "truncated.exr");
    std::filesystem::resize_file(folder / "truncated.exr", std::filesystem::file_size(kDump) * 2 / 3);
    for (const char* name : {"missing.exr", "text.exr", "flat.exr", "truncated.exr"}) {
        const ToolRun run = krige({folder / name, "-o", target / "out.exr"});
        EXPECT_EQ(run.exitCode, 1) << name;
        EXPECT_NE(run.err.find(name), std::string::npos) << run.err;
        EXPECT_EQ(target.entries(), 0) << name;
    }
    // A folder that is not there, and a full disk.
    EXPECT_EQ(krige({kDump, "-o", target / "no/out.exr"}).exitCode, 1);
    EXPECT_EQ(runTool("vlx-krige", {kDump, "-o", target / "out.exr"}, {.fileSizeLimit = 2000}).exitCode, 1);
    EXPECT_EQ(target.entries(), 0);
}

TEST(VlxKrige, NonFiniteSamplesAreDroppedAndCounted) {
    const TemporaryFolder folder;
    SampleBand band{0, 0, 4, 4, {0}, {"R", "G", "B"}, {}};
    band.values.assign(3, {});
    for (int p = 0; p < 16; ++p) {
        for (int s = 0; s < 4; ++s)
            for (auto& channel : band.values)
                channel.push_back(p == 5 && s == 1   ? NAN
                                  : p == 9 && s == 0 ? INFINITY
                                                     : 0.5f + 0.1f * static_cast<float>(s));
        band.offsets.push_back(band.values[0].size());
    }
    DumpHeader header;
    header.data = header.display = {0, 0, 4, 4};
    for (const auto& name : band.channels) header.channels.push_back({name, ChannelType::Float});
    DumpWriter writer(folder / "a.exr", header);
    writer.write(band);
    writer.close();
    const ToolRun run = krige({folder / "a.exr", "-o", folder / "out.exr", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(nlohmann::json::parse(run.out)["droppedSamples"], 2);
    for (const float value : readImage(folder / "out.exr").pixels) EXPECT_TRUE(std::isfinite(value));
}

// A flat image of means and variances with light groups, in the picture of an edge.
constexpr Window kFlatWindow{2, -1, 40, 37};

void writeFlat(const std::string& path, const std::vector<std::string>& more = {}, float bad = 1) {
    std::vector<std::string> channels = {"R", "G", "B", "A", "mse.R", "mse.G", "mse.B"};
    channels.insert(channels.end(), {"key.R", "key.G", "key.B", "fill.R", "fill.G", "fill.B"});
    channels.insert(channels.end(), more.begin(), more.end());
    Image image(kFlatWindow, channels);
    image.display = {0, 0, 50, 50};
    for (int row = 0; row < kFlatWindow.height; ++row)
        for (int col = 0; col < kFlatWindow.width; ++col) {
            float* pixel = image.at(col, row);
            for (int c = 0; c < image.channelCount(); ++c) {
                const float noise =
                    0.01f *
                    static_cast<float>((7 * col + 13 * row * row + 5 * (c < 7 ? c % 3 : (c - 7) % 3)) % 11);
                const float radiance = (col + row > 40 ? 2.f : 0.5f) + noise;
                pixel[c] = c < 3 ? radiance : c < 7 ? (c == 3 ? 1.f : 1e-3f) : radiance / 2;
            }
        }
    image.at(20, 20)[1] *= bad;
    writeImage(path, image);
}

TEST(VlxKrigeFlat, EqualsPackingAndKrigingAndKeepsTheOtherLayers) {
    const TemporaryFolder folder;
    writeFlat(folder / "in.exr", {"mask", "N.X", "N.Y", "N.Z"});
    const ToolRun run = krige({folder / "in.exr", "-o", folder / "out.exr", "--preset", "renderman",
                               "--radiance", "key", "--radiance", "fill"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    ASSERT_EQ(runTool("vlx-pack", {"moments", folder / "in.exr", "-o", folder / "dump.exr", "--radiance",
                                   "key", "--radiance", "fill"})
                  .exitCode,
              0);
    ASSERT_EQ(
        krige({folder / "dump.exr", "-o", folder / "two.exr", "--radiance", "key", "--radiance", "fill"})
            .exitCode,
        0);
    const Image in = readImage(folder / "in.exr"), out = readImage(folder / "out.exr"),
                two = readImage(folder / "two.exr");
    EXPECT_EQ(out.data, kFlatWindow);
    EXPECT_EQ(out.display, in.display);
    EXPECT_EQ(out.channelCount(), in.channelCount() + 3);
    for (int i = 0; i < kFlatWindow.width * kFlatWindow.height; ++i) {
        const float *was = in.at(i % 40, i / 40), *is = out.at(i % 40, i / 40),
                    *same = two.at(i % 40, i / 40);
        for (const std::string& name : out.channels) {
            const int denoised = two.channel(name);
            ASSERT_EQ(is[out.channel(name)], denoised >= 0 ? same[denoised] : was[in.channel(name)]) << name;
        }
        for (const char* c : {"R", "G", "B"}) {
            const std::string colour = c;
            ASSERT_NEAR(is[out.channel("key." + colour)] + is[out.channel("fill." + colour)],
                        is[out.channel(colour)], 4e-6);
        }
        ASSERT_EQ(is[out.channel("A")], 1);
    }
    EXPECT_NE(run.err.find("stddev.R added"), std::string::npos) << run.err;

    ASSERT_EQ(krige({folder / "in.exr", "-o", folder / "bare.exr", "--drop-layers", "-q"}).exitCode, 0);
    EXPECT_EQ(readImage(folder / "bare.exr").channels.size(), 7u);
}

TEST(VlxKrigeFlat, ANonFinitePixelIsPredictedAndCounted) {
    const TemporaryFolder folder;
    writeFlat(folder / "in.exr", {}, std::nanf(""));
    const ToolRun run = krige({folder / "in.exr", "-o", folder / "out.exr", "--json"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto report = nlohmann::json::parse(run.out);
    EXPECT_EQ(report["droppedSamples"], 1);
    EXPECT_EQ(report["emptyPixels"], 1);
    const Image image = readImage(folder / "out.exr");
    for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value));
    EXPECT_NEAR(image.at(20, 20)[image.channel("G")], 0.55, 0.1);
}

TEST(VlxKrigeFlat, ResultsGoIntoACopyOfATemplate) {
    const TemporaryFolder folder;
    writeFlat(folder / "in.exr");
    Image beauty(kFlatWindow,
                 {"V.Combined.R", "V.Combined.G", "V.Combined.B", "V.Combined.A", "V.Id.X", "key.G"});
    beauty.display = {0, 0, 60, 60};
    for (std::size_t i = 0; i < beauty.pixels.size(); ++i) beauty.pixels[i] = static_cast<float>(i % 13);
    ImageWriteOptions half;
    half.half = true;
    writeImage(folder / "beauty.exr", beauty, half);
    ASSERT_EQ(
        runTool("vlx-pack", {"moments", folder / "in.exr", "-o", folder / "dump.exr", "--radiance", "key"})
            .exitCode,
        0);
    const ToolRun run = krige({folder / "dump.exr", "-o", folder / "out.exr", "--template",
                               folder / "beauty.exr", "--radiance", "key.G"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    ASSERT_EQ(krige({folder / "dump.exr", "-o", folder / "plain.exr", "--radiance", "key.G"}).exitCode, 0);
    const Image out = readImage(folder / "out.exr"), plain = readImage(folder / "plain.exr");
    EXPECT_EQ(out.display, beauty.display);
    EXPECT_EQ(out.channelCount(), 9);
    EXPECT_EQ(out.channel("stddev.R"), -1) << "not where Blender's compositor does not look";
    for (int row = 0; row < 37; ++row)
        for (int col = 0; col < 40; ++col) {
            const float *is = out.at(col, row), *result = plain.at(col, row);
            ASSERT_EQ(is[out.channel("V.Id.X")], beauty.at(col, row)[4]);
            ASSERT_EQ(is[out.channel("V.stddev.B")], result[plain.channel("stddev.B")]);
            for (const auto& [layer, channel] : {std::pair{"V.Combined.B", "B"}, {"key.G", "key.G"}})
                ASSERT_NEAR(is[out.channel(layer)], result[plain.channel(channel)], 2e-3);
        }
}

TEST(VlxKrigeFlat, TheLayerCanBeChosen) {
    const TemporaryFolder folder;
    const std::string out = folder / "out.exr";
    std::vector<std::string> more;
    for (const char* layer : {"V.Combined", "W.Combined"})
        for (const char* c : {"R", "G", "B"}) more.push_back(std::string(layer) + "." + c);
    writeFlat(folder / "in.exr", more);
    const Image in = readImage(folder / "in.exr");
    const auto changed = [&](const Image& image, const char* channel) {
        int count = 0;
        for (int i = 0; i < kFlatWindow.width * kFlatWindow.height; ++i)
            count += image.at(i % 40, i / 40)[image.channel(channel)] !=
                     in.at(i % 40, i / 40)[in.channel(channel)];
        return count;
    };
    for (const std::string& input : {std::string("in"), std::string("dump")}) {
        if (input == "dump") {
            const ToolRun packed = runTool(
                "vlx-pack", {"moments", folder / "in.exr", "-o", folder / "dump.exr", "--layer", "W"});
            ASSERT_EQ(packed.exitCode, 0) << packed.err;
        }
        std::vector<std::string> arguments = {
            folder / (input + ".exr"), "-o", out, "--layer", "W", "--overwrite"};
        if (input == "dump") arguments.insert(arguments.end(), {"--template", folder / "in.exr"});
        const ToolRun run = krige(arguments);
        ASSERT_EQ(run.exitCode, 0) << run.err;
        const Image image = readImage(out);
        EXPECT_GT(changed(image, "W.Combined.G"), 500) << input;
        for (const char* same : {"V.Combined.G", "key.G", "G"})
            EXPECT_EQ(changed(image, same), 0) << input << same;
        EXPECT_GE(image.channel("W.stddev.R"), 0);
        EXPECT_EQ(image.channelCount(), in.channelCount() + 3);
    }
    const ToolRun none = krige({folder / "in.exr", "-o", folder / "none.exr", "--layer", "X"});
    EXPECT_EQ(none.exitCode, 1);
    EXPECT_NE(none.err.find("found the layers R, G, B, A, V.Combined, W.Combined, fill, key, mse"),
              std::string::npos)
        << none.err;
    EXPECT_FALSE(std::filesystem::exists(folder / "none.exr"));
    EXPECT_EQ(krige({kDump, "-o", folder / "none.exr", "--layer", "W"}).exitCode, 2);
}

TEST(VlxKrigeFlat, WhatDoesNotFitIsTold) {
    const TemporaryFolder folder;
    writeFlat(folder / "in.exr");
    Image other({0, 0, 8, 8}, {"R", "G", "B"});
    writeImage(folder / "other.exr", other);
    const auto fails = [&](std::vector<std::string> arguments, int code, const std::string& text) {
        arguments.insert(arguments.end(), {"-o", folder / "out.exr"});
        const ToolRun run = krige(arguments);
        EXPECT_EQ(run.exitCode, code) << run.err;
        EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
        EXPECT_FALSE(std::filesystem::exists(folder / "out.exr"));
    };
    fails({folder / "other.exr"}, 1, "other.exr: expected the variance of each pixel");
    fails({folder / "in.exr", "--template", folder / "other.exr"}, 1,
          "other.exr: expected the image's data window");
    fails({folder / "in.exr", "--template", kDump}, 1, "expected a flat image");
    fails({folder / "in.exr", "--band", "1/2"}, 2, "--band, --scale and --max-memory go with --drop-layers");
    fails({folder / "in.exr", "--radiance", "rim"}, 1, "layer rim for --radiance");
    fails({kDump, "--variance", folder / "in.exr"}, 2, "--variance goes with a flat image");
    fails({kDump, "--drop-layers"}, 2, "--drop-layers goes with a flat image");
}

}  // namespace
}  // namespace vlx
