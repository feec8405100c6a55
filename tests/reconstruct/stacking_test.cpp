#include "reconstruct/drift/stacking.h"

#include <gtest/gtest.h>

#include <random>

#include "reconstruct/drift/patch_similarity.h"

namespace vlx {
namespace {

/// Moments of n pixels whose truth lies `where` of the way from the base to each of two candidates.
StackingMoments momentsOf(double first, double second, int n, double noise) {
    std::mt19937 random(5);
    std::normal_distribution<double> normal;
    StackingMoments moments{Eigen::MatrixXd::Zero(2, 2), Eigen::VectorXd::Zero(2), Eigen::VectorXd::Zero(2)};
    for (int i = 0; i < n; ++i) {
        const Eigen::Vector2d e(normal(random) * 3, normal(random) * 3);
        const double y = first * e[0] + second * e[1] + noise * normal(random);
        moments.products += e * e.transpose();
        moments.agreement += e * y;
        moments.standardError.array() += (e * y).array().square();
    }
    moments.standardError = moments.standardError.array().sqrt();
    return moments;
}

TEST(StackingWeights, FindTheMixtureThatPredicts) {
    const Eigen::VectorXd w = stackingWeights(momentsOf(0.3, 0.5, 20000, 1), Eigen::Vector2d::Zero());
    EXPECT_NEAR(w[0], 0.3, 0.02);  // standard error 1 / (3 sqrt(20000)) = 0.0024
    EXPECT_NEAR(w[1], 0.5, 0.02);
}

TEST(StackingWeights, AreConvex) {
    for (const auto& [a, b] : {std::pair{2.0, 2.0}, {-1.0, 0.5}, {-1.0, -1.0}, {3.0, -2.0}}) {
        const Eigen::VectorXd w = stackingWeights(momentsOf(a, b, 500, 0.1), Eigen::Vector2d::Zero());
        EXPECT_GE(w.minCoeff(), 0);
        EXPECT_LE(w.sum(), 1 + 1e-12);
    }
    EXPECT_EQ(stackingWeights(momentsOf(-1, -1, 500, 0.1), Eigen::Vector2d::Zero()).sum(), 0);
}

TEST(StackingWeights, WhatIsNotSignificantIsLeftOut) {
    const StackingMoments noise = momentsOf(0, 0, 50, 5);
    EXPECT_EQ(stackingWeights(noise, Eigen::Vector2d(4, 4)).sum(), 0);
    EXPECT_GT(stackingWeights(momentsOf(0, 1, 2000, 0.5), Eigen::Vector2d(4, 4))[1], 0.8);
}

TEST(Shrinkage, IsPositivePartJamesStein) {
    EXPECT_EQ(shrinkage(0, 0), 0);
    EXPECT_EQ(shrinkage(1, 2), 0);
    EXPECT_EQ(shrinkage(4, 0), 1);
    EXPECT_DOUBLE_EQ(shrinkage(4, 1), 0.75);
}

/// A tile of noise of variance `v` about `level(column)`.
PatchTile noisyTile(float v, float step) {
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    PatchTile tile;
    tile.resize(3);
    tile.variance.assign(tile.value.size(), v);
    for (std::size_t i = 0; i < tile.value.size(); ++i)
        tile.value[i] = 1 + std::sqrt(v) * normal(random) +
                        (static_cast<int>(i) % kTileSide >= kTileMargin + kTile / 2 ? step : 0);
    tile.setScale(0);
    return tile;
}

TEST(PatchDistances, NoiseAloneIsNoDistance) {
    const PatchTile tile = noisyTile(0.04f, 0);
    std::vector<float> scratch, out(kTile * kTile);
    double sum = 0;
    int count = 0;
    for (const int d : {-15, -8, 7, 15}) {
        patchDistances(tile, d, -d, scratch, out.data());
        for (const float of : out) sum += static_cast<double>(of);
        count += kTile * kTile;
    }
    // 3 channels of about (kTile + 6)^2 independent differences an offset, each of variance 2.
    const double standardError = std::sqrt(2.0 / (4 * 3 * 38 * 38)) * 2;
    EXPECT_NEAR(sum / count, 0, 3 * standardError);
}

TEST(PatchDistances, AreSquaredDifferencesInUnitsOfTheirNoise) {
    const PatchTile tile = noisyTile(1e-6f, 0.01f);
    std::vector<float> scratch, out(kTile * kTile);
    patchDistances(tile, 15, 0, scratch, out.data());
    // Left of the step by more than a patch, but not 15 pixels: 0.01^2 / (2e-6) = 50, but for the relative
    // floor of 1e-6 (1 + 1).
    EXPECT_NEAR(out[5 * kTile + 8], 25, 4);
    EXPECT_NEAR(out[5 * kTile + 28], 0, 1);
    patchDistances(tile, 0, 15, scratch, out.data());
    EXPECT_NEAR(out[5 * kTile + 8], 0, 1);
}

TEST(PatchDistances, FromOnePixelAndOfALatticeAreThoseOfAll) {
    PatchTile tile = noisyTile(0.04f, 0.5f);
    for (std::size_t i = 0; i < tile.variance.size(); ++i)
        tile.variance[i] *= 1 + 0.1f * static_cast<float>(i % 7);
    tile.setScale(1e-3f);
    std::vector<float> scratch, all(kTile * kTile), one;
    for (const int reach : {3, 4, 8, 15}) {
        const Surroundings around{reach};
        PatchLattice lattice{{0, 13, 31}, {0, 20, 31}, around, {}};
        latticeDistances(tile, std::vector{&lattice}, scratch);
        one.resize(static_cast<std::size_t>(around.size()));
        for (const std::size_t i : {0U, 1U, 2U}) {
            const int column = lattice.columns[i], row = lattice.rows[i];
            patchDistancesFrom(tile, column, row, around, one.data());
            for (const auto& [dx, dy] :
                 {std::pair{0, 0}, {-reach, -reach}, {reach, reach}, {reach, -reach}, {-2, 3}}) {
                patchDistances(tile, dx, dy, scratch, all.data());
                const float d = all[static_cast<std::size_t>(row * kTile + column)];
                for (const float* of : {one.data(), lattice.of(i, i)})
                    EXPECT_NEAR(of[around.at(dx, dy)], d, 1e-5f * (1 + std::abs(d)))
                        << reach << ": " << column << " " << row << " " << dx << " " << dy;
            }
        }
    }
}

}  // namespace
}  // namespace vlx
