#include "variolux/reconstruct/pixel_filter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>

#include "reconstruct/common/rebin.h"

namespace vlx {
namespace {

TEST(PixelFilter, WeightsAreTheFiltersIntegrals) {
    for (const PixelFilter filter : {PixelFilter::Box, PixelFilter::Gaussian, PixelFilter::BlackmanHarris}) {
        const std::vector<double> w = filterWeights(filter);
        ASSERT_EQ(w.size(), 5u);
        EXPECT_NEAR(std::accumulate(w.begin(), w.end(), 0.0), 1, 1e-12);
        EXPECT_NEAR(w[0], w[4], 1e-12);
        EXPECT_NEAR(w[1], w[3], 1e-12);
    }
    EXPECT_EQ(filterWeights(PixelFilter::Box)[2], 1);
    // Integrals over [-1/2, 1/2] and [-3/2, 3/2]: of exp(-2 t^2) sqrt(pi / 2) erf(t sqrt 2) ...
    const double floor = std::exp(-4.5);
    const double inner = std::sqrt(M_PI / 2) * std::erf(std::sqrt(0.5)) - floor;
    const double whole = std::sqrt(M_PI / 2) * std::erf(1.5 * std::sqrt(2.0)) - 3 * floor;
    EXPECT_NEAR(filterWeights(PixelFilter::Gaussian)[2], inner / whole, 1e-6);
    // ... and of the cosines, whose integral over a period is 0: the constant's share, plus sines.
    const double sines = (0.48829 * std::sin(M_PI / 3) + 0.14128 / 2 * std::sin(2 * M_PI / 3)) * 3 / M_PI;
    EXPECT_NEAR(filterWeights(PixelFilter::BlackmanHarris)[2], (0.35875 + sines) / (3 * 0.35875), 1e-5);
}

TEST(PixelFilter, KeepsConstantsToTheBorderAndSpreadsAPoint) {
    Image image({-1, 2, 7, 6}, {"R", "stddev.R"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 2 == 0 ? 3.f : 0.f;
    const Image even = applyPixelFilter(image, PixelFilter::Gaussian);
    for (std::size_t i = 0; i < even.pixels.size(); i += 2) EXPECT_NEAR(even.pixels[i], 3, 1e-6);
    image.at(3, 3)[1] = 1;
    const Image point = applyPixelFilter(image, PixelFilter::BlackmanHarris);
    const std::vector<double> w = filterWeights(PixelFilter::BlackmanHarris);
    EXPECT_NEAR(point.at(3, 3)[1], w[2] * w[2], 1e-6);
    EXPECT_NEAR(point.at(4, 2)[1], w[1] * w[1], 1e-6);
    EXPECT_EQ(applyPixelFilter(image, PixelFilter::Box).pixels, image.pixels);
}

TEST(Rebin, SamplesGoWhereTheyLie) {
    // Two pixels at (-1, 4): channels z, x, y.
    SampleBand band{-1, 4, 2, 1, {0, 3, 5}, {"z", "x", "y"}, {}};
    const float nan = std::numeric_limits<float>::quiet_NaN();
    band.values = {{1, 2, 3, 4, 5}, {-0.9f, -0.1f, -0.4f, 0.2f, 7}, {4.1f, 4.9f, nan, 4.6f, 4.2f}};
    const SampleBand fine = rebin(band, 2, 1, 2);
    EXPECT_EQ(fine.x, -2);
    EXPECT_EQ(fine.y, 8);
    EXPECT_EQ(fine.width, 4);
    EXPECT_EQ(fine.height, 2);
    EXPECT_EQ(fine.offsets, (std::vector<std::uint64_t>{0, 1, 1, 1, 2, 2, 4, 5, 5}));
    EXPECT_EQ(fine.values[0], (std::vector<float>{1, 5, 2, 3, 4}));
}

}  // namespace
}  // namespace vlx
