#include "variolux/compare/reliability.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include "variolux/base/error.h"

namespace vlx {
namespace {

const std::vector<std::string> kColours = {"R", "G", "B"};

struct Case {
    Image reference{{2, -3, 80, 60}, kColours};
    Image image = reference, stddev = reference;
};

/// Normal errors of standard deviations between 0.01 and 1; the error map says `factor` times that.
Case normalErrors(double factor) {
    Case c;
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(-2, 0);
    for (std::size_t i = 0; i < c.image.pixels.size(); ++i) {
        const double s = std::pow(10, uniform(random));
        c.reference.pixels[i] = 0.5f;
        c.image.pixels[i] = static_cast<float>(0.5 + s * normal(random));
        c.stddev.pixels[i] = static_cast<float>(factor * s);
    }
    return c;
}

TEST(Reliability, OfARightErrorMap) {
    const Case c = normalErrors(1);
    const Reliability r = reliabilityOf(c.reference, c.image, c.stddev);
    const double n = static_cast<double>(c.image.pixels.size());
    EXPECT_EQ(r.calibration.values, static_cast<std::int64_t>(n));
    for (std::size_t i = 0; i < r.coverage.size(); ++i) {
        const double level = 0.05 * (static_cast<double>(i) + 1);
        EXPECT_NEAR(r.coverage[i], level, 4 * std::sqrt(level * (1 - level) / n)) << level;
    }
    EXPECT_NEAR(r.meanScore, 0, 4 / std::sqrt(n));
    EXPECT_NEAR(r.meanSquareScore, 1, 4 * std::sqrt(2 / n));
    ASSERT_EQ(r.bins.size(), static_cast<std::size_t>(kReliabilityBins));
    for (std::size_t i = 0; i < r.bins.size(); ++i) {
        EXPECT_EQ(r.bins[i].values, 900);
        EXPECT_NEAR(r.bins[i].actual / r.bins[i].predicted, 1, 4 / std::sqrt(2 * 900.0)) << i;
        EXPECT_GT(r.bins[i].predicted, i > 0 ? r.bins[i - 1].predicted : 0);
    }
    const double sum = std::accumulate(r.scores.begin(), r.scores.end(), r.below + r.above + r.certain);
    EXPECT_NEAR(sum, 1, 1e-9);
    // The class right of 0 holds Phi(1/4) - Phi(0).
    EXPECT_NEAR(r.scores[kScoreBins / 2], 0.0987, 0.01);
}

TEST(Reliability, OfAnErrorMapHalfTooSmall) {
    const Case c = normalErrors(0.5);
    const Reliability r = reliabilityOf(c.reference, c.image, c.stddev);
    EXPECT_NEAR(r.meanSquareScore, 4, 0.2);
    for (const ReliabilityBin& bin : r.bins) EXPECT_NEAR(bin.actual / bin.predicted, 2, 0.2);
    EXPECT_LT(r.coverage[18], 0.75);
}

TEST(Reliability, CertainAndUnusableValues) {
    Case c;
    c.reference = c.image = c.stddev = Image({0, 0, 2, 2}, kColours);
    c.image.pixels = {0, 0, 0, 0, 0, 0, 7, -7, 1, 0, NAN, 0};
    c.stddev.pixels = {0, 0, 0, 0, 0, 0, 1, 1, 1, -1, 1, INFINITY};
    const Reliability r = reliabilityOf(c.reference, c.image, c.stddev);
    EXPECT_EQ(r.calibration.values, 9);
    EXPECT_EQ(r.calibration.excluded, 3);
    EXPECT_DOUBLE_EQ(r.certain, 6.0 / 9);
    EXPECT_DOUBLE_EQ(r.above, 1.0 / 9);
    EXPECT_DOUBLE_EQ(r.below, 1.0 / 9);
    EXPECT_DOUBLE_EQ(r.meanSquareScore, (49 + 49 + 1) / 3.0);
    // The reference's own uncertainty counts: s^2 is 3 or 1 + 3.
    Image uncertain = c.stddev;
    for (float& s : uncertain.pixels) s = std::sqrt(3.0f);
    const Reliability both = reliabilityOf(c.reference, c.image, c.stddev, uncertain);
    EXPECT_EQ(both.certain, 0);
    EXPECT_NEAR(both.meanSquareScore, (49 + 49 + 1) / 4.0 / 9, 1e-6);
}

TEST(PredictedError, IsInTheUnitsOfTheMetrics) {
    Image image({0, 0, 2, 1}, kColours), stddev = image;
    image.pixels = {1, 1, 1, 0, 0, NAN};
    stddev.pixels = {0.1f, 0.1f, 0.1f, 0.2f, 0.2f, 0.2f};
    const PredictedError p = predictedError(image, stddev);
    EXPECT_EQ(p.values, 5);
    EXPECT_EQ(p.excluded, 1);
    EXPECT_NEAR(p.rmse, std::sqrt((3 * 0.01 + 2 * 0.04) / 5), 1e-6);
    EXPECT_NEAR(p.relMse, (3 * 0.01 / 1.01 + 2 * 0.04 / 0.01) / 5, 1e-5);
    EXPECT_THROW(predictedError(image, Image({0, 0, 3, 1}, kColours)), Error);
}

}  // namespace
}  // namespace vlx
