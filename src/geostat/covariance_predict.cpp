// CovarianceSystem's answers: weights, predictions, drift, leave-one-out.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kriging_names.h"
#include "variolux/geostat/covariance_system.h"

namespace vlx {
namespace {

constexpr int kMostSingleSteps = 8;

/// A few right-hand sides are quicker one at a time.
template <class Triangle, class Matrix>
void solveTriangle(const Triangle& triangle, Matrix& x) {
    if (x.cols() >= 4) return triangle.solveInPlace(x);
    for (Index t = 0; t < x.cols(); ++t) {
        auto column = x.col(t);
        triangle.solveInPlace(column);
    }
}

}  // namespace

void CovarianceSystem::solveLower(MatrixXd& x) const {
    const Index n = covariance_.rows();
    if (n == 0 || x.cols() == 0) return;
    if (!report_.singlePrecision) return solveTriangle(factor_.topRows(n).triangularView<Eigen::Lower>(), x);
    Eigen::MatrixXf y = x.cast<float>();
    solveTriangle(factorSingle_.topRows(n).triangularView<Eigen::Lower>(), y);
    x = y.cast<double>();
}

void CovarianceSystem::solveUpper(MatrixXd& x) const {
    const Index n = covariance_.rows();
    if (n == 0 || x.cols() == 0) return;
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
        out.converged = change < 1e-12;
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
    if (report_.singlePrecision && !solution.converged) return inDouble().predict(targets, options);
    const MatrixXd& v = solution.weights;
    RowVectorXd variance = targets.variance.transpose() - solution.explained;
    if (careful()) {
        const MatrixXd kv = covariance_.selfadjointView<Eigen::Lower>() * v;
        variance = targets.variance.transpose() + v.cwiseProduct(kv - 2 * c0).colwise().sum();
    }
    for (Index t = 0; t < m; ++t) {
        const auto at = static_cast<std::size_t>(t);
        if (!finite[at]) continue;
        const Index datum = targets.exactDatum.empty() ? -1 : targets.exactDatum[at];
        if (datum >= 0) {
            out.status[at] = TargetStatus::Exact;
            out.estimate.row(t) = rawValues_.row(datum);
            out.variance[t] = 0;
            if (options.weights) out.weights.row(t) = RowVectorXd::Unit(n, datum);
            continue;
        }
        out.status[at] = f0.estimable[at] ? TargetStatus::Ok : TargetStatus::NotEstimable;
        for (Index c = 0; c < columns; ++c)
            out.estimate(t, c) =
                reference_[c] * f0.constant[t] + v.col(t).dot(values_.col(c)) * valueScale_[c];
        out.lowestVariance = std::min(out.lowestVariance, variance[t]);
        out.variance[t] = std::max(0.0, variance[t]);
        if (options.weights) out.weights.row(t) = v.col(t).cwiseProduct(scale_).transpose();
    }
    return out;
}

DriftEstimate CovarianceSystem::drift() const {
    const Index p = driftColumns_, columns = rawValues_.cols();
    DriftEstimate out{MatrixXd::Zero(p, columns), MatrixXd::Zero(p, p)};
    if (!report_.ok() || p == 0) return out;
    const auto rank = static_cast<Index>(kept_.size());
    const Solution solution = solve(MatrixXd::Zero(covariance_.rows(), rank), MatrixXd::Identity(rank, rank));
    if (report_.singlePrecision && !solution.converged) return inDouble().drift();
    const MatrixXd& v = solution.weights;
    const MatrixXd beta = v.transpose() * values_;
    const MatrixXd covariance = v.transpose() * (covariance_.selfadjointView<Eigen::Lower>() * v);
    // F_internal = F M, so beta = M beta_internal.
    MatrixXd map = MatrixXd::Zero(p, rank);
    for (Index j = 0; j < rank; ++j) {
        const Index column = kept_[static_cast<std::size_t>(j)];
        if (column == constantColumn_) {
            map(column, j) = columnScale_[column] / constant_;
        } else {
            map(column, j) = columnScale_[column];
            if (constantColumn_ >= 0)
                map(constantColumn_, j) -= centre_[column] * columnScale_[column] / constant_;
        }
    }
    out.coefficients = map * beta * valueScale_.asDiagonal();
    if (constantColumn_ >= 0) out.coefficients.row(constantColumn_) += reference_ / constant_;
    out.covariance = map * covariance * map.transpose();
    return out;
}

LeaveOneOut CovarianceSystem::leaveOneOut() const {
    const Index n = rawValues_.rows(), columns = rawValues_.cols();
    LeaveOneOut out;
    out.estimate = MatrixXd::Constant(n, columns, kNaN);
    out.variance = VectorXd::Constant(n, kNaN);
    out.status.assign(static_cast<std::size_t>(n), TargetStatus::NotEstimable);
    if (!report_.ok() || n == 0) return out;
    if (report_.singlePrecision) return inDouble().leaveOneOut();
    // Q = W'W with W = (I - Q_drift Q_drift') L^-1: a sum of squares, nothing cancels.
    MatrixXd w = MatrixXd::Identity(n, n);
    solveLower(w);
    const RowVectorXd full = w.colwise().squaredNorm();
    w -= q_ * (q_.transpose() * w);
    MatrixXd y = values_;
    solveLower(y);
    y -= q_ * (q_.transpose() * y);
    const MatrixXd qz = w.transpose() * y;
    for (Index i = 0; i < n; ++i) {
        const double qii = w.col(i).squaredNorm();
        if (!(qii > 1e-22 * full[i])) continue;
        out.status[static_cast<std::size_t>(i)] = TargetStatus::Ok;
        out.variance[i] = 1 / (qii * scale_[i] * scale_[i]);
        const RowVectorXd residual = qz.row(i).cwiseProduct(valueScale_) / (qii * scale_[i]);
        out.estimate.row(i) = rawValues_.row(i) - residual;
    }
    return out;
}

}  // namespace vlx
