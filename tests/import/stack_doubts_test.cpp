// Stacks: adding to a dump, and what may be wrong with the images.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <functional>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "import/import.h"
#include "import/stack.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

const std::vector<std::string> kPasses = {
    "L.Combined.R",         "L.Combined.G",         "L.Combined.B",         "L.Combined.A",
    "L.Denoising Albedo.R", "L.Denoising Albedo.G", "L.Denoising Albedo.B", "L.Denoising Depth.Z"};

// Values of kPasses at a place in the picture.
using Scene = std::function<std::array<float, 8>(float x, float y)>;

// A number in [0, 1) of an image's pixel.
float noise(int image, int col, int row, int which) {
    const auto h =
        static_cast<unsigned>(image * 7919 + col * 131 + row * 1009 + which * 31 + 1) * 2654435761u;
    return static_cast<float>((h ^ (h >> 15)) * 2246822519u >> 8) / 16777216.0f;
}

// Images of a sample a pixel, at its centre or anywhere in it; the light is noise.
std::vector<std::string> render(const TemporaryFolder& folder, int images, bool centres, const Scene& scene,
                                const ImageWriteOptions& options = {}, int first = 0) {
    std::vector<std::string> paths;
    for (int i = first; i < first + images; ++i) {
        Image image({0, 0, 40, 30}, kPasses);
        for (int row = 0; row < 30; ++row)
            for (int col = 0; col < 40; ++col) {
                const float x = static_cast<float>(col) + (centres ? 0.5f : noise(i, col, row, 0));
                const float y = static_cast<float>(row) + (centres ? 0.5f : noise(i, col, row, 1));
                const auto values = scene(x, y);
                for (std::size_t c = 0; c < 8; ++c) image.at(col, row)[c] = values[c];
                if (values[3] > 0) image.at(col, row)[0] += noise(i, col, row, 2);
            }
        paths.push_back(folder / ("r" + std::to_string(i) + ".exr"));
        writeImage(paths.back(), image, options);
    }
    return paths;
}

const Scene kTilted = [](float x, float y) {
    return std::array{1.0f, 1.0f, 1.0f, 1.0f, 0.5f, 0.5f, 0.5f, 3 + 0.1f * x + 0.05f * y};
};
const Scene kFrontal = [](float, float) {
    return std::array{1.0f, 1.0f, 1.0f, 1.0f, 0.5f, 0.5f, 0.5f, 4.0f};
};
const Scene kChequered = [](float x, float y) {
    const float a = (static_cast<int>(x / 3.3f) + static_cast<int>(y / 3.3f)) % 2 == 0 ? 0.2f : 0.8f;
    return std::array{a, a, a, 1.0f, a, a, a, 4.0f};
};

bool warnsOfCentres(const std::vector<std::string>& images, const std::string& dump) {
    return anyContains(stackImages(images, dump, {}).notes, "all samples are at the pixels' centres");
}

TEST(StackDoubts, SamplesAtPixelCentresAreTold) {
    const TemporaryFolder folder;
    for (const bool half : {false, true}) {
        ImageWriteOptions write;
        write.half = half;
        EXPECT_TRUE(warnsOfCentres(render(folder, 2, true, kTilted, write), folder / "d.exr"));
        EXPECT_TRUE(warnsOfCentres(render(folder, 4, true, kTilted, write), folder / "d.exr"));
        EXPECT_FALSE(warnsOfCentres(render(folder, 2, false, kTilted, write), folder / "d.exr"));
        EXPECT_FALSE(warnsOfCentres(render(folder, 4, false, kTilted, write), folder / "d.exr"));
    }
    EXPECT_FALSE(warnsOfCentres(render(folder, 1, true, kTilted), folder / "d.exr"));
}

TEST(StackDoubts, FeaturesThatCannotVarySayNothingOfPositions) {
    const TemporaryFolder folder;
    EXPECT_FALSE(warnsOfCentres(render(folder, 4, false, kFrontal), folder / "d.exr"));
    EXPECT_FALSE(warnsOfCentres(render(folder, 2, false, kChequered), folder / "d.exr"));
}

// Which pixels of a dump of 40 x 30 have samples.
std::vector<bool> sampled(const std::string& dump) {
    std::vector<bool> has;
    for (const std::uint32_t n : DumpReader(dump).counts(0, 30)) has.push_back(n > 0);
    return has;
}

Scene inside(const Scene& scene, const std::function<bool(float, float)>& region) {
    return [=](float x, float y) { return region(x, y) ? scene(x, y) : std::array<float, 8>{}; };
}

TEST(StackDoubts, PixelsOutsideARenderBorderGetNoSamples) {
    const TemporaryFolder folder;
    const auto border = [](float x, float y) { return x >= 10 && x < 30 && y >= 5 && y < 30; };
    const auto images = render(folder, 3, false, inside(kTilted, border));
    const ImportReport report = stackImages(images, folder / "d.exr", {});
    EXPECT_TRUE(anyContains(report.notes, "WARNING: 700 pixels were not rendered"));
    const auto has = sampled(folder / "d.exr");
    for (int p = 0; p < 1200; ++p)
        ASSERT_EQ(has[static_cast<std::size_t>(p)],
                  border(static_cast<float>(p % 40) + 0.5f, static_cast<float>(p / 40) + 0.5f));
    EXPECT_EQ(DumpReader(folder / "d.exr").read(5, 1, {"Z"}).samples(), 60u);
    StackOptions options;
    options.keepEmpty = true;
    stackImages(images, folder / "d.exr", options);
    EXPECT_EQ(DumpReader(folder / "d.exr").read(0, 1).samples(), 120u);
}

TEST(StackDoubts, WhatATransparentFilmMissesStaysASample) {
    const TemporaryFolder folder;
    const auto disc = [](float x, float y) { return std::hypot(x - 20, y - 15) < 10; };
    const auto images = render(folder, 3, false, inside(kTilted, disc));
    const ImportReport report = stackImages(images, folder / "d.exr", {});
    EXPECT_EQ(DumpReader(folder / "d.exr").read(0, 30).samples(), 3600u);
    EXPECT_TRUE(anyContains(report.notes, "kept as a transparent film's misses"));
}

TEST(StackDoubts, ACardBeforeNothingIsNoRenderBorder) {
    const TemporaryFolder folder;
    const auto card = [](float x, float y) { return x >= 9.2f && x < 30.8f && y >= 5.2f && y < 24.8f; };
    const auto images = render(folder, 12, false, inside(kTilted, card));
    const ImportReport report = stackImages(images, folder / "d.exr", {});
    EXPECT_TRUE(anyContains(report.notes, "kept as a transparent film's misses"));
    EXPECT_EQ(DumpReader(folder / "d.exr").read(0, 30).samples(), 14400u);
}

TEST(StackDoubts, TheDepthPassTellsMissesFromWhatWasNotRendered) {
    const TemporaryFolder folder;
    std::vector<std::string> channels = kPasses;
    channels.push_back("L.Depth.Z");
    std::vector<std::string> images;
    for (int i = 0; i < 2; ++i) {
        Image image({0, 0, 3, 1}, channels);
        image.at(0, 0)[8] = 1e11f;  // as Blender fills it
        image.at(1, 0)[8] = 1e10f;  // a miss
        image.at(2, 0)[3] = 1;
        image.at(2, 0)[8] = 1e11f;
        images.push_back(folder / ("z" + std::to_string(i) + ".exr"));
        writeImage(images.back(), image);
    }
    stackImages(images, folder / "d.exr", {});
    EXPECT_EQ(DumpReader(folder / "d.exr").counts(0, 1), (std::vector<std::uint32_t>{0, 2, 2}));
}

TEST(StackDoubts, LightBeyondHalfFloatsIsTold) {
    const TemporaryFolder folder;
    const Scene bright = [](float x, float y) {
        auto values = kTilted(x, y);
        values[1] = x < 1 ? 65504.0f : 1.0f;
        values[4] = 65504.0f;  // no light
        return values;
    };
    ImageWriteOptions write;
    write.half = true;
    EXPECT_TRUE(anyContains(stackImages(render(folder, 2, false, bright, write), folder / "d.exr", {}).notes,
                            "WARNING: 60 values are 65504 or infinite"));
    EXPECT_FALSE(
        anyContains(stackImages(render(folder, 2, false, bright), folder / "d.exr", {}).notes, "65504"));
}

TEST(StackAppend, SamplesAreAddedAfterThoseOfADump) {
    const TemporaryFolder folder;
    const auto border = inside(kTilted, [](float, float y) { return y >= 1; });  // row 0 has no samples
    const auto images = render(folder, 5, false, border);
    const std::vector<std::string> first(images.begin(), images.begin() + 2),
        more(images.begin() + 2, images.end());
    stackImages(images, folder / "all.exr", {});
    stackImages(first, folder / "first.exr", {});
    StackOptions options;
    options.append = folder / "first.exr";
    const ImportReport report = stackImages(more, folder / "both.exr", options);
    EXPECT_TRUE(anyContains(report.notes, "They are added to the 2 samples a pixel of " + options.append +
                                              ", which makes 5; replicates go on from 2"));
    for (const char* said : {"already", "nothing about positions", "Normals are taken"})
        EXPECT_FALSE(anyContains(report.notes, said)) << said;
    const DumpReader all(folder / "all.exr"), both(folder / "both.exr");
    EXPECT_EQ(both.header().samples, 5.0);
    std::vector<std::string> names;
    for (const DumpChannel& channel : all.header().channels) names.push_back(channel.name);
    expectSame(all.read(0, 30, names), both.read(0, 30, names));

    EXPECT_TRUE(anyContains(stackImages({images[1], images[3]}, folder / "twice.exr", options).notes,
                            "r1.exr is in " + folder / "first.exr" + " already"));
}

TEST(StackAppend, ViewsAndChannelsMustAgree) {
    const TemporaryFolder folder;
    const auto images = render(folder, 2, false, kTilted);
    StackOptions options;
    options.map = {{"fog", "L.Combined.R"}};
    stackImages(images, folder / "fog.exr", options);
    StackOptions add;
    add.append = folder / "fog.exr";
    EXPECT_NE(errorOf([&] {
                  stackImages(images, folder / "d.exr", add);
              }).find("fog.exr: expected the channels of the images, found besides them fog"),
              std::string::npos);
    stackImages(images, folder / "plain.exr", {});
    add.append = folder / "plain.exr";
    add.map = options.map;
    EXPECT_NE(errorOf([&] {
                  stackImages(images, folder / "d.exr", add);
              }).find("found none of their fog: images of the same passes"),
              std::string::npos);
    Image small({0, 0, 4, 4}, kPasses);
    writeImage(folder / "small.exr", small);
    EXPECT_NE(errorOf([&] {
                  stackImages({folder / "small.exr"}, folder / "d.exr", add);
              }).find("expected a dump of the images' view"),
              std::string::npos);
}

TEST(StackAppend, MeansOfOtherNumbersOfSamplesAreTold) {
    const TemporaryFolder folder;
    ImageWriteOptions write;
    write.attributes["cycles.L.samples"] = "4";
    stackImages(render(folder, 2, false, kTilted, write), folder / "four.exr", {});
    write.attributes["cycles.L.samples"] = "1";
    StackOptions add;
    add.append = folder / "four.exr";
    const ImportReport report =
        stackImages(render(folder, 2, false, kTilted, write, 2), folder / "d.exr", add);
    EXPECT_TRUE(anyContains(report.notes, "are means of 4 of the renderer's, those of the images of 1"));
    EXPECT_EQ(DumpReader(folder / "d.exr").header().averaged, 2.5);
}

TEST(Sequences, WildcardsStandForFilesThatFit) {
    const TemporaryFolder folder;
    for (const char* name : {"s10.exr", "s2.exr", "s1.exr", "t[1.exr", ".s3.exr"})
        std::ofstream(folder / name) << "x";
    EXPECT_EQ(expandSequences({folder / "s*.exr"}),
              (std::vector<std::string>{folder / "s1.exr", folder / "s2.exr", folder / "s10.exr"}));
    EXPECT_EQ(expandSequences({folder / "s?.exr"}),
              (std::vector<std::string>{folder / "s1.exr", folder / "s2.exr"}));
    EXPECT_EQ(expandSequences({folder / "t[?.exr"}), (std::vector<std::string>{folder / "t[1.exr"}));
    EXPECT_NE(errorOf([&] { expandSequences({folder / "u*.exr"}); }).find("found none"), std::string::npos);
    EXPECT_NE(errorOf([&] {
                  expandSequences({folder / "f_####_s?.exr"});
              }).find("with --frames LIST #### is the frame's number"),
              std::string::npos);
}

}  // namespace
}  // namespace vlx
