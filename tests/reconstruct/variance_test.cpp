// The variance of one sample that smoothVariances() takes from a pixel's window, and from one twice as wide.

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/data/prefilter.h"

namespace vlx {
namespace {

constexpr int kSide = 30, kHere = 15;
constexpr DataPlanes kData{3};
constexpr float kSamples = 4;
constexpr double kWindow = 11 * 11, kFreedom = kWindow * (kSamples - 1);

struct VarianceTest : testing::Test {
    VarianceTest() {
        set(squares, 3, kSamples - 1);
        set(squares, 4, kSamples);
        for (int half = 0; half < 2; ++half)
            for (int c = 0; c < 3; ++c) set(data, kData.mean(half) + c, 0.25f);
    }
    static void set(RowRing& ring, int plane, float value) {
        for (int y = 0; y < kSide; ++y) std::fill_n(ring.row(plane, y), kSide, value);
    }
    /// The sum of squares of each colour of a pixel.
    void scatter(int x, int y, float square) {
        for (int c = 0; c < 3; ++c) squares.row(c, y)[x] = square;
        const double all = 3 * static_cast<double>(square) * picture.unit();
        squares.row(5, y)[x] = static_cast<float>(all * all);
    }
    double variance(const RowRing* of, int plane = 0) {
        RowRing out(kSide, VariancePlanes::kChannels, kSide), features(kSide, 0, kSide);
        smoothVariances(squares, data, kData, features, 0, picture, true, of, kHere, kSide, kSide, out);
        return static_cast<double>(out.row(plane, kHere)[kHere]);
    }
    double unseen(double level) const { return unseenVariance(kWindow * kSamples, level); }

    PictureScale picture;
    RowRing data{kSide, kData.channels(), kSide}, squares{kSide, SquaresPlanes::kChannels, kSide},
        wide{kSide / 2, VariancePlanes::kChannels, kSide / 2};
};

TEST_F(VarianceTest, IsThatOfTheWindowAndOfWhatItDidNotSee) {
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) scatter(x, y, 1.5f);
    EXPECT_NEAR(variance(nullptr), 0.5 + unseen(1), 1e-6);
    EXPECT_NEAR(variance(nullptr, 3), kSamples - 1, 1e-5);  // every pixel tells it
}

TEST_F(VarianceTest, WhatOnePixelMetIsRare) {
    scatter(kHere + 2, kHere, 30);
    EXPECT_NEAR(variance(nullptr), 30 / kFreedom + unseen(1), 1e-6);
    EXPECT_NEAR(variance(nullptr, 3), kFreedom, 1e-3);
}

TEST_F(VarianceTest, AgreeingSamplesAboveThePicturesLevelMissedWhatIsAsBright) {
    EXPECT_NEAR(variance(nullptr), unseen(1), 1e-9);
    for (int c = 0; c < 3; ++c) set(data, kData.mean(0) + c, 4);
    EXPECT_NEAR(variance(nullptr), unseen(4), 1e-9);
    set(data, kData.stated(), 1);
    EXPECT_EQ(variance(nullptr), 0);
}

TEST_F(VarianceTest, WhatTheWideWindowMetIsNotDenied) {
    constexpr double kRarity = 100, kVariance = 2;
    for (int c = 0; c < 3; ++c) wide.row(c, kHere / 2)[kHere / 2] = kVariance;
    wide.row(3, kHere / 2)[kHere / 2] = kRarity;
    const double more = kRarity / (1 + 2 * kFreedom / kRarity);
    EXPECT_NEAR(variance(&wide), more * kVariance / (kFreedom + more) + unseen(1), 1e-6);
    // What the dump states, it knows.
    set(data, kData.stated(), 1);
    EXPECT_EQ(variance(&wide), 0);
}

TEST_F(VarianceTest, NoiseThatTheWindowShowsNeedsNoOther) {
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) scatter(x, y, 0.03f);
    for (int c = 0; c < 3; ++c) wide.row(c, kHere / 2)[kHere / 2] = 2;
    wide.row(3, kHere / 2)[kHere / 2] = 100;
    EXPECT_NEAR(variance(&wide), 0.01 + unseen(1), 1e-6);
}

TEST_F(VarianceTest, IsANumberWhereSquaresOfItAreNone) {
    for (int y = 0; y < kSide; ++y)
        for (int x = 0; x < kSide; ++x) scatter(x, y, 1e25f);
    for (int c = 0; c < 3; ++c) wide.row(c, kHere / 2)[kHere / 2] = 1e25f;
    EXPECT_EQ(variance(&wide, 3), 0);
    EXPECT_NEAR(variance(&wide) / (1e25 / (kSamples - 1)), 1, 1e-5);
}

}  // namespace
}  // namespace vlx
