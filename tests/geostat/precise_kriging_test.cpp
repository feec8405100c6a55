#include <gtest/gtest.h>

#include <cmath>

#include "exact_kriging.h"
#include "random_problem.h"

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::exactDrift;
using testing::ExactKriging;
using testing::exactKriging;
using testing::leftOut;
using testing::Random;
using testing::randomProblem;
using testing::RandomProblem;
using testing::RandomProblemOptions;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

#ifdef VARIOLUX_SANITIZED
constexpr int kSystems = 10;
#else
constexpr int kSystems = 150;
#endif

struct Hard {
    std::string name;
    KrigingProblem problem;
    KrigingTargets targets;
};

VariogramStructure structure(StructureType type, double range, double shape = 1, double sill = 1) {
    return {type, sill, range, shape};
}

MatrixXd lattice(Index side) {
    MatrixXd x(side * side, 2);
    for (Index i = 0; i < x.rows(); ++i)
        x.row(i) << (static_cast<double>(i / side) + 0.5) / static_cast<double>(side),
            (static_cast<double>(i % side) + 0.5) / static_cast<double>(side);
    return x;
}

/// Near and far targets of a smooth field.
Hard make(const std::string& name, const MatrixXd& positions, const VariogramStructure& s,
          DriftPolynomial drift) {
    Hard out{name, {}, {}};
    out.problem.model.structures = {s};
    out.problem.positions = positions;
    out.problem.drift.polynomial = drift;
    if (drift == DriftPolynomial::None) out.problem.drift.mean = Eigen::RowVector2d(0.25, -1);
    out.problem.values.resize(positions.rows(), 2);
    for (Index i = 0; i < positions.rows(); ++i) {
        const double x = positions(i, 0), y = positions.cols() > 1 ? positions(i, 1) : 0;
        out.problem.values.row(i) << 1 + std::sin(3 * x) * std::cos(2 * y) - y, 1e3 + x * x;
    }
    out.targets.points.resize(4, positions.cols());
    out.targets.points.setConstant(0.31);
    out.targets.points.row(1).setConstant(0.97);
    out.targets.points.row(2).setConstant(2.5);
    out.targets.points.row(3).setConstant(40);
    return out;
}

/// Other lattices, ranges, models, drifts and supports than testdata/hard has.
std::vector<Hard> hardSystems() {
    using enum StructureType;
    constexpr auto None = DriftPolynomial::None, Constant = DriftPolynomial::Constant;
    constexpr auto Plane = DriftPolynomial::Linear, Quadratic = DriftPolynomial::Quadratic;
    Random random(7);
    const MatrixXd scattered = MatrixXd::NullaryExpr(24, 2, [&] { return random.uniform(); });
    const MatrixXd line = VectorXd::LinSpaced(17, 0, 1);
    std::vector<Hard> all = {
        make("lattice 5, range 20", lattice(5), structure(Gaussian, 20), Constant),
        make("lattice 6, range 3, plane", lattice(6), structure(Gaussian, 3), Plane),
        make("lattice 5, quadratic", lattice(5), structure(Gaussian, 2), Quadratic),
        make("line, range 5", line, structure(Gaussian, 5), Constant),
        make("line, known mean", line, structure(Gaussian, 9), None),
        make("scattered, known mean", scattered, structure(Gaussian, 4), None),
        make("stable 1.999", scattered, structure(Stable, 6, 1.999), Plane),
        make("stable 1.9", scattered, structure(Stable, 1e4, 1.9), Constant),
        make("Matern 7/2", scattered, structure(Matern, 300, 3.5), Plane),
        make("Matern 5/2", scattered, structure(Matern, 1e5, 2.5), Constant),
        make("exponential, range 1e9", scattered, structure(Exponential, 1e9), Quadratic)};
    Hard nested = make("nested", scattered, structure(Gaussian, 8), Plane);
    nested.problem.model.structures.push_back(structure(Spherical, 0.4, 1, 1e-13));
    all.push_back(nested);
    Hard anisotropic = make("anisotropic", scattered, structure(Gaussian, 3), Constant);
    anisotropic.problem.transform = anisotropyTransform({0.6, 0.05});
    all.push_back(anisotropic);
    for (const double error : {1e-10, 1e-16, 1e-25}) {
        Hard tiny = make("errors " + std::to_string(error), lattice(5), structure(Gaussian, 1.3), Plane);
        tiny.problem.errorVariances = VectorXd::LinSpaced(25, error, 3 * error);
        all.push_back(tiny);
        // Twins with errors, which are merged.
        tiny.problem.positions.row(3) = tiny.problem.positions.row(17);
        tiny.problem.positions.row(4) = tiny.problem.positions.row(17);
        tiny.name += ", coincident";
        all.push_back(tiny);
    }
    for (const DriftPolynomial drift : {None, Constant, Plane}) {
        Hard block = make("blocks", scattered, structure(Gaussian, 3), drift);
        block.targets.begin = {0, 2, 4};
        block.targets.weights = VectorXd::LinSpaced(4, 1, 3);
        all.push_back(block);
    }
    Hard near = make("nearly coincident", scattered, structure(Exponential, 1), Constant);
    near.problem.positions.row(5) = near.problem.positions.row(6).array() + 1e-14;
    near.problem.positions.row(7) = near.problem.positions.row(8).array() - 1e-12;
    all.push_back(near);
    Hard linear = make("unbounded", scattered, structure(Linear, 1), Plane);
    linear.problem.positions.row(5) = linear.problem.positions.row(6).array() + 1e-13;
    all.push_back(linear);
    Hard external = make("external", scattered, structure(Gaussian, 5), Constant);
    external.problem.drift.external = scattered.col(0).array().sin();
    external.targets.externalDrift = external.targets.points.col(0).array().sin();
    all.push_back(external);
#ifdef VARIOLUX_SANITIZED
    std::vector<Hard> few;
    for (std::size_t k = 1; k < all.size(); k += 8) few.push_back(all[k]);
    return few;
#else
    return all;
#endif
}

/// Within 1e-8 of the answer's own size, or of the data's.
void expectNear(double found, double wanted, double scale) {
    EXPECT_NEAR(found, wanted, 1e-8 * std::max(scale, std::abs(wanted)));
}

TEST(PreciseKriging, HardSystemsEqualTheTextbookIn400Digits) {
    const std::vector<Hard> systems = hardSystems();
    std::size_t moreDigits = 0;
    for (const Hard& hard : systems) {
        SCOPED_TRACE(hard.name);
        const ExactKriging exact = exactKriging(hard.problem, hard.targets);
        const KrigingSystem system(hard.problem);
        const KrigingPrediction p = system.predict(hard.targets);
        moreDigits += p.moreDigits > 0 ? 1 : 0;
        const auto check = [&](const KrigingPrediction& found) {
            for (Index t = 0; t < exact.variance.size(); ++t) {
                EXPECT_EQ(found.status[static_cast<std::size_t>(t)], TargetStatus::Ok);
                for (Index c = 0; c < 2; ++c) expectNear(found.estimate(t, c), exact.estimate(t, c), 1);
                expectNear(found.variance[t], exact.variance[t], 1);
            }
        };
        check(p);
        KrigingProblem single = hard.problem;
        single.precision = KrigingPrecision::Single;
        check(KrigingSystem(single).predict(hard.targets));
    }
    EXPECT_GT(moreDigits, systems.size() / 2);
}

TEST(PreciseKriging, DriftOfHardSystemsEqualsTheTextbook) {
    for (const Hard& hard : hardSystems()) {
        if (hard.problem.drift.polynomial == DriftPolynomial::None || !hard.problem.model.bounded()) continue;
        SCOPED_TRACE(hard.name);
        const KrigingSystem system(hard.problem);
        const ExactKriging exact = exactDrift(hard.problem, system.driftOrigin());
        const DriftEstimate drift = system.drift();
        EXPECT_TRUE(drift.accurate);
        for (Index j = 0; j < exact.variance.size(); ++j) {
            expectNear(drift.covariance(j, j), exact.variance[j], 1);
            for (Index c = 0; c < 2; ++c) expectNear(drift.coefficients(j, c), exact.estimate(j, c), 1);
        }
    }
}

TEST(PreciseKriging, LeaveOneOutOfHardSystemsEqualsTheTextbook) {
    for (const Hard& hard : hardSystems()) {
        SCOPED_TRACE(hard.name);
        const LeaveOneOut left = KrigingSystem(hard.problem).leaveOneOut();
        for (Index i = 0; i < hard.problem.positions.rows(); i += 14) {
            const auto [others, target] = leftOut(hard.problem, i);
            const ExactKriging exact = exactKriging(others, target);
            const double error = others.errorVariances.size() > 0 ? hard.problem.errorVariances[i] : 0;
            EXPECT_EQ(left.status[static_cast<std::size_t>(i)], TargetStatus::Ok);
            expectNear(left.variance[i], exact.variance[0] + error, 1);
            for (Index c = 0; c < 2; ++c) expectNear(left.estimate(i, c), exact.estimate(0, c), 1);
        }
    }
}

TEST(PreciseKriging, WhoCannotAffordItGetsABoundAndNoCleanStatus) {
    const std::vector<Hard> systems = hardSystems();
    std::size_t flagged = 0;
    for (Hard hard : systems) {
        SCOPED_TRACE(hard.name);
        const ExactKriging exact = exactKriging(hard.problem, hard.targets);
        hard.problem.accuracy.mostDigits = 16;
        const KrigingPrediction p = KrigingSystem(hard.problem).predict(hard.targets);
        EXPECT_EQ(p.moreDigits, 0);
        for (Index t = 0; t < exact.variance.size(); ++t) {
            flagged += p.status[static_cast<std::size_t>(t)] == TargetStatus::Inaccurate ? 1 : 0;
            EXPECT_LE(std::abs(p.variance[t] - exact.variance[t]), p.varianceError[t]);
            for (Index c = 0; c < 2; ++c)
                EXPECT_LE(std::abs(p.estimate(t, c) - exact.estimate(t, c)), p.estimateError(t, c));
        }
    }
    EXPECT_GT(flagged, systems.size());
}

/// The bounds against the truth, for random systems of every kind and of any condition.
void expectHonest(bool hard) {
    Random random(hard ? 21 : 20);
    RandomProblemOptions options;
    options.fewestData = 3;
    options.mostData = 14;
    options.hard = hard;
    options.coincident = false;
    for (int k = 0; k < kSystems && !::testing::Test::HasFailure(); ++k) {
        RandomProblem r = randomProblem(random, options);
        SCOPED_TRACE("system " + std::to_string(k));
        r.targets.points.row(0).array() += 10;
        if (KrigingSystem(r.problem).report().merged > 0) continue;  // the reference cannot
        const ExactKriging exact = exactKriging(r.problem, r.targets);
        for (const int digits : {16, 400}) {
            r.problem.accuracy.mostDigits = digits;
            const KrigingSystem system(r.problem);
            if (system.report().droppedDrift > 0) continue;
            const KrigingPrediction p = system.predict(r.targets);
            for (Index t = 0; t < exact.variance.size(); ++t) {
                if (p.status[static_cast<std::size_t>(t)] == TargetStatus::NotEstimable) continue;
                if (digits == 400) {
                    EXPECT_NE(p.status[static_cast<std::size_t>(t)], TargetStatus::Inaccurate);
                }
                EXPECT_LE(std::abs(p.variance[t] - exact.variance[t]), p.varianceError[t]);
                for (Index c = 0; c < 2; ++c)
                    EXPECT_LE(std::abs(p.estimate(t, c) - exact.estimate(t, c)), p.estimateError(t, c));
            }
        }
    }
}

TEST(PreciseKriging, BoundsHoldForRandomSystems) { expectHonest(false); }
TEST(PreciseKriging, BoundsHoldForRandomHardSystems) { expectHonest(true); }

TEST(PreciseKriging, ACovarianceOfTheCallersOwnIsFlagged) {
    const Hard hard = make("", lattice(6), structure(StructureType::Gaussian, 3), DriftPolynomial::Constant);
    const MatrixXd& x = hard.problem.positions;
    CovarianceProblem problem;
    problem.covariance = MatrixXd::NullaryExpr(36, 36, [&](Index i, Index j) {
        return covariance(hard.problem.model, (x.row(i) - x.row(j)).norm());
    });
    problem.drift = MatrixXd::Ones(36, 1);
    problem.values = hard.problem.values;
    CovarianceTargets target;
    target.covariance =
        VectorXd::NullaryExpr(36, [&](Index i) { return covariance(hard.problem.model, x.row(i).norm()); });
    target.drift = MatrixXd::Ones(1, 1);
    target.variance = VectorXd::Ones(1);
    const CovarianceSystem system(problem);
    EXPECT_EQ(system.predict(target).status[0], TargetStatus::Inaccurate);
    EXPECT_FALSE(system.drift().accurate);
    EXPECT_EQ(system.leaveOneOut().status[0], TargetStatus::Inaccurate);
}

TEST(PreciseKriging, LargeSystemsStayInDoublePrecision) {
    Hard hard = make("", lattice(6), structure(StructureType::Gaussian, 3), DriftPolynomial::Constant);
    hard.problem.accuracy.mostData = 35;
    const KrigingPrediction p = KrigingSystem(hard.problem).predict(hard.targets);
    EXPECT_EQ(p.digits, 16);
    EXPECT_EQ(p.status[3], TargetStatus::Inaccurate);
}

TEST(PreciseKriging, DataWithoutAnyVarianceAreAccurate) {
    Hard hard = make("", lattice(4), structure(StructureType::Exponential, 1, 1, 0), DriftPolynomial::Linear);
    for (const double error : {0.0, 1.0}) {
        hard.problem.errorVariances = VectorXd::Zero(16);
        hard.problem.errorVariances.head(4).setConstant(error);
        const KrigingPrediction p = KrigingSystem(hard.problem).predict(hard.targets);
        for (const TargetStatus status : p.status) EXPECT_EQ(status, TargetStatus::Ok);
        EXPECT_LT(p.variance.maxCoeff(), 1e-12);
    }
}

TEST(PreciseKriging, AnInvalidSystemAnswersInTheUsualShapes) {
    Hard hard = make("", lattice(3), structure(StructureType::Gaussian, -1), DriftPolynomial::Linear);
    const KrigingSystem system(hard.problem);
    ASSERT_FALSE(system.report().ok());
    const KrigingPrediction p = system.predict(hard.targets, {.weights = true});
    ASSERT_EQ(p.estimate.rows(), 4);
    ASSERT_EQ(p.estimate.cols(), 2);
    EXPECT_TRUE(p.estimate.array().isNaN().all());
    EXPECT_TRUE(p.variance.size() == 4 && p.variance.array().isNaN().all());
    EXPECT_TRUE(p.weights.rows() == 4 && p.weights.cols() == 9 && p.weights.array().isNaN().all());
    EXPECT_EQ(p.status[3], TargetStatus::InvalidTarget);
    const LeaveOneOut left = system.leaveOneOut();
    EXPECT_TRUE(left.estimate.rows() == 9 && left.estimate.cols() == 2 &&
                left.estimate.array().isNaN().all());
    EXPECT_TRUE(left.variance.size() == 9 && left.status.size() == 9);
    const DriftEstimate drift = system.drift();
    EXPECT_TRUE(drift.coefficients.rows() == 3 && drift.coefficients.cols() == 2);
    EXPECT_TRUE(drift.coefficients.array().isNaN().all() && drift.covariance.array().isNaN().all());
    CovarianceProblem broken;
    broken.covariance = -MatrixXd::Identity(2, 2);
    broken.drift = MatrixXd::Ones(2, 1);
    broken.values = MatrixXd::Ones(2, 1);
    EXPECT_TRUE(std::isnan(CovarianceSystem(broken).drift().coefficients(0, 0)));
}

TEST(PreciseKriging, ADatumOfInfiniteErrorVarianceIsIgnoredWhateverItsNumbers) {
    Hard hard = make("", lattice(3), structure(StructureType::Exponential, 1), DriftPolynomial::Constant);
    KrigingProblem& problem = hard.problem;
    problem.drift.external = problem.positions.col(0).array().square();
    hard.targets.externalDrift = hard.targets.points.col(0).array().square();
    problem.errorVariances = VectorXd::Zero(9);
    problem.errorVariances[4] = kInfinity;
    const KrigingPrediction wanted = KrigingSystem(problem).predict(hard.targets);
    problem.values.row(4).setConstant(kNaN);
    problem.positions.row(4) << kNaN, kInfinity;
    problem.drift.external(4, 0) = kNaN;
    const KrigingSystem system(problem);
    ASSERT_TRUE(system.report().ok()) << system.report().message;
    EXPECT_EQ(system.report().ignored, 1);
    const KrigingPrediction found = system.predict(hard.targets);
    EXPECT_EQ((found.estimate - wanted.estimate).cwiseAbs().maxCoeff(), 0);
    EXPECT_EQ((found.variance - wanted.variance).cwiseAbs().maxCoeff(), 0);
    EXPECT_EQ(system.leaveOneOut().status[4], TargetStatus::InvalidTarget);
    problem.errorVariances[4] = 1;
    EXPECT_FALSE(KrigingSystem(problem).report().ok());
}

}  // namespace
}  // namespace vlx
