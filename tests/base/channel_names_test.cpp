// Where renderers keep their picture, by the names of channels alone.

#include "variolux/base/channel_names.h"

#include <gtest/gtest.h>

namespace vlx {
namespace {

using Names = std::vector<std::string>;

Names layersOf(const Names& layers, const std::string& endings = "RGB") {
    Names names;
    for (const std::string& layer : layers)
        for (const char end : endings) names.push_back(layer + (layer.empty() ? "" : ".") + end);
    return names;
}

std::string redOf(const Names& names, const std::string& layer = {}) {
    const auto colour = findColour(names, layer);
    return colour ? colour->front() : "none";
}

TEST(ChannelNames, LayersAndWhatTheyBeginWith) {
    EXPECT_EQ(layerOf("ViewLayer.Combined.R"), "ViewLayer.Combined");
    EXPECT_EQ(layerOf("R"), "");
    EXPECT_EQ(layerPrefix("ViewLayer.Combined.R"), "ViewLayer.");
    EXPECT_EQ(layerPrefix("shot.View.Combined.R"), "shot.View.");
    for (const char* none : {"rgba.R", "beauty.red", "R"}) EXPECT_EQ(layerPrefix(none), "") << none;
}

TEST(ChannelNames, ChannelsOfLaterPartsGoByThePart) {
    EXPECT_EQ(partChannel(0, "main", "R"), "R");
    EXPECT_EQ(partChannel(1, "key", "R"), "key.R");
    EXPECT_EQ(partChannel(1, "key", "key.R"), "key.R");
    EXPECT_EQ(partChannel(2, "", "R"), "R");
    EXPECT_EQ(partChannel(1, "View.Combined", "View.stddev.R"), "View.stddev.R");
}

TEST(ChannelNames, ThePictureIsFoundWhereRenderersKeepIt) {
    EXPECT_EQ(redOf({"B", "G", "R", "albedo.B", "albedo.G", "albedo.R"}), "R");
    EXPECT_EQ(redOf(layersOf({"V.Albedo", "V.Combined", "V2.Combined"})), "V.Combined.R");
    EXPECT_EQ(redOf(layersOf({"Composite.Combined", "V.Combined"})), "V.Combined.R")
        << "the compositor's picture is no render";
    EXPECT_EQ(redOf(layersOf({"Composite.Combined"})), "Composite.Combined.R");
    EXPECT_EQ(redOf(layersOf({"albedo", "rgba"})), "rgba.R");
    EXPECT_EQ(redOf({"beauty.red", "beauty.green", "beauty.blue"}), "beauty.red");
    EXPECT_EQ(redOf({"Y", "Z"}), "Y");
    EXPECT_EQ(redOf({"X", "Y", "Z"}), "none");
    EXPECT_EQ(redOf(layersOf({"albedo"})), "none");
}

TEST(ChannelNames, ALayerIsChosenByItsNameOrItsViewLayers) {
    Names names = layersOf({"V.Combined", "V.Combined_key", "V2.Combined", "beauty"});
    for (const Names& more :
         {layersOf({"V.Normal"}, "XYZ"), Names{"V.Depth.Z", "nuke.red", "nuke.green", "nuke.blue"}})
        names.insert(names.end(), more.begin(), more.end());
    EXPECT_EQ(redOf(names, "V2"), "V2.Combined.R");
    EXPECT_EQ(redOf(names, "V.Combined_key"), "V.Combined_key.R");
    EXPECT_EQ(redOf(names, "beauty"), "beauty.R");
    EXPECT_EQ(redOf(names, "nuke"), "nuke.red");
    EXPECT_EQ(redOf(names, "V.Normal"), "V.Normal.X");
    for (const char* none : {"V3", "V.Depth", "Combined"}) EXPECT_EQ(redOf(names, none), "none") << none;
    EXPECT_EQ(listedLayers(names),
              "V.Combined, V.Combined_key, V2.Combined, beauty, V.Normal, V.Depth, nuke");
    EXPECT_EQ(listedLayers({"R", "G", "key.R", "key.G"}), "R, G, key");
}

TEST(ChannelNames, AlphaAndErrorBelongToTheirLayer) {
    Names names = layersOf({"V.Combined", "V2.Combined", ""}, "RGBA");
    for (const Names& more :
         {layersOf({"V.key", "V.stddev", "stddev", "part.stddev", "part"}), Names{"n.red", "n.alpha", "m.r"}})
        names.insert(names.end(), more.begin(), more.end());
    EXPECT_EQ(findAlpha(names, "V2.Combined.R"), "V2.Combined.A");
    EXPECT_EQ(findAlpha(names, "R"), "A");
    EXPECT_EQ(findAlpha(names, "n.red"), "n.alpha");
    for (const char* none : {"V.key.R", "m.r"}) EXPECT_FALSE(findAlpha(names, none)) << none;
    const auto error = [&](const char* red) { return findError(names, red).value()[0]; };
    EXPECT_EQ(error("V.Combined.R"), "V.stddev.R");
    EXPECT_EQ(error("V.key.R"), "V.stddev.R");
    EXPECT_EQ(error("V2.Combined.R"), "stddev.R") << "there is no other";
    EXPECT_EQ(error("part.R"), "part.stddev.R");
    EXPECT_EQ(error("R"), "stddev.R");
    EXPECT_FALSE(findError(layersOf({"V.stddev"}), "V2.Combined.R"));
}

}  // namespace
}  // namespace vlx
