// Pictures whose values' squares no float holds: right, or an error, never a picture of what little is left.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <memory>
#include <random>
#include <string>

#include "variolux/base/error.h"
#include "variolux/dump/sample_buffer.h"
#include "variolux/reconstruct/reconstruct.h"
#include "variolux/reconstruct/sequence.h"

namespace vlx {
namespace {

constexpr int kRangeSize = 40;
const Window kRangeWindow{0, 0, kRangeSize, kRangeSize};

/// Noise about 1, 4 samples a pixel but for a hole, times unit(x, y).
template <class Unit>
std::unique_ptr<SampleBuffer> pictureInUnits(const Unit& unit, bool stated = false) {
    DumpHeader header;
    header.data = header.display = kRangeWindow;
    header.channels = {{"R"}, {"G"}, {"B"}};
    if (stated)
        header.channels.insert(header.channels.end(), {{"variance.R"}, {"variance.G"}, {"variance.B"}});
    SampleBand band{0, 0, kRangeSize, kRangeSize, {0}, {}, {}};
    for (const DumpChannel& channel : header.channels) band.channels.push_back(channel.name);
    band.values.resize(header.channels.size());
    std::mt19937 random(7);
    std::normal_distribution<float> noise(1, 0.2f);
    for (int y = 0; y < kRangeSize; ++y)
        for (int x = 0; x < kRangeSize; ++x) {
            for (int s = 0; s < 4 && !(x < 5 && y < 5); ++s) {
                const float u = unit(x, y);
                for (std::size_t c = 0; c < 3; ++c) band.values[c].push_back(u * noise(random));
                for (std::size_t c = 3; c < band.values.size(); ++c) band.values[c].push_back(0.04f * u * u);
            }
            band.offsets.push_back(band.values[0].size());
        }
    return std::make_unique<SampleBuffer>(header, band);
}

std::unique_ptr<SampleBuffer> pictureOfUnit(float unit, bool stated = false) {
    return pictureInUnits([=](int, int) { return unit; }, stated);
}

std::string rangeErrorOf(const std::function<void()>& run) {
    try {
        run();
    } catch (const Error& error) {
        return error.what();
    }
    return "none";
}

bool saysOfRange(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

TEST(RadianceRange, KrigingRefusesPicturesBeyondIt) {
    for (const float unit : {1e16f, 1e17f, 1e20f, -1e20f, 1e37f})
        for (const bool stated : {false, true}) {
            const auto dump = pictureOfUnit(unit, stated);
            bool written = false;
            const std::string error = rangeErrorOf(
                [&] { reconstruct(*dump, Drift{}, [&](const float*, int) { written = true; }, {}); });
            EXPECT_TRUE(saysOfRange(error, dump->path())) << error;
            for (const char* part : {"expected radiance up to 2^50", "found up to", "exposure", "--map"})
                EXPECT_TRUE(saysOfRange(error, part)) << unit << ": " << error;
            EXPECT_FALSE(written) << unit;
        }
}

TEST(RadianceRange, KrigingIsTheSameUpToIt) {
    const Image small = reconstruct(*pictureOfUnit(1), Drift{}).image;
    for (const float unit : {0x1p30f, 0x1p48f}) {
        const Image large = reconstruct(*pictureOfUnit(unit), Drift{}).image;
        for (std::size_t i = 0; i < small.pixels.size(); ++i)
            ASSERT_NEAR(large.pixels[i] / unit, small.pixels[i], 0.02f) << unit << " " << i;
    }
}

// What they compute in double precision is right, and so is what they say of pixels without samples.
TEST(RadianceRange, OtherMethodsKnowNone) {
    for (const Method& method : {Method(Mean{}), Method(Gaussian{}), Method(Paper{})}) {
        const Image small = reconstruct(*pictureOfUnit(1), method).image;
        for (const float unit : {0x1p60f, 0x1p100f}) {
            const Image large = reconstruct(*pictureOfUnit(unit), method).image;
            for (std::size_t i = 0; i < small.pixels.size(); ++i)
                ASSERT_NEAR(large.pixels[i] / unit, small.pixels[i], 0.01f) << method.index() << " " << i;
        }
    }
}

// Not in the rows that are looked at before: known at the end, when nothing has its final name yet.
TEST(RadianceRange, ALampIsNoFirefly) {
    const auto lamp = [](int x, int y) { return (y == 9 || y == 19) && x > 10 && x < 20 ? 1e18f : 1.f; };
    const std::string error = rangeErrorOf([&] { reconstruct(*pictureInUnits(lamp), Drift{}); });
    EXPECT_TRUE(saysOfRange(error, "72 of 6300 samples of the picture")) << error;
    const auto firefly = [](int x, int y) { return y == 19 && x > 10 && x < 15 ? 1e18f : 1.f; };
    EXPECT_EQ(reconstruct(*pictureInUnits(firefly), Drift{}).report.droppedSamples, 16);
}

TEST(RadianceRange, FramesAroundAreInIt) {
    const auto open = [](int frame) -> std::unique_ptr<SampleSource> {
        if (frame < 1 || frame > 5) return nullptr;
        return pictureOfUnit(frame == 5 ? 1e20f : 1.f);
    };
    Drift options;
    options.temporal = 1;
    EXPECT_TRUE(saysOfRange(rangeErrorOf([&] { Sequence(open, options).reconstruct(4); }), "up to 2^50"));
    EXPECT_EQ(rangeErrorOf([&] { Sequence(open, options).reconstruct(2); }), "none");
}

TEST(RadianceRange, SoAreSamplesBesideAnotherDenoisersImage) {
    auto opinion = std::make_shared<SecondOpinion>();
    opinion->image = Image(kRangeWindow, {"R", "G", "B"});
    std::fill(opinion->image.pixels.begin(), opinion->image.pixels.end(), 1.f);
    Drift options;
    options.secondOpinion = opinion;
    EXPECT_EQ(rangeErrorOf([&] { reconstruct(*pictureOfUnit(1), options); }), "none");
    EXPECT_TRUE(
        saysOfRange(rangeErrorOf([&] { reconstruct(*pictureOfUnit(1e20f), options); }), "up to 2^50"));
}

}  // namespace
}  // namespace vlx
