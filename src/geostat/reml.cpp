#include "variolux/geostat/reml.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

#include "geostat/projected_bfgs.h"

namespace vlx {
namespace {

using Eigen::Index;

Eigen::MatrixXd orthonormalDrift(const Eigen::MatrixXd& drift) {
    if (drift.cols() == 0) return drift;
    // Columns of any size count alike for the rank.
    const Eigen::RowVectorXd norms = drift.colwise().norm();
    const Eigen::MatrixXd scaled = drift.array().rowwise() / norms.array().max(1e-300);
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(scaled);
    qr.setThreshold(1e-13 * static_cast<double>(drift.rows()));
    return qr.householderQ() * Eigen::MatrixXd::Identity(drift.rows(), qr.rank());
}

/// Distances and an orthonormal drift: what does not change with the model.
struct Prepared {
    Eigen::MatrixXd distances;
    Eigen::MatrixXd drift;
    Eigen::MatrixXd values;
    Eigen::VectorXd noise;
};

Prepared prepare(const RemlData& data) {
    const Index n = data.positions.rows();
    Prepared p;
    p.distances = Eigen::MatrixXd::Zero(n, n);
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < j; ++i)
            p.distances(i, j) = p.distances(j, i) =
                (data.positions.row(i) - data.positions.row(j)).stableNorm();
    p.drift = orthonormalDrift(data.drift.rows() == n ? data.drift : Eigen::MatrixXd(n, 0));
    p.values = data.values;
    p.noise = data.errorVariances.size() == n ? data.errorVariances : Eigen::VectorXd::Zero(n);
    return p;
}

RemlLikelihood evaluate(const Prepared& data, const VariogramModel& model, bool derivatives) {
    RemlLikelihood result;
    const Index n = data.values.rows(), p = data.drift.cols(), channels = data.values.cols();
    if (n <= p) return result;
    Eigen::MatrixXd k(n, n);
    for (Index j = 0; j < n; ++j) {
        for (Index i = 0; i < j; ++i) k(i, j) = k(j, i) = covariance(model, data.distances(i, j));
        k(j, j) = covariance(model, 0) + data.noise[j];
    }
    const Eigen::VectorXd scale = k.diagonal().cwiseSqrt();
    if (!(scale.minCoeff() > 0) || !scale.allFinite()) return result;
    const Eigen::VectorXd inverseScale = scale.cwiseInverse();
    const Eigen::LLT<Eigen::MatrixXd> factor(inverseScale.asDiagonal() * k * inverseScale.asDiagonal());
    if (factor.info() != Eigen::Success) return result;
    // Pivots of rounding size: coincident data without error have no density.
    const Eigen::MatrixXd lower = factor.matrixL();
    if (!(lower.diagonal().cwiseAbs2().minCoeff() > 1e-15 * std::max(1.0, static_cast<double>(n) / 8)))
        return result;
    const Eigen::MatrixXd a = factor.matrixL().solve(inverseScale.asDiagonal() * data.drift);
    const Eigen::MatrixXd z = factor.matrixL().solve(inverseScale.asDiagonal() * data.values);
    Eigen::HouseholderQR<Eigen::MatrixXd> qr(a);
    const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(n, p);
    double logDeterminant = 2 * scale.array().log().sum();
    logDeterminant += 2 * lower.diagonal().array().log().sum();
    logDeterminant += 2 * qr.matrixQR().diagonal().head(p).array().abs().log().sum();
    const Eigen::MatrixXd projected = z - q * (q.transpose() * z);
    const double c = static_cast<double>(channels), freedom = static_cast<double>(n - p);
    result.logLikelihood = -0.5 * (c * (freedom * std::log(2 * 3.14159265358979323846) + logDeterminant) +
                                   projected.squaredNorm());
    result.ok = std::isfinite(result.logLikelihood);
    if (!derivatives || !result.ok) return result;

    Eigen::MatrixXd inner = Eigen::MatrixXd::Identity(n, n) - q * q.transpose();
    inner = factor.matrixU().solve(inner);
    inner = factor.matrixU().solve(inner.transpose().eval());
    const Eigen::MatrixXd precision = inverseScale.asDiagonal() * inner * inverseScale.asDiagonal();  // P
    const Eigen::MatrixXd pz = precision * data.values;
    const Index parameters = 1 + 3 * static_cast<Index>(model.structures.size());
    std::vector<Eigen::MatrixXd> dk(static_cast<std::size_t>(parameters), Eigen::MatrixXd::Zero(n, n));
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i <= j; ++i) {
            // C = sill - gamma: the sill's own derivatives are 1 by nugget and sills, 0 by the rest.
            const Eigen::VectorXd gradient = semivarianceGradient(model, data.distances(i, j));
            for (Index t = 0; t < parameters; ++t) {
                const double own = t == 0 || (t - 1) % 3 == 0 ? 1 : 0;
                dk[static_cast<std::size_t>(t)](i, j) = dk[static_cast<std::size_t>(t)](j, i) =
                    own - gradient[t];
            }
        }
    result.gradient.resize(parameters);
    result.information.resize(parameters, parameters);
    std::vector<Eigen::MatrixXd> pdk;
    for (Index t = 0; t < parameters; ++t) {
        const Eigen::MatrixXd& d = dk[static_cast<std::size_t>(t)];
        pdk.push_back(precision * d);
        result.gradient[t] = -0.5 * (c * pdk.back().trace() - (pz.transpose() * d * pz).trace());
        for (Index s = 0; s <= t; ++s)
            result.information(s, t) = result.information(t, s) =
                0.5 * c * pdk[static_cast<std::size_t>(s)].cwiseProduct(pdk.back().transpose()).sum();
    }
    return result;
}

/// One variable of the optimiser: the log of a variance or range, or a shape.
struct Variable {
    Index parameter;  ///< index in semivarianceGradient()'s order
    bool logarithmic;
    double lower, upper;
};

double& parameterOf(VariogramModel& model, Index t) {
    if (t == 0) return model.nugget;
    VariogramStructure& s = model.structures[static_cast<std::size_t>((t - 1) / 3)];
    return (t - 1) % 3 == 0 ? s.sill : (t - 1) % 3 == 1 ? s.range : s.shape;
}

VariogramModel modelAt(const VariogramModel& base, const std::vector<Variable>& variables,
                       const Eigen::VectorXd& x) {
    VariogramModel model = base;
    for (std::size_t v = 0; v < variables.size(); ++v) {
        const double value = x[static_cast<Index>(v)];
        parameterOf(model, variables[v].parameter) = variables[v].logarithmic ? std::exp(value) : value;
    }
    return model;
}

/// Minus the log-likelihood and its gradient by the variables.
struct Objective {
    const Prepared& data;
    const VariogramModel& base;
    const std::vector<Variable>& variables;
    int& evaluations;

    double operator()(const Eigen::VectorXd& x, Eigen::VectorXd* gradient) const {
        ++evaluations;
        const VariogramModel model = modelAt(base, variables, x);
        const RemlLikelihood l = evaluate(data, model, gradient != nullptr);
        if (!l.ok) return std::numeric_limits<double>::infinity();
        if (gradient) {
            gradient->resize(x.size());
            for (std::size_t v = 0; v < variables.size(); ++v) {
                const Index i = static_cast<Index>(v);
                const double chain = variables[v].logarithmic ? std::exp(x[i]) : 1;
                (*gradient)[i] = -l.gradient[variables[v].parameter] * chain;
            }
        }
        return -l.logLikelihood;
    }
};

struct Optimum {
    double value = std::numeric_limits<double>::infinity();
    Eigen::VectorXd x;
    bool converged = false;
};

Optimum optimise(const Objective& objective, const std::vector<Eigen::VectorXd>& points, int starts,
                 int iterations) {
    Eigen::VectorXd lower(static_cast<Index>(objective.variables.size())), upper = lower;
    for (std::size_t v = 0; v < objective.variables.size(); ++v) {
        lower[static_cast<Index>(v)] = objective.variables[v].lower;
        upper[static_cast<Index>(v)] = objective.variables[v].upper;
    }
    std::vector<std::pair<double, Eigen::VectorXd>> ranked;
    for (const Eigen::VectorXd& x : points) {
        const Eigen::VectorXd inside = x.cwiseMax(lower).cwiseMin(upper);
        const double value = objective(inside, nullptr);
        if (std::isfinite(value)) ranked.emplace_back(value, inside);
    }
    std::stable_sort(ranked.begin(), ranked.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    Optimum best;
    for (std::size_t s = 0; s < ranked.size() && s < static_cast<std::size_t>(starts); ++s) {
        const BfgsResult r = minimizeBfgs(objective, ranked[s].second, lower, upper, iterations);
        if (r.value < best.value) best = {r.value, r.x, r.converged};
    }
    return best;
}

RemlData scaled(const RemlData& data, double scale) {
    RemlData result = data;
    result.values /= scale;
    result.errorVariances = result.errorVariances / scale / scale;
    return result;
}

}  // namespace

std::optional<std::string> RemlData::validate() const {
    const Index n = positions.rows();
    if (values.rows() != n) return "values must have one row a position";
    if (values.cols() < 1) return "values must have a column";
    if (drift.cols() > 0 && drift.rows() != n) return "drift must have one row a position";
    if (errorVariances.size() != 0 && errorVariances.size() != n)
        return "errorVariances must be empty or one a position";
    if (!positions.allFinite() || !values.allFinite() || !drift.allFinite() || !errorVariances.allFinite())
        return "positions, values, drift and errorVariances must be finite";
    if (errorVariances.size() > 0 && !(errorVariances.minCoeff() >= 0)) return "errorVariances must be >= 0";
    return std::nullopt;
}

std::optional<std::string> RemlOptions::validate() const {
    FitOptions fit;
    fit.structures = structures;
    fit.level = level;
    if (const auto broken = fit.validate()) return broken;
    for (const FitStructure& s : structures)
        if (s.type == StructureType::Linear) return "structures must be bounded, found Linear";
    if (starts < 1 || iterations < 1) return "starts and iterations must be positive";
    return std::nullopt;
}

RemlLikelihood remlLikelihood(const RemlData& data, const VariogramModel& model, bool derivatives) {
    assert(!data.validate());
    assert(!model.validate() && model.bounded());
    return evaluate(prepare(data), model, derivatives);
}

std::string RemlFit::message() const {
    std::ostringstream text;
    switch (status) {
        case RemlStatus::Ok:
        case RemlStatus::NotConverged:
            text << "log-likelihood " << logLikelihood << " after " << evaluations << " evaluations";
            if (status == RemlStatus::NotConverged) text << ", not converged";
            break;
        case RemlStatus::TooFewData:
            text << "too few data at different positions for the drift and a variance";
            break;
        case RemlStatus::Zero:
            text << "the drift explains the data exactly";
            break;
        case RemlStatus::Singular:
            text << "no covariance matrix of the starting models is positive definite";
            break;
    }
    return text.str();
}

RemlFit fitReml(const RemlData& input, const RemlOptions& options) {
    assert(!input.validate());
    assert(!options.validate());
    RemlFit fit;
    const Index parameters = 1 + 3 * static_cast<Index>(options.structures.size());
    fit.standardErrors = Eigen::VectorXd::Constant(parameters, std::numeric_limits<double>::quiet_NaN());
    const Index n = input.positions.rows();
    if (n < 2) return fit;
    Prepared data = prepare(input);
    if (n <= data.drift.cols()) return fit;
    double longest = data.distances.maxCoeff(), shortest = longest;
    for (Index i = 0; i < n * n; ++i)
        if (data.distances.data()[i] > 0) shortest = std::min(shortest, data.distances.data()[i]);
    if (!(longest > 0)) return fit;

    // Values of unit variance, so that the bounds below and the stopping rule have no unit.
    const double size = input.values.cwiseAbs().maxCoeff();
    if (!(size > 0)) {
        fit.status = RemlStatus::Zero;
        return fit;
    }
    const Eigen::MatrixXd unit = input.values / size;
    const Eigen::MatrixXd residual = unit - data.drift * (data.drift.transpose() * unit);
    const double freedom = static_cast<double>((n - data.drift.cols()) * unit.cols());
    const double deviation = size * std::sqrt(residual.squaredNorm() / freedom);
    if (!(deviation > 1e-14 * size)) {
        fit.status = RemlStatus::Zero;
        return fit;
    }
    data = prepare(scaled(input, deviation));

    constexpr double tiny = 1e-8, huge = 1e3;
    VariogramModel base;
    std::vector<Variable> variables;
    if (options.nugget) variables.push_back({0, true, std::log(tiny), std::log(huge)});
    for (std::size_t s = 0; s < options.structures.size(); ++s) {
        const FitStructure& structure = options.structures[s];
        const Index first = 1 + 3 * static_cast<Index>(s);
        const double lower = structure.minRange > 0 ? structure.minRange : shortest / 3;
        const double upper = structure.maxRange > 0 ? structure.maxRange : 10 * longest;
        base.structures.push_back({structure.type, 0.5, upper, structure.minShape});
        variables.push_back({first, true, std::log(tiny), std::log(huge)});
        if (lower < upper) variables.push_back({first + 1, true, std::log(lower), std::log(upper)});
        const bool shaped =
            structure.type == StructureType::Stable || structure.type == StructureType::Matern;
        if (shaped && structure.minShape < structure.maxShape)
            variables.push_back({first + 2, false, structure.minShape, structure.maxShape});
    }
    std::vector<Eigen::VectorXd> points;
    for (const double nugget : {0.05, 0.5, 0.9})
        for (const double range : {0.05, 0.2, 0.6}) {
            Eigen::VectorXd x(static_cast<Index>(variables.size()));
            for (std::size_t v = 0; v < variables.size(); ++v) {
                const Variable& variable = variables[v];
                const double nested = 1 + static_cast<double>((variable.parameter - 1) / 3);
                double value = 0.5 * (variable.lower + variable.upper);
                if (variable.parameter == 0) value = std::log(nugget);
                if (variable.parameter % 3 == 1)
                    value = std::log((1 - nugget) / static_cast<double>(options.structures.size()));
                if (variable.parameter % 3 == 2 && variable.parameter > 0)
                    value = std::log(range * longest * nested * nested);
                x[static_cast<Index>(v)] = value;
            }
            points.push_back(x);
        }
    const Objective objective{data, base, variables, fit.evaluations};
    const Optimum best = optimise(objective, points, options.starts, options.iterations);
    if (!std::isfinite(best.value)) {
        fit.status = RemlStatus::Singular;
        return fit;
    }
    fit.status = best.converged ? RemlStatus::Ok : RemlStatus::NotConverged;
    VariogramModel model = modelAt(base, variables, best.x);
    double value = -best.value;
    // A variance at its lower bound is 0 if that costs no likelihood.
    for (Index t = 0; t < parameters; ++t) {
        if (t % 3 == 2 || (t > 0 && t % 3 == 0)) continue;
        VariogramModel without = model;
        if (!(parameterOf(without, t) > 0 && parameterOf(without, t) < 10 * tiny)) continue;
        parameterOf(without, t) = 0;
        const RemlLikelihood l = evaluate(data, without, false);
        if (l.ok && l.logLikelihood >= value - 1e-3) model = without, value = l.logLikelihood;
    }

    const RemlLikelihood final = evaluate(data, model, true);
    std::vector<Index> free;
    for (std::size_t v = 0; v < variables.size(); ++v) {
        const double x = best.x[static_cast<Index>(v)];
        if (x > variables[v].lower + 1e-6 && x < variables[v].upper - 1e-6)
            free.push_back(variables[v].parameter);
    }
    const auto isVariance = [](Index t) { return t == 0 || t % 3 == 1; };
    if (!free.empty()) {
        const Eigen::MatrixXd information = final.information(free, free);
        const Eigen::VectorXd root = information.diagonal().cwiseSqrt();
        if (root.minCoeff() > 0) {
            const Eigen::VectorXd inverse = root.cwiseInverse();
            const Eigen::FullPivLU<Eigen::MatrixXd> lu(inverse.asDiagonal() * information *
                                                       inverse.asDiagonal());
            if (lu.isInvertible()) {
                const Eigen::MatrixXd covariance = lu.inverse();
                for (std::size_t i = 0; i < free.size(); ++i) {
                    const Index at = static_cast<Index>(i);
                    const double unitError = std::sqrt(std::max(0.0, covariance(at, at))) / root[at];
                    fit.standardErrors[free[i]] =
                        unitError * (isVariance(free[i]) ? deviation * deviation : 1);
                }
            }
        }
    }

    // The null hypothesis: no structure.
    const VariogramModel none;
    std::vector<Variable> nuggetOnly;
    if (options.nugget) nuggetOnly.push_back(variables[0]);
    const Objective nullObjective{data, none, nuggetOnly, fit.evaluations};
    double nullValue =
        nullObjective(Eigen::VectorXd::Constant(static_cast<Index>(nuggetOnly.size()), 0), nullptr);
    if (options.nugget) {
        std::vector<Eigen::VectorXd> nuggets;
        for (const double v : {1.0, 0.1, 0.01}) nuggets.push_back(Eigen::VectorXd::Constant(1, std::log(v)));
        nullValue = std::min(nullValue, optimise(nullObjective, nuggets, 2, options.iterations).value);
        const RemlLikelihood errorsOnly = evaluate(data, none, false);
        if (errorsOnly.ok) nullValue = std::min(nullValue, -errorsOnly.logLikelihood);
    }
    fit.likelihoodRatio = std::max(0.0, 2 * (value + nullValue));
    fit.pValue = std::exp(-0.5 * fit.likelihoodRatio);
    fit.significant = fit.pValue <= options.level;
    // Back to the unit of the values.
    fit.logLikelihood = value - freedom * std::log(deviation);
    fit.model = model;
    for (Index t = 0; t < parameters; ++t)
        if (isVariance(t)) parameterOf(fit.model, t) *= deviation * deviation;
    return fit;
}

}  // namespace vlx
