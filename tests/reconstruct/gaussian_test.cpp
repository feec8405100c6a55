#include "variolux/reconstruct/gaussian.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "variolux/base/error.h"
#include "variolux/base/parallel.h"

namespace vlx {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
constexpr float kInf = std::numeric_limits<float>::infinity();

Image noise(int width, int height, unsigned seed) {
    Image image(Window{-3, 7, width, height}, {"B", "G", "R"});
    image.display = Window{0, 0, 100, 100};
    std::mt19937 random(seed);
    std::lognormal_distribution<float> value(0.0f, 1.0f);
    for (float& pixel : image.pixels) pixel = value(random);
    return image;
}

/// The definition, pixel by pixel: no separable passes.
double direct(const Image& image, double sigma, int col, int row, int channel) {
    const int radius = static_cast<int>(std::ceil(4 * sigma));
    double sum = 0, norm = 0;
    for (int y = std::max(0, row - radius); y <= std::min(image.data.height - 1, row + radius); ++y)
        for (int x = std::max(0, col - radius); x <= std::min(image.data.width - 1, col + radius); ++x) {
            const double value = image.at(x, y)[channel];
            if (!std::isfinite(value)) continue;
            const double squared = (x - col) * (x - col) + (y - row) * (y - row);
            const double weight = std::exp(-squared / (2 * sigma * sigma));
            sum += weight * value;
            norm += weight;
        }
    return norm > 0 ? sum / norm : 0;
}

TEST(GaussianFilter, IsItsDefinitionAlsoAtBordersAndHoles) {
    for (const double sigma : {0.25, 0.5, 1.0, 3.0}) {
        Image image = noise(13, 9, 1);
        image.at(4, 4)[1] = kNan;
        image.at(0, 0)[0] = kInf;
        image.at(12, 8)[2] = -kInf;
        const GaussianResult result = gaussianFilter(image, sigma);
        EXPECT_EQ(result.excluded, 3);
        EXPECT_EQ(result.empty, 0);
        EXPECT_EQ(result.image.data, image.data);
        EXPECT_EQ(result.image.display, image.display);
        EXPECT_EQ(result.image.channels, image.channels);
        for (int row = 0; row < 9; ++row)
            for (int col = 0; col < 13; ++col)
                for (int c = 0; c < 3; ++c)
                    ASSERT_NEAR(result.image.at(col, row)[c], direct(image, sigma, col, row, c), 1e-6)
                        << sigma << " at " << col << ' ' << row << ' ' << c;
    }
}

TEST(GaussianFilter, KeepsConstantsAndInteriorEnergy) {
    Image flat(Window{0, 0, 31, 17}, {"R"});
    for (float& pixel : flat.pixels) pixel = 0.7f;
    for (const float pixel : gaussianFilter(flat, 2.0).image.pixels) EXPECT_FLOAT_EQ(pixel, 0.7f);

    Image impulse(Window{0, 0, 41, 41}, {"R"});
    impulse.at(20, 20)[0] = 1.0f;
    double total = 0, spread = 0;
    const Image blurred = gaussianFilter(impulse, 2.0).image;
    for (int row = 0; row < 41; ++row)
        for (int col = 0; col < 41; ++col) {
            total += blurred.at(col, row)[0];
            spread += blurred.at(col, row)[0] * (col - 20) * (col - 20);
        }
    EXPECT_NEAR(total, 1.0, 1e-5);
    EXPECT_NEAR(spread, 4.0, 4e-3);  // its variance is sigma^2
}

TEST(GaussianFilter, NothingInReachIsZeroAndCounted) {
    Image image(Window{0, 0, 20, 1}, {"R"});
    for (float& pixel : image.pixels) pixel = kNan;
    image.pixels[0] = 2.0f;
    const GaussianResult result = gaussianFilter(image, 1.0);
    EXPECT_EQ(result.excluded, 19);
    EXPECT_EQ(result.empty, 15);  // all but the columns 0 to 4
    EXPECT_EQ(result.image.pixels[4], 2.0f);
    EXPECT_EQ(result.image.pixels[5], 0.0f);
}

TEST(GaussianFilter, SigmaLargerThanTheImageIsItsMean) {
    const Image image = noise(5, 4, 2);
    double mean = 0;
    for (int i = 0; i < 20; ++i) mean += image.pixels[static_cast<std::size_t>(3 * i)] / 20.0;
    EXPECT_NEAR(gaussianFilter(image, 1e9).image.pixels[0], mean, 1e-6);
}

TEST(GaussianFilter, SigmaMustBePositiveAndFinite) {
    const Image image = noise(5, 4, 2);
    for (const double sigma :
         {0.0, -1.0, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()})
        EXPECT_THROW(gaussianFilter(image, sigma), Error) << sigma;
}

TEST(GaussianFilter, EmptyImageStaysEmpty) { EXPECT_TRUE(gaussianFilter(Image(), 1.0).image.pixels.empty()); }

TEST(GaussianFilter, IsBitIdenticalForAnyNumberOfThreads) {
    const Image image = noise(67, 53, 3);
    std::vector<float> expected;
    for (int threads = 1; threads <= 8; ++threads) {
        const ThreadLimit limit(threads);
        const std::vector<float> pixels = gaussianFilter(image, 1.5).image.pixels;
        if (threads == 1) expected = pixels;
        EXPECT_EQ(pixels, expected) << threads;
    }
}

}  // namespace
}  // namespace vlx
