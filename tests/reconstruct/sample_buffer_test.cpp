// Reconstruction of samples in memory: the bits of the way through a file.

#include "variolux/dump/sample_buffer.h"

#include <gtest/gtest.h>

#include <random>

#include "../base/temporary_folder.h"
#include "variolux/base/error.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

struct Samples {
    DumpHeader header;
    SampleBand band;
};

/// Noise around an edge, of uneven counts; alpha and albedo that HALF does not hold exactly.
Samples someSamples() {
    Samples all;
    const Window window{-3, 5, 41, 37};
    all.header.data = all.header.display = window;
    all.header.channels = {{"R"},
                           {"G"},
                           {"B"},
                           {"A", ChannelType::Half},
                           {"albedo.R", ChannelType::Half},
                           {"albedo.G", ChannelType::Half},
                           {"albedo.B", ChannelType::Half},
                           {"sample.replicate", ChannelType::Uint}};
    all.band = {window.x, window.y, window.width, window.height, {0}, {}, {}};
    for (const auto& channel : all.header.channels) all.band.channels.push_back(channel.name);
    all.band.values.resize(all.band.channels.size());
    std::mt19937 random(3);
    std::exponential_distribution<float> light(1);
    for (int y = 0; y < window.height; ++y)
        for (int x = 0; x < window.width; ++x) {
            const float albedo = x + y > 40 ? 0.3f : 0.7f;
            for (int s = 0; s < 3 + x % 3; ++s) {
                for (std::size_t c = 0; c < 3; ++c) all.band.values[c].push_back(albedo * light(random));
                all.band.values[3].push_back(x % 5 == 0 ? 0.3f : 1.f);
                for (std::size_t c = 4; c < 7; ++c) all.band.values[c].push_back(albedo);
                all.band.values[7].push_back(static_cast<float>(s));
            }
            all.band.offsets.push_back(all.band.values[0].size());
        }
    return all;
}

TEST(SampleBuffer, GivesTheBitsOfTheWayThroughAFile) {
    const TemporaryFolder folder;
    const Samples all = someSamples();
    DumpWriter writer(folder / "a.exr", all.header);
    writer.write(all.band);
    writer.close();
    const DumpReader dump(folder / "a.exr");
    const SampleBuffer buffer(all.header, all.band);
    EXPECT_EQ(reconstruct(buffer, Drift{}).image.pixels, reconstruct(dump, Drift{}).image.pixels);
    EXPECT_EQ(reconstruct(buffer, Mean{}).image.pixels, reconstruct(dump, Mean{}).image.pixels);
    EXPECT_EQ(reconstruct(buffer, Paper{}).image.pixels, reconstruct(dump, Paper{}).image.pixels);
}

TEST(SampleBuffer, WhatAProgressThrowsEndsTheReconstruction) {
    const Samples all = someSamples();
    const SampleBuffer buffer(all.header, all.band);
    struct Cancelled {};
    int calls = 0;
    EXPECT_THROW(reconstruct(buffer, Drift{.quality = Quality::Draft},
                             [&](std::int64_t, std::int64_t) {
                                 ++calls;
                                 throw Cancelled();
                             }),
                 Cancelled);
    EXPECT_EQ(calls, 1);
}

TEST(SampleBuffer, MisfitsAreErrors) {
    const Samples good = someSamples();
    const auto error = [&](auto change) -> std::string {
        Samples bad = good;
        change(bad);
        try {
            const SampleBuffer buffer(bad.header, bad.band, "mine");
        } catch (const Error& e) {
            return e.what();
        }
        return "none";
    };
    const auto starts = [](const std::string& text, const std::string& with) {
        EXPECT_TRUE(text.starts_with("mine: expected " + with)) << text;
    };
    starts(error([](Samples& s) { s.band.height = 36; }), "the samples of the data window");
    starts(error([](Samples& s) { s.header.channels[0].name = "Q"; }), "channels R, G and B");
    starts(error([](Samples& s) { s.band.channels.pop_back(); }), "the header's 8 channels");
    starts(error([](Samples& s) { s.band.offsets[7] = 0; }), "1518 offsets");
    starts(error([](Samples& s) { s.band.values[2].pop_back(); }), "");
    starts(error([](Samples& s) { s.header.data = s.header.display = {}; }), "a data window with pixels");
    const SampleBuffer buffer(good.header, good.band);
    EXPECT_THROW(buffer.read(4, 1), Error);
    EXPECT_THROW(buffer.read(41, 2), Error);
    EXPECT_THROW(buffer.read(5, 1, {"N.X"}), Error);
}

}  // namespace
}  // namespace vlx
