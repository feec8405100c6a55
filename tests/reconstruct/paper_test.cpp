#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "make_band.h"
#include "reconstruct/paper/krige_region.h"
#include "variolux/dump/sample_buffer.h"
#include "variolux/geostat/kriging.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

constexpr Window kRegion{8, 4, 4, 4};

RegionData gather(const SampleBand& band, const Window& region = kRegion) {
    return gatherRegion(band, madeLayout(), region, 4);
}

/// Radiance that falls from left to right, with normal noise of standard deviation `noise`.
SampleBand ramp(int count, double noise, unsigned seed, double slope = 0.5) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal(0, 1);
    return makeBand(kRegion, count, [&](int column, int row, int i) {
        const float x = stratumX(column, i), y = stratumY(row, i);
        const double signal = 2 + slope * (x - 10);
        const auto z = [&](double scale) {
            return static_cast<float>(scale * (signal + noise * normal(random)));
        };
        return MadeSample{z(1), z(0.5), z(0.25), x, y};
    });
}

TEST(KrigeRegion, AllEqualIsThatValueWithoutError) {
    const SampleBand band = makeBand(kRegion, 16, [](int column, int row, int i) {
        return MadeSample{0.3f, 0.2f, 0.1f, stratumX(column, i), stratumY(row, i)};
    });
    const RegionEstimate estimate = krigeRegion(gather(band), {});
    EXPECT_EQ(estimate.diagnostics.outcome, RegionOutcome::AllEqual);
    for (int p = 0; p < 16; ++p) {
        EXPECT_FLOAT_EQ(static_cast<float>(estimate.values(p, 0)), 0.3f);
        EXPECT_EQ(estimate.stddev(p, 0), 0);
    }
}

// 256 exact data of a smooth surface: the covariance matrix is singular in double precision.
TEST(ReconstructPaper, CountsWhatMayBeOffByRounding) {
    const SampleBand band = makeBand(kRegion, 32, [](int column, int row, int i) {
        const float x = stratumX(column, i), y = stratumY(row, i);
        const float z = 2 + std::sin(0.75f * (x - 10)) * std::cos(0.75f * (y - 6));
        return MadeSample{z, z, z, x, y};
    });
    const RegionDiagnostics region = krigeRegion(gather(band), {.colourDistance = false}).diagnostics;
    EXPECT_EQ(region.outcome, RegionOutcome::Kriged);
    EXPECT_EQ(region.inaccurate, 16);
    DumpHeader header;
    header.data = header.display = kRegion;
    for (const std::string& channel : band.channels) header.channels.push_back({channel, ChannelType::Float});
    const Reconstruction result =
        reconstruct(SampleBuffer(header, band, "ramp"), Paper{.colourDistance = false});
    EXPECT_EQ(result.report.paper().inaccuratePixels, 16);
    EXPECT_NE(toText(result.report).find("16 pixels of ill-conditioned systems"), std::string::npos);
    EXPECT_NE(toJson(result.report).find("\"inaccuratePixels\": 16"), std::string::npos);
    const SampleBand noisy = ramp(32, 0.3, 1);
    EXPECT_EQ(krigeRegion(gather(noisy), {}).diagnostics.inaccurate, 0);
}

TEST(KrigeRegion, FewSamplesGiveTheirMean) {
    for (int used = 0; used <= 2; ++used) {
        SampleBand band = ramp(1, 0, 1);
        RegionData data = gather(band);
        // Keep the first `used` data.
        data.positions.conservativeResize(used, 2);
        data.means.conservativeResize(used, 3);
        data.counts.conservativeResize(used);
        data.errorVariances.conservativeResize(used, 3);
        data.samples = used;
        const RegionEstimate estimate = krigeRegion(data, {});
        EXPECT_EQ(estimate.diagnostics.outcome, used == 0 ? RegionOutcome::Empty : RegionOutcome::TooFewData);
        EXPECT_TRUE(estimate.values.allFinite());
        if (used > 0) {
            EXPECT_NEAR(estimate.values(3, 0), data.means.col(0).mean(), 1e-12);
        }
    }
}

TEST(KrigeRegion, NoiseFreeDataAreReproduced) {
    // One sample a cell, no noise: each pixel's estimate is the mean of its cells, exactly.
    const SampleBand band = makeBand(kRegion, 16, [](int column, int row, int i) {
        const float x = stratumX(column, i), y = stratumY(row, i);
        const float z = std::sin(x) * std::cos(2 * y) + 2;
        return MadeSample{z, z * z, 1, x, y};
    });
    RegionData data = gather(band);
    data.errorVariances.setZero();  // what the region has within pixels is signal
    const RegionEstimate estimate = krigeRegion(data, {.colourDistance = false});
    ASSERT_EQ(estimate.diagnostics.outcome, RegionOutcome::Kriged);
    for (int p = 0; p < 16; ++p) {
        double mean = 0;
        for (int i = 0; i < 16; ++i)
            mean += static_cast<double>(band.values[0][static_cast<std::size_t>(p * 16 + i)]) / 16;
        EXPECT_NEAR(estimate.values(p, 0), mean, 1e-6);
        EXPECT_LT(estimate.stddev(p, 0), 1e-3);
    }
}

TEST(KrigeRegion, SolvesTheOrdinaryKrigingSystemWithKnownErrors) {
    // Without colour distance and nugget the same problem can be put to KrigingSystem, which the oracle
    // checks.
    RegionData data;
    RegionEstimate estimate;
    for (unsigned seed = 1; estimate.diagnostics.sill == 0 || estimate.diagnostics.nugget > 0; ++seed) {
        ASSERT_LT(seed, 50u) << "no fit without a nugget";
        data = gather(ramp(32, 0.3, seed));
        estimate = krigeRegion(data, {.colourDistance = false});
    }
    const RegionDiagnostics& d = estimate.diagnostics;
    ASSERT_EQ(d.outcome, RegionOutcome::Kriged);
    KrigingProblem problem;
    problem.model = {.nugget = 0, .structures = {{StructureType::Stable, d.sill, d.range, d.exponent}}};
    problem.positions = data.positions;
    problem.values = data.means;
    problem.errorVariances = d.errorVariance / data.counts.array();
    Eigen::MatrixXd centres(16, 2), offsets(16, 2);
    for (int p = 0; p < 16; ++p) {
        centres.row(p) << kRegion.x + p % 4 + 0.5, kRegion.y + p / 4 + 0.5;
        offsets.row(p) << (p % 4 - 1.5) / 4, (p / 4 - 1.5) / 4;
    }
    const KrigingPrediction expected = KrigingSystem(problem).predict(blockTargets(centres, offsets));
    const double scale = data.means.cwiseAbs().maxCoeff();
    EXPECT_LT((estimate.values - expected.estimate).cwiseAbs().maxCoeff(), 1e-10 * scale);
}

TEST(KrigeRegion, IsMoreAccurateThanTheMeanAndKnowsItsError) {
    // 300 regions of a noisy ramp: the squared error must be well below the pixel means' (0.09 / 16), and the
    // coverage of one and two standard deviations near the normal law's 68 % and 95 %. The 16 errors of a
    // region are correlated: as if there were some 1000 independent ones, a standard error of 1.5 and 0.7 %.
    double squares = 0, one = 0, two = 0;
    const int regions = 300;
    for (int seed = 1; seed <= regions; ++seed) {
        const RegionData data = gather(ramp(16, 0.3, static_cast<unsigned>(seed), 0.2));
        const RegionEstimate estimate = krigeRegion(data, {.colourDistance = false});
        for (int p = 0; p < 16; ++p) {
            const double truth = 2 + 0.2 * (kRegion.x + p % 4 + 0.5 - 10);
            const double error = std::abs(estimate.values(p, 0) - truth);
            squares += error * error / (16.0 * regions);
            one += error < estimate.stddev(p, 0) ? 1.0 / (16 * regions) : 0;
            two += error < 2 * estimate.stddev(p, 0) ? 1.0 / (16 * regions) : 0;
        }
    }
    EXPECT_LT(squares, 0.35 * 0.09 / 16);
    EXPECT_NEAR(one, 0.683, 0.06);
    EXPECT_NEAR(two, 0.954, 0.03);
}

TEST(KrigeRegion, ColourDistanceKeepsABrightSideFromItsDarkNeighbours) {
    // A lamp of 100 beside a wall of 1, the edge inside a pixel, noise in proportion.
    std::mt19937 random(4);
    std::normal_distribution<float> normal(0, 1);
    const SampleBand band = makeBand(kRegion, 16, [&](int column, int row, int i) {
        const float x = stratumX(column, i), y = stratumY(row, i);
        const float z = (x + 0.3f * y > 11.5f ? 100.0f : 1.0f) * (1 + 0.2f * normal(random));
        return MadeSample{z, z, z, x, y};
    });
    const auto error = [&](bool colour) {
        const RegionEstimate estimate = krigeRegion(gather(band), {.colourDistance = colour});
        double sum = 0;
        for (const int p : {0, 4, 8, 12}) sum += std::abs(estimate.values(p, 0) - 1);  // well on the wall
        return sum / 4;
    };
    EXPECT_LT(error(true), 0.5 * error(false));
}

TEST(KrigeRegion, ResultScalesWithRadiance) {
    SampleBand band = ramp(16, 0.3, 3);
    const RegionEstimate plain = krigeRegion(gather(band), {});
    for (const float factor : {0x1p-40f, 0x1p40f}) {
        SampleBand scaled = band;
        for (int c = 0; c < 3; ++c)
            for (float& z : scaled.values[static_cast<std::size_t>(c)]) z *= factor;
        const RegionEstimate estimate = krigeRegion(gather(scaled), {});
        EXPECT_EQ(estimate.diagnostics.outcome, plain.diagnostics.outcome);
        const double f = static_cast<double>(factor);
        EXPECT_LT((estimate.values / f - plain.values).cwiseAbs().maxCoeff(), 1e-9);
        EXPECT_LT((estimate.stddev / f - plain.stddev).cwiseAbs().maxCoeff(), 1e-9);
    }
}

TEST(KrigeRegion, HardRegionsStayFinite) {
    std::mt19937 random(11);
    std::lognormal_distribution<float> heavy(0, 4);
    for (int trial = 0; trial < 300; ++trial) {
        const int width = 1 + static_cast<int>(random() % 4), height = 1 + static_cast<int>(random() % 4);
        const float scale = std::ldexp(1.0f, static_cast<int>(random() % 80) - 40);
        const int offset = trial % 3 == 0 ? 65530 : -7;
        const Window region{offset, offset, width, height};
        const int count = 1 + static_cast<int>(random() % 20);
        const SampleBand band = makeBand(region, count, [&](int column, int row, int i) {
            // Half of the trials have samples at one place, zeros, or one huge value.
            float z = trial % 2 == 0 ? heavy(random) * scale : (i == 0 && random() % 8 == 0 ? 1e18f : 0.0f);
            if (random() % 50 == 0) z = std::numeric_limits<float>::denorm_min();
            const float x = trial % 4 == 1 ? static_cast<float>(column) + 0.5f : stratumX(column, i);
            return MadeSample{z, 0.5f * z, heavy(random), x, stratumY(row, i)};
        });
        for (const bool colour : {true, false}) {
            const RegionEstimate estimate = krigeRegion(gather(band, region), {.colourDistance = colour});
            ASSERT_TRUE(estimate.values.allFinite()) << trial;
            ASSERT_TRUE(estimate.stddev.allFinite()) << trial;
            ASSERT_GE(estimate.stddev.minCoeff(), 0) << trial;
        }
    }
}

TEST(KrigeRegion, TakesTheNuggetForNoiseWhereThereIsOneSampleAPixel) {
    // Noise of standard deviation 0.3 on a constant: the estimates must vary much less than the samples.
    double squares = 0;
    for (unsigned seed = 1; seed <= 50; ++seed) {
        const RegionEstimate estimate = krigeRegion(gather(ramp(1, 0.3, seed, 0)), {});
        squares += (estimate.values.col(0).array() - 2).square().sum() / (16 * 50);
    }
    EXPECT_LT(squares, 0.5 * 0.09);
}

TEST(Paper, NameTheBrokenConstraint) {
    EXPECT_FALSE(Paper{}.validate());
    EXPECT_TRUE(Paper{.regionSize = -1}.validate());
}

}  // namespace
}  // namespace vlx
