#include "variolux/compare/metrics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "compare/constants.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"

namespace vlx {
namespace {

constexpr float kInf = std::numeric_limits<float>::infinity();

Image constant(int width, int height, float value) {
    Image image(Window{0, 0, width, height}, {"R", "G", "B"});
    for (float& pixel : image.pixels) pixel = value;
    return image;
}

Image noise(int width, int height, unsigned seed) {
    Image image(Window{0, 0, width, height}, {"R", "G", "B"});
    std::mt19937 random(seed);
    std::lognormal_distribution<float> value(-1.0f, 1.0f);
    for (float& pixel : image.pixels) pixel = value(random);
    return image;
}

TEST(Metrics, ConstantImagesHaveTheAnalyticValues) {
    const Comparison result = compareColour(constant(20, 30, 0.5f), constant(20, 30, 0.75f));
    EXPECT_DOUBLE_EQ(result[Metric::Mse], 0.0625);
    EXPECT_DOUBLE_EQ(result[Metric::Rmse], 0.25);
    EXPECT_DOUBLE_EQ(result[Metric::RelMse], 0.0625 / 0.26);
    EXPECT_NEAR(result[Metric::RelMseTrimmed], 0.0625 / 0.26, 1e-15);
    EXPECT_NEAR(result[Metric::Mape], 0.25 / 0.51, 1e-15);
    const double shown = std::pow(0.75, 1 / 2.2) - std::pow(0.5, 1 / 2.2);
    EXPECT_NEAR(result[Metric::RmseToneMapped], shown, 1e-15);
    EXPECT_NEAR(result[Metric::Psnr], -20 * std::log10(shown), 1e-12);
    EXPECT_DOUBLE_EQ(result[Metric::Bias], 0.5);
    // Without structure, SSIM is its luminance term.
    const double x = toneMapped(0.75), r = toneMapped(0.5);
    EXPECT_NEAR(result[Metric::Ssim], (2 * x * r + 1e-4) / (x * x + r * r + 1e-4), 1e-12);
    EXPECT_EQ(result[Metric::Gross], 0);
    EXPECT_EQ(result.ssimWindows, 10 * 20);
    EXPECT_EQ(result.pixels, 600);
    EXPECT_EQ(result.excluded, 0);
}

TEST(Metrics, GrossPixelsAreWrongByAFactorOfTwo) {
    Image reference = constant(4, 1, 0.1f), image = constant(4, 1, 0.1f);
    const float values[4][2] = {{0.1f, 0.049f}, {0.1f, 0.051f}, {0.1f, 0.231f}, {0.029f, 0}};
    for (int x = 0; x < 4; ++x)
        for (int c = 0; c < 3; ++c) {
            reference.at(x, 0)[c] = values[x][0];
            image.at(x, 0)[c] = values[x][1];
        }
    EXPECT_DOUBLE_EQ(compareColour(reference, image)[Metric::Gross], 0.5);
    image.at(2, 0)[0] = -0.1f;  // by the mean of the channels
    EXPECT_DOUBLE_EQ(compareColour(reference, image)[Metric::Gross], 0.25);
}

TEST(Metrics, EqualImagesArePerfect) {
    const Image image = noise(16, 16, 1);
    const Comparison result = compareColour(image, image);
    for (const Metric metric : {Metric::Mse, Metric::Rmse, Metric::RelMse, Metric::RelMseTrimmed,
                                Metric::Mape, Metric::RmseToneMapped, Metric::Bias})
        EXPECT_EQ(result[metric], 0.0);
    EXPECT_EQ(result[Metric::Psnr], std::numeric_limits<double>::infinity());
    EXPECT_NEAR(result[Metric::Ssim], 1.0, 1e-12);
}

// Values computed once by a separate plain Python program: windows of 121 products, two-pass variances.
TEST(Metrics, AgreeWithAnIndependentComputation) {
    Image image(Window{0, 0, 17, 14}, {"R", "G", "B"});
    Image reference = image;
    for (int j = 0; j < 14; ++j)
        for (int i = 0; i < 17; ++i)
            for (int c = 0; c < 3; ++c) {
                image.at(i, j)[c] =
                    static_cast<float>(0.5 + 0.4 * std::sin(0.7 * i + 0.3 * c) * std::cos(0.5 * j));
                reference.at(i, j)[c] =
                    static_cast<float>(0.45 + 0.35 * std::sin(0.7 * i + 0.2) * std::cos(0.45 * j + 0.1 * c));
            }
    const Comparison result = compareColour(reference, image);
    EXPECT_NEAR(result[Metric::Ssim], 0.928711561427802, 1e-9);
    EXPECT_NEAR(result[Metric::Psnr], 23.7115982614578, 1e-9);
    EXPECT_NEAR(result[Metric::Mape], 0.187719593304014, 1e-12);
    EXPECT_NEAR(result[Metric::RelMse], 0.0528611470234327, 1e-12);
    EXPECT_NEAR(result[Metric::Mse], 0.00907994453620228, 1e-12);
    EXPECT_NEAR(result[Metric::Bias], 0.112872379823849, 1e-12);
    EXPECT_EQ(result.ssimWindows, 28);
}

TEST(Metrics, TrimmingDropsTheWorstThousandthRoundedUp) {
    // 2,001 pixels: 3 go. Two fireflies and the worst of the rest.
    const Image reference = constant(2001, 1, 0.0f);
    Image image = constant(2001, 1, 0.1f);
    image.at(7, 0)[0] = 1e6f;
    image.at(1999, 0)[2] = 1e4f;
    image.at(3, 0)[1] = 0.4f;
    EXPECT_NEAR(compareColour(reference, image)[Metric::RelMseTrimmed], 1.0, 1e-6);
    image.at(5, 0)[1] = 0.2f;  // the fourth worst stays: (1 + 4 + 1) / 3 instead of 1
    EXPECT_NEAR(compareColour(reference, image)[Metric::RelMseTrimmed], (1997 + 2.0) / 1998, 1e-6);
    EXPECT_GT(compareColour(reference, image)[Metric::RelMse], 1e9);
}

TEST(Metrics, TrimmedIsTheMeanOfTheSortedRest) {
    const Image reference = noise(60, 50, 2), image = noise(60, 50, 3);
    std::vector<double> errors;
    for (int row = 0; row < 50; ++row)
        for (int col = 0; col < 60; ++col) {
            double sum = 0;
            for (int c = 0; c < 3; ++c) {
                const double r = reference.at(col, row)[c], d = image.at(col, row)[c] - r;
                sum += d * d / (r * r + 0.01);
            }
            errors.push_back(sum / 3);
        }
    std::sort(errors.begin(), errors.end());
    double sum = 0;
    for (std::size_t i = 0; i < 2997; ++i) sum += errors[i];
    EXPECT_NEAR(compareColour(reference, image)[Metric::RelMseTrimmed], sum / 2997, 1e-12 * sum);
}

TEST(Metrics, NonFinitePixelsAreExcludedAndCountedInBothImages) {
    const Image cleanReference = noise(25, 24, 4), clean = noise(25, 24, 5);
    Image reference = cleanReference, image = clean;
    image.at(0, 0)[0] = kNan;
    image.at(1, 0)[1] = kInf;
    image.at(1, 0)[2] = -kInf;
    reference.at(1, 0)[2] = kNan;
    reference.at(24, 0)[2] = kInf;
    image.at(5, 23)[0] = -0.25f;
    image.at(5, 23)[1] = -0.5f;
    reference.at(6, 23)[0] = -0.125f;
    const Comparison result = compareColour(reference, image);
    EXPECT_EQ(result[Metric::NonFinite], 2);
    EXPECT_EQ(result[Metric::Negative], 1);
    EXPECT_EQ(result.referenceNonFinite, 2);
    EXPECT_EQ(result.referenceNegative, 1);
    EXPECT_EQ(result.excluded, 3);
    for (const MetricInfo& info : metricInfos()) EXPECT_TRUE(std::isfinite(result[info.metric])) << info.name;
    // Of 15 x 14 windows, those that start in row 0 at columns 0, 1 or 14 hold an excluded pixel.
    EXPECT_EQ(result.ssimWindows, 15 * 14 - 3);

    // The same numbers as without those pixels: sums over the rest by hand.
    double squared = 0;
    for (int row = 0; row < 24; ++row)
        for (int col = 0; col < 25; ++col) {
            if (row == 0 && (col < 2 || col == 24)) continue;
            for (int c = 0; c < 3; ++c) {
                const double d = static_cast<double>(image.at(col, row)[c]) - reference.at(col, row)[c];
                squared += d * d;
            }
        }
    EXPECT_NEAR(result[Metric::Mse], squared / (3 * 597), 1e-12);
}

TEST(Metrics, SsimLeavesOutExactlyTheWindowsThatHoldAnExcludedPixel) {
    const Image reference = noise(33, 31, 6);
    Image image = noise(33, 31, 7);
    image.at(20, 15)[1] = kNan;
    // 23 x 21 windows start at columns 0 to 22 and rows 0 to 20; (20, 15) lies in those that start at
    // columns 10 to 20 and rows 5 to 15.
    EXPECT_EQ(compareColour(reference, image).ssimWindows, 23 * 21 - 11 * 11);
}

TEST(Metrics, NothingToCompareIsNanNotZero) {
    const Image reference = constant(4, 4, 1.0f);
    const Comparison result = compareColour(reference, constant(4, 4, kNan));
    EXPECT_EQ(result.excluded, 16);
    EXPECT_EQ(result[Metric::NonFinite], 16);
    for (const Metric metric :
         {Metric::Mse, Metric::RelMse, Metric::RelMseTrimmed, Metric::Psnr, Metric::Ssim, Metric::Bias})
        EXPECT_TRUE(std::isnan(result[metric]));
    // Too small for an SSIM window; all else is there.
    const Comparison small = compareColour(reference, reference);
    EXPECT_TRUE(std::isnan(small[Metric::Ssim]));
    EXPECT_EQ(small[Metric::Mse], 0);
}

TEST(Metrics, DataWindowsMustMatch) {
    const Image reference = constant(4, 4, 1.0f);
    Image moved = reference;
    moved.data.x = -2;
    for (const Image& image : {constant(4, 5, 1.0f), moved}) {
        try {
            compareColour(reference, image, "b.exr");
            FAIL();
        } catch (const Error& error) {
            const std::string message = error.what();
            EXPECT_NE(message.find("b.exr"), std::string::npos) << message;
            EXPECT_NE(message.find("4 x 4 pixels at (0, 0)"), std::string::npos) << message;
        }
        EXPECT_THROW(checkCalibration(reference, image, reference), Error);
        EXPECT_THROW(checkCalibration(reference, reference, image), Error);
        EXPECT_THROW(checkCalibration(reference, reference, reference, image), Error);
    }
}

TEST(Metrics, AreBitIdenticalForAnyNumberOfThreads) {
    const Image reference = noise(97, 83, 8), image = noise(97, 83, 9);
    Comparison expected;
    for (int threads = 1; threads <= 8; ++threads) {
        const ThreadLimit limit(threads);
        const Comparison result = compareColour(reference, image);
        if (threads == 1) expected = result;
        EXPECT_EQ(result.values, expected.values) << threads;
    }
}

TEST(Metrics, AreFoundByName) {
    EXPECT_EQ(findMetric("relmse"), Metric::RelMse);
    EXPECT_EQ(findMetric("nosuch"), std::nullopt);
    std::size_t index = 0;
    for (const MetricInfo& info : metricInfos()) {
        EXPECT_EQ(static_cast<std::size_t>(info.metric), index++);
        EXPECT_EQ(findMetric(info.name), info.metric);
    }
}

TEST(ToneMapped, IsGammaInsideZeroToOne) {
    EXPECT_EQ(toneMapped(-1), 0);
    EXPECT_EQ(toneMapped(0), 0);
    EXPECT_EQ(toneMapped(1), 1);
    EXPECT_EQ(toneMapped(7), 1);
    EXPECT_EQ(toneMapped(std::numeric_limits<double>::quiet_NaN()), 0);
    EXPECT_NEAR(toneMapped(std::pow(0.5, 2.2)), 0.5, 1e-15);
}

TEST(Calibration, NormalErrorsOfTheStatedSizeAreCovered) {
    const int side = 200;
    Image reference = noise(side, side, 10), image = reference, stddev = reference;
    std::mt19937 random(11);
    std::normal_distribution<float> error;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        stddev.pixels[i] = 0.1f * (1.0f + reference.pixels[i]);
        image.pixels[i] += stddev.pixels[i] * error(random);
    }
    const Calibration result = checkCalibration(reference, image, stddev);
    EXPECT_EQ(result.values, 3 * side * side);
    EXPECT_EQ(result.excluded, 0);
    // Binomial, 120,000 values: five standard deviations are 0.0067 and 0.0030.
    EXPECT_NEAR(result.withinOne, 0.68269, 0.0067);
    EXPECT_NEAR(result.withinTwo, 0.95450, 0.0030);
    EXPECT_NEAR(result.predictedRmse / result.actualRmse, 1.0, 0.03);

    // A reference with as large an error of its own: both variances count.
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        reference.pixels[i] += stddev.pixels[i] * error(random);
    EXPECT_NEAR(checkCalibration(reference, image, stddev).withinOne, 0.52050, 0.0072);
    EXPECT_NEAR(checkCalibration(reference, image, stddev, stddev).withinOne, 0.68269, 0.0067);
}

TEST(Calibration, CountsWhatItCannotUse) {
    const Image reference = constant(2, 2, 1.0f);
    Image image = reference, stddev = constant(2, 2, 0.0f);
    image.pixels[0] = kNan;
    stddev.pixels[1] = kInf;
    stddev.pixels[2] = -1.0f;
    const Calibration result = checkCalibration(reference, image, stddev);
    EXPECT_EQ(result.excluded, 3);
    EXPECT_EQ(result.values, 9);
    EXPECT_EQ(result.withinOne, 1.0);  // exact and said to be exact
    EXPECT_TRUE(std::isnan(checkCalibration(reference, image, constant(2, 2, kNan)).withinOne));
}

}  // namespace
}  // namespace vlx
