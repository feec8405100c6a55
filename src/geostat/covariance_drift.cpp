// CovarianceSystem's drift coefficients and leave-one-out.
#include <algorithm>
#include <cmath>

#include "geostat/kriging_names.h"
#include "variolux/geostat/covariance_system.h"

namespace vlx {

DriftEstimate CovarianceSystem::drift() const {
    const Index p = driftColumns_, columns = rawValues_.cols();
    DriftEstimate out;
    if (!report_.ok()) {
        out.coefficients = out.coefficientError = MatrixXd::Constant(p, columns, kNaN);
        out.covariance = MatrixXd::Constant(p, p, kNaN);
        out.varianceError = VectorXd::Constant(p, kNaN);
        out.accurate = false;
        return out;
    }
    out.coefficients = out.coefficientError = MatrixXd::Zero(p, columns);
    out.covariance = MatrixXd::Zero(p, p);
    out.varianceError = VectorXd::Zero(p);
    if (p == 0) return out;
    const auto rank = static_cast<Index>(kept_.size());
    const Right right{MatrixXd::Zero(covariance_.rows(), rank), MatrixXd::Identity(rank, rank),
                      RowVectorXd::Zero(rank), RowVectorXd::Zero(rank)};
    const Solution solution = solve(right.covariance, right.drift);
    if (report_.singlePrecision && !(solution.change < kConverged)) return inDouble().drift();
    const MatrixXd& v = solution.weights;
    const MatrixXd beta = v.transpose() * values_;
    const MatrixXd covariance = v.transpose() * (covariance_.selfadjointView<Eigen::Lower>() * v);

    // In the internal basis, where L^-1 F has columns of norm 1 to 2 and variances are 1/4 at least.
    Bounds bounds = quickBounds(solution, right, dualNormsAtMost());
    const auto accurate = [&] {
        bool all =
            (bounds.variance.array() <= tolerance_ * covariance.diagonal().transpose().array().max(0.25))
                .all();
        for (Index j = 0; j < rank && all; ++j) {
            const double reach = (keptDrift_.col(j).array() / scale_.array()).abs().maxCoeff();
            for (Index c = 0; c < columns; ++c) {
                const double size = std::max(std::abs(beta(j, c)), spread_[c] / (valueScale_[c] * reach));
                all = all && bounds.estimate(c, j) <= (tolerance_ + 4 * kEpsilon) * size;
            }
        }
        return all;
    };
    if (!accurate() && boundable() && !report_.degenerate) bounds = closeBounds(solution, right);
    out.accurate = accurate();

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
    out.coefficientError = map.cwiseAbs() * bounds.estimate.transpose() * valueScale_.asDiagonal();
    out.coefficientError += 2 * kEpsilon * out.coefficients.cwiseAbs();
    // |w_j' dK w_k| is at most the root of the two variances' bounds.
    out.varianceError = (map.cwiseAbs() * bounds.variance.cwiseSqrt().transpose()).cwiseAbs2();
    return out;
}

LeaveOneOut CovarianceSystem::leaveOneOut() const {
    const Index n = rawValues_.rows(), columns = rawValues_.cols();
    LeaveOneOut out;
    out.estimate = out.estimateError = MatrixXd::Constant(n, columns, kNaN);
    out.variance = out.varianceError = VectorXd::Constant(n, kNaN);
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
    const RowVectorXd qii = w.colwise().squaredNorm(), total = qz.colwise().lpNorm<1>();
    const auto estimable = [&](Index i) { return qii[i] > 1e-22 * full[i]; };
    const double least = smallestVariance();

    // dQ = -Q dK Q; what errors of F add, see quickBounds.
    const double noise = boundable() ? 6 * entryNoise() : kInfinity;
    const auto evaluate = [&](const VectorXd& rowNorms) {
        bool accurate = true;
        for (Index i = 0; i < n; ++i) {
            if (!estimable(i)) continue;
            const double share = noise * rowNorms[i] / qii[i];
            const double unit = scale_[i] * scale_[i];
            out.variance[i] = 1 / (qii[i] * unit);
            out.varianceError[i] = out.variance[i] * share * rowNorms[i];
            const RowVectorXd scaled = valueScale_ / scale_[i];
            const RowVectorXd residual = qz.row(i).cwiseProduct(scaled) / qii[i];
            out.estimate.row(i) = rawValues_.row(i) - residual;
            out.estimateError.row(i) =
                share * (total.cwiseProduct(scaled) + rowNorms[i] * residual.cwiseAbs()) +
                2 * kEpsilon * rawValues_.row(i).cwiseAbs();
            bool good = out.varianceError[i] <= allowedVarianceError(out.variance[i], least);
            for (Index c = 0; c < columns; ++c)
                good = good && out.estimateError(i, c) <= allowedEstimateError(c, out.estimate(i, c));
            out.status[static_cast<std::size_t>(i)] = good ? TargetStatus::Ok : TargetStatus::Inaccurate;
            accurate = accurate && good;
        }
        return accurate;
    };
    const double largest = static_cast<double>(n) * inverseNorm();
    if (!evaluate((qii * largest).cwiseSqrt().transpose()) && boundable()) {
        const MatrixXd q = w.transpose() * w;
        evaluate(q.cwiseAbs().rowwise().sum());
    }
    return out;
}

}  // namespace vlx
