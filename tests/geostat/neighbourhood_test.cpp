#include "variolux/geostat/neighbourhood.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "random_problem.h"

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

TEST(NearestPoints, FindsWhatSortingFinds) {
    testing::Random random(1);
    for (int k = 0; k < 50; ++k) {
        const Index n = 1 + random.below(300), d = 1 + random.below(4);
        MatrixXd x(n, d);
        for (Index i = 0; i < x.size(); ++i) x.data()[i] = random.uniform();
        VectorXd target(d);
        for (Index j = 0; j < d; ++j) target[j] = random.uniform(-0.5, 1.5);
        std::vector<std::pair<double, Index>> all;
        for (Index i = 0; i < n; ++i) all.emplace_back((x.row(i) - target.transpose()).norm(), i);
        std::sort(all.begin(), all.end());
        const NearestPoints points(x);
        const auto nearest = points.nearest(target, 20);
        ASSERT_EQ(nearest.size(), static_cast<std::size_t>(std::min<Index>(n, 20)));
        for (std::size_t i = 0; i < nearest.size(); ++i) EXPECT_EQ(nearest[i], all[i].second);
        const auto within = points.within(target, 0.4);
        for (const auto& [distance, i] : all)
            EXPECT_EQ(distance <= 0.4, std::find(within.begin(), within.end(), i) != within.end());
    }
}

TEST(NearestPoints, SkipsPointsThatAreNotFinite) {
    MatrixXd x(3, 1);
    x << 0, std::nan(""), 2;
    EXPECT_EQ(NearestPoints(x).nearest(VectorXd::Constant(1, 1.9), 5), (std::vector<Index>{2, 0}));
    EXPECT_TRUE(NearestPoints(x).nearest(VectorXd::Constant(1, std::nan("")), 5).empty());
}

/// On a lattice every distance is tied: the answer must still not depend on the order of the data.
TEST(Neighbourhood, TiesDoNotDependOnTheOrderOfData) {
    testing::Random random(2);
    KrigingProblem problem;
    problem.model = {0.1, {{StructureType::Exponential, 1, 6, 1}}};
    problem.positions.resize(32 * 32, 2);
    problem.values.resize(32 * 32, 1);
    for (Index i = 0; i < 32 * 32; ++i) {
        problem.positions.row(i) << static_cast<double>(i % 32), static_cast<double>(i / 32);
        problem.values(i, 0) = random.normal();
    }
    KrigingTargets targets;
    targets.points.resize(3, 2);
    targets.points << 15.5, 15.5, 7, 7.5, 0, 31;
    NeighbourhoodOptions options;
    options.most = 20;
    const NeighbourhoodPrediction a = predictLocally(problem, targets, options);
    ASSERT_TRUE(a.report.ok()) << a.report.message;
    KrigingProblem reversed = problem;
    reversed.positions = problem.positions.colwise().reverse();
    reversed.values = problem.values.colwise().reverse();
    const NeighbourhoodPrediction b = predictLocally(reversed, targets, options);
    for (Index t = 0; t < 3; ++t) {
        EXPECT_NEAR(a.prediction.estimate(t, 0), b.prediction.estimate(t, 0), 1e-12);
        EXPECT_NEAR(a.prediction.variance[t], b.prediction.variance[t], 1e-12);
    }
    EXPECT_EQ(a.prediction.status[2], TargetStatus::Exact);
}

TEST(Neighbourhood, WithAllDataEqualsTheWholeSystem) {
    testing::Random random(3);
    testing::RandomProblemOptions options;
    options.coincident = false;
    for (int k = 0; k < 100; ++k) {
        const testing::RandomProblem r = testing::randomProblem(random, options);
        const KrigingSystem system(r.problem);
        const KrigingPrediction whole = system.predict(r.targets);
        NeighbourhoodOptions all;
        all.most = 1000;
        const NeighbourhoodPrediction local = predictLocally(r.problem, r.targets, all);
        EXPECT_EQ(local.systems, 1);
        for (Index t = 0; t < whole.estimate.rows(); ++t) {
            if (!(system.report().conditionEstimate < 1e6)) continue;
            EXPECT_NEAR(local.prediction.estimate(t, 0), whole.estimate(t, 0), 1e-9);
            EXPECT_NEAR(local.prediction.variance[t], whole.variance[t], 1e-9 * (1 + whole.variance[t]));
        }
    }
}

TEST(Neighbourhood, WithoutDataIsTheKnownMeanOrInvalid) {
    KrigingProblem problem;
    problem.model = {0, {{StructureType::Exponential, 2, 1, 1}}};
    problem.positions = MatrixXd::Zero(1, 2);
    problem.values = MatrixXd::Ones(1, 1);
    KrigingTargets far;
    far.points = Eigen::RowVector2d(10, 0);
    NeighbourhoodOptions options;
    options.radius = 5;
    EXPECT_EQ(predictLocally(problem, far, options).prediction.status[0], TargetStatus::InvalidTarget);
    problem.drift.polynomial = DriftPolynomial::None;
    problem.drift.mean = Eigen::RowVectorXd::Constant(1, 3);
    const KrigingPrediction mean = predictLocally(problem, far, options).prediction;
    EXPECT_EQ(mean.estimate(0, 0), 3);
    EXPECT_EQ(mean.variance[0], 2);
}

}  // namespace
}  // namespace vlx
