#include "variolux/geostat/reml.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "simulated_field.h"

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using vlx::RemlData;
using vlx::RemlFit;
using vlx::RemlOptions;
using vlx::RemlStatus;
using vlx::StructureType;
using vlx::VariogramModel;
using vlx::testing::FieldSampler;
using vlx::testing::kRepeat;
using vlx::testing::pixelCentres;
using vlx::testing::Sample;

RemlData sample(const VariogramModel& truth, int side, std::uint64_t seed, Index channels = 1) {
    RemlData data;
    data.positions = pixelCentres(side, side);
    FieldSampler sampler(truth, data.positions, seed);
    const Index n = data.positions.rows();
    data.drift = MatrixXd::Ones(n, 2);
    data.drift.col(1) = data.positions.col(0);
    data.errorVariances = 0.3 * sampler.noise(n).cwiseAbs2();
    data.values.resize(n, channels);
    for (Index c = 0; c < channels; ++c)
        data.values.col(c) = sampler.draw() + data.errorVariances.cwiseSqrt().cwiseProduct(sampler.noise(n)) +
                             data.drift * Eigen::Vector2d(5, -0.3);
    return data;
}

const VariogramModel kTruth{0.2,
                            {{StructureType::Stable, 1.1, 2.5, 1.3}, {StructureType::Spherical, 0.4, 6, 1}}};

// The definition: the density of the contrasts A'z, A an orthonormal basis of the complement of the drift.
TEST(RemlLikelihood, IsTheDensityOfContrasts) {
    const RemlData data = sample(kTruth, 5, 1, 2);
    const MatrixXd q = Eigen::HouseholderQR<MatrixXd>(data.drift).householderQ();
    const MatrixXd a = q.rightCols(23);
    MatrixXd k = vlx::testing::covarianceMatrix(kTruth, data.positions);
    k.diagonal() += data.errorVariances;
    const MatrixXd v = a.transpose() * k * a;
    double expected = 0;
    for (Index c = 0; c < 2; ++c) {
        const VectorXd e = a.transpose() * data.values.col(c);
        expected -=
            0.5 * (23 * std::log(2 * std::acos(-1.0)) + std::log(v.determinant()) + e.dot(v.inverse() * e));
    }
    const auto l = vlx::remlLikelihood(data, kTruth);
    ASSERT_TRUE(l.ok);
    EXPECT_NEAR(l.logLikelihood, expected, 1e-9);
    // It does not depend on the drift's coefficients, nor on how the drift is written.
    RemlData moved = data;
    moved.values += data.drift * MatrixXd::Constant(2, 2, 100);
    moved.drift.col(1) = 1e5 * data.drift.col(1) + 7 * data.drift.col(0);
    moved.drift.conservativeResize(25, 3);
    moved.drift.col(2) = data.drift.col(0) * 3;  // and a dependent column
    EXPECT_NEAR(vlx::remlLikelihood(moved, kTruth).logLikelihood, expected, 1e-6);
}

TEST(RemlLikelihood, GradientEqualsFiniteDifferences) {
    for (const double shape : {0.6, 1.3, 1.9}) {
        VariogramModel model = kTruth;
        model.structures[0].shape = shape;
        const RemlData data = sample(kTruth, 6, 2, 2);
        const auto l = vlx::remlLikelihood(data, model);
        ASSERT_EQ(l.gradient.size(), 7);
        for (Index p = 0; p < 7; ++p) {
            const auto shifted = [&](double d) {
                VariogramModel m = model;
                if (p == 0) {
                    m.nugget += d;
                } else {
                    auto& s = m.structures[static_cast<std::size_t>((p - 1) / 3)];
                    ((p - 1) % 3 == 0 ? s.sill : (p - 1) % 3 == 1 ? s.range : s.shape) += d;
                }
                return vlx::remlLikelihood(data, m, false).logLikelihood;
            };
            const double d = 1e-5;
            EXPECT_NEAR(l.gradient[p], (shifted(d) - shifted(-d)) / (2 * d),
                        1e-6 * (1 + std::abs(l.gradient[p])))
                << p;
        }
    }
}

// The expected information is the covariance of the gradient at the truth.
TEST(RemlLikelihood, InformationIsTheCovarianceOfTheGradient) {
    const VariogramModel truth{0.3, {{StructureType::Exponential, 1, 2, 1}}};
    MatrixXd products = MatrixXd::Zero(3, 3), information;
    const int repeats = 150 * kRepeat;
    for (int r = 0; r < repeats; ++r) {
        RemlData data = sample(truth, 6, static_cast<std::uint64_t>(r));
        data.errorVariances.setZero();
        FieldSampler sampler(truth, data.positions, static_cast<std::uint64_t>(1000 + r));
        data.values = sampler.draw();
        const auto l = vlx::remlLikelihood(data, truth);
        const VectorXd g = l.gradient.head(3);
        products += g * g.transpose() / repeats;
        information = l.information.topLeftCorner(3, 3);
    }
    for (Index i = 0; i < 3; ++i) EXPECT_NEAR(products(i, i) / information(i, i), 1, 0.3) << i;
}

// Pure nugget with a constant mean: the sample variance with n - 1, which maximum likelihood misses.
TEST(Reml, PureNuggetIsTheSampleVariance) {
    RemlData data = sample({1, {}}, 7, 3);
    data.errorVariances.resize(0);
    data.drift = MatrixXd::Ones(49, 1);
    const double variance = (data.values.array() - data.values.mean()).square().sum() / 48;
    const auto at = [&](double nugget) {
        return vlx::remlLikelihood(data, {nugget, {}}, false).logLikelihood;
    };
    EXPECT_GT(at(variance), at(variance * 1.01));
    EXPECT_GT(at(variance), at(variance * 0.99));
    EXPECT_NEAR(vlx::remlLikelihood(data, {variance, {}}).gradient[0], 0, 1e-9);
}

TEST(Reml, StopsAtAStationaryPoint) {
    const RemlData data = sample({0.3, {{StructureType::Exponential, 1.5, 2, 1}}}, 9, 4);
    RemlOptions options;
    const RemlFit fit = vlx::fitReml(data, options);
    ASSERT_EQ(fit.status, RemlStatus::Ok) << fit.message();
    const auto l = vlx::remlLikelihood(data, fit.model);
    EXPECT_NEAR(l.logLikelihood, fit.logLikelihood, 1e-8);
    const auto& s = fit.model.structures[0];
    EXPECT_NEAR(l.gradient[1] * s.sill, 0, 1e-3);
    EXPECT_NEAR(l.gradient[2] * s.range, 0, 1e-3);
    if (fit.model.nugget > 0) {
        EXPECT_NEAR(l.gradient[0] * fit.model.nugget, 0, 1e-3);
    }
    // No point of a fine grid is better.
    for (const double nugget : {0.0, 0.05, 0.2, 0.5, 1.0})
        for (const double sill : {0.1, 0.5, 1.0, 2.0, 4.0})
            for (const double range : {0.5, 1.0, 2.0, 4.0, 8.0, 16.0}) {
                const VariogramModel m{nugget, {{StructureType::Exponential, sill, range, 1}}};
                EXPECT_LE(vlx::remlLikelihood(data, m, false).logLikelihood, fit.logLikelihood + 1e-6);
            }
}

TEST(Reml, ScalesWithUnits) {
    const RemlData data = sample({0.3, {{StructureType::Exponential, 1.5, 2, 1}}}, 7, 5);
    const RemlFit one = vlx::fitReml(data);
    for (const double scale : {1e-100, 1e-12, 1e12, 1e100}) {
        RemlData other = data;
        other.values *= scale;
        other.errorVariances *= scale * scale;
        other.positions *= 1e6;
        const RemlFit fit = vlx::fitReml(other);
        ASSERT_TRUE(fit.ok()) << fit.message();
        EXPECT_NEAR(fit.model.structures[0].sill / scale / scale, one.model.structures[0].sill, 1e-4);
        EXPECT_NEAR(fit.model.structures[0].range / 1e6, one.model.structures[0].range, 1e-3);
        EXPECT_NEAR(fit.likelihoodRatio, one.likelihoodRatio, 1e-5);
    }
}

TEST(Reml, DegenerateDataGivesAStatus) {
    RemlData data = sample({0.3, {}}, 4, 6);
    data.values.setZero();
    EXPECT_EQ(vlx::fitReml(data).status, RemlStatus::Zero);
    data.values = data.drift.col(1) * 3;  // the drift itself
    EXPECT_EQ(vlx::fitReml(data).status, RemlStatus::Zero);
    data = sample({0.3, {}}, 4, 6);
    data.positions.setZero();
    EXPECT_EQ(vlx::fitReml(data).status, RemlStatus::TooFewData);
    data = sample({0.3, {}}, 1, 6);
    EXPECT_EQ(vlx::fitReml(data).status, RemlStatus::TooFewData);
    data = sample({0.3, {}}, 4, 6);
    data.drift = MatrixXd::Identity(16, 16);
    EXPECT_EQ(vlx::fitReml(data).status, RemlStatus::TooFewData);
    data.drift = MatrixXd::Ones(16, 1);
    data.errorVariances.setZero();
    data.positions.row(3) = data.positions.row(8);  // coincident, without error
    const RemlFit fit = vlx::fitReml(data);
    EXPECT_FALSE(fit.model.validate());
    EXPECT_FALSE(fit.message().empty());
    EXPECT_EQ(fit.status, RemlStatus::Singular);  // two values at one place have no likelihood
}

TEST(Reml, ValidateNamesTheBrokenConstraint) {
    RemlData data = sample({0.3, {}}, 4, 6);
    EXPECT_FALSE(data.validate());
    data.errorVariances[3] = -1;
    EXPECT_TRUE(data.validate());
    data = sample({0.3, {}}, 4, 6);
    data.values(2, 0) = std::nan("");
    EXPECT_TRUE(data.validate());
    data.values.resize(3, 1);
    EXPECT_TRUE(data.validate());
    RemlOptions options;
    EXPECT_FALSE(options.validate());
    options.structures = {{StructureType::Linear}};
    EXPECT_TRUE(options.validate());
}

// Estimates from fields with a drift and unequal known errors: without bias within 4.5 standard errors plus
// the 4 % that a logarithm of an estimate may be off at this size; and the reported errors are their scatter.
TEST(RemlStatistics, IsNearlyUnbiased) {
    const VariogramModel truth{0, {{StructureType::Exponential, 1, 1.5, 1}}};
    RemlOptions options;
    options.nugget = false;
    options.starts = 1;
    Sample sill, range, sillError, rangeError;
    for (int r = 0; r < 25 * kRepeat; ++r) {
        const RemlFit fit = vlx::fitReml(sample(truth, 10, static_cast<std::uint64_t>(100 + r)), options);
        ASSERT_TRUE(fit.ok()) << fit.message();
        sill.add(fit.model.structures[0].sill);
        range.add(std::log(fit.model.structures[0].range));
        sillError.add(fit.standardErrors[1]);
        rangeError.add(fit.standardErrors[2] / fit.model.structures[0].range);
    }
    EXPECT_LT(std::abs(sill.mean() - 1), 4.5 * sill.error() + 0.04);
    EXPECT_LT(std::abs(range.mean() - std::log(1.5)), 4.5 * range.error() + 0.04);
    EXPECT_NEAR(sillError.mean() / std::sqrt(sill.variance()), 1, 0.4);
    EXPECT_NEAR(rangeError.mean() / std::sqrt(range.variance()), 1, 0.4);
}

TEST(RemlStatistics, LikelihoodRatioSeldomAlarmsOnNoiseAndFindsStructure) {
    int alarms = 0, found = 0;
    const int repeats = 20 * kRepeat;
    RemlOptions options;
    options.starts = 2;
    for (int r = 0; r < repeats; ++r) {
        alarms += vlx::fitReml(sample({1, {}}, 7, static_cast<std::uint64_t>(500 + r)), options).significant;
        found += vlx::fitReml(sample({0.1, {{StructureType::Exponential, 1, 2, 1}}}, 7,
                                     static_cast<std::uint64_t>(900 + r)),
                              options)
                     .significant;
    }
    EXPECT_LT(alarms, repeats * 0.05 + 4 * std::sqrt(repeats * 0.05 * 0.95));
    EXPECT_GT(found, 0.5 * repeats);
}

}  // namespace
