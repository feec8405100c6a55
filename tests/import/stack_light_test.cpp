// Stacks of Blender's files: parts of the light, passes, and what headers say.

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfIntAttribute.h>
#include <OpenEXR/ImfOutputFile.h>
#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <filesystem>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "exr/flat_images.h"
#include "import/image_layers.h"
#include "import/stack.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kView{0, 0, 6, 5};
using Values = std::map<std::string, float>;

// Images of one value a channel each.
std::vector<std::string> writeFlat(const TemporaryFolder& folder, const std::vector<Values>& ofImages,
                                   const ImageWriteOptions& options = {}) {
    std::vector<std::string> paths;
    for (const Values& values : ofImages) {
        std::vector<std::string> names;
        for (const auto& [name, value] : values) names.push_back(name);
        Image image(kView, names);
        for (int row = 0; row < kView.height; ++row)
            for (int col = 0; col < kView.width; ++col)
                for (std::size_t c = 0; c < names.size(); ++c) image.at(col, row)[c] = values.at(names[c]);
        paths.push_back(folder / ("flat" + std::to_string(paths.size()) + ".exr"));
        writeImage(paths.back(), image, options);
    }
    return paths;
}

void setColour(Values& values, const std::string& layer, float r, float g, float b) {
    values[layer + ".R"] = r;
    values[layer + ".G"] = g;
    values[layer + ".B"] = b;
}

Values lit(float key, float fill) {
    Values values = {{"L.Combined.A", 1}};
    setColour(values, "L.Combined", key + fill, 2 * key + fill, key + 2 * fill);
    setColour(values, "L.Combined_key", key, 2 * key, key);
    setColour(values, "L.Combined_fill", fill, fill, 2 * fill);
    return values;
}

TEST(StackLight, EveryLightGroupBecomesRadiance) {
    const TemporaryFolder folder;
    auto images = writeFlat(folder, {lit(0.5f, 0.25f), lit(1, 2)});
    StackOptions options;
    options.groups = true;
    ImportReport report = stackImages(images, folder / "d.exr", options);
    const SampleBand band =
        DumpReader(folder / "d.exr").read(0, 1, {"L.Combined_key.G", "L.Combined_fill.B"});
    EXPECT_EQ(band.values[0][1], 2.0f);
    EXPECT_EQ(band.values[1][0], 0.5f);
    EXPECT_TRUE(anyContains(report.notes, "Light groups add up to the light"));
    EXPECT_TRUE(anyContains(report.notes, "--radiance 'L.Combined_fill' --radiance 'L.Combined_key'"));

    Values half = lit(1, 1);  // a quarter of R, G and B each is in no group
    for (auto& [name, value] : half)
        if (name.starts_with("L.Combined_")) value *= 0.75f;
    images = writeFlat(folder, {half, half});
    report = stackImages(images, folder / "d.exr", options);
    EXPECT_TRUE(anyContains(report.notes, "do not add up to the light: 25 % of it is in none"));

    images = writeFlat(folder, {{{"R", 1}, {"G", 1}, {"B", 1}}});
    EXPECT_NE(errorOf([&] {
                  stackImages(images, folder / "d.exr", options);
              }).find("L.Combined.R of some layer L, as --groups auto says, found R, G, B"),
              std::string::npos);
}

Values contributing(float scale) {
    Values values = {{"L.Combined.A", 1}};
    setColour(values, "L.DiffDir", scale, 2 * scale, 0);
    setColour(values, "L.DiffInd", 0.5f, 0.25f, 1);
    setColour(values, "L.DiffCol", 0.5f, 0.25f, 0.125f);
    setColour(values, "L.VolumeDir", 0.5f, 0, 0);
    setColour(values, "L.VolumeInd", 0.25f, 0, 0);
    setColour(values, "L.Emit", 0, 3, 0);
    const auto diffuse = [&](const std::string& c) {
        return (values["L.DiffDir." + c] + values["L.DiffInd." + c]) * values["L.DiffCol." + c];
    };
    setColour(values, "L.Combined", diffuse("R") + 0.75f, diffuse("G") + 3, diffuse("B"));
    return values;
}

TEST(StackLight, ContributionsAddUpAndPassesAreAveraged) {
    const TemporaryFolder folder;
    std::vector<Values> ofImages = {contributing(1), contributing(4)};
    for (int i = 0; i < 2; ++i) {
        Values& values = ofImages[static_cast<std::size_t>(i)];
        values["L.Mist.Z"] = static_cast<float>(i);
        values["L.Depth.Z"] = i == 0 ? 1e10f : 5.0f;  // of sample 0 alone: the second image has it
        values["L.IndexOB.X"] = i == 0 ? 0.0f : 7.0f;
        for (const char* c : {"X", "Y", "Z", "W"})
            values[std::string("L.Vector.") + c] = i == 0 ? 0.0f : (*c == 'Y' ? 0.0f : 3.0f);
    }
    const auto images = writeFlat(folder, ofImages);
    StackOptions options;
    options.passes = folder / "passes.exr";
    options.inputs = "made of";
    const ImportReport report = stackImages(images, folder / "d.exr", options);
    EXPECT_TRUE(report.ignored.empty());  // the passes' file has what the dump has not
    EXPECT_TRUE(anyContains(report.notes, "Contributions add up to the light"));
    EXPECT_EQ(report.mapped.at("L.Diffuse.G"), "(L.DiffDir.G + L.DiffInd.G) * L.DiffCol.G");
    const SampleBand band =
        DumpReader(folder / "d.exr").read(0, 1, {"L.Diffuse.R", "L.Volume.R", "L.Emit.G", "R"});
    EXPECT_EQ(band.values[0][0], 0.75f);
    EXPECT_EQ(band.values[0][1], 2.25f);
    EXPECT_EQ(band.values[1][0], 0.75f);
    EXPECT_EQ(band.values[2][1], 3.0f);
    EXPECT_EQ(band.values[3][1], 3.0f);

    const Image passes = readImage(folder / "passes.exr");
    const auto value = [&](const std::string& name) {
        EXPECT_GE(passes.channel(name), 0) << name;
        return passes.at(5, 4)[passes.channel(name)];
    };
    EXPECT_EQ(value("L.Diffuse.R"), 1.5f);
    EXPECT_EQ(value("L.Combined.R"), 2.25f);
    EXPECT_EQ(value("L.DiffCol.G"), 0.25f);
    EXPECT_EQ(passes.channel("L.DiffDir.R"), -1);
    EXPECT_EQ(passes.channel("L.VolumeInd.R"), -1);
    EXPECT_EQ(value("L.Mist.Z"), 0.5f);
    EXPECT_EQ(value("L.Depth.Z"), 5.0f);
    EXPECT_EQ(value("L.IndexOB.X"), 7.0f);
    EXPECT_EQ(value("L.Vector.X"), 3.0f);
    EXPECT_EQ(value("L.Vector.Y"), 0.0f);
    EXPECT_EQ(readTextAttribute(folder / "passes.exr", "variolux:inputs"), "made of");
    EXPECT_EQ(findRadiance(folder / "passes.exr", {}).at("R"), "L.Combined.R");
}

TEST(StackLight, WhatContributionsLackIsTold) {
    const TemporaryFolder folder;
    Values values = contributing(1);
    setColour(values, "L.Combined", 4, 8, 4);
    const auto images = writeFlat(folder, {values, values});
    StackOptions options;
    options.passes = folder / "passes.exr";
    const ImportReport report = stackImages(images, folder / "d.exr", options);
    EXPECT_TRUE(anyContains(report.notes, "Contributions do not add up"));
    EXPECT_TRUE(anyContains(report.notes, "not there: GlossDir, GlossInd, GlossCol, TransDir"));
}

TEST(StackLight, PassesOfTheFirstSampleThatNoImageHasAreTold) {
    const TemporaryFolder folder;
    Values values = lit(1, 1);
    values["L.Depth.Z"] = 1e10f;
    StackOptions options;
    options.passes = folder / "passes.exr";
    const auto told = [&] {
        const auto images = writeFlat(folder, {values, values});
        const ImportReport report = stackImages(images, folder / "d.exr", options);
        EXPECT_FALSE(anyContains(report.notes, "WARNING: no image"));
        return anyContains(report.notes, "No image has anything in Depth: Cycles records");
    };
    EXPECT_TRUE(told());
    options.append = folder / "earlier.exr";  // said when that was made, of images that may have had them
    std::filesystem::copy_file(folder / "d.exr", options.append);
    EXPECT_FALSE(told());
    options.append.clear();
    values["L.Depth.Z"] = 3;
    EXPECT_FALSE(told());
}

float idOf(std::uint32_t bits) { return std::bit_cast<float>(bits); }

TEST(StackLight, CryptomattesAreMergedByCoverage) {
    const TemporaryFolder folder;
    const float a = idOf(0x7f7fffff), b = idOf(0x00800001), c = idOf(0xc0490fdb);
    const auto ranked = [&](std::array<float, 4> first, std::array<float, 4> second) {
        Values values = lit(1, 1);
        const char* ends[] = {"r", "g", "b", "a"};
        for (std::size_t k = 0; k < 4; ++k) {
            values[std::string("L.CryptoObject00.") + ends[k]] = first[k];
            values[std::string("L.CryptoObject01.") + ends[k]] = second[k];
        }
        return values;
    };
    ImageWriteOptions write;
    write.attributes["cryptomatte/542cafa/name"] = "L.CryptoObject";
    write.attributes["cryptomatte/542cafa/manifest"] = "{\"A\":\"7f7fffff\"}";
    const auto images = writeFlat(
        folder, {ranked({a, 0.5f, b, 0.375f}, {0, 0, 0, 0}), ranked({c, 0.5f, b, 0.25f}, {a, 0.25f, 0, 0})},
        write);
    StackOptions options;
    options.passes = folder / "passes.exr";
    stackImages(images, folder / "d.exr", options);
    const Image passes = readImage(folder / "passes.exr");
    const auto value = [&](const std::string& name) { return passes.at(2, 3)[passes.channel(name)]; };
    const std::pair<const char*, float> expected[] = {{"00.r", a},       {"00.g", 0.375f}, {"00.b", b},
                                                      {"00.a", 0.3125f}, {"01.r", c},      {"01.g", 0.25f},
                                                      {"01.b", 0},       {"01.a", 0}};
    for (const auto& [end, wanted] : expected)
        EXPECT_EQ(std::bit_cast<std::uint32_t>(value(std::string("L.CryptoObject") + end)),
                  std::bit_cast<std::uint32_t>(wanted))
            << end;
    EXPECT_EQ(readTextAttribute(folder / "passes.exr", "cryptomatte/542cafa/manifest"),
              "{\"A\":\"7f7fffff\"}");
}

TEST(StackLight, ThePassesKeepTheirTypesAndSayHowManySamplesTheyAreOf) {
    const TemporaryFolder folder;
    ImageWriteOptions write;
    write.half = true;
    write.compression = "dwaa";
    write.attributes["cycles.L.samples"] = "4";
    write.attributes["cycles.L.render_time"] = "00:01";
    const auto images = writeFlat(folder, {contributing(1), contributing(2)}, write);
    StackOptions options;
    options.passes = folder / "passes.exr";
    const ImportReport report = stackImages(images, folder / "d.exr", options);
    EXPECT_TRUE(anyContains(report.notes, "as half floats round it"));
    const FlatImages passes({folder / "passes.exr"});
    EXPECT_EQ(passes.type(0, "L.Combined.R"), "half");
    EXPECT_EQ(passes.type(0, "L.Diffuse.R"), "float");
    EXPECT_EQ(passes.text(0, "cycles.L.samples"), "8");
    EXPECT_EQ(passes.text(0, "cycles.L.render_time"), "");
    EXPECT_EQ(passes.text(0, "compression"), "zip");
}

TEST(StackLight, HeadersSayHowManySamplesAnImageIsOf) {
    const TemporaryFolder folder;
    ImageWriteOptions write;
    write.attributes["cycles.L.samples"] = "4";
    auto images = writeFlat(folder, {lit(1, 1), lit(2, 1)}, write);
    ImportReport report = stackImages(images, folder / "d.exr", {});
    const DumpHeader header = DumpReader(folder / "d.exr").header();
    EXPECT_EQ(header.samples, 2.0);
    EXPECT_EQ(header.averaged, 4.0);
    EXPECT_EQ(header.renderer, "Blender Cycles");
    EXPECT_TRUE(anyContains(report.notes, "2 images of 4 samples each"));

    write.attributes["cycles.L.samples"] = "2";
    const TemporaryFolder other;
    images.push_back(writeFlat(other, {lit(1, 3)}, write).front());
    report = stackImages(images, folder / "d.exr", {});
    EXPECT_TRUE(anyContains(report.notes, "different numbers of samples (2, 4), but count alike"));
    EXPECT_NEAR(DumpReader(folder / "d.exr").header().averaged, 10.0 / 3, 1e-12);
}

TEST(StackLight, WholeNumbersInHeadersAreRead) {
    const TemporaryFolder folder;
    Imf::Header header(2, 1);
    for (const char* name : {"R", "G", "B"}) header.channels().insert(name, Imf::Channel(Imf::FLOAT));
    header.insert("samplesPerPixel", Imf::IntAttribute(64));  // as pbrt writes it
    const float zeros[2] = {};
    Imf::FrameBuffer frame;
    for (const char* name : {"R", "G", "B"})
        frame.insert(name, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(const_cast<float*>(zeros)), 4, 8));
    {
        Imf::OutputFile file((folder / "p.exr").c_str(), header);
        file.setFrameBuffer(frame);
        file.writePixels(1);
    }
    stackImages({folder / "p.exr"}, folder / "d.exr", {});
    EXPECT_EQ(DumpReader(folder / "d.exr").header().averaged, 64.0);
}

TEST(StackLight, TheNoisyImageIsTakenInPlaceOfADenoisedOne) {
    const TemporaryFolder folder;
    Values values = lit(1, 1);
    setColour(values, "L.Noisy Image", 5, 6, 7);
    values["L.Noisy Image.A"] = 0.5f;
    const auto images = writeFlat(folder, {values, values});
    const ImportReport report = stackImages(images, folder / "d.exr", {});
    const SampleBand band = DumpReader(folder / "d.exr").read(0, 1, {"G", "A"});
    EXPECT_EQ(band.values[0][0], 6.0f);
    EXPECT_EQ(band.values[1][0], 0.5f);
    EXPECT_TRUE(anyContains(report.notes, "Combined is denoised: R, G, B and A are from Noisy Image"));
    StackOptions mapped;
    mapped.map = {{"R", "L.Combined_key.R"}};
    stackImages(images, folder / "d.exr", mapped);
    EXPECT_EQ(DumpReader(folder / "d.exr").read(0, 1, {"R"}).values[0][0], 1.0f);
}

}  // namespace
}  // namespace vlx
