// CovarianceSystem's bounds of error (their derivation: covariance_system.h).
#include <algorithm>
#include <cmath>

#include "geostat/kriging_names.h"
#include "variolux/geostat/covariance_system.h"

namespace vlx {
namespace {

/// A drift whose columns are this far from dependent adds to errors no more than the covariances do.
constexpr double kIndependent = 1e-3;
/// Units of the last place that an answer is always allowed.
constexpr double kLastPlaces = 4;

}  // namespace

double CovarianceSystem::allowedEstimateError(Index column, double estimate) const {
    const double size = std::max(spread_[column], std::abs(estimate - reference_[column]));
    const double digits = std::max(std::abs(estimate), std::abs(reference_[column]));
    return tolerance_ * size + kLastPlaces * kEpsilon * digits;
}

double CovarianceSystem::allowedVarianceError(double variance, double scale) const {
    return tolerance_ * std::max(variance, scale) + kLastPlaces * kEpsilon * std::abs(variance);
}

/// The field's variance at the datum where it and the error are least.
double CovarianceSystem::smallestVariance() const {
    if (covariance_.rows() == 0) return 0;
    return (covariance_.diagonal().array() / scale_.array().square()).minCoeff();
}

double CovarianceSystem::entryNoise() const {
    return entryError_ + kEpsilon * std::sqrt(static_cast<double>(covariance_.rows()));
}

/// Of the equilibrated matrix, with the same margin as the condition estimate.
double CovarianceSystem::inverseNorm() const {
    const double trace = covariance_.diagonal().sum();
    return trace > 0 ? report_.conditionEstimate * static_cast<double>(covariance_.rows()) / trace : 1;
}

/// Whether the bounds, which are of first order, hold.
bool CovarianceSystem::boundable() const {
    const double n = static_cast<double>(covariance_.rows());
    return report_.jitter == 0 && entryNoise() * report_.conditionEstimate * std::sqrt(n) < 0.1;
}

/// Bounds of the dual weights' 1-norms that cost nothing: |y|_1 <= sqrt(n) |L^-T| |L'y|.
RowVectorXd CovarianceSystem::dualNormsAtMost() const {
    return std::sqrt(static_cast<double>(covariance_.rows()) * inverseNorm()) * dualNorm_;
}

/// The norms themselves, for a triangular solve.
RowVectorXd CovarianceSystem::dualNorms() const {
    if (covariance_.rows() == 0) return dualNorm_;
    MatrixXd y = carriedRows(driftColumns_, values_.cols());
    y -= q_.lazyProduct(q_.transpose().lazyProduct(y).eval());
    solveUpper(y);
    return y.colwise().lpNorm<1>();
}

/// Bounds from norms of primal weights and of dual ones, y. Entries of the equilibrated matrix are at most 2,
/// those of F m at most |c0| + |K w|, and those of F b at most |z| + |K y|, which makes 6 of 2.
CovarianceSystem::Bounds CovarianceSystem::quickBounds(const Solution& solution, const Right& right,
                                                       const RowVectorXd& y) const {
    const Index n = covariance_.rows(), m = right.covariance.cols(), columns = values_.cols();
    const auto pivots = r_.diagonal().cwiseAbs();
    const bool independent = kept_.empty() || pivots.minCoeff() > kIndependent * pivots.maxCoeff();
    if (!boundable() || !independent)
        return {MatrixXd::Constant(columns, m, kInfinity), RowVectorXd::Constant(m, kInfinity)};
    Bounds out{MatrixXd::Zero(columns, m), RowVectorXd::Zero(m)};
    if (n == 0) return out;
    const double noise = entryNoise(), widest = scale_.maxCoeff();
    const double rounding = kEpsilon * std::sqrt(static_cast<double>(n));
    const RowVectorXd z = values_.colwise().lpNorm<Eigen::Infinity>();
    for (Index t = 0; t < m; ++t) {
        const double w = solution.weights.col(t).lpNorm<1>();
        const double c = right.covariance.col(t).lpNorm<Eigen::Infinity>();
        const double left = solution.change * w, given = right.entryError[t];
        for (Index k = 0; k < columns; ++k)
            out.estimate(k, t) = y[k] * (noise * (6 * w + 2 * c) + widest * given) +
                                 (rounding * w + left * std::sqrt(n)) * z[k];
        out.variance[t] = noise * (std::abs(right.variance[t]) + 2 * c * w + 6 * w * w) +
                          given * (1 + 2 * widest * w) + 2 * static_cast<double>(n) * left * left;
        if (!report_.degenerate) continue;
        // Data without variance have none to be wrong: relative to the terms themselves.
        const VectorXd size = solution.weights.col(t).cwiseAbs();
        const MatrixXd k = MatrixXd(covariance_.selfadjointView<Eigen::Lower>()).cwiseAbs();
        out.variance[t] = noise * (std::abs(right.variance[t]) +
                                   2 * size.dot(right.covariance.col(t).cwiseAbs()) + size.dot(k * size));
    }
    return out;
}

/// Bounds from the dual weights and from what is left of the equations: the cost of a few targets.
CovarianceSystem::Bounds CovarianceSystem::closeBounds(const Solution& solution, const Right& right) const {
    const Index n = covariance_.rows(), m = right.covariance.cols(), columns = values_.cols();
    const MatrixXd &w = solution.weights, &multipliers = solution.multipliers;
    const Solution dual = solve(values_, MatrixXd::Zero(keptDrift_.cols(), columns));
    MatrixXd r = right.covariance, s = right.drift;
    r.noalias() -= covariance_.selfadjointView<Eigen::Lower>() * w;
    r.noalias() -= keptDrift_ * multipliers;
    s.noalias() -= keptDrift_.transpose() * w;
    const double noise = entryNoise();
    const double rounding = kEpsilon * std::sqrt(static_cast<double>(n));
    const MatrixXd drift = keptDrift_.cwiseAbs().transpose();
    const MatrixXd y = dual.weights.cwiseAbs(), b = dual.multipliers.cwiseAbs();
    const MatrixXd dualDrift = drift * y;
    const VectorXd yNorm = y.colwise().sum().transpose(), yScaled = y.transpose() * scale_;
    Bounds out{MatrixXd(columns, m), RowVectorXd(m)};
    for (Index t = 0; t < m; ++t) {
        const VectorXd weights = w.col(t).cwiseAbs(), mu = multipliers.col(t).cwiseAbs();
        const double wNorm = weights.sum(), c = right.covariance.col(t).lpNorm<Eigen::Infinity>();
        const double given = right.entryError[t];
        const VectorXd residual = r.col(t).cwiseAbs(), driftResidual = s.col(t).cwiseAbs();
        const VectorXd driftNoise = right.drift.col(t).cwiseAbs() + drift * weights;
        out.estimate.col(t) = y.transpose() * residual +
                              b.transpose() * (driftResidual + noise * driftNoise) +
                              noise * ((2 * wNorm + c) * yNorm + dualDrift.transpose() * mu) +
                              given * yScaled + rounding * (values_.cwiseAbs().transpose() * weights);
        out.variance[t] = noise * (std::abs(right.variance[t]) + 2 * c * wNorm + 2 * wNorm * wNorm) +
                          given * (1 + 2 * scale_.dot(weights)) + inverseNorm() * residual.squaredNorm() +
                          2 * mu.dot(driftResidual + noise * driftNoise);
    }
    return out;
}

}  // namespace vlx
