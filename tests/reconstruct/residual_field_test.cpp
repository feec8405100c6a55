// Variograms of what the estimate lacks, on simulated fields.

#include "reconstruct/drift/residual_field.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "../geostat/simulated_field.h"

namespace vlx {
namespace {

constexpr int kRegion = ResidualField::kSide, kAcross = 8, kDown = 8;
constexpr int kFieldWidth = kAcross * kRegion, kFieldHeight = kDown * kRegion;
constexpr float kOfHalf = 4;  // of a half

/// Estimates of 0, of data that are a field (the same in R, G, B, independent in each region) with noise of
/// variance 1 in each half.
DriftReport residualsOf(const VariogramModel& field, std::uint64_t seed, double leak = 0) {
    const DataPlanes data{3};
    const CombinedPlanes combined{3};
    RowRing means(kFieldWidth, data.channels(), kFieldHeight), features(kFieldWidth, 0, kFieldHeight),
        variances(kFieldWidth, VariancePlanes::kChannels, kFieldHeight),
        estimates(kFieldWidth, combined.channels(), kFieldHeight);
    testing::FieldSampler sampler(field, testing::pixelCentres(kRegion, kRegion), seed);
    std::normal_distribution<double> normal;
    for (int row = 0; row < kDown; ++row)
        for (int column = 0; column < kAcross; ++column) {
            const Eigen::VectorXd lacking = sampler.draw();
            for (int p = 0; p < kRegion * kRegion; ++p) {
                const int x = column * kRegion + p % kRegion, y = row * kRegion + p / kRegion;
                for (int c = 0; c < 3; ++c) {
                    variances.row(c, y)[x] = kOfHalf;
                    const double noise[2] = {normal(sampler.random()), normal(sampler.random())};
                    for (int half = 0; half < 2; ++half) {
                        means.row(data.halfCount(half), y)[x] = kOfHalf;
                        means.row(data.mean(half) + c, y)[x] = static_cast<float>(lacking[p] + noise[half]);
                        estimates.row(combined.half(half) + c, y)[x] =
                            static_cast<float>(leak * noise[1 - half]);
                    }
                }
            }
        }
    DriftReport report;
    ResidualField residuals(kFieldWidth, kFieldHeight, {0, 0, kFieldWidth, kFieldHeight}, {{5, 40}},
                            {kFieldWidth, kFieldHeight, means, features, variances, estimates}, estimates, 3);
    for (int y = 0; y < kFieldHeight; ++y) residuals.addRow(y, report);
    return report;
}

VariogramModel exponential(double sill, double range) {
    return {.nugget = 0, .structures = {{StructureType::Exponential, sill, range, 1}}};
}

TEST(ResidualField, FindsTheSillAndTheRangeInNoiseThatIsLarger) {
    const DriftReport report = residualsOf(exponential(0.5, 4), 1);
    ASSERT_EQ(report.residuals.size(), 64u);
    testing::Sample near, far, found;
    for (const ResidualRegion& r : report.residuals) {
        EXPECT_EQ(r.data, kRegion * kRegion);
        found.add(r.structure);
        const auto semivariance = [&](double h) {
            return r.nugget + r.sill * (1 - std::exp(-std::pow(h / r.range, r.exponent)));
        };
        near.add(semivariance(2));
        far.add(semivariance(16));
    }
    EXPECT_GT(found.sum, 58);
    // Sums over R, G, B; four standard errors, and what a fit of three parameters bends.
    EXPECT_NEAR(near.mean(), 1.5 * (1 - std::exp(-2 / 4.0)), 4 * near.error() + 0.03);
    EXPECT_NEAR(far.mean(), 1.5 * (1 - std::exp(-16 / 4.0)), 4 * far.error() + 0.06);
    ASSERT_EQ(report.inspections.size(), 1u);
    const RegionInspection& inspection = report.inspections.at(kAcross);
    EXPECT_EQ(inspection.classes.size(), 8u);
    EXPECT_FALSE(inspection.model.structures.empty());
}

// What a half's weights know of the other half's noise is in no pair of pixels: it shows as a negative
// nugget.
TEST(ResidualField, OfNoiseAloneItFindsAsMuchAsChance) {
    for (const double leak : {0.0, 0.1}) {
        testing::Sample found, nugget;
        for (std::uint64_t seed = 1; seed <= 3; ++seed)
            for (const ResidualRegion& r : residualsOf(exponential(1e-12, 4), seed, leak).residuals) {
                found.add(r.structure);
                nugget.add(r.nugget + r.sill);
            }
        EXPECT_LT(found.mean(), 0.05 + 3 * std::sqrt(0.05 * 0.95 / found.n)) << leak;
        // (z_A - l e_B)(z_B - l e_A): -2 l of each colour's variance.
        EXPECT_NEAR(nugget.mean(), -6 * leak, 4 * nugget.error() + 0.02) << leak;
    }
}

}  // namespace
}  // namespace vlx
