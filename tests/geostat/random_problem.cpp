#include "random_problem.h"

#include <cmath>
#include <numbers>

namespace vlx::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

VariogramModel randomModel(Random& random, const RandomProblemOptions& options, Index dimension) {
    VariogramModel model;
    const int structures = 1 + random.below(2);
    for (int k = 0; k < structures; ++k) {
        VariogramStructure s;
        s.sill = random.logUniform(0.01, 100);
        s.range = options.hard ? random.logUniform(0.01, 1e4) : random.logUniform(0.05, 2);
        switch (random.below(6)) {
            case 0:  // positive definite in up to three dimensions only
                s.type = dimension <= 3 ? StructureType::Spherical : StructureType::Exponential;
                break;
            case 1:
                s.type = StructureType::Exponential;
                break;
            case 2:
                s.type = options.hard || random.chance(0.3) ? StructureType::Gaussian : StructureType::Stable;
                s.shape = random.uniform(0.2, 1.8);
                break;
            case 3:
                s.type = StructureType::Stable;
                s.shape = options.hard ? random.uniform(0.05, 2) : random.uniform(0.2, 1.8);
                break;
            case 4:
                s.type = StructureType::Matern;
                s.shape = 0.5 + random.below(options.hard ? 3 : 2);
                break;
            default:
                s.type = options.unbounded ? StructureType::Linear : StructureType::Exponential;
        }
        model.structures.push_back(s);
    }
    if (random.chance(0.4)) model.nugget = model.structures[0].sill * random.logUniform(1e-3, 1);
    return model;
}

MatrixXd randomPositions(Random& random, const RandomProblemOptions& options, Index n, Index dimension) {
    MatrixXd x(n, dimension);
    const int layout = random.below(4);
    const int side = static_cast<int>(std::ceil(std::pow(n, 1.0 / static_cast<double>(dimension))));
    for (Index i = 0; i < n; ++i)
        for (Index j = 0; j < dimension; ++j) {
            switch (layout) {
                case 0:  // a lattice
                    x(i, j) = static_cast<double>(
                                  (i / static_cast<Index>(std::pow(side, static_cast<double>(j)))) % side) /
                              side;
                    break;
                case 1:  // clusters
                    x(i, j) = 0.2 * random.below(5) + 0.02 * random.uniform();
                    break;
                default:
                    x(i, j) = random.uniform();
            }
        }
    if (options.coincident && n > 3 && random.chance(0.3))
        for (int k = 0; k < 1 + static_cast<int>(n) / 8; ++k)
            x.row(random.below(static_cast<int>(n))) = x.row(random.below(static_cast<int>(n)));
    if (options.hard && n > 3 && random.chance(0.4))
        for (int k = 0; k < 1 + static_cast<int>(n) / 8; ++k) {
            const Index to = random.below(static_cast<int>(n));
            x.row(to) = x.row(random.below(static_cast<int>(n)));
            for (Index j = 0; j < dimension; ++j) x(to, j) += random.logUniform(1e-14, 1e-3);
        }
    if (options.hard && dimension > 1 && random.chance(0.1)) x.col(1) = 2 * x.col(0).array() + 1;
    return x;
}

}  // namespace

double Random::logUniform(double low, double high) {
    return std::exp(uniform(std::log(low), std::log(high)));
}

double Random::normal() {
    const double u = 1 - uniform(), v = uniform();
    return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * v);
}

RandomProblem randomProblem(Random& random, const RandomProblemOptions& options) {
    RandomProblem out;
    KrigingProblem& problem = out.problem;
    const Index dimension = 1 + random.below(4);
    const auto n = static_cast<Index>(
        random.logUniform(options.fewestData, static_cast<double>(options.mostData) + 0.999));
    problem.model = randomModel(random, options, dimension);
    problem.positions = randomPositions(random, options, n, dimension);
    const Index m = options.targets;
    out.targets.points.resize(m, dimension);
    for (Index t = 0; t < m; ++t)
        for (Index j = 0; j < dimension; ++j) out.targets.points(t, j) = random.uniform(-0.2, 1.2);
    const Index twin = random.below(static_cast<int>(n));
    out.targets.points.row(m - 1) = problem.positions.row(twin);

    const bool constantNeeded = !problem.model.bounded();
    switch (random.below(5)) {
        case 0:
            problem.drift.polynomial = constantNeeded ? DriftPolynomial::Constant : DriftPolynomial::None;
            problem.drift.mean = Eigen::RowVectorXd::Constant(2, random.normal());
            break;
        case 1:
        case 2:
            problem.drift.polynomial = DriftPolynomial::Constant;
            break;
        case 3:
            problem.drift.polynomial =
                n > 2 * dimension + 2 ? DriftPolynomial::Linear : DriftPolynomial::Constant;
            break;
        default:
            problem.drift.polynomial = n > (dimension + 1) * (dimension + 2) ? DriftPolynomial::Quadratic
                                                                             : DriftPolynomial::Constant;
    }
    if (problem.drift.polynomial == DriftPolynomial::Constant && n > 6 && random.chance(0.3)) {
        const Index q = 1 + random.below(2);
        problem.drift.external.resize(n, q);
        out.targets.externalDrift.resize(m, q);
        const auto feature = [&](const auto& x, Index k) {
            return std::sin(3 * x.sum() + static_cast<double>(k));
        };
        for (Index k = 0; k < q; ++k) {
            for (Index i = 0; i < n; ++i) problem.drift.external(i, k) = feature(problem.positions.row(i), k);
            for (Index t = 0; t < m; ++t)
                out.targets.externalDrift(t, k) = feature(out.targets.points.row(t), k);
        }
    }

    problem.values.resize(n, 2);
    for (Index i = 0; i < n; ++i)
        for (Index c = 0; c < 2; ++c)
            problem.values(i, c) = random.normal() + (options.hard && random.chance(0.01) ? 1e6 : 0);
    const double sill = problem.model.structures[0].sill;
    const int errors = random.below(4);
    if (errors > 0) {
        problem.errorVariances.resize(n);
        for (Index i = 0; i < n; ++i) switch (errors) {
                case 1:
                    problem.errorVariances[i] = 0.1 * sill;
                    break;
                case 2:
                    problem.errorVariances[i] =
                        sill * (options.hard ? random.logUniform(1e-12, 1e12) : random.logUniform(1e-3, 10));
                    break;
                default:
                    problem.errorVariances[i] = random.chance(0.3) ? 0 : 0.3 * sill;
            }
    }
    return out;
}

}  // namespace vlx::testing
