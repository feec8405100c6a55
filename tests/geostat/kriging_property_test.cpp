#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <cmath>
#include <numeric>

#include "random_problem.h"
#include "variolux/geostat/kriging.h"

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::Random;
using testing::randomProblem;
using testing::RandomProblem;
using testing::RandomProblemOptions;

#ifdef VARIOLUX_SANITIZED
constexpr int kSystems = 150;
#else
constexpr int kSystems = 3000;
#endif

constexpr double kWellConditioned = 1e6;

KrigingPrediction predict(const KrigingProblem& problem, const KrigingTargets& targets,
                          KrigingQuantity quantity = KrigingQuantity::Field) {
    KrigingPredictOptions options;
    options.weights = true;
    options.quantity = quantity;
    return KrigingSystem(problem).predict(targets, options);
}

/// The size of variances in a problem: sills (at unit distance for unbounded structures) and nugget.
double varianceSize(const KrigingProblem& problem) {
    double size = problem.model.nugget;
    for (const VariogramStructure& s : problem.model.structures)
        size += s.type == StructureType::Linear ? s.sill * std::max(1.0, 1 / s.range) : s.sill;
    return size;
}

double weightSize(const KrigingPrediction& p, Index t) {
    return std::max(1.0, p.weights.row(t).cwiseAbs().sum());
}

/// Runs `check(random problem, its system)` on well-conditioned random systems of every kind.
template <class Check>
void forEachSystem(std::uint64_t seed, const RandomProblemOptions& options, const Check& check) {
    Random random(seed);
    int checked = 0;
    for (int k = 0; k < kSystems && !::testing::Test::HasFailure(); ++k) {
        const RandomProblem r = randomProblem(random, options);
        const KrigingSystem system(r.problem);
        ASSERT_TRUE(system.report().ok()) << system.report().message;
        if (!(system.report().conditionEstimate < kWellConditioned)) continue;
        SCOPED_TRACE("system " + std::to_string(k));
        check(r, system);
        ++checked;
    }
    EXPECT_GT(checked, kSystems / 2);
}

/// Compares targets that both can estimate; S and V as in testdata/hard/README.md.
void expectSame(const RandomProblem& r, const KrigingPrediction& a, const KrigingPrediction& b, double factor,
                double offset, double varianceFactor, double tolerance = 1e-9) {
    const double range = r.problem.values.maxCoeff() - r.problem.values.minCoeff() + 1;
    for (Index t = 0; t < a.estimate.rows(); ++t) {
        if (a.status[static_cast<std::size_t>(t)] == TargetStatus::NotEstimable) continue;
        const double size = weightSize(a, t);
        for (Index c = 0; c < a.estimate.cols(); ++c)
            EXPECT_NEAR(b.estimate(t, c), factor * a.estimate(t, c) + offset,
                        tolerance * range * size * std::abs(factor));
        EXPECT_NEAR(b.variance[t], varianceFactor * a.variance[t],
                    tolerance * varianceSize(r.problem) * varianceFactor * size * size);
    }
}

/// The same system as the textbook writes it: the bordered matrix, semivariances (or covariances with a known
/// mean), full pivoting, extended precision.
KrigingPrediction textbook(const RandomProblem& r) {
    using Matrix = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
    const KrigingProblem& p = r.problem;
    const Index n = p.positions.rows(), d = p.positions.cols(), m = r.targets.points.rows();
    const auto driftRow = [&](const Eigen::RowVectorXd& x, const Eigen::RowVectorXd& external) {
        std::vector<long double> f;
        if (p.drift.polynomial != DriftPolynomial::None) f.push_back(1);
        if (p.drift.polynomial >= DriftPolynomial::Linear)
            for (Index j = 0; j < d; ++j) f.push_back(x[j]);
        if (p.drift.polynomial == DriftPolynomial::Quadratic)
            for (Index a = 0; a < d; ++a)
                for (Index b = a; b < d; ++b) f.push_back(static_cast<long double>(x[a]) * x[b]);
        for (const double e : external) f.push_back(e);
        return f;
    };
    const auto externalOf = [](const MatrixXd& all, Index i) {
        return all.size() > 0 ? Eigen::RowVectorXd(all.row(i)) : Eigen::RowVectorXd();
    };
    const auto columns =
        static_cast<Index>(driftRow(p.positions.row(0), externalOf(p.drift.external, 0)).size());
    const bool known = columns == 0;
    const auto entry = [&](double h) {  // with zero lag counted as the same point
        return static_cast<long double>(known ? covariance(p.model, h) : -semivariance(p.model, h));
    };
    Matrix k = Matrix::Zero(n + columns, n + columns);
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) k(i, j) = entry((p.positions.row(i) - p.positions.row(j)).norm());
        if (p.errorVariances.size() > 0) k(i, i) += p.errorVariances[i];
        const auto f = driftRow(p.positions.row(i), externalOf(p.drift.external, i));
        for (Index j = 0; j < columns; ++j) k(i, n + j) = k(n + j, i) = f[static_cast<std::size_t>(j)];
    }
    const Eigen::FullPivLU<Matrix> lu(k);
    KrigingPrediction out;
    out.estimate.resize(m, p.values.cols());
    out.variance.resize(m);
    out.weights.resize(m, n);
    out.status.assign(static_cast<std::size_t>(m), TargetStatus::Ok);
    for (Index t = 0; t < m; ++t) {
        Matrix right(n + columns, 1);
        for (Index i = 0; i < n; ++i)
            right(i, 0) = entry((p.positions.row(i) - r.targets.points.row(t)).norm());
        const auto f = driftRow(r.targets.points.row(t), externalOf(r.targets.externalDrift, t));
        for (Index j = 0; j < columns; ++j) right(n + j, 0) = f[static_cast<std::size_t>(j)];
        const Matrix solution = lu.solve(right);
        const Eigen::RowVectorXd w = solution.topRows(n).transpose().cast<double>();
        out.weights.row(t) = w;
        Eigen::RowVectorXd mean = Eigen::RowVectorXd::Zero(p.values.cols());
        if (known) mean = p.drift.mean;
        out.estimate.row(t) = mean + w * (p.values.rowwise() - mean);
        out.variance[t] = static_cast<double>(entry(0) - (solution.transpose() * right)(0, 0));
    }
    return out;
}

TEST(KrigingProperty, EqualsTheBorderedSystemInExtendedPrecision) {
    RandomProblemOptions options;
    options.coincident = false;
    options.mostData = 25;
    forEachSystem(1, options, [&](const RandomProblem& r, const KrigingSystem& system) {
        if (system.report().droppedDrift > 0) return;
        const KrigingPrediction a = predict(r.problem, r.targets);
        expectSame(r, a, textbook(r), 1, 0, 1, 1e-8);
    });
}

TEST(KrigingProperty, DoesNotDependOnTheOrderOfData) {
    Random random(100);
    forEachSystem(2, {}, [&](const RandomProblem& r, const KrigingSystem&) {
        std::vector<Index> order(static_cast<std::size_t>(r.problem.positions.rows()));
        std::iota(order.begin(), order.end(), Index{0});
        for (std::size_t i = order.size(); i > 1; --i)
            std::swap(order[i - 1], order[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
        KrigingProblem p = r.problem;
        p.positions = r.problem.positions(order, Eigen::all);
        p.values = r.problem.values(order, Eigen::all);
        if (p.errorVariances.size() > 0) p.errorVariances = r.problem.errorVariances(order);
        if (p.drift.external.size() > 0) p.drift.external = r.problem.drift.external(order, Eigen::all);
        expectSame(r, predict(r.problem, r.targets), predict(p, r.targets), 1, 0, 1);
    });
}

TEST(KrigingProperty, MovesWithTheCoordinates) {
    // The shift is exact for the coordinates' upper bits only: near-coincident data are left out.
    forEachSystem(3, {}, [&](const RandomProblem& r, const KrigingSystem&) {
        KrigingProblem p = r.problem;
        KrigingTargets t = r.targets;
        // Coordinates on a grid of 2^-30: adding 2^10 is exact.
        const auto grid = [](double x) { return std::round(x * 0x1p30) * 0x1p-30; };
        p.positions = p.positions.unaryExpr(grid);
        t.points = t.points.unaryExpr(grid);
        const KrigingPrediction a = predict(p, t);
        p.positions.array() += 1024;
        t.points.array() += 1024;
        expectSame(r, a, predict(p, t), 1, 0, 1);
    });
}

TEST(KrigingProperty, ScalesWithCoordinatesModelAndValues) {
    forEachSystem(4, {}, [&](const RandomProblem& r, const KrigingSystem&) {
        const KrigingPrediction a = predict(r.problem, r.targets);
        KrigingProblem p = r.problem;
        KrigingTargets t = r.targets;
        p.positions *= 3;
        t.points *= 3;
        for (VariogramStructure& s : p.model.structures) s.range *= 3;
        expectSame(r, a, predict(p, t), 1, 0, 1);

        p = r.problem;
        p.model.nugget *= 5;
        for (VariogramStructure& s : p.model.structures) s.sill *= 5;
        p.errorVariances *= 5;
        expectSame(r, a, predict(p, r.targets), 1, 0, 5);

        p = r.problem;
        p.values = -3 * r.problem.values.array() + 7;
        p.drift.mean = -3 * r.problem.drift.mean.array() + 7;
        expectSame(r, a, predict(p, r.targets), -3, 7, 1);
    });
}

TEST(KrigingProperty, DoesNotDependOnRotation) {
    forEachSystem(5, {}, [&](const RandomProblem& r, const KrigingSystem&) {
        if (r.problem.positions.cols() < 2) return;
        KrigingProblem p = r.problem;
        KrigingTargets t = r.targets;
        const double c = std::cos(0.7), s = std::sin(0.7);
        const auto rotate = [&](MatrixXd& x) {
            for (Index i = 0; i < x.rows(); ++i) {
                const double u = x(i, 0), v = x(i, 1);
                x(i, 0) = c * u - s * v;
                x(i, 1) = s * u + c * v;
            }
        };
        rotate(p.positions);
        rotate(t.points);
        expectSame(r, predict(r.problem, r.targets), predict(p, t), 1, 0, 1);
    });
}

TEST(KrigingProperty, WeightsReproduceTheDriftAndErrorFreeData) {
    forEachSystem(6, {}, [&](const RandomProblem& r, const KrigingSystem&) {
        const KrigingPrediction a = predict(r.problem, r.targets);
        const DriftModel& drift = r.problem.drift;
        for (Index t = 0; t < a.estimate.rows(); ++t) {
            const auto status = a.status[static_cast<std::size_t>(t)];
            ASSERT_GE(a.variance[t], 0);
            if (status == TargetStatus::NotEstimable) continue;
            const Eigen::RowVectorXd w = a.weights.row(t);
            if (drift.polynomial != DriftPolynomial::None) {
                EXPECT_NEAR(w.sum(), 1, 1e-10 * weightSize(a, t));
            }
            if (drift.polynomial >= DriftPolynomial::Linear) {
                for (Index j = 0; j < r.problem.positions.cols(); ++j)
                    EXPECT_NEAR(w.dot(r.problem.positions.col(j)), r.targets.points(t, j),
                                1e-10 * weightSize(a, t));
            }
            for (Index k = 0; k < drift.external.cols(); ++k)
                EXPECT_NEAR(w.dot(drift.external.col(k)), r.targets.externalDrift(t, k),
                            1e-10 * weightSize(a, t));
            if (status == TargetStatus::Exact) {
                EXPECT_EQ(a.variance[t], 0);
            }
        }
        EXPECT_GE(a.lowestVariance, -1e-11 * varianceSize(r.problem));
    });
}

TEST(KrigingProperty, LeaveOneOutEqualsLeavingOneOut) {
    RandomProblemOptions options;
    options.fewestData = 2;
    options.mostData = 14;
    int compared = 0;
    forEachSystem(7, options, [&](const RandomProblem& r, const KrigingSystem& system) {
        const Index n = r.problem.positions.rows();
        const LeaveOneOut loo = system.leaveOneOut();
        for (Index i = 0; i < n; ++i) {
            std::vector<Index> others;
            for (Index j = 0; j < n; ++j)
                if (j != i) others.push_back(j);
            KrigingProblem p = r.problem;
            p.positions = r.problem.positions(others, Eigen::all);
            p.values = r.problem.values(others, Eigen::all);
            if (p.errorVariances.size() > 0) p.errorVariances = r.problem.errorVariances(others);
            KrigingTargets t;
            t.points = r.problem.positions.row(i);
            if (p.drift.external.size() > 0) {
                p.drift.external = r.problem.drift.external(others, Eigen::all);
                t.externalDrift = r.problem.drift.external.row(i);
            }
            const KrigingSystem without(p);
            if (!without.report().ok() || without.report().droppedDrift > 0 ||
                !(without.report().conditionEstimate < kWellConditioned))
                continue;
            const KrigingPrediction wanted = predict(p, t);
            ASSERT_EQ(loo.status[static_cast<std::size_t>(i)], TargetStatus::Ok);
            const double error = r.problem.errorVariances.size() > 0 ? r.problem.errorVariances[i] : 0;
            const double size = weightSize(wanted, 0);
            EXPECT_NEAR(loo.estimate(i, 0), wanted.estimate(0, 0), 1e-8 * size * 5);
            EXPECT_NEAR(loo.estimate(i, 1), wanted.estimate(0, 1), 1e-8 * size * 5);
            EXPECT_NEAR(loo.variance[i], wanted.variance[0] + error,
                        1e-8 * size * size * (varianceSize(r.problem) + error));
            ++compared;
        }
    });
    EXPECT_GT(compared, kSystems);
}

TEST(KrigingProperty, BlocksAreAveragesOfPoints) {
    RandomProblemOptions options;
    options.coincident = false;
    forEachSystem(8, options, [&](const RandomProblem& r, const KrigingSystem& system) {
        if (r.problem.drift.external.size() > 0) return;
        const Index m = r.targets.points.rows();
        KrigingTargets blocks = r.targets;
        blocks.begin = {0, m};
        blocks.weights = VectorXd::LinSpaced(m, 1, 2);
        // One-point blocks: the field without its nugget.
        KrigingTargets points = r.targets;
        for (Index t = 0; t <= m; ++t) points.begin.push_back(t);
        const KrigingPrediction b = system.predict(blocks), p = system.predict(points);
        const double sum = blocks.weights.sum();
        if (r.problem.drift.polynomial != DriftPolynomial::None) {
            // With weights that sum to 1 the variance is that of an increment:
            // 2 sum w gamma(x_i, B) - w'Gamma w - gamma(B, B) + errors, whatever form the solver used.
            KrigingPredictOptions weights;
            weights.weights = true;
            const VectorXd w = system.predict(blocks, weights).weights.row(0).transpose();
            VariogramModel structures = r.problem.model;
            structures.nugget = 0;
            const MatrixXd& x = r.problem.positions;
            const MatrixXd& y = r.targets.points;
            const VectorXd share = blocks.weights / sum;
            const auto mean = [&](const MatrixXd& from, const VectorXd& wFrom, const MatrixXd& to,
                                  const VectorXd& wTo) {
                double total = 0;
                for (Index i = 0; i < from.rows(); ++i)
                    for (Index j = 0; j < to.rows(); ++j)
                        total +=
                            wFrom[i] * wTo[j] * semivariance(structures, (from.row(i) - to.row(j)).norm());
                return total;
            };
            double variance = 2 * mean(x, w, y, share) - mean(x, w, x, w) - mean(y, share, y, share) +
                              r.problem.model.nugget * w.squaredNorm();
            if (r.problem.errorVariances.size() > 0) variance += w.cwiseAbs2().dot(r.problem.errorVariances);
            const double size = std::max(1.0, w.cwiseAbs().sum());
            EXPECT_NEAR(b.variance[0], variance, 1e-9 * size * size * varianceSize(r.problem));
        }
        EXPECT_NEAR(b.estimate(0, 0), blocks.weights.dot(p.estimate.col(0)) / sum, 1e-8 * 10);
        // The standard deviation of a mean is at most the mean standard deviation.
        EXPECT_LE(std::sqrt(b.variance[0]), blocks.weights.dot(p.variance.cwiseSqrt()) / sum +
                                                1e-6 * std::sqrt(varianceSize(r.problem)));
    });
}

TEST(KrigingProperty, ColumnsShareOneFactorisation) {
    forEachSystem(9, {}, [&](const RandomProblem& r, const KrigingSystem& system) {
        KrigingProblem one = r.problem;
        one.values = r.problem.values.col(1);
        if (one.drift.mean.size() > 0) one.drift.mean = r.problem.drift.mean.tail(1);
        const KrigingPrediction a = system.predict(r.targets), b = KrigingSystem(one).predict(r.targets);
        for (Index t = 0; t < a.estimate.rows(); ++t) {
            EXPECT_NEAR(a.estimate(t, 1), b.estimate(t, 0), 1e-12 * (1 + std::abs(a.estimate(t, 1))));
            EXPECT_EQ(a.variance[t], b.variance[t]);
        }
    });
}

TEST(KrigingProperty, DriftCoefficientsEqualTheDriftAtTargets) {
    RandomProblemOptions options;
    forEachSystem(10, options, [&](const RandomProblem& r, const KrigingSystem& system) {
        const DriftModel& drift = r.problem.drift;
        if (drift.polynomial == DriftPolynomial::None || drift.polynomial == DriftPolynomial::Quadratic ||
            !r.problem.model.bounded() || system.report().droppedDrift > 0)
            return;
        const KrigingPrediction p = predict(r.problem, r.targets, KrigingQuantity::Drift);
        const DriftEstimate d = system.drift();
        for (Index t = 0; t < p.estimate.rows(); ++t) {
            VectorXd f = VectorXd::Zero(d.coefficients.rows());
            f[0] = 1;
            if (drift.polynomial == DriftPolynomial::Linear)
                f.segment(1, r.problem.positions.cols()) =
                    r.targets.points.row(t).transpose() - system.driftOrigin();
            if (drift.external.cols() > 0)
                f.tail(drift.external.cols()) = r.targets.externalDrift.row(t).transpose();
            const double size = weightSize(p, t);
            EXPECT_NEAR(p.estimate(t, 0), f.dot(d.coefficients.col(0)), 1e-8 * size);
            EXPECT_NEAR(p.variance[t], f.dot(d.covariance * f), 1e-8 * size * size * varianceSize(r.problem));
        }
    });
}

TEST(KrigingProperty, SinglePrecisionEqualsDouble) {
    int single = 0;
    forEachSystem(12, {}, [&](const RandomProblem& r, const KrigingSystem&) {
        KrigingProblem p = r.problem;
        p.precision = KrigingPrecision::Single;
        single += KrigingSystem(p).report().singlePrecision ? 1 : 0;
        expectSame(r, predict(r.problem, r.targets), predict(p, r.targets), 1, 0, 1, 1e-10);
    });
    EXPECT_GT(single, kSystems / 2);
}

/// What the cells of a block have of their own is known where each has an exact datum: their mean is it.
TEST(KrigingProperty, BlocksOfCellsShareTheNuggetOfTheirData) {
    KrigingProblem problem;
    problem.model = {.nugget = 0.5, .structures = {{StructureType::Exponential, 1, 2, 1}}};
    problem.positions.resize(6, 3);  // a place, and a feature that is no place
    problem.positions << 0, 0, 0.1, 1, 0, 0.2, 0, 1, 0.3, 1, 1, 0.1, 3, 0, 0, 3, 1, 0.4;
    problem.values.resize(6, 1);
    problem.values << 2, 3, 5, 7, -11, 13;
    KrigingTargets block;
    block.points = problem.positions.topRows(4);
    block.begin = {0, 4};
    for (const double tolerance : {1e-9, 0.0}) {  // 0: solved with more digits too
        problem.accuracy.tolerance = tolerance;
        const KrigingSystem system(problem);
        block.cellAxes = 0;
        const KrigingPrediction smooth = system.predict(block);
        EXPECT_GT(std::abs(smooth.estimate(0, 0) - 4.25), 0.01);
        EXPECT_GT(smooth.variance[0], 0.05);
        block.cellAxes = 2;
        const KrigingPrediction cells = system.predict(block);
        EXPECT_NEAR(cells.estimate(0, 0), 4.25, 1e-12);
        EXPECT_NEAR(cells.variance[0], 0, 1e-12);
        EXPECT_EQ(cells.moreDigits, tolerance > 0 ? 0 : 1);
        // A cell without a datum has a nugget that nobody knows.
        KrigingTargets wide = block;
        wide.points.conservativeResize(5, 3);
        wide.points.row(4) << 0.5, 0.25, 0.2;
        wide.begin = {0, 5};
        const double without = 0.5 / 25;
        wide.cellAxes = 2;
        EXPECT_GT(system.predict(wide).variance[0], without);
        // The feature is no place: the same cells, unlike in it, share the nugget still.
        wide = block;
        wide.points.col(2).setConstant(0.15);
        EXPECT_LT(system.predict(wide).variance[0], smooth.variance[0]);
    }
    block.cellAxes = 4;
    EXPECT_EQ(KrigingSystem(problem).predict(block).status[0], TargetStatus::InvalidTarget);
}

/// Simulates fields with the model's covariance, adds errors of the stated variances, kriges them, and
/// compares the mean squared error with the kriging variance: N MSE / variance is chi-squared with N degrees
/// of freedom. All columns share one factorisation, so that many replicates cost little.
TEST(KrigingProperty, VarianceIsTheMeanSquaredErrorOfSimulations) {
#ifdef VARIOLUX_SANITIZED
    constexpr int kFields = 20, kReplicates = 500;
#else
    constexpr int kFields = 150, kReplicates = 4000;
#endif
    Random random(11);
    RandomProblemOptions options;
    options.unbounded = false;
    options.fewestData = 4;
    options.mostData = 30;
    int checks = 0;
    double sum = 0, sumSquares = 0;
    for (int field = 0; field < kFields; ++field) {
        RandomProblem r = randomProblem(random, options);
        const Index n = r.problem.positions.rows(), m = r.targets.points.rows(), all = n + m;
        MatrixXd x(all, r.problem.positions.cols());
        x << r.problem.positions, r.targets.points;
        MatrixXd c(all, all);
        for (Index i = 0; i < all; ++i)
            for (Index j = 0; j < all; ++j) {
                c(i, j) = covariance(r.problem.model, (x.row(i) - x.row(j)).norm());
            }
        // Coincident points make it singular: a tiny independent part that no check can see.
        c.diagonal().array() += 1e-12 * c(0, 0);
        const Eigen::LLT<MatrixXd> llt(c);
        if (llt.info() != Eigen::Success) continue;
        MatrixXd noise(all, kReplicates);
        for (Index i = 0; i < noise.size(); ++i) noise.data()[i] = random.normal();
        MatrixXd z = llt.matrixL() * noise;
        // A drift that the kriging must not see: a constant, and for linear drift a slope.
        const bool known = r.problem.drift.polynomial == DriftPolynomial::None;
        if (!known) z.array() += 12.5;
        if (r.problem.drift.polynomial >= DriftPolynomial::Linear) z.colwise() += 3 * x.col(0);
        if (known) r.problem.drift.mean = Eigen::RowVectorXd::Zero(kReplicates);
        r.problem.values = z.topRows(n);
        for (Index i = 0; i < n && r.problem.errorVariances.size() > 0; ++i)
            for (Index k = 0; k < kReplicates; ++k)
                r.problem.values(i, k) += std::sqrt(r.problem.errorVariances[i]) * random.normal();
        const KrigingSystem system(r.problem);
        if (!(system.report().conditionEstimate < 1e8)) continue;
        const KrigingPrediction p = system.predict(r.targets);
        for (Index t = 0; t < m; ++t) {
            if (p.status[static_cast<std::size_t>(t)] != TargetStatus::Ok) continue;
            if (p.variance[t] < 1e-6 * varianceSize(r.problem)) continue;
            const double chiSquared = (p.estimate.row(t) - z.row(n + t)).squaredNorm() / p.variance[t];
            const double score = (chiSquared - kReplicates) / std::sqrt(2.0 * kReplicates);
            // 6 sigma: below 1e-8 a check (chi-squared is close to normal here).
            EXPECT_LT(std::abs(score), 6) << "field " << field << " target " << t;
            sum += score;
            sumSquares += score * score;
            ++checks;
        }
    }
    ASSERT_GT(checks, kFields);
    // Together: the scores' mean and mean square, correlated within a field (4 targets): bounds of 6 sigma
    // for one independent score a field.
    const double fields = static_cast<double>(checks) / 4;
    EXPECT_LT(std::abs(sum / checks), 6 / std::sqrt(fields));
    EXPECT_LT(std::abs(sumSquares / checks - 1), 6 * std::sqrt(2 / fields));
}

}  // namespace
}  // namespace vlx
