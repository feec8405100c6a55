#include "exact_kriging.h"

#include <boost/multiprecision/mpfr.hpp>
#include <vector>

namespace vlx::testing {
namespace {

using Eigen::Index;
/// GNU MPFR's: the library under test computes with numbers of Boost's own.
using Real = boost::multiprecision::number<boost::multiprecision::mpfr_float_backend<400>,
                                           boost::multiprecision::et_off>;
using Row = std::vector<Real>;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// 1 - rho of a unit structure.
Real gammaOf(const VariogramStructure& s, const Real& h) {
    const Real u = h / s.range;
    switch (s.type) {
        case StructureType::Spherical:
            return u < 1 ? Real((3 * u - u * u * u) / 2) : Real(1);
        case StructureType::Exponential:
            return 1 - exp(-u);
        case StructureType::Gaussian:
            return 1 - exp(-u * u);
        case StructureType::Stable:
            return u == 0 ? Real(0) : Real(1 - exp(-exp(log(u) * s.shape)));
        case StructureType::Matern:
            if (s.shape == 0.5) return 1 - exp(-u);
            if (s.shape == 1.5) return 1 - (1 + u) * exp(-u);
            if (s.shape == 2.5) return 1 - (1 + u + u * u / 3) * exp(-u);
            return 1 - (1 + u + 2 * u * u / 5 + u * u * u / 15) * exp(-u);
        case StructureType::Linear:
            return u;
    }
    return 0;
}

struct Setting {
    const KrigingProblem& problem;
    Eigen::VectorXd origin;

    Row place(const Eigen::RowVectorXd& x) const {
        const auto& transform = problem.transform;
        if (transform.size() == 0) return Row(x.data(), x.data() + x.size());
        Row out;
        for (Index a = 0; a < transform.rows(); ++a) {
            Real sum = 0;
            for (Index b = 0; b < x.size(); ++b) sum += Real(transform(a, b)) * x[b];
            out.push_back(sum);
        }
        return out;
    }

    /// C, or -gamma where the model has no covariance, without nugget.
    Real covariance(const Row& a, const Row& b) const {
        Real squared = 0;
        for (std::size_t k = 0; k < a.size(); ++k) squared += (a[k] - b[k]) * (a[k] - b[k]);
        const Real h = sqrt(squared);
        Real sum = 0;
        for (const VariogramStructure& s : problem.model.structures)
            sum += s.sill * (problem.model.bounded() ? Real(1 - gammaOf(s, h)) : Real(-gammaOf(s, h)));
        return sum;
    }

    Row drift(const Eigen::RowVectorXd& x, const Eigen::MatrixXd& external, Index row) const {
        Row f, centred;
        const auto polynomial = problem.drift.polynomial;
        for (Index a = 0; a < x.size(); ++a) centred.push_back(Real(x[a]) - origin[a]);
        if (polynomial != DriftPolynomial::None) f.push_back(1);
        if (polynomial >= DriftPolynomial::Linear) f.insert(f.end(), centred.begin(), centred.end());
        if (polynomial == DriftPolynomial::Quadratic)
            for (std::size_t a = 0; a < centred.size(); ++a)
                for (std::size_t b = a; b < centred.size(); ++b) f.push_back(centred[a] * centred[b]);
        for (Index k = 0; k < external.cols(); ++k) f.push_back(external(row, k));
        return f;
    }
};

/// One right-hand side a target: c0, f0, C00.
struct Right {
    std::vector<Row> sides;
    Row variance;
};

/// Solves the bordered system by elimination with pivoting by rows.
ExactKriging solve(const Setting& setting, Right right) {
    const KrigingProblem& problem = setting.problem;
    const Index n = problem.positions.rows();
    std::vector<Row> places, drift;
    for (Index i = 0; i < n; ++i) {
        places.push_back(setting.place(problem.positions.row(i)));
        drift.push_back(setting.drift(problem.positions.row(i), problem.drift.external, i));
    }
    const std::size_t p = drift[0].size(), size = at(n) + p;
    std::vector<Row> a(size, Row(size, Real(0)));
    for (std::size_t i = 0; i < at(n); ++i) {
        for (std::size_t j = 0; j <= i; ++j) {
            a[i][j] = setting.covariance(places[i], places[j]);
            if (places[i] == places[j]) a[i][j] += problem.model.nugget;
            a[j][i] = a[i][j];
        }
        if (problem.errorVariances.size() > 0) a[i][i] += problem.errorVariances[static_cast<Index>(i)];
        for (std::size_t j = 0; j < p; ++j) a[i][at(n) + j] = a[at(n) + j][i] = drift[i][j];
    }
    const std::vector<Row> given = right.sides;
    for (std::size_t k = 0; k < size; ++k) {
        std::size_t best = k;
        for (std::size_t i = k + 1; i < size; ++i)
            if (abs(a[i][k]) > abs(a[best][k])) best = i;
        std::swap(a[k], a[best]);
        for (Row& side : right.sides) std::swap(side[k], side[best]);
        for (std::size_t i = k + 1; i < size; ++i) {
            const Real factor = a[i][k] / a[k][k];
            for (std::size_t j = k; j < size; ++j) a[i][j] -= factor * a[k][j];
            for (Row& side : right.sides) side[i] -= factor * side[k];
        }
    }
    ExactKriging out;
    out.estimate.resize(static_cast<Index>(given.size()), problem.values.cols());
    out.variance.resize(static_cast<Index>(given.size()));
    for (std::size_t t = 0; t < given.size(); ++t) {
        Row& x = right.sides[t];
        for (std::size_t k = size; k-- > 0;) {
            for (std::size_t j = k + 1; j < size; ++j) x[k] -= a[k][j] * x[j];
            x[k] /= a[k][k];
        }
        Real variance = right.variance[t];
        for (std::size_t k = 0; k < size; ++k) variance -= x[k] * given[t][k];
        const auto row = static_cast<Index>(t);
        out.variance[row] = static_cast<double>(variance);
        for (Index c = 0; c < problem.values.cols(); ++c) {
            const double mean = p == 0 && problem.drift.mean.size() > 0 ? problem.drift.mean[c] : 0;
            Real estimate = mean;
            for (Index i = 0; i < n; ++i) estimate += x[at(i)] * (Real(problem.values(i, c)) - mean);
            out.estimate(row, c) = static_cast<double>(estimate);
        }
    }
    return out;
}

}  // namespace

ExactKriging exactKriging(const KrigingProblem& problem, const KrigingTargets& targets) {
    const Setting setting{problem, Eigen::VectorXd::Zero(problem.positions.cols())};
    const Index n = problem.positions.rows();
    std::vector<Row> places;
    for (Index i = 0; i < n; ++i) places.push_back(setting.place(problem.positions.row(i)));
    Right right;
    for (Index t = 0; t < targets.count(); ++t) {
        const bool point = targets.begin.empty();
        const Index first = point ? t : targets.begin[at(t)];
        const Index last = point ? t + 1 : targets.begin[at(t) + 1];
        Real total = 0, variance = 0;
        const auto weight = [&](Index a) { return targets.weights.size() > 0 ? targets.weights[a] : 1.0; };
        for (Index a = first; a < last; ++a) total += point ? 1.0 : weight(a);
        Row side;
        for (Index a = first; a < last; ++a) {
            const Real share = (point ? 1.0 : weight(a)) / total;
            const Row place = setting.place(targets.points.row(a));
            Row column;
            for (Index i = 0; i < n; ++i) {
                column.push_back(setting.covariance(place, places[at(i)]));
                if (point && places[at(i)] == place) column.back() += problem.model.nugget;
            }
            const Row drift = setting.drift(targets.points.row(a), targets.externalDrift, t);
            column.insert(column.end(), drift.begin(), drift.end());
            side.resize(column.size(), Real(0));
            for (std::size_t k = 0; k < column.size(); ++k) side[k] += share * column[k];
            for (Index b = first; b < last; ++b)
                variance += share * (point ? 1.0 : weight(b)) / total *
                            setting.covariance(place, setting.place(targets.points.row(b)));
        }
        right.sides.push_back(side);
        right.variance.push_back(point ? Real(variance + problem.model.nugget) : variance);
    }
    return solve(setting, right);
}

ExactKriging exactDrift(const KrigingProblem& problem, const Eigen::VectorXd& origin) {
    const Setting setting{problem, origin};
    const std::size_t p = setting.drift(problem.positions.row(0), problem.drift.external, 0).size();
    Right right;
    for (std::size_t j = 0; j < p; ++j) {
        right.sides.emplace_back(at(problem.positions.rows()) + p, Real(0));
        right.sides.back()[at(problem.positions.rows()) + j] = 1;
        right.variance.emplace_back(0);
    }
    return solve(setting, right);
}

std::pair<KrigingProblem, KrigingTargets> leftOut(const KrigingProblem& problem, Index datum) {
    std::vector<Index> others;
    for (Index i = 0; i < problem.positions.rows(); ++i)
        if (i != datum) others.push_back(i);
    KrigingProblem out = problem;
    out.positions = problem.positions(others, Eigen::all);
    out.values = problem.values(others, Eigen::all);
    if (problem.errorVariances.size() > 0) out.errorVariances = problem.errorVariances(others);
    KrigingTargets target;
    target.points = problem.positions.row(datum);
    if (problem.drift.external.size() > 0) {
        out.drift.external = problem.drift.external(others, Eigen::all);
        target.externalDrift = problem.drift.external.row(datum);
    }
    return {out, target};
}

}  // namespace vlx::testing
