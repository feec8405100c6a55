#include "variolux/compare/statistics.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <random>
#include <vector>

#include "compare/constants.h"

namespace vlx {
namespace {

TEST(StudentQuantile95, PublishedTable) {
    // Abramowitz and Stegun, table 26.10, P = 0.975.
    for (const auto& [degrees, quantile] :
         {std::pair{1, 12.706}, {2, 4.303}, {3, 3.182}, {4, 2.776}, {9, 2.262}, {30, 2.042}, {120, 1.980}})
        EXPECT_NEAR(studentQuantile95(degrees), quantile, 5.1e-4) << degrees;
}

TEST(MeanInterval, KnownValues) {
    const Interval i = meanInterval(std::array{1.0, 2.0, 3.0});
    EXPECT_DOUBLE_EQ(i.value, 2);
    EXPECT_NEAR(i.upper - i.value, studentQuantile95(2) / std::sqrt(3.0), 1e-12);
    EXPECT_NEAR(i.value - i.lower, i.upper - i.value, 1e-12);
    EXPECT_EQ(i.count, 3);
    const Interval one = meanInterval(std::array{5.0});
    EXPECT_EQ(one.value, 5);
    EXPECT_TRUE(std::isnan(one.lower) && std::isnan(one.upper));
    EXPECT_TRUE(std::isnan(meanInterval({}).value));
    EXPECT_TRUE(std::isnan(meanInterval(std::array{1.0, kNan}).value));
}

TEST(MeanInterval, HoldsTheMeanInNinetyFivePercent) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal(3, 2);
    int inside = 0;
    constexpr int kTrials = 20000;
    for (int t = 0; t < kTrials; ++t) {
        const Interval i = meanInterval(std::array{normal(random), normal(random), normal(random)});
        inside += i.lower <= 3 && 3 <= i.upper;
    }
    // Binomial standard deviation: 0.0015.
    EXPECT_NEAR(static_cast<double>(inside) / kTrials, 0.95, 0.006);
}

TEST(GeometricInterval, IsSymmetricAsARatio) {
    const Interval i = geometricInterval(std::array{1.0, 100.0});
    EXPECT_NEAR(i.value, 10, 1e-9);
    EXPECT_NEAR(i.upper / i.value, i.value / i.lower, 1e-6 * i.upper);
    // Where there is no logarithm it is the plain mean.
    EXPECT_DOUBLE_EQ(geometricInterval(std::array{0.0, 4.0}).value, 2);
}

TEST(RatioInterval, KnownValues) {
    // Sums of 10 and 30 about 20 each: the logarithm's standard error is sqrt(2 / 1 * (100 + 100)) / 40 =
    // 0.5.
    const Interval i = ratioInterval(std::array{10.0, 30.0}, std::array{10.0, 10.0});
    EXPECT_DOUBLE_EQ(i.value, 2);
    EXPECT_EQ(i.count, 2);
    EXPECT_NEAR(std::log(i.upper / i.value), 0.5 * studentQuantile95(1), 1e-12);
    EXPECT_NEAR(i.upper / i.value, i.value / i.lower, 1e-9 * i.upper);
    // Blocks of one mean, of whatever size, leave no doubt; empty ones say nothing.
    const Interval sure = ratioInterval(std::array{3.0, 0.0, 6.0}, std::array{1.0, 0.0, 2.0});
    EXPECT_DOUBLE_EQ(sure.value, 3);
    EXPECT_DOUBLE_EQ(sure.lower, 3);
    EXPECT_DOUBLE_EQ(sure.upper, 3);
    EXPECT_EQ(sure.count, 2);
    EXPECT_TRUE(std::isnan(ratioInterval(std::array{3.0, 0.0}, std::array{1.0, 0.0}).lower));
    EXPECT_EQ(ratioInterval(std::array{0.0, 0.0}, std::array{1.0, 1.0}).value, 0);
    EXPECT_TRUE(std::isnan(ratioInterval(std::array{0.0}, std::array{0.0}).value));
}

TEST(RatioInterval, HoldsTheMeanInNinetyFivePercent) {
    // Blocks of different sizes whose means vary by a factor, as noise does over a picture.
    std::mt19937 random(11);
    std::lognormal_distribution<double> mean(0, 0.5);
    constexpr int kTrials = 5000, kBlocks = 64;
    const double truth = std::exp(0.125);
    int inside = 0;
    for (int t = 0; t < kTrials; ++t) {
        std::vector<double> sums, counts;
        for (int b = 0; b < kBlocks; ++b) {
            counts.push_back(b % 8 == 7 ? 100 : 256);
            sums.push_back(counts.back() * mean(random));
        }
        const Interval i = ratioInterval(sums, counts);
        inside += i.lower <= truth && truth <= i.upper;
    }
    // Binomial standard deviation: 0.003; the distribution is skewed.
    EXPECT_NEAR(static_cast<double>(inside) / kTrials, 0.95, 0.015);
}

TEST(FitLine, ExactLineAndTooFewPoints) {
    const std::array x{0.0, 1.0, 2.0, 4.0}, y{1.0, 0.5, 0.0, -1.0};
    const auto line = fitLine(x, y);
    ASSERT_TRUE(line);
    EXPECT_NEAR(line->slope.value, -0.5, 1e-12);
    EXPECT_NEAR(line->intercept, 1, 1e-12);
    EXPECT_NEAR(line->slope.upper - line->slope.lower, 0, 1e-6);
    EXPECT_FALSE(fitLine(std::array{1.0}, std::array{1.0}));
    EXPECT_FALSE(fitLine(std::array{1.0, 1.0, 1.0}, std::array{1.0, 2.0, 3.0}));
    const auto two = fitLine(std::array{0.0, 1.0}, std::array{0.0, 3.0});
    ASSERT_TRUE(two);
    EXPECT_NEAR(two->slope.value, 3, 1e-12);
    EXPECT_TRUE(std::isnan(two->slope.lower));
}

TEST(FitLine, IntervalHoldsTheSlopeInNinetyFivePercent) {
    std::mt19937 random(11);
    std::normal_distribution<double> noise(0, 0.3);
    int inside = 0;
    constexpr int kTrials = 10000;
    for (int t = 0; t < kTrials; ++t) {
        std::vector<double> x, y;
        for (int i = 0; i < 6; ++i) {
            x.push_back(i / 2);
            y.push_back(2 - 0.5 * x.back() + noise(random));
        }
        const Interval slope = fitLine(x, y)->slope;
        inside += slope.lower <= -0.5 && -0.5 <= slope.upper;
    }
    EXPECT_NEAR(static_cast<double>(inside) / kTrials, 0.95, 0.009);
}

TEST(Curve, ReadBetweenPointsAndBeyond) {
    // error = 1 / cost: log error = -log cost, each point with variance 0.01.
    std::vector<CurvePoint> curve;
    for (const double cost : {16.0, 1.0, 4.0}) curve.push_back({std::log(cost), -std::log(cost), 0.01});
    const auto inside = costAtError(curve, -std::log(8.0));
    ASSERT_TRUE(inside);
    EXPECT_NEAR(std::exp(inside->log), 8, 1e-9);
    EXPECT_FALSE(inside->extrapolated);
    EXPECT_NEAR(inside->variance, 0.005, 1e-9);  // half-way between two points, slope -1
    EXPECT_NEAR(costAtError(curve, -std::log(8.0), 0.02)->variance, 0.025, 1e-9);
    const auto beyond = costAtError(curve, -std::log(100.0));
    ASSERT_TRUE(beyond);
    EXPECT_NEAR(std::exp(beyond->log), 100, 1e-6);
    EXPECT_TRUE(beyond->extrapolated);

    EXPECT_NEAR(errorAtCost(curve, std::log(2.0))->log, -std::log(2.0), 1e-9);
    EXPECT_NEAR(errorAtCost(curve, std::log(16.0))->log, -std::log(16.0), 1e-9);
    EXPECT_FALSE(errorAtCost(curve, std::log(17.0)));
    EXPECT_FALSE(errorAtCost(curve, std::log(0.9)));
    EXPECT_FALSE(errorAtCost({}, 0));
}

TEST(Curve, WhatDoesNotFallIsNotExtrapolated) {
    const std::vector<CurvePoint> rising = {{0, 0, 0}, {1, 1, 0}};
    EXPECT_TRUE(costAtError(rising, 0.5));
    EXPECT_FALSE(costAtError(rising, -1));
    EXPECT_FALSE(costAtError(std::vector<CurvePoint>{{0, 0, 0}}, -1));
}

TEST(ParetoFront, KeepsWhatNothingBeats) {
    const std::array cost{1.0, 2.0, 3.0, 3.0, 4.0, kNan, 0.5};
    const std::array error{5.0, 6.0, 2.0, 3.0, 2.0, 0.0, kNan};
    EXPECT_EQ(paretoFront(cost, error), (std::vector<std::size_t>{0, 2}));
    EXPECT_TRUE(paretoFront({}, {}).empty());
}

}  // namespace
}  // namespace vlx
