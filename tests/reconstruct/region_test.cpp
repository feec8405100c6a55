#include "reconstruct/common/region.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "make_band.h"

namespace vlx {
namespace {

TEST(GatherRegion, MeansAndCountsOfSubPixelCells) {
    // Two samples in the cell (1, 2) of pixel (5, -3), one in the cell (3, 0) of pixel (6, -3).
    SampleBand band{5, -3, 2, 1, {0, 2, 3}, {"R", "G", "B", "sample.x", "sample.y"}, {}};
    band.values = {{1, 3, 7}, {0, 0, 1}, {2, 4, 5}, {5.3f, 5.45f, 6.9f}, {-2.4f, -2.3f, -2.99f}};
    const RegionData data = gatherRegion(band, madeLayout(), {5, -3, 2, 1}, 4);
    ASSERT_EQ(data.size(), 2);
    EXPECT_EQ(data.samples, 3);
    EXPECT_EQ(data.dropped, 0);
    // Row by row over the region's grid: the upper cell comes first.
    EXPECT_DOUBLE_EQ(data.positions(0, 0), 6.875);
    EXPECT_DOUBLE_EQ(data.positions(0, 1), -2.875);
    EXPECT_DOUBLE_EQ(data.positions(1, 0), 5.375);
    EXPECT_DOUBLE_EQ(data.positions(1, 1), -2.375);
    EXPECT_DOUBLE_EQ(data.means(1, 0), 2);
    EXPECT_DOUBLE_EQ(data.means(1, 2), 3);
    EXPECT_DOUBLE_EQ(data.means(0, 0), 7);
    EXPECT_EQ(data.counts[1], 2);
}

TEST(GatherRegion, ErrorVariancesArePooledWithinTheFinestCellsOfTwoSamples) {
    // 32 samples a pixel, two in each cell, whose pixel values differ by 1000: only the difference within
    // cells, 2, may count: variance 2 for every pair.
    const SampleBand band = makeBand({0, 0, 4, 4}, 32, [](int column, int row, int i) {
        const float z = 1000.0f * static_cast<float>(column + row) + 100.0f * static_cast<float>(i % 16) +
                        (i < 16 ? -1.0f : 1.0f);
        return MadeSample{z, 2 * z, 0, stratumX(column, i), stratumY(row, i)};
    });
    const RegionData data = gatherRegion(band, madeLayout(), {0, 0, 4, 4}, 4);
    EXPECT_TRUE(data.varianceKnown);
    EXPECT_EQ(data.size(), 256);
    EXPECT_NEAR(data.errorVariances(0, 0), 1, 1e-6);  // of the mean of two
    EXPECT_NEAR(data.errorVariances(255, 1), 4, 4e-6);
    EXPECT_EQ(data.errorVariances.col(2).maxCoeff(), 0);
}

TEST(GatherRegion, AdaptiveCountsPoolQuietAndNoisyPixelsApart) {
    // Left half: 4 samples of +-0.1; right half: 64 of +-10. One variance for both would drown the left half.
    SampleBand band{0, 0, 4, 4, {0}, {"R", "G", "B", "sample.x", "sample.y"}, {}};
    band.values.resize(5);
    for (int p = 0; p < 16; ++p) {
        const bool quiet = p % 4 < 2;
        for (int i = 0; i < (quiet ? 4 : 64); ++i) {
            const float z = (i % 2 == 0 ? 1.0f : -1.0f) * (quiet ? 0.1f : 10.0f);
            int c = 0;
            for (const float value :
                 {z, z, z, static_cast<float>(p % 4) + 0.5f, static_cast<float>(p / 4) + 0.5f})
                band.values[static_cast<std::size_t>(c++)].push_back(value);
        }
        band.offsets.push_back(band.values[0].size());
    }
    const RegionData data = gatherRegion(band, madeLayout(), {0, 0, 4, 4}, 1);
    ASSERT_EQ(data.size(), 16);
    EXPECT_NEAR(data.errorVariances(0, 0), 0.01 * 4 / 3 / 4, 1e-8);
    EXPECT_NEAR(data.errorVariances(3, 0), 100.0 * 64 / 63 / 64, 1e-6);
}

TEST(GatherRegion, VarianceIsUnknownWithOneSampleAPixel) {
    const SampleBand band = makeBand({0, 0, 4, 4}, 1, [](int column, int row, int i) {
        return MadeSample{static_cast<float>(column), 0, 0, stratumX(column, i), stratumY(row, i)};
    });
    const RegionData data = gatherRegion(band, madeLayout(), {0, 0, 4, 4}, 4);
    EXPECT_FALSE(data.varianceKnown);
    EXPECT_EQ(data.errorVariances.maxCoeff(), 0);
}

TEST(GatherRegion, DropsNonFiniteSamplesAndCountsThem) {
    constexpr float nan = std::numeric_limits<float>::quiet_NaN(),
                    inf = std::numeric_limits<float>::infinity();
    const SampleBand band = makeBand({0, 0, 1, 1}, 4, [&](int, int, int i) {
        const float z[] = {1, nan, -inf, 3}, x[] = {0.5f, 0.5f, 0.5f, nan};
        return MadeSample{z[i], 0, 0, x[i], 0.5f};
    });
    const RegionData data = gatherRegion(band, madeLayout(), {0, 0, 1, 1}, 4);
    EXPECT_EQ(data.dropped, 2);
    EXPECT_EQ(data.samples, 2);
    ASSERT_EQ(data.size(), 1);
    EXPECT_DOUBLE_EQ(data.means(0, 0), 2);
}

TEST(GatherRegion, PositionsOutsideThePixelGoToItsNearestCell) {
    SampleBand band{0, 0, 2, 1, {0, 1, 2}, {"R", "G", "B", "sample.x", "sample.y"}, {}};
    band.values = {{1, 2}, {0, 0}, {0, 0}, {-0.7f, 0.2f}, {1e20f, -1e20f}};
    const RegionData data = gatherRegion(band, madeLayout(), {0, 0, 2, 1}, 4);
    ASSERT_EQ(data.size(), 2);
    EXPECT_DOUBLE_EQ(data.positions(0, 0), 1.125);
    EXPECT_DOUBLE_EQ(data.positions(0, 1), 0.125);
    EXPECT_DOUBLE_EQ(data.positions(1, 0), 0.125);
    EXPECT_DOUBLE_EQ(data.positions(1, 1), 0.875);
}

TEST(GatherRegion, VarianceOfAnOffsetLosesNoDigits) {
    const SampleBand band = makeBand({0, 0, 1, 1}, 2, [](int, int, int i) {
        return MadeSample{1e6f + static_cast<float>(i), 0, 0, 0.5f, 0.5f};
    });
    EXPECT_DOUBLE_EQ(gatherRegion(band, madeLayout(), {0, 0, 1, 1}, 1).errorVariances(0, 0), 0.25);
}

}  // namespace
}  // namespace vlx
