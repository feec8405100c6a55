#include "variolux/geostat/empirical_variogram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "simulated_field.h"
#include "variolux/geostat/lattice_variogram.h"

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using vlx::EmpiricalVariogram;
using vlx::EmpiricalVariogramOptions;
using vlx::VariogramBin;
using vlx::VariogramEstimator;
using vlx::testing::FieldSampler;
using vlx::testing::kRepeat;
using vlx::testing::pixelCentres;
using vlx::testing::Sample;

EmpiricalVariogramOptions withEdges(std::vector<double> edges,
                                    VariogramEstimator estimator = VariogramEstimator::Matheron) {
    EmpiricalVariogramOptions options;
    options.edges = std::move(edges);
    options.estimator = estimator;
    return options;
}

TEST(EmpiricalVariogram, HandComputedExample) {
    MatrixXd x(4, 1);
    x << 0, 1, 2, 4;
    const Eigen::Vector4d z(1, 3, 2, 7);
    const EmpiricalVariogram v = vlx::empiricalVariogram(x, z, withEdges({0, 1, 2, 3, 4, 9}));
    ASSERT_EQ(v.status, vlx::VariogramStatus::Ok);
    ASSERT_EQ(v.bins.size(), 5u);
    EXPECT_EQ(v.bins[0].pairs, 2);  // (0,1) (1,2)
    EXPECT_DOUBLE_EQ(v.bins[0].semivariance, (4 + 1) / 4.0);
    EXPECT_EQ(v.bins[1].pairs, 2);  // (0,2) (2,4)
    EXPECT_DOUBLE_EQ(v.bins[1].semivariance, (1 + 25) / 4.0);
    EXPECT_DOUBLE_EQ(v.bins[2].semivariance, 16 / 2.0);
    EXPECT_DOUBLE_EQ(v.bins[3].semivariance, 36 / 2.0);
    EXPECT_DOUBLE_EQ(v.bins[3].distance, 4);
    EXPECT_EQ(v.bins[4].pairs, 0);
    EXPECT_TRUE(std::isnan(v.bins[4].semivariance));
    EXPECT_EQ(v.bins[4].distance, 6.5);
    EXPECT_EQ(v.nullError[4], 0);
    EXPECT_TRUE(v.nullCorrelation.row(4).isZero(0));
}

TEST(EmpiricalVariogram, RobustEstimatorsByTheirFormulas) {
    MatrixXd x(5, 1);
    x << 0, 1, 2, 3, 4;
    VectorXd z(5);
    z << 0, 1, 5, 2, 9;  // differences 1 4 3 7 at distance 1
    const double mean = (1 + 2 + std::sqrt(3.0) + std::sqrt(7.0)) / 4;
    const auto ch = vlx::empiricalVariogram(x, z, withEdges({0.5, 1.5}, VariogramEstimator::CressieHawkins));
    EXPECT_NEAR(ch.bins[0].semivariance, 0.5 * std::pow(mean, 4) / (0.457 + 0.494 / 4 + 0.045 / 16), 1e-13);
    const auto dowd = vlx::empiricalVariogram(x, z, withEdges({0.5, 1.5}, VariogramEstimator::Dowd));
    EXPECT_NEAR(dowd.bins[0].semivariance, 2.198 * 3.5 * 3.5 / 2, 1e-13);
}

TEST(EmpiricalVariogram, ClassesAreOpenBelowAndClosedAbove) {
    // Distances that lie exactly on edges, which equal-width arithmetic would round across.
    MatrixXd x(12, 1);
    for (Index i = 0; i < 12; ++i) x(i, 0) = 0.1 * static_cast<double>(i);
    const VectorXd z = VectorXd::LinSpaced(12, 0, 1);
    for (const bool uniform : {true, false}) {
        std::vector<double> edges;
        for (int b = 0; b < 12; ++b) edges.push_back(0.1 * b);
        if (!uniform) edges.push_back(7);
        const EmpiricalVariogram v = vlx::empiricalVariogram(x, z, withEdges(edges));
        for (std::size_t b = 0; b + 1 < edges.size(); ++b) {
            double expected = 0;
            for (Index i = 0; i < 12; ++i)
                for (Index j = i + 1; j < 12; ++j) {
                    const double h = std::abs(x(i, 0) - x(j, 0));
                    expected += h > edges[b] && h <= edges[b + 1];
                }
            EXPECT_EQ(v.bins[b].pairs, expected) << b;
        }
    }
    // Coincident pairs: only in a first class that starts at 0.
    MatrixXd same = MatrixXd::Zero(3, 2);
    EXPECT_EQ(vlx::empiricalVariogram(same, z.head(3), withEdges({0, 1})).bins[0].pairs, 3);
    EXPECT_EQ(vlx::empiricalVariogram(same, z.head(3), withEdges({0.1, 1})).status,
              vlx::VariogramStatus::NoPairs);
}

TEST(EmpiricalVariogram, EqualsTheMeanOfTheCloud) {
    FieldSampler sampler({0.1, {{vlx::StructureType::Exponential, 1, 3, 1}}}, pixelCentres(9, 7), 5);
    const MatrixXd x = pixelCentres(9, 7);
    const VectorXd noise = sampler.noise(63).cwiseAbs2();
    MatrixXd z(63, 3);
    for (Index c = 0; c < 3; ++c) z.col(c) = sampler.draw();
    const auto edges = std::vector<double>{0, 1.2, 2.7, 5, 5.5};
    const EmpiricalVariogram v = vlx::empiricalVariogram(x, z, withEdges(edges), noise);
    const auto cloud = vlx::variogramCloud(x, z, 5.5, noise);
    EXPECT_TRUE(std::is_sorted(cloud.begin(), cloud.end(), [](const auto& a, const auto& b) {
        return std::pair(a.first, a.second) < std::pair(b.first, b.second);
    }));
    for (const VariogramBin& bin : v.bins) {
        double n = 0, h = 0, gamma = 0, subtracted = 0;
        for (const auto& point : cloud) {
            if (!(point.distance > bin.lower && point.distance <= bin.upper)) continue;
            n += 1;
            h += point.distance;
            gamma += point.semivariance;
            subtracted += 0.5 * (noise[point.first] + noise[point.second]);
        }
        EXPECT_EQ(bin.pairs, n);
        EXPECT_NEAR(bin.distance, h / n, 1e-12);
        EXPECT_NEAR(bin.semivariance, gamma / n, 1e-12);
        EXPECT_NEAR(bin.noise, subtracted / n, 1e-12);
    }
    // The squared norm is the sum over channels.
    for (std::size_t b = 0; b < v.bins.size(); ++b) {
        double sum = 0;
        for (Index c = 0; c < 3; ++c)
            sum += vlx::empiricalVariogram(x, z.col(c), withEdges(edges)).bins[b].semivariance;
        EXPECT_NEAR(v.bins[b].semivariance + v.bins[b].noise, sum, 1e-12);
    }
}

TEST(LatticeVariogram, IsTheVariogramOfItsData) {
    const Index width = 11, height = 7;
    std::mt19937 random(3);
    std::uniform_real_distribution<double> uniform;
    for (const Index channels : {1, 3, 4})
        for (const double filled : {1.0, 0.4}) {
            std::vector<Index> cells;
            for (Index cell = 0; cell < width * height; ++cell)
                if (uniform(random) < filled) cells.push_back(cell);
            const auto n = static_cast<Index>(cells.size());
            MatrixXd x(n, 2), z(n, channels);
            VectorXd noise(n);
            for (Index i = 0; i < n; ++i) {
                const Index cell = cells[static_cast<std::size_t>(i)];
                x.row(i) << 5 + 0.25 * static_cast<double>(cell % width),
                    -3 + 0.25 * static_cast<double>(cell / width);
                for (Index c = 0; c < channels; ++c) z(i, c) = 1000 + uniform(random);
                noise[i] = uniform(random);
            }
            z(2, 0) = std::numeric_limits<double>::quiet_NaN();
            noise[4] = -1;
            const std::vector<double> edges{0, 0.25, 0.9, 1.5, 1.51, 2};
            const auto expected = vlx::empiricalVariogram(x, z, withEdges(edges), noise);
            const auto found = vlx::latticeVariogram({width, height, 0.25}, cells, z, edges, noise);
            EXPECT_EQ(found.status, vlx::VariogramStatus::Ok);
            EXPECT_EQ(found.data, expected.data);
            EXPECT_EQ(found.skipped, 2);
            EXPECT_NEAR(found.meanNoise, expected.meanNoise, 1e-12);
            for (std::size_t b = 0; b < expected.bins.size(); ++b) {
                EXPECT_EQ(found.bins[b].pairs, expected.bins[b].pairs);
                EXPECT_NEAR(found.bins[b].distance, expected.bins[b].distance, 1e-12);
                EXPECT_NEAR(found.bins[b].noise, expected.bins[b].noise, 1e-12);
                if (expected.bins[b].pairs > 0) {
                    EXPECT_NEAR(found.bins[b].semivariance, expected.bins[b].semivariance, 1e-12);
                }
            }
        }
    const VectorXd one = VectorXd::Ones(1), two = VectorXd::Ones(2);
    EXPECT_EQ(vlx::latticeVariogram({2, 2, 1}, {3}, one, {0, 2}, one).status,
              vlx::VariogramStatus::TooFewData);
    EXPECT_EQ(vlx::latticeVariogram({2, 2, 1}, {0, 3}, two, {0, 1}, two).status,
              vlx::VariogramStatus::NoPairs);
}

TEST(EmpiricalVariogram, DirectionsSplitThePairs) {
    const MatrixXd x = pixelCentres(8, 8);
    const VectorXd z = x.col(0);  // changes along x only
    EmpiricalVariogramOptions options = withEdges({0.5, 1.1, 2.1, 3.1});
    options.direction = vlx::VariogramDirection{0, 0.1};
    const auto alongX = vlx::empiricalVariogram(x, z, options);
    options.direction = vlx::VariogramDirection{std::acos(-1.0) / 2, 0};
    const auto alongY = vlx::empiricalVariogram(x, z, options);
    for (int b = 0; b < 3; ++b) {
        const std::size_t at = static_cast<std::size_t>(b);
        EXPECT_EQ(alongX.bins[at].pairs, 8 * (7 - b));
        EXPECT_DOUBLE_EQ(alongX.bins[at].semivariance, 0.5 * (b + 1) * (b + 1));
        EXPECT_EQ(alongY.bins[at].pairs, 8 * (7 - b));
        EXPECT_EQ(alongY.bins[at].semivariance, 0);
    }
    // Four sectors of 45 degrees hold every pair once, up to pairs on their borders; opposite angles agree.
    double sum = 0;
    for (int sector = 0; sector < 4; ++sector) {
        options.direction = vlx::VariogramDirection{0.1 + sector * std::acos(-1.0) / 4, std::acos(-1.0) / 8};
        const double pairs = vlx::empiricalVariogram(x, z, options).bins[2].pairs;
        options.direction->angle += std::acos(-1.0);
        EXPECT_EQ(vlx::empiricalVariogram(x, z, options).bins[2].pairs, pairs);
        sum += pairs;
    }
    options.direction.reset();
    EXPECT_EQ(sum, vlx::empiricalVariogram(x, z, options).bins[2].pairs);
    options.direction = vlx::VariogramDirection{0, std::acos(-1.0) / 2, 0.5};  // a band one row wide
    EXPECT_EQ(vlx::empiricalVariogram(x, z, options).bins[2].pairs, 8 * 5);
}

TEST(EmpiricalVariogram, CompositeDistanceUsesEveryColumn) {
    const MatrixXd x = pixelCentres(6, 6);
    FieldSampler sampler({1, {}}, x, 9);
    MatrixXd composite(36, 4);
    composite << x, sampler.noise(36), sampler.noise(36);
    const auto cloud = vlx::variogramCloud(composite, sampler.noise(36), 100);
    ASSERT_EQ(cloud.size(), 36u * 35 / 2);
    for (const auto& point : cloud)
        EXPECT_NEAR(point.distance, (composite.row(point.first) - composite.row(point.second)).norm(), 1e-13);
}

TEST(EmpiricalVariogram, LeavesOutUnusableData) {
    MatrixXd x = pixelCentres(4, 4);
    VectorXd z = VectorXd::LinSpaced(16, 0, 3), noise = VectorXd::Constant(16, 0.1);
    const auto options = withEdges({0, 1.1, 2.3});
    std::vector<Index> good;
    for (Index i = 0; i < 16; ++i)
        if (i != 2 && i != 5 && i != 7 && i != 11) good.push_back(i);
    const auto expected = vlx::empiricalVariogram(x(good, Eigen::all), z(good), options, noise(good));
    x(2, 0) = std::nan("");
    z[5] = std::numeric_limits<double>::infinity();
    noise[7] = -1e-30;
    noise[11] = std::nan("");
    const auto v = vlx::empiricalVariogram(x, z, options, noise);
    EXPECT_EQ(v.skipped, 4);
    EXPECT_EQ(v.data, 12);
    for (std::size_t b = 0; b < 2; ++b) EXPECT_EQ(v.bins[b].semivariance, expected.bins[b].semivariance);
    EXPECT_EQ(vlx::variogramCloud(x, z, 1.1, noise).back().second, 15);  // rows of the caller's data
    EXPECT_EQ(vlx::empiricalVariogram(x.topRows(1), z.head(1), options).status,
              vlx::VariogramStatus::TooFewData);
    EXPECT_EQ(vlx::empiricalVariogram(x.topRows(0), z.head(0), options).status,
              vlx::VariogramStatus::TooFewData);
    EXPECT_EQ(vlx::empiricalVariogram(x, z, withEdges({50, 60})).status, vlx::VariogramStatus::NoPairs);
}

TEST(EmpiricalVariogram, ConstantDataHasZeroSemivarianceAndError) {
    const auto v =
        vlx::empiricalVariogram(pixelCentres(5, 5), VectorXd::Constant(25, 0.1), withEdges({0, 2, 4}));
    for (const VariogramBin& bin : v.bins) {
        EXPECT_EQ(bin.semivariance, 0);
        EXPECT_EQ(bin.standardError, 0);
    }
    EXPECT_TRUE(v.nullError.isZero(0));
}

TEST(EmpiricalVariogram, ValidateNamesTheBrokenConstraint) {
    EXPECT_TRUE(withEdges({1}).validate());
    EXPECT_TRUE(withEdges({-1, 1}).validate());
    EXPECT_TRUE(withEdges({0, 1, 1}).validate());
    EXPECT_TRUE(withEdges({0, std::nan("")}).validate());
    EXPECT_FALSE(withEdges(vlx::uniformEdges(8, 12)).validate());
    auto options = withEdges({0, 1});
    options.direction = vlx::VariogramDirection{0, 2};
    EXPECT_TRUE(options.validate());
}

TEST(EmpiricalVariogram, WeightsOfZeroRemoveData) {
    const MatrixXd x = pixelCentres(6, 6);
    FieldSampler sampler({1, {}}, x, 4);
    const VectorXd z = sampler.draw();
    VectorXd w = VectorXd::Ones(36);
    std::vector<Index> kept;
    for (Index i = 0; i < 36; ++i) {
        if (i % 3 == 0) w[i] = 0;
        if (i % 3 != 0) kept.push_back(i);
    }
    const auto options = withEdges({0, 1.1, 2.3, 4});
    const auto weighted = vlx::empiricalVariogram(x, z, options, VectorXd(), w);
    const auto removed = vlx::empiricalVariogram(x(kept, Eigen::all), z(kept), options);
    for (std::size_t b = 0; b < 3; ++b) {
        EXPECT_NEAR(weighted.bins[b].semivariance, removed.bins[b].semivariance, 1e-13);
        EXPECT_NEAR(weighted.bins[b].pairs, removed.bins[b].pairs, 1e-9);
    }
}

// Mean over fields within 4.5 standard errors of the truth: one false alarm in 1e5 a class.
TEST(EmpiricalVariogramStatistics, KnownNoiseIsRemovedWithoutBias) {
    const MatrixXd x = pixelCentres(10, 10);
    const vlx::VariogramModel model{0.2, {{vlx::StructureType::Spherical, 1, 4, 1}}};
    FieldSampler sampler(model, x, 11);
    const VectorXd noise = 2 * sampler.noise(100).cwiseAbs2();  // as large as the field, very unequal
    const auto options = withEdges({0, 1, 1.5, 2.1, 3, 5});
    std::vector<double> truth(5, 0.0), pairs(5, 0.0);  // mean of gamma over the pairs of each class
    for (const auto& p : vlx::variogramCloud(x, VectorXd::Zero(100), 5))
        for (std::size_t b = 0; b < 5; ++b)
            if (p.distance > options.edges[b] && p.distance <= options.edges[b + 1]) {
                truth[b] += vlx::semivariance(model, p.distance);
                pairs[b] += 1;
            }
    std::vector<Sample> excess(5);
    for (int r = 0; r < 150 * kRepeat; ++r) {
        const VectorXd z = sampler.draw() + noise.cwiseSqrt().cwiseProduct(sampler.noise(100));
        const auto v = vlx::empiricalVariogram(x, z, options, noise);
        for (std::size_t b = 0; b < 5; ++b) excess[b].add(v.bins[b].semivariance - truth[b] / pairs[b]);
    }
    for (const Sample& s : excess) EXPECT_LT(std::abs(s.mean()), 4.5 * s.error());
}

TEST(EmpiricalVariogramStatistics, RobustEstimatorsAreNearlyUnbiasedAndResistOutliers) {
    const MatrixXd x = pixelCentres(16, 16);
    FieldSampler sampler({1, {}}, x, 12);
    for (const auto estimator : {VariogramEstimator::CressieHawkins, VariogramEstimator::Dowd}) {
        Sample clean, dirty, plain;
        for (int r = 0; r < 25 * kRepeat; ++r) {
            VectorXd z = sampler.draw();
            clean.add(vlx::empiricalVariogram(x, z, withEdges({0, 3}, estimator)).bins[0].semivariance);
            for (const Index i : {17, 80, 133, 200}) z[i] = 1000;
            dirty.add(vlx::empiricalVariogram(x, z, withEdges({0, 3}, estimator)).bins[0].semivariance);
            plain.add(vlx::empiricalVariogram(x, z, withEdges({0, 3})).bins[0].semivariance);
        }
        EXPECT_NEAR(clean.mean(), 1, 0.02 + 4.5 * clean.error());
        EXPECT_GT(plain.mean(), 1e4);
        EXPECT_LT(dirty.mean(), estimator == VariogramEstimator::Dowd ? 1.3 : 30);
    }
}

// The covariance of the classes under independence, against simulation: Gaussian and heavy-tailed noise, one
// channel and three correlated ones, unequal known variances.
TEST(EmpiricalVariogramStatistics, NullDistributionAndStandardErrorsMatchSimulation) {
    const MatrixXd x = pixelCentres(8, 8);
    const auto options = withEdges(vlx::uniformEdges(6, 6));
    for (const int channels : {1, 3})
        for (const bool heavy : {false, true}) {
            FieldSampler sampler({1, {}}, x, 13);
            VectorXd noise = (0.7 * sampler.noise(64)).array().exp();
            MatrixXd predicted = MatrixXd::Zero(6, 6), products = predicted;
            VectorXd mean = VectorXd::Zero(6), errors = VectorXd::Zero(6);
            const int repeats = 500 * kRepeat;
            for (int r = 0; r < repeats; ++r) {
                MatrixXd z(64, channels);
                const VectorXd common = sampler.noise(64);
                for (Index c = 0; c < channels; ++c) {
                    VectorXd e = channels == 1 ? common : VectorXd(0.8 * common + 0.6 * sampler.noise(64));
                    // Kurtosis 4.3: sinh of a normal, scaled to variance 1.
                    if (heavy) e = (0.4 * e.array()).sinh() / std::sqrt(0.5 * (std::exp(2 * 0.16) - 1));
                    z.col(c) = noise.cwiseSqrt().cwiseProduct(e);
                }
                const auto v = vlx::empiricalVariogram(x, z, options, channels * noise);
                VectorXd gamma(6);
                for (Index b = 0; b < 6; ++b) {
                    gamma[b] = v.bins[static_cast<std::size_t>(b)].semivariance;
                    errors[b] += v.bins[static_cast<std::size_t>(b)].standardError;
                }
                mean += gamma;
                products += gamma * gamma.transpose();
                predicted += v.nullError.asDiagonal() * v.nullCorrelation * v.nullError.asDiagonal();
            }
            mean /= repeats;
            const MatrixXd actual = products / repeats - mean * mean.transpose();
            predicted /= repeats;
            errors /= repeats;
            for (Index a = 0; a < 6; ++a) {
                const double deviation = std::sqrt(actual(a, a));
                EXPECT_NEAR(std::sqrt(predicted(a, a)) / deviation, 1, heavy ? 0.2 : 0.12)
                    << channels << heavy << a;
                EXPECT_NEAR(errors[a] / deviation, 1, 0.25) << channels << heavy << a;
                for (Index b = 0; b < a; ++b)
                    EXPECT_NEAR(predicted(a, b), actual(a, b), 0.3 * deviation * std::sqrt(actual(b, b)));
            }
        }
}

}  // namespace
