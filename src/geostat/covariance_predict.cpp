// CovarianceSystem's answers: weights and predictions.
#include <algorithm>
#include <cmath>
#include <limits>

#include "geostat/kernels.h"
#include "geostat/kriging_names.h"
#include "variolux/geostat/covariance_system.h"

namespace vlx {
namespace {

constexpr int kMostSingleSteps = 8;
constexpr Index kRows = 8;  // right-hand sides from which solveRows() is quicker

/// A few right-hand sides are quicker one at a time.
template <class Triangle, class Matrix>
void solveTriangle(const Triangle& triangle, Matrix& x) {
    if (x.cols() >= 4) return triangle.solveInPlace(x);
    for (Index t = 0; t < x.cols(); ++t) {
        auto column = x.col(t);
        triangle.solveInPlace(column);
    }
}

/// Many are rows of vectors.
void solveRows(const MatrixXd& factor, bool upper, MatrixXd& x) {
    const Index n = x.rows(), m = x.cols();
    MatrixXd rows = MatrixXd::Zero((m + 15) / 16 * 16, n);
    rows.topRows(m) = x.transpose();
    kernels::solveTriangle(factor.data(), n, factor.rows(), upper, rows.data(), m, rows.rows());
    x = rows.topRows(m).transpose();
}

}  // namespace

void CovarianceSystem::solveLower(MatrixXd& x) const {
    const Index n = covariance_.rows();
    if (n == 0 || x.cols() == 0) return;
    if (!report_.singlePrecision && x.cols() >= kRows) return solveRows(factor_, false, x);
    if (!report_.singlePrecision) return solveTriangle(factor_.topRows(n).triangularView<Eigen::Lower>(), x);
    Eigen::MatrixXf y = x.cast<float>();
    solveTriangle(factorSingle_.topRows(n).triangularView<Eigen::Lower>(), y);
    x = y.cast<double>();
}

void CovarianceSystem::solveUpper(MatrixXd& x) const {
    const Index n = covariance_.rows();
    if (n == 0 || x.cols() == 0) return;
    if (!report_.singlePrecision && x.cols() >= kRows) return solveRows(factor_, true, x);
    if (!report_.singlePrecision)
        return solveTriangle(factor_.topRows(n).triangularView<Eigen::Lower>().transpose(), x);
    Eigen::MatrixXf y = x.cast<float>();
    solveTriangle(factorSingle_.topRows(n).triangularView<Eigen::Lower>().transpose(), y);
    x = y.cast<double>();
}

/// The same system with a double factor: where refinement of a float one does not converge.
CovarianceSystem CovarianceSystem::inDouble() const {
    CovarianceSystem out = *this;
    out.report_.singlePrecision = false;
    out.factorSingle_.resize(0, 0);
    out.factoriseDouble();
    out.decomposeDrift();
    return out;
}

CovarianceSystem::TargetDrift CovarianceSystem::targetDrift(const MatrixXd& drift) const {
    const Index m = drift.rows(), p = driftColumns_;
    TargetDrift out;
    out.constant = constantColumn_ >= 0 ? RowVectorXd(drift.col(constantColumn_).transpose() / constant_)
                                        : RowVectorXd(RowVectorXd::Zero(m));
    MatrixXd internal(p, m);
    MatrixXd magnitude(p, m);
    for (Index j = 0; j < p; ++j) {
        if (j == constantColumn_) {
            internal.row(j) = out.constant * columnScale_[j];
            magnitude.row(j) = internal.row(j).cwiseAbs();
        } else {
            const auto f = drift.col(j).transpose();
            internal.row(j) = (f - centre_[j] * out.constant) * columnScale_[j];
            magnitude.row(j) =
                (f.cwiseAbs() + std::abs(centre_[j]) * out.constant.cwiseAbs()) * columnScale_[j];
        }
    }
    const auto rank = static_cast<Index>(kept_.size());
    out.kept.resize(rank, m);
    for (Index j = 0; j < rank; ++j) out.kept.row(j) = internal.row(kept_[static_cast<std::size_t>(j)]);
    out.estimable.assign(static_cast<std::size_t>(m), true);
    if (dropped_.empty()) return out;
    const MatrixXd implied = dependence_.transpose() * out.kept;
    const MatrixXd impliedMagnitude = dependence_.cwiseAbs().transpose() * out.kept.cwiseAbs();
    for (Index t = 0; t < m; ++t)
        for (std::size_t d = 0; d < dropped_.size(); ++d) {
            const auto row = static_cast<Index>(d);
            const double gap = std::abs(internal(dropped_[d], t) - implied(row, t));
            if (gap > 1e-9 * (magnitude(dropped_[d], t) + impliedMagnitude(row, t)))
                out.estimable[static_cast<std::size_t>(t)] = false;
        }
    return out;
}

CovarianceSystem::Solution CovarianceSystem::solveOnce(const MatrixXd& c0, const MatrixXd& f0) const {
    Solution out{c0, f0, RowVectorXd::Zero(c0.cols())};
    MatrixXd& x = out.weights;
    solveLower(x);
    if (f0.rows() == 0) {
        out.explained = x.colwise().squaredNorm();
        solveUpper(x);
        return out;
    }
    MatrixXd& t = out.multipliers;
    solveTriangle(r_.triangularView<Eigen::Upper>().transpose(), t);
    t.noalias() -= q_.transpose().lazyProduct(x);
    out.explained = x.colwise().squaredNorm() - t.colwise().squaredNorm();
    x.noalias() += q_.lazyProduct(t);
    solveUpper(x);
    solveTriangle(r_.triangularView<Eigen::Upper>(), t);
    t = -t;
    return out;
}

CovarianceSystem::Solution CovarianceSystem::solve(const MatrixXd& c0, const MatrixXd& f0) const {
    Solution out = solveOnce(c0, f0);
    if (!careful() || report_.degenerate) return out;
    double last = std::numeric_limits<double>::infinity();
    for (int step = 0; step < (report_.singlePrecision ? kMostSingleSteps : 1); ++step) {
        MatrixXd c = c0;
        c.noalias() -= covariance_.selfadjointView<Eigen::Lower>() * out.weights;
        c.noalias() -= keptDrift_ * out.multipliers;
        MatrixXd f = f0;
        f.noalias() -= keptDrift_.transpose() * out.weights;
        const Solution correction = solveOnce(c, f);
        out.weights += correction.weights;
        out.multipliers += correction.multipliers;
        const double change = (correction.weights.colwise().norm().array() /
                               out.weights.colwise().norm().array().max(std::numeric_limits<double>::min()))
                                  .maxCoeff();
        out.change = change;
        if (change < 1e-15 || !(change < last)) break;
        last = change;
    }
    return out;
}

KrigingPrediction CovarianceSystem::predict(const CovarianceTargets& targets,
                                            const PredictOptions& options) const {
    const Index n = covariance_.rows(), m = targets.covariance.cols(), columns = rawValues_.cols();
    KrigingPrediction out;
    out.estimate = MatrixXd::Constant(m, columns, kNaN);
    out.variance = VectorXd::Constant(m, kNaN);
    out.estimateError = out.estimate;
    out.varianceError = out.variance;
    if (options.weights) out.weights = MatrixXd::Constant(m, report_.used, kNaN);
    out.status.assign(static_cast<std::size_t>(m), TargetStatus::InvalidTarget);
    const bool shapes = targets.covariance.rows() == n && targets.variance.size() == m &&
                        targets.drift.cols() == driftColumns_ &&
                        (driftColumns_ == 0 || targets.drift.rows() == m);
    if (!report_.ok() || !shapes || m == 0) return out;

    // Targets that are not finite must not touch the others.
    MatrixXd c0 = scale_.asDiagonal() * targets.covariance;
    MatrixXd drift = driftColumns_ > 0 ? targets.drift : MatrixXd(m, 0);
    std::vector<bool> finite(static_cast<std::size_t>(m));
    for (Index t = 0; t < m; ++t) {
        const bool good =
            c0.col(t).allFinite() && drift.row(t).allFinite() && std::isfinite(targets.variance[t]);
        finite[static_cast<std::size_t>(t)] = good;
        if (!good) {
            c0.col(t).setZero();
            drift.row(t).setZero();
        }
    }
    const TargetDrift f0 = targetDrift(drift);
    const Solution solution = solve(c0, f0.kept);
    if (report_.singlePrecision && !(solution.change < kConverged))
        return inDouble().predict(targets, options);
    const MatrixXd& v = solution.weights;
    RowVectorXd noise = RowVectorXd::Zero(m);
    if (targets.entryError.size() == m) noise = targets.entryError.transpose();
    const Right right{c0, f0.kept, targets.variance.transpose(), noise};
    Bounds bounds = quickBounds(solution, right, dualNormsAtMost());
    RowVectorXd variance = targets.variance.transpose() - solution.explained;
    if (careful()) {
        const MatrixXd kv = covariance_.selfadjointView<Eigen::Lower>() * v;
        variance = targets.variance.transpose() + v.cwiseProduct(kv - 2 * c0).colwise().sum();
    }
    MatrixXd estimate(m, columns);
    for (Index t = 0; t < m; ++t)
        for (Index c = 0; c < columns; ++c)
            estimate(t, c) = reference_[c] * f0.constant[t] + v.col(t).dot(values_.col(c)) * valueScale_[c];
    const double least = smallestVariance();
    const auto allowed = [&](Index t) {
        bool all =
            bounds.variance[t] <= allowedVarianceError(variance[t], std::max(right.variance[t], least));
        for (Index c = 0; c < columns; ++c)
            all = all && valueScale_[c] * bounds.estimate(c, t) <= allowedEstimateError(c, estimate(t, c));
        return all;
    };
    const auto allAllowed = [&] {
        for (Index t = 0; t < m; ++t)
            if (finite[static_cast<std::size_t>(t)] && !allowed(t)) return false;
        return true;
    };
    if (boundable() && !allAllowed()) {
        bounds = quickBounds(solution, right, dualNorms());
        if (!report_.degenerate && !allAllowed()) bounds = closeBounds(solution, right);
    }

    for (Index t = 0; t < m; ++t) {
        const auto at = static_cast<std::size_t>(t);
        if (!finite[at]) continue;
        const Index datum = targets.exactDatum.empty() ? -1 : targets.exactDatum[at];
        if (datum >= 0) {
            out.status[at] = TargetStatus::Exact;
            out.estimate.row(t) = rawValues_.row(datum);
            out.variance[t] = 0;
            out.estimateError.row(t).setZero();
            out.varianceError[t] = 0;
            if (options.weights) out.weights.row(t) = RowVectorXd::Unit(n, datum);
            continue;
        }
        out.status[at] = !f0.estimable[at] ? TargetStatus::NotEstimable
                         : allowed(t)      ? TargetStatus::Ok
                                           : TargetStatus::Inaccurate;
        out.estimate.row(t) = estimate.row(t);
        out.estimateError.row(t) = bounds.estimate.col(t).transpose().cwiseProduct(valueScale_) +
                                   2 * kEpsilon * estimate.row(t).cwiseAbs();
        out.varianceError[t] = bounds.variance[t] + 2 * kEpsilon * std::abs(variance[t]);
        out.lowestVariance = std::min(out.lowestVariance, variance[t]);
        out.variance[t] = std::max(0.0, variance[t]);
        if (options.weights) out.weights.row(t) = v.col(t).cwiseProduct(scale_).transpose();
    }
    return out;
}

}  // namespace vlx
