#include "variolux/reconstruct/sequence.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <random>
#include <set>

#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/sample_buffer.h"

namespace vlx {
namespace {

constexpr int kColumns = 72, kLines = 56, kSamples = 4;

/// What a shot truly shows, and what moves in it.
struct MadeUpShot {
    std::function<double(int frame, int x, int y)> truth = [](int, int x, int y) {
        return 1 + 0.4 * std::sin(0.2 * x) * std::cos(0.17 * y);
    };
    std::function<double(int frame, int x, int y)> albedo = [](int, int, int) { return 0.5; };
    /// Pixels along x since the frame before; none: no channels of motion.
    std::function<double(int frame, int x, int y)> motion = {};
    int first = 1, last = 7, columns = kColumns;
    double noise = 0.4;       ///< standard deviation of a sample, of the signal
    double featureNoise = 0;  ///< of the albedo of a sample
    unsigned seed = 1;
    std::function<int(int frame, int x, int y)> samples = [](int, int, int) { return kSamples; };
    bool sameNoise = false;  ///< and seed

    std::unique_ptr<SampleSource> open(int frame) const {
        if (frame < first || frame > last) return nullptr;
        DumpHeader header;
        header.data = header.display = {3, -5, columns, kLines};
        header.seed = sameNoise ? 1 : frame;
        SampleBand band{3, -5, columns, kLines, {0}, {}, {}};
        for (const char* name : {"R", "G", "B", "albedo.R", "albedo.G", "albedo.B"})
            band.channels.emplace_back(name);
        if (motion)
            for (const std::string_view name : kMotionChannels) band.channels.emplace_back(name);
        for (const std::string& name : band.channels) header.channels.push_back({name, ChannelType::Float});
        band.values.resize(band.channels.size());
        std::mt19937 random(sameNoise ? seed : 1000 * seed + static_cast<unsigned>(frame));
        std::normal_distribution<double> normal;
        for (int y = 0; y < kLines; ++y)
            for (int x = 0; x < columns; ++x) {
                for (int s = 0; s < samples(frame, x, y); ++s) {
                    const double z = truth(frame, x, y) * (1 + noise * normal(random));
                    for (std::size_t c = 0; c < 3; ++c)
                        band.values[c].push_back(static_cast<float>(z * (1 - 0.3 * static_cast<double>(c))));
                    const double blurred = featureNoise > 0 ? featureNoise * normal(random) : 0;
                    for (std::size_t c = 3; c < 6; ++c)
                        band.values[c].push_back(static_cast<float>(albedo(frame, x, y) + blurred));
                    if (!motion) continue;
                    const double step = motion(frame, x, y);
                    const double values[] = {-step, 0, step, 0};
                    for (std::size_t k = 0; k < 4; ++k)
                        band.values[6 + k].push_back(static_cast<float>(values[k]));
                }
                band.offsets.push_back(band.values[0].size());
            }
        return std::make_unique<SampleBuffer>(header, std::move(band), "frame " + std::to_string(frame));
    }
    Sequence sequence(const Drift& options) const {
        return Sequence([this](int frame) { return open(frame); }, options);
    }
    Image krige(int frame, Drift options = {.temporal = 2}) const {
        return sequence(options).reconstruct(frame).image;
    }
    /// Mean squared relative error of R.
    double error(const Image& image, int frame) const {
        double sum = 0;
        for (int y = 0; y < kLines; ++y)
            for (int x = 0; x < columns; ++x) {
                const double z = truth(frame, x, y), d = static_cast<double>(image.at(x, y)[0]) - z;
                sum += d * d / (z * z);
            }
        return sum / (columns * kLines);
    }
    /// Over that of the frame by itself: means over seeds.
    double ratio(int frame, int seeds = 4) {
        double with = 0, alone = 0;
        for (seed = 1; seed <= static_cast<unsigned>(seeds); ++seed) {
            with += error(krige(frame), frame);
            alone += error(reconstruct(*open(frame), Drift{}).image, frame);
        }
        return with / alone;
    }
};

TEST(Sequence, OfOneFrameIsThatFrame) {
    MadeUpShot shot;
    shot.first = shot.last = 4;
    EXPECT_EQ(shot.krige(4).pixels, reconstruct(*shot.open(4), Drift{}).image.pixels);
    EXPECT_THROW(shot.krige(5), Error);
}

Drift bandOf3(int i) {
    Drift options{.temporal = 2};
    options.band = {i, 3};
    return options;
}

TEST(Sequence, SamePixelsInAnyOrderAndForAnyThreadsAndBands) {
    MadeUpShot shot;
    shot.motion = [](int, int, int) { return 1.3; };
    Sequence inOrder = shot.sequence({.temporal = 2});
    std::map<int, Image> images;
    for (int frame = 1; frame <= 7; ++frame) images[frame] = inOrder.reconstruct(frame).image;
    for (const int frame : {4, 1, 7}) EXPECT_EQ(shot.krige(frame).pixels, images[frame].pixels) << frame;
    for (const int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        std::vector<float> joined;
        for (int i = 0; i < 3; ++i) {
            const Image band = shot.krige(4, bandOf3(i));
            joined.insert(joined.end(), band.pixels.begin(), band.pixels.end());
        }
        EXPECT_EQ(joined, images[4].pixels) << threads;
    }
}

TEST(Sequence, AStillShotGains) {
    MadeUpShot shot;
    EXPECT_LT(shot.ratio(4), 0.5);
    EXPECT_LT(shot.ratio(1), 0.5) << "four frames after it";
}

TEST(Sequence, TheWindowIsShiftedNearTheEnds) {
    const auto around = [](int frame, int temporal, std::set<int> frames) {
        const FramesAround of = framesAround(frame, temporal, [&](int i) { return frames.contains(i); });
        return std::pair(of.before, of.after);
    };
    const std::set<int> shot = {0, 1, 2, 3, 4, 5, 6, 8, 9};
    EXPECT_EQ(around(3, 2, shot), std::pair(2, 2));
    EXPECT_EQ(around(3, 0, shot), std::pair(0, 0));
    EXPECT_EQ(around(0, 2, shot), std::pair(0, 4));
    EXPECT_EQ(around(1, 2, shot), std::pair(1, 3));
    EXPECT_EQ(around(6, 2, shot), std::pair(4, 0)) << "what comes after a missing frame is another shot";
    EXPECT_EQ(around(8, 2, shot), std::pair(0, 1));
    EXPECT_EQ(around(3, 8, shot), std::pair(3, 3));
    MadeUpShot made;
    made.last = 4;
    EXPECT_EQ(made.sequence({.temporal = 2}).reconstruct(4).report.drift().sequence->frames, 3);
    EXPECT_EQ(made.sequence({.temporal = 1}).reconstruct(4).report.drift().sequence->frames, 2);
}

TEST(Sequence, MotionBringsDataTogether) {
    MadeUpShot shot;  // a texture that pans three pixels a frame
    shot.truth = [](int frame, int x, int y) {
        const int there = x - 3 * frame;
        return ((there % 10 + 10) % 10 < 5) == (y % 10 < 5) ? 1.0 : 0.3;
    };
    EXPECT_LT(shot.ratio(4), 1.02) << "as they lie they are others";
    shot.motion = [](int, int, int) { return 3.0; };
    EXPECT_LT(shot.ratio(4), 0.6);
}

// Samples are too few to show it, and their albedo is blurred by the motion: it differs everywhere all the
// same.
TEST(Sequence, APanWithoutMotionVectorsCostsLittle) {
    MadeUpShot shot;
    shot.albedo = [](int frame, int x, int y) { return (x + 11 * frame) / 9 % 2 == y / 9 % 2 ? 0.7 : 0.4; };
    shot.truth = shot.albedo;
    shot.noise = 1.2;
    shot.featureNoise = 0.2;
    EXPECT_LT(shot.ratio(4), 1.05);
    shot.motion = [](int, int, int) { return -11.0; };
    EXPECT_LT(shot.ratio(4), 0.7);
}

// Halves without samples, and a part where nothing scatters, beside frames that are more and more unlike from
// left to right: what hardly weighs must not become all that is known. (Black bands, pixels that were no
// numbers.)
TEST(Sequence, WhatHardlyWeighsSaysNothing) {
    MadeUpShot shot;
    shot.truth = [](int frame, int x, int y) { return frame == 4 ? 1 : 1 + (y < 28 ? 0.02 : 0.05) * x; };
    for (const int few : {2, 1}) {
        shot.samples = [&](int frame, int x, int y) {
            return frame != 4 ? 4 : few == 2 ? 2 : few + ((x + y) % 3 == 0);
        };
        EXPECT_LT(shot.ratio(4), 1.25) << few;
    }
    shot.samples = [](int frame, int x, int y) { return frame != 4 ? 4 : (x + y) % 3 == 0; };
    for (const float value : shot.krige(4).pixels) ASSERT_TRUE(std::isfinite(value));
    MadeUpShot clean = shot;
    clean.noise = 0;
    const Sequence::Open open = [&](int frame) { return frame == 4 ? clean.open(4) : shot.open(frame); };
    shot.noise = 2;
    for (const float value : Sequence(open, {.temporal = 1}).reconstruct(4).image.pixels)
        ASSERT_TRUE(std::isfinite(value));
}

// Dark bars of a pixel before a bright window, half a pixel farther in every frame: between the pixels of
// another frame lies a mixture that this one has nowhere.
TEST(Sequence, ThinBarsBeforeAWindowStayDark) {
    MadeUpShot shot;
    shot.albedo = [](int frame, int x, int) { return (2 * x - frame + 1000) % 14 < 2 ? 0.1 : 1.0; };
    shot.truth = [&](int frame, int x, int y) { return shot.albedo(frame, x, y) == 1 ? 3 : 0.05; };
    shot.motion = [](int, int, int) { return 0.5; };
    shot.noise = 0.1;
    EXPECT_LT(shot.ratio(4), 1.02);
}

TEST(Sequence, ACutOrAFlashCostsNothing) {
    MadeUpShot shot;
    shot.truth = [](int frame, int x, int y) {
        return frame < 4 ? 1 + 0.4 * std::sin(0.2 * x) : 0.5 + 0.3 * std::cos(0.3 * y);
    };
    EXPECT_LT(shot.ratio(3), 1.02);
    EXPECT_LT(shot.ratio(4), 1.02);
    shot.truth = [](int frame, int x, int) { return (frame == 4 ? 2 : 1) * (1 + 0.4 * std::sin(0.2 * x)); };
    EXPECT_LT(shot.ratio(4), 1.02);
}

/// A square that moves over a flat wall of the same albedo, by 5 pixels a frame.
TEST(Sequence, WhatMovesLeavesNoGhost) {
    MadeUpShot shot;
    const auto inSquare = [](int frame, int x, int y) {
        return x >= 10 + 5 * frame && x < 22 + 5 * frame && y >= 20 && y < 32;
    };
    shot.truth = [inSquare](int frame, int x, int y) { return inSquare(frame, x, y) ? 2.0 : 1.0; };
    for (const bool known : {true, false}) {
        if (known) shot.motion = [inSquare](int f, int x, int y) { return inSquare(f, x, y) ? 5.0 : 0.0; };
        if (!known) shot.motion = {};
        // Where it was and will be: on average over seeds, what is there is the wall.
        double with = 0, alone = 0, count = 0;
        constexpr int kSeeds = 8;
        for (shot.seed = 1; shot.seed <= kSeeds; ++shot.seed) {
            const Image image = shot.krige(4), single = reconstruct(*shot.open(4), Drift{}).image;
            for (int y = 22; y < 30; ++y)
                for (int x = 0; x < kColumns; ++x) {
                    bool near = false, passed = false;
                    for (int dx = -2; dx <= 2; ++dx) near = near || inSquare(4, x + dx, y);
                    for (const int frame : {2, 3, 5, 6}) passed = passed || inSquare(frame, x, y);
                    if (near || !passed) continue;
                    with += static_cast<double>(image.at(x, y)[0]) - 1;
                    alone += static_cast<double>(single.at(x, y)[0]) - 1;
                    ++count;
                }
        }
        EXPECT_NEAR(with / count, alone / count, 0.01) << known;
        EXPECT_NEAR(with / count, 0, 0.02) << known;
    }
}

TEST(Sequence, ImpossibleMotionIsNone) {
    MadeUpShot shot;
    const Image unmoved = [&] {
        MadeUpShot alone = shot;
        alone.first = alone.last = 4;
        return alone.krige(4);
    }();
    for (const double step : {std::numeric_limits<double>::quiet_NaN(), 1e9, -1e9}) {
        shot.motion = [step](int, int, int) { return step; };
        EXPECT_EQ(shot.krige(4).pixels, unmoved.pixels) << step;
    }
}

TEST(Sequence, TheSameNoiseIsNoNews) {
    MadeUpShot shot;
    shot.sameNoise = true;
    const Reconstruction of = shot.sequence({.temporal = 2}).reconstruct(4);
    EXPECT_EQ(of.image.pixels, reconstruct(*shot.open(4), Drift{}).image.pixels);
    EXPECT_EQ(of.report.drift().sequence->equalSeeds, 4);
    EXPECT_NE(toText(of.report).find("have the same seed"), std::string::npos);
}

TEST(Sequence, TheErrorMapKnowsIt) {
    MadeUpShot shot;
    double predicted = 0, actual = 0;
    for (shot.seed = 1; shot.seed <= 6; ++shot.seed) {
        const Image image = shot.krige(4);
        actual += shot.error(image, 4);
        for (int y = 0; y < kLines; ++y)
            for (int x = 0; x < kColumns; ++x) {
                const double z = shot.truth(4, x, y), s = static_cast<double>(image.at(x, y)[3]);
                predicted += s * s / (z * z) / (kColumns * kLines);
            }
    }
    EXPECT_GT(predicted / actual, 0.5);
    EXPECT_LT(predicted / actual, 2);
}

TEST(Sequence, FramesOfAnotherSizeAreRefused) {
    const MadeUpShot shot;
    Sequence sequence(
        [&](int frame) {
            MadeUpShot of = shot;
            if (frame == 5) of.columns = 60;
            return of.open(frame);
        },
        {.temporal = 1});
    EXPECT_NO_THROW(sequence.reconstruct(3));
    try {
        sequence.reconstruct(4);
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("frame 5: expected "), std::string::npos) << error.what();
    }
}

TEST(Sequence, MemoryThatIsNotThereIsToldBefore) {
    const MadeUpShot shot;
    Drift options{.temporal = 2};
    options.maxMemory = 1'000'000;
    try {
        shot.sequence(options).reconstruct(4);
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("5 frames of this size"), std::string::npos) << error.what();
    }
}

}  // namespace
}  // namespace vlx
