// Features of two halves: what is noise and what is not, and how much of either is left.

#include "reconstruct/data/prefilter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace vlx {
namespace {

constexpr int kColumns = 96, kLines = 64;
constexpr FeaturePlanes kFeaturePlanes{3};
constexpr ResidualPlanes kResidualPlanes{1};
constexpr DataPlanes kDataPlanes{3};
constexpr double kHalfNoise = 0.2;  // standard deviation of a half's mean

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
        for (int y = 0; y < kLines; ++y)
            for (int x = 0; x < kColumns; ++x) {
                data.row(kDataPlanes.count(), y)[x] = count;
                for (int f = 0; f < 3; ++f) {
                    const double t = 0.5 + texture * normal(random);
                    const double a = t + kHalfNoise * normal(random), b = t + kHalfNoise * normal(random);
                    truth.row(f, y)[x] = static_cast<float>(t);
                    raw.row(kFeaturePlanes.value(f), y)[x] = static_cast<float>(count > 1 ? (a + b) / 2 : a);
                    raw.row(kFeaturePlanes.difference(f), y)[x] =
                        static_cast<float>(count > 1 ? (a - b) / 2 : 0);
                    raw.row(kFeaturePlanes.error(f), y)[x] =
                        static_cast<float>(kHalfNoise * kHalfNoise / (count > 1 ? 2 : 1));
                }
            }
    }
    void prefilter() {
        for (int y = 0; y < kLines; y += kTile)
            for (int x = 0; x < kColumns; x += kTile)
                prefilterFeatures(raw, data, kDataPlanes, layout, kMostFeatureReach, x, y, kColumns, kLines,
                                  features, residuals);
    }
    void giveBack() {
        for (int y = 0; y < kLines; ++y)
            returnResiduals(raw, residuals, layout, y, kColumns, kLines, features);
    }
    struct FeatureErrors {
        double actual = 0, predicted = 0;
    };
    FeatureErrors errors() const {
        FeatureErrors mean;
        for (int y = 0; y < kLines; ++y)
            for (int x = 0; x < kColumns; ++x)
                for (int f = 0; f < 3; ++f) {
                    const auto d =
                        static_cast<double>(features.row(kFeaturePlanes.value(f), y)[x] - truth.row(f, y)[x]);
                    mean.actual += d * d / (3 * kColumns * kLines);
                    mean.predicted += static_cast<double>(features.row(kFeaturePlanes.error(f), y)[x]) /
                                      (3 * kColumns * kLines);
                }
        return mean;
    }

    SampleLayout layout;
    RowRing data{kColumns, kDataPlanes.channels(), kLines},
        raw{kColumns, kFeaturePlanes.rawChannels(), kLines}, truth{kColumns, 3, kLines},
        features{kColumns, kFeaturePlanes.channels(), kLines},
        residuals{kColumns, kResidualPlanes.channels(), kLines};
};

TEST_F(PrefilterTest, NoiseIsAveragedAndWhatIsLeftIsKnown) {
    draw(0, 4);
    prefilter();
    const FeatureErrors before = errors();
    EXPECT_LT(before.actual, 0.05 * kHalfNoise * kHalfNoise / 2);
    // Weights of one half know nothing of the other's noise: its error is what they say.
    EXPECT_NEAR(before.predicted / before.actual, 1, 0.25);
    giveBack();
    EXPECT_NEAR(errors().actual / before.actual, 1, 0.05);  // noise is in one half only
}

TEST_F(PrefilterTest, AHalfsWeightsAreTheOthers) {
    // B is the same everywhere: all weights of A are 1, however much its values differ beside their errors.
    draw(0, 4);
    for (int y = 0; y < kLines; ++y)
        for (int x = 0; x < kColumns; ++x)
            for (int f = 0; f < 3; ++f) {
                const float a = truth.row(f, y)[x] + raw.row(kFeaturePlanes.difference(f), y)[x];
                raw.row(kFeaturePlanes.value(f), y)[x] = (a + 0.5f) / 2;
                raw.row(kFeaturePlanes.difference(f), y)[x] = (a - 0.5f) / 2;
                raw.row(kFeaturePlanes.error(f), y)[x] = 1e-6f;
            }
    prefilter();
    constexpr int kX = 40, kY = 30, kSide = 2 * kMostFeatureReach + 1;
    double sum = 0;
    for (int y = kY - kMostFeatureReach; y <= kY + kMostFeatureReach; ++y)
        for (int x = kX - kMostFeatureReach; x <= kX + kMostFeatureReach; ++x)
            sum += static_cast<double>(raw.row(kFeaturePlanes.value(0), y)[x] +
                                       raw.row(kFeaturePlanes.difference(0), y)[x]);
    // B's weights, from A, move nothing: it has one value.
    EXPECT_NEAR(features.row(kFeaturePlanes.value(0), kY)[kX], (sum / (kSide * kSide) + 0.5) / 2, 1e-5);
}

TEST_F(PrefilterTest, WhatBothHalvesShowIsGivenBack) {
    draw(kHalfNoise / 2, 4);  // less than a half's noise: patches look alike
    prefilter();
    const FeatureErrors before = errors();
    EXPECT_GT(before.actual, 0.9 * kHalfNoise * kHalfNoise / 4);  // the texture is gone
    giveBack();
    // The least that a linear estimate from both halves leaves of texture s^2 under noise v: s^2 v / (s^2 +
    // v).
    const double s2 = kHalfNoise * kHalfNoise / 4, v = kHalfNoise * kHalfNoise / 2, least = s2 * v / (s2 + v);
    EXPECT_LT(errors().actual, 1.3 * least);  // three standard errors are not given back
    EXPECT_GT(errors().predicted, before.predicted);
}

TEST_F(PrefilterTest, OneSampleIsNoEvidenceOfTexture) {
    draw(0, 1);
    prefilter();
    const FeatureErrors before = errors();
    EXPECT_LT(before.actual, 0.5 * kHalfNoise * kHalfNoise);
    giveBack();
    EXPECT_EQ(errors().actual, before.actual);
}

}  // namespace
}  // namespace vlx
