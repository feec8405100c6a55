// Features of two halves: what is noise and what is not, and how much of either is left.

#include "reconstruct/drift/prefilter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace vlx {
namespace {

constexpr int kAcross = 96, kDown = 64;
constexpr FeaturePlanes kPlanes{3};
constexpr ResidualPlanes kResiduals{1};
constexpr DataPlanes kData{3};
constexpr double kNoise = 0.2;  // standard deviation of a half's mean

/// One group of three features, `texture` times what differs from pixel to pixel, and noise.
struct PrefilterTest : testing::Test {
    PrefilterTest() {
        layout.features = 3;
        layout.group = {0, 0, 0};
        layout.groups = 1;
    }
    void draw(double texture, float count) {
        std::mt19937_64 random(3);
        std::normal_distribution<double> normal;
        for (int y = 0; y < kDown; ++y)
            for (int x = 0; x < kAcross; ++x) {
                data.row(kData.count(), y)[x] = count;
                for (int f = 0; f < 3; ++f) {
                    const double t = 0.5 + texture * normal(random);
                    const double a = t + kNoise * normal(random), b = t + kNoise * normal(random);
                    truth.row(f, y)[x] = static_cast<float>(t);
                    raw.row(kPlanes.value(f), y)[x] = static_cast<float>(count > 1 ? (a + b) / 2 : a);
                    raw.row(kPlanes.difference(f), y)[x] = static_cast<float>(count > 1 ? (a - b) / 2 : 0);
                    raw.row(kPlanes.error(f), y)[x] =
                        static_cast<float>(kNoise * kNoise / (count > 1 ? 2 : 1));
                }
            }
    }
    void prefilter() {
        for (int y = 0; y < kDown; y += kTile)
            for (int x = 0; x < kAcross; x += kTile)
                prefilterFeatures(raw, data, kData, layout, true, x, y, kAcross, kDown, features, residuals);
    }
    void giveBack() {
        for (int y = 0; y < kDown; ++y) returnResiduals(raw, residuals, layout, y, kAcross, kDown, features);
    }
    struct Errors {
        double actual = 0, predicted = 0;
    };
    Errors errors() const {
        Errors mean;
        for (int y = 0; y < kDown; ++y)
            for (int x = 0; x < kAcross; ++x)
                for (int f = 0; f < 3; ++f) {
                    const auto d =
                        static_cast<double>(features.row(kPlanes.value(f), y)[x] - truth.row(f, y)[x]);
                    mean.actual += d * d / (3 * kAcross * kDown);
                    mean.predicted +=
                        static_cast<double>(features.row(kPlanes.error(f), y)[x]) / (3 * kAcross * kDown);
                }
        return mean;
    }

    SampleLayout layout;
    RowRing data{kAcross, kData.channels(), kDown}, raw{kAcross, kPlanes.rawChannels(), kDown},
        truth{kAcross, 3, kDown}, features{kAcross, kPlanes.channels(), kDown},
        residuals{kAcross, kResiduals.channels(), kDown};
};

TEST_F(PrefilterTest, NoiseIsAveragedAndWhatIsLeftIsKnown) {
    draw(0, 4);
    prefilter();
    const Errors before = errors();
    EXPECT_LT(before.actual, 0.05 * kNoise * kNoise / 2);
    // Weights of one half know nothing of the other's noise: its error is what they say.
    EXPECT_NEAR(before.predicted / before.actual, 1, 0.25);
    giveBack();
    EXPECT_NEAR(errors().actual / before.actual, 1, 0.05);  // noise is in one half only
}

TEST_F(PrefilterTest, WhatBothHalvesShowIsGivenBack) {
    draw(kNoise / 2, 4);  // less than a half's noise: patches look alike
    prefilter();
    const Errors before = errors();
    EXPECT_GT(before.actual, 0.9 * kNoise * kNoise / 4);  // the texture is gone
    giveBack();
    // The least that a linear estimate from both halves leaves of texture s^2 under noise v: s^2 v / (s^2 +
    // v).
    const double s2 = kNoise * kNoise / 4, v = kNoise * kNoise / 2, least = s2 * v / (s2 + v);
    EXPECT_LT(errors().actual, 1.3 * least);  // three standard errors are not given back
    EXPECT_GT(errors().predicted, before.predicted);
}

TEST_F(PrefilterTest, OneSampleIsNoEvidenceOfTexture) {
    draw(0, 1);
    prefilter();
    const Errors before = errors();
    EXPECT_LT(before.actual, 0.5 * kNoise * kNoise);
    giveBack();
    EXPECT_EQ(errors().actual, before.actual);
}

}  // namespace
}  // namespace vlx
