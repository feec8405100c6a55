// Copies of renderers' files with some layers replaced: all else must be there, bit for bit.

#include "import/image_layers.h"

#include <gtest/gtest.h>

#include "../base/temporary_folder.h"
#include "../dump/layer_files.h"
#include "../dump/renderer_files.h"
#include "../dump/test_dumps.h"
#include "exr/header_walker.h"
#include "import/moments.h"
#include "variolux/base/image_io.h"

namespace vlx {
namespace {

constexpr Window kData{3, -2, 13, 150};

float denoised(int channel, int x, int y) {
    return 0.01f * static_cast<float>(channel + 1) * static_cast<float>(x + 2 * y);
}

std::string expectedBytes(ChannelType type, int channel) {
    std::vector<float> values;
    for (int y = kData.y; y < kData.y + kData.height; ++y)
        for (int x = kData.x; x < kData.x + kData.width; ++x) values.push_back(denoised(channel, x, y));
    constexpr const char* number[] = {"1:", "2:", "0:"};  // OpenEXR's of Half, Float, Uint
    return number[static_cast<int>(type)] + layerBytes(type, values);
}

TEST(ImageLayers, EverythingElseOfAllPartsStaysAsItWas) {
    const TemporaryFolder folder;
    writeLayers(folder / "in.exr", rendererParts());
    const Image image =
        imageOf(kData, {"R", "G", "B", "variance.G", "stddev.R"}, denoised);  // of both parts, and a new one
    const LayerCopy copy = copyWithLayers(folder / "in.exr", folder / "out.exr", image,
                                          {{"R", "R"}, {"G", "key.G"}, {"B", "B"}}, {{"made of", "this"}});
    EXPECT_EQ(copy.replaced,
              (ChannelMap{{"R", "R"}, {"key.G", "G"}, {"B", "B"}, {"variance.G", "variance.G"}}));
    EXPECT_EQ(copy.added, std::vector<std::string>{"stddev.R"});
    EXPECT_EQ(copy.overflows, 0);
    EXPECT_EQ(copy.recompressed, "");

    auto before = readLayers(folder / "in.exr");
    const auto after = readLayers(folder / "out.exr");
    ASSERT_EQ(after.size(), 3u);
    before[0].channels["R"] = expectedBytes(ChannelType::Half, 0);
    before[0].channels["key.G"] = expectedBytes(ChannelType::Half, 1);
    before[0].channels["B"] = expectedBytes(ChannelType::Half, 2);
    before[1].channels["G"] = expectedBytes(ChannelType::Float, 3);
    before[0].channels["stddev.R"] = expectedBytes(ChannelType::Float, 4);
    before[0].attributes["made of"] = "string:this";
    for (std::size_t i = 0; i < 3; ++i) {
        EXPECT_EQ(after[i].attributes, before[i].attributes) << i;
        EXPECT_EQ(after[i].attributes.at("strange"), std::string("strange:\1\2\3\4\5"));
        ASSERT_EQ(after[i].channels.size(), before[i].channels.size());
        for (const auto& [name, bytes] : before[i].channels)
            EXPECT_TRUE(after[i].channels.at(name) == bytes) << i << " " << name;
    }
}

std::vector<std::string> attributeNames(const std::string& path) {
    const auto bytes = fileBytes(path);
    HeaderWalker walker(path, bytes, bytes.size());
    walker.word();
    walker.word();
    std::vector<std::string> names;
    for (const RawAttribute& attribute : walker.header()) names.push_back(attribute.name + attribute.type);
    return names;
}

// Of every compression, scan lines and tiles: what was not replaced is what it was.
TEST(ImageLayers, NoCompressionLosesBitsOfUntouchedLayers) {
    const TemporaryFolder folder;
    const Image image = imageOf(kData, {"R"}, denoised);
    for (int number = Imf::NO_COMPRESSION; number < Imf::NUM_COMPRESSION_METHODS; ++number)
        for (const bool tiled : {false, true}) {
            LayerPart part = rendererParts().front();
            part.compression = static_cast<Imf::Compression>(number);
            part.tiled = tiled;
            writeLayers(folder / "in.exr", {part});
            const LayerCopy copy = copyWithLayers(folder / "in.exr", folder / "out.exr", image, {{"R", "R"}});
            auto before = readLayers(folder / "in.exr"), after = readLayers(folder / "out.exr");
            ASSERT_EQ(after.size(), 1u);
            EXPECT_EQ(copy.recompressed.empty(), number < Imf::B44_COMPRESSION) << number;
            if (!copy.recompressed.empty())
                after[0].attributes["compression"] = before[0].attributes["compression"];
            EXPECT_EQ(after[0].attributes, before[0].attributes) << number;
            EXPECT_EQ(attributeNames(folder / "out.exr"), attributeNames(folder / "in.exr"));
            before[0].channels.erase("R");
            after[0].channels.erase("R");
            EXPECT_TRUE(after[0].channels == before[0].channels) << number << tiled;
        }
}

TEST(ImageLayers, WhatHalfCannotHoldIsCountedNotInfinite) {
    const TemporaryFolder folder;
    LayerPart part = rendererParts().front();
    part.channels = {{"R", ChannelType::Half}};  // nothing else to be read
    writeLayers(folder / "in.exr", {part});
    Image image(kData, {"R"});
    image.at(1, 2)[0] = 1e6f;
    image.at(2, 2)[0] = -7e4f;
    image.at(3, 2)[0] = 65519;  // rounds to 65504
    const LayerCopy copy = copyWithLayers(folder / "in.exr", folder / "out.exr", image, {{"R", "R"}});
    EXPECT_EQ(copy.overflows, 2);
    const Image back = readImage(folder / "out.exr");
    const int r = back.channel("R");
    EXPECT_EQ(back.at(1, 2)[r], 65504);
    EXPECT_EQ(back.at(2, 2)[r], -65504);
    EXPECT_EQ(back.at(3, 2)[r], 65504);
}

TEST(ImageLayers, MisfitsAreErrorsAndLeaveNothing) {
    const TemporaryFolder folder;
    const std::string in = folder / "in.exr", out = folder / "out.exr";
    writeLayers(in, rendererParts());
    const auto error = [&](const std::string& from, const Window& window, const ChannelMap& map) {
        const std::string text =
            errorOf([&] { copyWithLayers(from, out, imageOf(window, {"R"}, denoised), map); });
        EXPECT_FALSE(std::filesystem::exists(out));
        return text;
    };
    EXPECT_NE(error(in, {3, -2, 13, 149}, {{"R", "R"}}).find("expected the image's data window"),
              std::string::npos);
    EXPECT_NE(error(in, kData, {{"R", "mask.x"}}).find("expected the image's data window"),
              std::string::npos);
    EXPECT_NE(error(in, kData, {{"R", "L.Combined.R"}}).find("in.exr: expected a channel L.Combined.R"),
              std::string::npos);
    LayerPart part = rendererParts().front();
    part.tiled = part.mipmap = true;
    writeLayers(folder / "mipmap.exr", {part});
    EXPECT_NE(error(folder / "mipmap.exr", kData, {{"R", "R"}}).find("one resolution"), std::string::npos);
    auto bytes = fileBytes(in);
    bytes.resize(bytes.size() * 2 / 3);
    writeBytes(folder / "cut.exr", bytes);
    EXPECT_NE(error(folder / "cut.exr", kData, {{"R", "R"}}).find("cut.exr: "), std::string::npos);
    writeBytes(folder / "text.exr", {'t', 'e', 'x', 't', ' ', ' ', ' ', ' ', ' '});
    EXPECT_NE(error(folder / "text.exr", kData, {{"R", "R"}}).find("text.exr: expected a flat OpenEXR file"),
              std::string::npos);
}

TEST(ImageLayers, RadianceIsFoundAsAStackFindsIt) {
    const TemporaryFolder folder;
    LayerPart part = rendererParts().front();
    part.channels = {{"V.Combined.R"}, {"V.Combined.G"}, {"V.Combined.B"}, {"V.Combined.A"}, {"V.Mist.Z"}};
    writeLayers(folder / "in.exr", {part});
    EXPECT_EQ(
        findRadiance(folder / "in.exr", {{"G", "V.Mist.Z"}}),
        (ChannelMap{{"R", "V.Combined.R"}, {"G", "V.Mist.Z"}, {"B", "V.Combined.B"}, {"A", "V.Combined.A"}}));
}

LayerPart partOf(const std::string& name, const std::vector<std::string>& channels) {
    LayerPart part = rendererParts().front();
    part.name = name;
    part.channels.clear();
    for (const std::string& channel : channels) part.channels.push_back({channel});
    return part;
}

std::vector<std::string> namesIn(const std::string& path, std::size_t part = 0) {
    std::vector<std::string> names;
    const std::vector<ReadPart> parts = readLayers(path);
    for (const auto& [name, bytes] : parts[part].channels) names.push_back(name);
    return names;
}

// Blender's compositor shows passes of the layer that it shows, none beside it.
TEST(ImageLayers, WhatIsNewGoesBesideTheLayerThatIsReplaced) {
    const TemporaryFolder folder;
    const std::string in = folder / "in.exr", once = folder / "once.exr", twice = folder / "twice.exr";
    writeLayers(in, {partOf("main", {"V.Combined.R", "V.key.R", "rim.R", "W.Combined.R"})});
    const std::vector<std::string> channels = {"R", "rim.R", "V.key.R", "stddev.R", "fill.R", "ao"};
    const Image image = imageOf(kData, channels, denoised),
                other = imageOf(kData, channels, [](int c, int x, int y) { return -denoised(c, x, y); });
    const LayerCopy copy = copyWithLayers(in, once, image, {{"R", "V.Combined.R"}});
    EXPECT_EQ(copy.replaced, (ChannelMap{{"V.Combined.R", "R"}, {"V.key.R", "V.key.R"}, {"rim.R", "rim.R"}}));
    EXPECT_EQ(copy.added, (std::vector<std::string>{"V.ao.V", "V.fill.R", "V.stddev.R"}));

    // Once more: what was added is replaced.
    const LayerCopy again = copyWithLayers(once, twice, other, {{"R", "V.Combined.R"}});
    EXPECT_TRUE(again.added.empty());
    EXPECT_EQ(again.replaced.at("V.stddev.R"), "stddev.R");
    EXPECT_EQ(namesIn(twice), namesIn(once));
    const Image first = readImage(once), second = readImage(twice);
    EXPECT_EQ(first.at(3, 4)[first.channel("V.stddev.R")], denoised(3, kData.x + 3, kData.y + 4));
    EXPECT_EQ(second.at(3, 4)[second.channel("V.stddev.R")], -denoised(3, kData.x + 3, kData.y + 4));

    // The other view layer has an error of its own; what has no layer above keeps its name.
    EXPECT_EQ(copyWithLayers(once, twice, image, {{"R", "W.Combined.R"}}).added,
              (std::vector<std::string>{"W.ao.V", "W.fill.R", "W.stddev.R"}));
    EXPECT_EQ(copyWithLayers(in, twice, image, {{"R", "rim.R"}}).added,
              (std::vector<std::string>{"ao", "fill.R", "stddev.R"}));
}

TEST(ImageLayers, PartsOfTheirOwnGetTheErrorOfTheirLayer) {
    const TemporaryFolder folder;
    const std::string in = folder / "in.exr", out = folder / "out.exr";
    writeLayers(
        in, {partOf("V.Depth", {"V.Depth.Z"}), partOf("V.Combined", {"V.Combined.R"}), partOf("raw", {"R"})});
    const Image image = imageOf(kData, {"R", "stddev.R"}, denoised);
    copyWithLayers(in, out, image, {{"R", "V.Combined.R"}});
    EXPECT_EQ(namesIn(out, 1), (std::vector<std::string>{"V.Combined.R", "V.stddev.R"}));
    EXPECT_TRUE(copyWithLayers(out, folder / "twice.exr", image, {{"R", "V.Combined.R"}}).added.empty());
    copyWithLayers(in, out, image, {{"R", "raw.R"}});
    EXPECT_EQ(namesIn(out, 2), (std::vector<std::string>{"R", "stddev.R"}));
    const Image read = readImage(out, [](const std::vector<std::string>& names) {
        EXPECT_EQ(names, (std::vector<std::string>{"V.Depth.Z", "V.Combined.R", "raw.R", "raw.stddev.R"}));
        return std::vector<std::string>{"raw.stddev.R", "V.Combined.R", "raw.R"};
    });
    const std::vector<std::string> wanted = {"raw.stddev.R", "V.Combined.R", "raw.R"};
    EXPECT_EQ(read.channels, wanted);
    const int x = kData.x + 7, y = kData.y + 140;
    const float* pixel = read.at(7, 140);
    EXPECT_EQ(pixel[0], denoised(1, x, y));
    EXPECT_EQ(pixel[1], layerValue("V.Combined.R", x, y));
    EXPECT_EQ(pixel[2], denoised(0, x, y));
}

TEST(ImageLayers, ALayerIsChosenByName) {
    const TemporaryFolder folder;
    const std::string in = folder / "in.exr";
    LayerPart part = partOf("", {});
    for (const char* layer : {"V.Combined", "V.Combined_key", "W.Combined", "W.Denoising Albedo"})
        for (const char* c : {"R", "G", "B", "A"}) part.channels.push_back({std::string(layer) + "." + c});
    std::erase_if(part.channels, [](const auto& channel) {
        return channel.name == "V.Combined_key.A" || channel.name == "W.Denoising Albedo.A";
    });
    writeLayers(in, {part});
    EXPECT_EQ(
        findRadiance(in, {}, "W"),
        (ChannelMap{
            {"R", "W.Combined.R"}, {"G", "W.Combined.G"}, {"B", "W.Combined.B"}, {"A", "W.Combined.A"}}));
    EXPECT_EQ(findRadiance(in, {}, "V.Combined_key"),
              (ChannelMap{{"R", "V.Combined_key.R"}, {"G", "V.Combined_key.G"}, {"B", "V.Combined_key.B"}}));
    EXPECT_NE(errorOf([&] {
                  findRadiance(in, {}, "Z");
              }).find("found the layers V.Combined, V.Combined_key, W.Combined, W.Denoising Albedo"),
              std::string::npos);
    // Features are those of the same view layer.
    MomentOptions options;
    options.layer = "W";
    options.meaning = VarianceMeaning::OfMean;
    options.map = {
        {"variance.R", "V.Combined.R"}, {"variance.G", "V.Combined.R"}, {"variance.B", "V.Combined.R"}};
    const auto mapped = openMoments(in, options)->report().mapped;
    EXPECT_EQ(mapped.at("R"), "W.Combined.R");
    EXPECT_EQ(mapped.at("A"), "W.Combined.A");
    EXPECT_EQ(mapped.at("albedo.G"), "W.Denoising Albedo.G");
}

// Channels of later parts go by their part's name: a variance in a part of its own.
TEST(ImageLayers, MomentsMayLieInSeveralParts) {
    const TemporaryFolder folder;
    writeLayers(folder / "in.exr", rendererParts());
    MomentOptions options;
    options.samples = 4;
    const auto samples = openMoments(folder / "in.exr", options);
    EXPECT_EQ(samples->report().mapped.at("variance.B"), "variance.B");
    const SampleBand band = samples->read(100, 3, {"variance.B"});
    ASSERT_EQ(band.samples(), 3u * 13 * 2);
    for (int i = 0; i < 3 * 13; ++i)
        ASSERT_FLOAT_EQ(band.values[0][static_cast<std::size_t>(2 * i)],
                        layerValue("B", kData.x + i % 13, 100 + i / 13) / 4 * 2);
}

}  // namespace
}  // namespace vlx
