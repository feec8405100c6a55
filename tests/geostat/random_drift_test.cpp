#include "variolux/geostat/random_drift.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <random>

namespace vlx {
namespace {

/// A made-up neighbourhood: n data, p drift functions, three value columns.
struct Neighbourhood {
    Eigen::MatrixXd functions;  // n x p
    Eigen::MatrixXd values;     // n x 3
    Eigen::VectorXd weights;    // n
    double variance = 0.25;     // s^2 of a datum of weight 1

    DriftMoments moments() const {
        const Eigen::RowVectorXd meanF = weights.transpose() * functions / weights.sum();
        const Eigen::RowVectorXd meanZ = weights.transpose() * values / weights.sum();
        const Eigen::MatrixXd f = functions.rowwise() - meanF, z = values.rowwise() - meanZ;
        DriftMoments m;
        m.normal = f.transpose() * weights.asDiagonal() * f / variance;
        m.right = f.transpose() * weights.asDiagonal() * z / variance;
        m.fitted = 3;
        m.start = 1;
        return m;
    }
};

Neighbourhood made(int n, const Eigen::MatrixXd& slopes, double noise = 0.5) {
    std::mt19937 random(7);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> uniform(0.2, 1);
    Neighbourhood data;
    const auto fill = [&](Eigen::Index rows, Eigen::Index columns) {
        return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }).eval();
    };
    data.functions = fill(n, slopes.rows());
    data.weights = Eigen::VectorXd::NullaryExpr(n, [&] { return uniform(random); });
    const Eigen::VectorXd scale = data.weights.array().rsqrt();
    data.values = data.functions * slopes + noise * (scale.asDiagonal() * fill(n, 3));
    data.values.array() += 4;
    data.variance = noise * noise;
    return data;
}

TEST(RandomDrift, IsOrdinaryKrigingWithItsCovariance) {
    const Eigen::MatrixXd slopes =
        (Eigen::MatrixXd(3, 3) << 1, 0.5, 0.2, -0.4, 0.3, 0, 0.1, 0.1, 0.1).finished();
    const Neighbourhood data = made(40, slopes);
    const RandomDrift drift = fitRandomDrift(data.moments(), {0, 0, 1}, 2, 5);
    ASSERT_TRUE(drift.ok);
    // The same model in covariance form, with the bordered system of ordinary kriging (METHOD.md, 5).
    Eigen::MatrixXd prior = Eigen::MatrixXd::Zero(3, 3);
    for (int j = 0; j < 3; ++j) prior(j, j) = 1 / drift.precision[j < 2 ? 0 : 1];
    const Eigen::Index n = data.functions.rows();
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(n + 1, n + 1);
    system.topLeftCorner(n, n) = data.functions * prior * data.functions.transpose();
    for (Eigen::Index i = 0; i < n; ++i) system(i, i) += data.variance / data.weights[i];
    system.col(n).head(n).setOnes();
    system.row(n).head(n).setOnes();
    const Eigen::RowVector3d target(0.3, -1.2, 0.8);
    Eigen::VectorXd right(n + 1);
    right << data.functions * prior * target.transpose(), 1;
    const Eigen::VectorXd weights = system.fullPivLu().solve(right).head(n);
    const Eigen::RowVectorXd kriged = weights.transpose() * data.values;

    const double total = data.weights.sum();
    const Eigen::RowVectorXd meanF = data.weights.transpose() * data.functions / total;
    const Eigen::RowVectorXd meanZ = data.weights.transpose() * data.values / total;
    const Eigen::RowVectorXd predicted = meanZ + (target - meanF) * drift.coefficients;
    EXPECT_LT((predicted - kriged).cwiseAbs().maxCoeff(), 1e-10);
}

TEST(RandomDrift, PriorVariancesAreTheFixedPointOfTheEvidence) {
    const Eigen::MatrixXd slopes = (Eigen::MatrixXd(2, 3) << 1, 0.5, 0.2, 0.4, -0.3, 0.6).finished();
    const RandomDrift drift = fitRandomDrift(made(60, slopes).moments(), {0, 1}, 2, 200);
    for (Eigen::Index j = 0; j < 2; ++j) {
        const double a = drift.precision[static_cast<std::size_t>(j)];
        const double gamma = 1 - a * drift.variance[j];
        EXPECT_NEAR(a, gamma / (drift.coefficients.row(j).squaredNorm() / 3), 1e-6 * a);
    }
}

TEST(RandomDrift, WhatExplainsNothingDropsOutAndWhatExplainsMuchStays) {
    Eigen::MatrixXd slopes = Eigen::MatrixXd::Zero(6, 3);
    slopes.row(0) << 3, 2, 1;
    const Neighbourhood data = made(200, slopes);
    const RandomDrift drift = fitRandomDrift(data.moments(), {0, 1, 1, 1, 1, 1}, 2, 200);
    EXPECT_LT((drift.coefficients.row(0) - slopes.row(0)).cwiseAbs().maxCoeff(), 5 * 0.5 / std::sqrt(120));
    EXPECT_LT(drift.effective, 2.5);  // of 6
    EXPECT_LT(drift.coefficients.bottomRows(5).cwiseAbs().maxCoeff(), 0.08);
}

TEST(RandomDrift, VarianceCoversTheCoefficients) {
    // 400 replications with slopes drawn from the prior: z scores of N(0, 1) lie within 1 in 68 %.
    std::mt19937 random(3);
    std::normal_distribution<double> normal;
    int within = 0, count = 0;
    for (int i = 0; i < 400; ++i) {
        const Eigen::MatrixXd slopes =
            Eigen::MatrixXd::NullaryExpr(4, 3, [&] { return 0.5 * normal(random); });
        Neighbourhood data = made(30, Eigen::MatrixXd::Zero(4, 3));
        for (Eigen::Index k = 0; k < data.values.size(); ++k)
            data.values(k) = 0.5 * normal(random) / std::sqrt(data.weights[k % 30]);
        data.values += data.functions * slopes;
        const RandomDrift drift = fitRandomDrift(data.moments(), {0, 0, 0, 0}, 1, 30);
        for (Eigen::Index j = 0; j < 4; ++j)
            for (Eigen::Index c = 0; c < 3; ++c) {
                within += std::abs(drift.coefficients(j, c) - slopes(j, c)) < std::sqrt(drift.variance[j]);
                ++count;
            }
    }
    // 4800 nearly independent trials, standard error 0.7 %; the prior is estimated, which costs a little.
    EXPECT_NEAR(static_cast<double>(within) / count, 0.683, 0.03);
}

TEST(RandomDrift, NumbersThatAreNoneGiveNoDriftAndSaySo) {
    DriftMoments moments = made(20, Eigen::MatrixXd::Ones(2, 3)).moments();
    moments.normal(1, 1) = std::numeric_limits<double>::quiet_NaN();
    const RandomDrift drift = fitRandomDrift(moments, {0, 0}, 1, 4);
    EXPECT_FALSE(drift.ok);
    EXPECT_EQ(drift.coefficients.cwiseAbs().maxCoeff(), 0);
}

TEST(RandomDrift, NoFunctionsAreTheMean) {
    const RandomDrift drift = fitRandomDrift(made(20, Eigen::MatrixXd::Zero(0, 3)).moments(), {}, 1, 4);
    EXPECT_TRUE(drift.ok);
    EXPECT_EQ(drift.effective, 0);
}

}  // namespace
}  // namespace vlx
