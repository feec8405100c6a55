// What stability costs: time of a kriging system against n, and error against condition number, for
//   bare LLT      Eigen's Cholesky of a ready covariance matrix: no filling, no drift, no target
//   double        KrigingSystem: positions in; filling, factorisation, one target's estimate and variance out
//   float         the same with a float factor and refinement
//   pivoted LU    the bordered matrix of the textbook, by Eigen's full-pivot LU
// and what more digits cost where double precision has lost too many. Prints tables for testdata/results. All
// columns are measured in turns in one run; times are the fastest of many.
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/eigen.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <random>

#include "variolux/geostat/kriging.h"

namespace {

using namespace vlx;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

double sink = 0;  // keeps results alive

KrigingProblem makeProblem(Index n, std::mt19937_64& engine, const VariogramModel& model, double error) {
    std::uniform_real_distribution<double> uniform;
    std::normal_distribution<double> normal;
    KrigingProblem p;
    p.model = model;
    p.positions = MatrixXd::NullaryExpr(n, 2, [&] { return uniform(engine); });
    p.values = MatrixXd::NullaryExpr(n, 3, [&] { return normal(engine); });
    if (error > 0) p.errorVariances = VectorXd::Constant(n, error);
    return p;
}

KrigingTargets makeTargets() {
    KrigingTargets t;
    t.points = Eigen::RowVector2d(0.47, 0.53);
    return t;
}

MatrixXd covarianceMatrix(const KrigingProblem& p) {
    const Index n = p.positions.rows();
    MatrixXd k(n, n);
    for (Index i = 0; i < n; ++i)
        for (Index j = 0; j < n; ++j)
            k(i, j) = covariance(p.model, (p.positions.row(i) - p.positions.row(j)).norm());
    if (p.errorVariances.size() > 0) k.diagonal() += p.errorVariances;
    return k;
}

/// Estimate of the first column and variance by the bordered matrix.
Eigen::Vector2d bordered(const MatrixXd& k, const KrigingProblem& p, const KrigingTargets& t) {
    const Index n = k.rows();
    MatrixXd a = MatrixXd::Zero(n + 1, n + 1);
    a.topLeftCorner(n, n) = k;
    a.row(n).head(n).setOnes();
    a.col(n).head(n).setOnes();
    VectorXd b = VectorXd::Ones(n + 1);
    for (Index i = 0; i < n; ++i) b[i] = covariance(p.model, (p.positions.row(i) - t.points.row(0)).norm());
    const VectorXd x = Eigen::FullPivLU<MatrixXd>(a).solve(b);
    return {x.head(n).dot(p.values.col(0)), covariance(p.model, 0) - x.dot(b)};
}

/// Seconds a call, the fastest of several rounds.
class Timer {
  public:
    void round(const std::function<void()>& work, int repeats) {
        const auto begin = std::chrono::steady_clock::now();
        for (int k = 0; k < repeats; ++k) work();
        const std::chrono::duration<double> time = std::chrono::steady_clock::now() - begin;
        best_ = std::min(best_, time.count() / repeats);
    }
    double best() const { return best_; }

  private:
    double best_ = std::numeric_limits<double>::infinity();
};

void timeTable(const char* title, const VariogramModel& model) {
    std::printf("\n%s: microseconds a system (ratio to bare LLT)\n", title);
    std::printf("%5s %10s %18s %18s %18s\n", "n", "bare LLT", "double", "float", "pivoted LU");
    std::mt19937_64 engine(1);
    const KrigingTargets targets = makeTargets();
    for (const Index n : {16, 32, 64, 128, 256}) {
        const int systems = static_cast<int>(std::max<Index>(16, 1024 / n * 8));
        std::vector<KrigingProblem> problems;
        for (int k = 0; k < systems; ++k) problems.push_back(makeProblem(n, engine, model, 0.05));
        const MatrixXd k = covarianceMatrix(problems[0]);
        std::vector<KrigingProblem> single = problems;
        for (KrigingProblem& p : single) p.precision = KrigingPrecision::Single;
        Timer llt, solver, solverSingle, lu;
        const int repeats = static_cast<int>(std::max<Index>(2, 2000000 / (n * n * n)));
        for (int round = 0; round < 15; ++round) {
            llt.round([&] { sink += Eigen::LLT<MatrixXd>(k).matrixLLT()(n - 1, n - 1); }, repeats);
            std::size_t at = 0;
            const auto next = [&] { return at++ % problems.size(); };
            solver.round([&] { sink += KrigingSystem(problems[next()]).predict(targets).estimate(0, 0); },
                         repeats);
            solverSingle.round([&] { sink += KrigingSystem(single[next()]).predict(targets).estimate(0, 0); },
                               repeats);
            if (round < 4) lu.round([&] { sink += bordered(k, problems[0], targets)[0]; }, 2);
        }
        const double base = llt.best() * 1e6;
        const auto cell = [&](double seconds) {
            if (std::isfinite(seconds))
                std::printf(" %10.2f (%5.2f)", seconds * 1e6, seconds * 1e6 / base);
            else
                std::printf(" %18s", "-");
        };
        std::printf("%5ld %10.2f", static_cast<long>(n), base);
        cell(solver.best());
        cell(solverSingle.best());
        cell(lu.best());
        std::printf("\n");
    }
}

/// The exact answer in 100 digits.
Eigen::Vector2d exact(const KrigingProblem& p, const KrigingTargets& t) {
    using Real = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<100>,
                                               boost::multiprecision::et_off>;
    using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;
    const Index n = p.positions.rows();
    const VariogramStructure& s = p.model.structures[0];
    const auto rho = [&](const Eigen::RowVector2d& a, const Eigen::RowVector2d& b) {
        const Real dx = Real(a[0]) - Real(b[0]), dy = Real(a[1]) - Real(b[1]);
        const Real u2 = (dx * dx + dy * dy) / (Real(s.range) * Real(s.range));
        return Real(Real(s.sill) * exp(-u2));
    };
    Matrix a = Matrix::Zero(n + 1, n + 1), b = Matrix::Constant(n + 1, 1, Real(1));
    for (Index i = 0; i < n; ++i) {
        for (Index j = 0; j < n; ++j) a(i, j) = rho(p.positions.row(i), p.positions.row(j));
        if (p.errorVariances.size() > 0) a(i, i) += Real(p.errorVariances[i]);
        a(i, n) = a(n, i) = Real(1);
        b(i, 0) = rho(p.positions.row(i), t.points.row(0));
    }
    const Matrix x = a.partialPivLu().solve(b);
    Real estimate = 0, variance = Real(s.sill) - x(n, 0);
    for (Index i = 0; i < n; ++i) {
        estimate += x(i, 0) * Real(p.values(i, 0));
        variance -= x(i, 0) * b(i, 0);
    }
    return {static_cast<double>(estimate), static_cast<double>(variance)};
}

void errorTable() {
    std::printf(
        "\nerror of the estimate | of the variance (sill 1), worst of 5 systems of 40 data, smooth values, "
        "Gaussian model\n");
    std::printf("%12s %12s %23s %23s %23s\n", "error var.", "condition", "double", "float", "pivoted LU");
    std::mt19937_64 engine(2);
    const KrigingTargets targets = makeTargets();
    for (int digits = 2; digits <= 16; digits += 2) {
        double condition = 0;
        Eigen::Vector2d worst[3];
        for (Eigen::Vector2d& w : worst) w.setZero();
        for (int k = 0; k < 5; ++k) {
            KrigingProblem p =
                makeProblem(40, engine, {0, {{StructureType::Gaussian, 1, 1.0, 1}}}, std::pow(10.0, -digits));
            for (Index i = 0; i < 40; ++i)
                p.values.row(i).setConstant(std::sin(3 * p.positions(i, 0)) +
                                            std::cos(2 * p.positions(i, 1)));
            p.accuracy.mostDigits = 16;  // what double precision alone does
            const Eigen::Vector2d wanted = exact(p, targets);
            const MatrixXd matrix = covarianceMatrix(p);
            // The field's own covariance has eigenvalues down to 1e-20: the error variance is the smallest.
            const VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<MatrixXd>(matrix).eigenvalues();
            condition = std::max(condition, eigenvalues[39] / p.errorVariances[0]);
            const auto note = [&](int solver, const KrigingPrediction& found) {
                const Eigen::Vector2d answer(found.estimate(0, 0), found.variance[0]);
                worst[solver] = worst[solver].cwiseMax((answer - wanted).cwiseAbs());
            };
            note(0, KrigingSystem(p).predict(targets));
            worst[2] = worst[2].cwiseMax((bordered(matrix, p, targets) - wanted).cwiseAbs());
            p.precision = KrigingPrecision::Single;
            note(1, KrigingSystem(p).predict(targets));
        }
        std::printf("%12.0e %12.1e", std::pow(10.0, -digits), condition);
        for (const Eigen::Vector2d& w : worst) std::printf("   %9.1e | %9.1e", w[0], w[1]);
        std::printf("\n");
    }
}

/// Time of a system that is solved with more digits, against double precision alone.
void moreDigitsTable(const char* title, const VariogramModel& model, double error, double tolerance) {
    std::printf("\n%s: milliseconds a system\n", title);
    std::printf("%5s %10s %14s %8s %8s\n", "n", "double", "more digits", "ratio", "digits");
    std::mt19937_64 engine(3);
    const KrigingTargets targets = makeTargets();
    for (const Index n : {16, 64, 256}) {
        KrigingProblem p = makeProblem(n, engine, model, error);
        p.accuracy.tolerance = tolerance;
        KrigingProblem plain = p;
        plain.accuracy.mostDigits = 16;
        Timer precise, alone;
        int digits = 0;
        for (int round = 0; round < 3; ++round) {
            precise.round([&] { digits = KrigingSystem(p).predict(targets).digits; }, n > 64 ? 1 : 3);
            alone.round([&] { sink += KrigingSystem(plain).predict(targets).estimate(0, 0); }, 20);
        }
        std::printf("%5ld %10.4f %14.3f %8.0f %8d\n", static_cast<long>(n), alone.best() * 1e3,
                    precise.best() * 1e3, precise.best() / alone.best(), digits);
    }
}

}  // namespace

int main() {
    timeTable("Exponential model", {0.02, {{StructureType::Exponential, 1, 0.3, 1}}});
    timeTable("Stable model, alpha 1.5", {0.02, {{StructureType::Stable, 1, 0.3, 1.5}}});
    errorTable();
    moreDigitsTable("Exponential model, a tolerance that double precision cannot meet",
                    {0.02, {{StructureType::Exponential, 1, 0.3, 1}}}, 0.05, 0);
    moreDigitsTable("Gaussian model, range 1, errors 1e-12", {0, {{StructureType::Gaussian, 1, 1, 1}}}, 1e-12,
                    KrigingAccuracy{}.tolerance);
    return std::isfinite(sink) ? 0 : 1;
}
