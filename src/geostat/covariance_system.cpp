#include "variolux/geostat/covariance_system.h"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A power of two near x > 0: scaling by it rounds nothing.
double powerOfTwo(double x) { return std::ldexp(1.0, std::ilogb(x)); }

/// 2^-round(log2(x) / 2): x times its square is within a factor two of 1.
double equilibrator(double x) {
    return std::ldexp(1.0, -static_cast<int>(std::floor((std::ilogb(x) + 1) / 2.0)));
}

/// Index of the first entry that is not finite, or nothing, in words.
std::string firstNotFinite(const MatrixXd& matrix, const char* name) {
    if (matrix.allFinite()) return {};
    for (Index i = 0; i < matrix.rows(); ++i)
        for (Index j = 0; j < matrix.cols(); ++j)
            if (!std::isfinite(matrix(i, j))) {
                std::ostringstream text;
                text << name << " (" << i << ", " << j << ") must be finite, found " << matrix(i, j);
                return text.str();
            }
    return {};
}

}  // namespace

CovarianceSystem::CovarianceSystem(CovarianceProblem problem) {
    driftColumns_ = problem.drift.cols();
    rawValues_ = std::move(problem.values);
    report_.used = problem.covariance.rows();
    if (!validate(problem)) return;
    equilibrate(problem.covariance);
    factorise();
    decomposeDrift(problem.drift);
    centreValues();
    describe();
}

bool CovarianceSystem::validate(const CovarianceProblem& problem) {
    const Index n = problem.covariance.rows();
    const auto fail = [&](KrigingStatus status, std::string message) {
        report_.status = status;
        report_.message = std::move(message);
        return false;
    };
    if (problem.covariance.cols() != n || rawValues_.rows() != n ||
        (driftColumns_ > 0 && problem.drift.rows() != n))
        return fail(KrigingStatus::InvalidInput, "covariance, drift and values must have the same rows");
    if (n == 0 && driftColumns_ > 0)
        return fail(KrigingStatus::TooFewData, "no data, and the mean is not known");
    // The strict upper half is never read.
    const MatrixXd lower = problem.covariance.triangularView<Eigen::Lower>();
    for (const std::string& text :
         {firstNotFinite(lower, "covariance"), firstNotFinite(problem.drift, "drift"),
          firstNotFinite(rawValues_, "value")})
        if (!text.empty()) return fail(KrigingStatus::InvalidInput, text);
    for (Index i = 0; i < n; ++i)
        if (problem.covariance(i, i) < 0)
            return fail(KrigingStatus::InvalidInput,
                        "the variance of datum " + std::to_string(i) + " must be >= 0");
    return true;
}

void CovarianceSystem::equilibrate(const MatrixXd& covariance) {
    const Index n = covariance.rows();
    const double largest = n > 0 ? covariance.diagonal().maxCoeff() : 0;
    scale_.resize(n);
    for (Index i = 0; i < n; ++i) {
        const double variance = covariance(i, i);
        if (variance > 0) {
            scale_[i] = equilibrator(variance);
        } else {
            // A datum without any variance: the limit of a vanishing one. Its row is set to the identity
            // below; weights of such data dominate all others', and are equal among themselves.
            report_.degenerate = true;
            scale_[i] = largest > 0 ? equilibrator(largest) * 0x1p50 : 1;
        }
    }
    covariance_.resize(n, n);
    for (Index j = 0; j < n; ++j)
        for (Index i = j; i < n; ++i) {
            const double c = covariance(i, j) * scale_[j] * scale_[i];
            covariance_(i, j) = c;
            covariance_(j, i) = c;
        }
}

void CovarianceSystem::factorise() {
    const Index n = covariance_.rows();
    if (n == 0) return;
    MatrixXd matrix = covariance_;
    for (Index i = 0; i < n; ++i)
        if (matrix(i, i) == 0) {
            matrix.row(i).setZero();
            matrix.col(i).setZero();
            matrix(i, i) = 1;
        }
    const VectorXd diagonal = matrix.diagonal();
    const double noise = 4 * kEpsilon * std::max(1.0, static_cast<double>(n) / 8);
    double jitter = 0;
    for (;;) {
        const Eigen::LLT<Eigen::Ref<MatrixXd>> llt(matrix);
        const double lowest = matrix.diagonal().minCoeff();
        if (llt.info() == Eigen::Success && (lowest * lowest > noise || jitter >= 1)) break;
        // LLT works in place: restore the lower half from the upper one.
        jitter = jitter == 0 ? kEpsilon * static_cast<double>(n) : 10 * jitter;
        matrix.triangularView<Eigen::StrictlyLower>() = matrix.transpose();
        matrix.diagonal() = diagonal * (1 + jitter);
    }
    factor_ = std::move(matrix);
    report_.jitter = jitter;
    report_.indefinite = jitter > 1e5 * kEpsilon * static_cast<double>(n);

    // ||K^-1|| >= ||L^-T e_k||^2 with k the smallest pivot; ||K|| <= trace.
    Index k = 0;
    factor_.diagonal().minCoeff(&k);
    VectorXd x = VectorXd::Unit(n, k);
    factor_.topLeftCorner(k + 1, k + 1)
        .triangularView<Eigen::Lower>()
        .transpose()
        .solveInPlace(x.head(k + 1));
    report_.conditionEstimate = std::max(1.0, diagonal.sum() / static_cast<double>(n) * x.squaredNorm()) *
                                std::sqrt(static_cast<double>(n));
}

void CovarianceSystem::solveLower(MatrixXd& x) const {
    factor_.triangularView<Eigen::Lower>().solveInPlace(x);
}

void CovarianceSystem::solveUpper(MatrixXd& x) const {
    factor_.triangularView<Eigen::Lower>().transpose().solveInPlace(x);
}

void CovarianceSystem::decomposeDrift(const MatrixXd& drift) {
    const Index n = covariance_.rows(), p = driftColumns_;
    if (p == 0) {
        q_ = keptDrift_ = MatrixXd(n, 0);
        centre_ = columnScale_ = RowVectorXd(0);
        return;
    }
    for (Index j = 0; j < p && constantColumn_ < 0; ++j)
        if (drift(0, j) != 0 && (drift.col(j).array() == drift(0, j)).all()) constantColumn_ = j;
    if (constantColumn_ >= 0) constant_ = drift(0, constantColumn_);

    // Centred at the mean weighted by 1 / K_ii, so that a few precise data do not make columns parallel.
    const VectorXd precision = (scale_ / (n > 0 ? scale_.maxCoeff() : 1)).array().square();
    MatrixXd internal(n, p);
    centre_ = RowVectorXd::Zero(p);
    columnScale_ = RowVectorXd::Ones(p);
    for (Index j = 0; j < p; ++j) {
        if (j == constantColumn_) {
            internal.col(j).setOnes();
            continue;
        }
        const double magnitude = drift.col(j).cwiseAbs().maxCoeff();
        const double unit = magnitude > 0 ? powerOfTwo(magnitude) : 1;
        if (constantColumn_ >= 0) centre_[j] = unit * (drift.col(j) / unit).dot(precision) / precision.sum();
        internal.col(j) = (drift.col(j).array() - centre_[j]) / unit;
        // What is left of a constant after centring is rounding.
        if (internal.col(j).cwiseAbs().maxCoeff() <= 4 * kEpsilon && constantColumn_ >= 0)
            internal.col(j).setZero();
        columnScale_[j] = 1 / unit;
    }
    MatrixXd a = scale_.asDiagonal() * internal;
    const MatrixXd equilibrated = a;
    solveLower(a);
    RowVectorXd normScale(p);
    for (Index j = 0; j < p; ++j) {
        const double norm = a.col(j).norm();
        normScale[j] = norm > 0 ? 1 / powerOfTwo(norm) : 1;
        a.col(j) *= normScale[j];
    }
    columnScale_ = columnScale_.cwiseProduct(normScale);

    Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
    const double tolerance = 100 * kEpsilon * static_cast<double>(std::max(n, p));
    Index rank = 0;
    const Index most = std::min(n, p);
    while (rank < most && std::abs(qr.matrixQR()(rank, rank)) > tolerance * std::abs(qr.matrixQR()(0, 0)) &&
           qr.matrixQR()(rank, rank) != 0)
        ++rank;
    const auto& order = qr.colsPermutation().indices();
    for (Index j = 0; j < p; ++j) (j < rank ? kept_ : dropped_).push_back(order[j]);
    report_.droppedDrift = static_cast<int>(p - rank);

    r_ = qr.matrixQR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
    q_ = MatrixXd::Identity(n, rank);
    q_.applyOnTheLeft(qr.householderQ());
    dependence_ = qr.matrixQR().topRightCorner(rank, p - rank);
    r_.triangularView<Eigen::Upper>().solveInPlace(dependence_);
    keptDrift_.resize(n, rank);
    for (Index j = 0; j < rank; ++j)
        keptDrift_.col(j) = equilibrated.col(kept_[static_cast<std::size_t>(j)]) *
                            normScale[kept_[static_cast<std::size_t>(j)]];
}

void CovarianceSystem::centreValues() {
    const Index n = rawValues_.rows(), columns = rawValues_.cols();
    reference_ = RowVectorXd::Zero(columns);
    valueScale_ = RowVectorXd::Ones(columns);
    values_.resize(n, columns);
    for (Index c = 0; c < columns; ++c) {
        const auto z = rawValues_.col(c);
        const double magnitude = n > 0 ? z.cwiseAbs().maxCoeff() : 0;
        if (magnitude > 0) valueScale_[c] = powerOfTwo(magnitude);
        if (constantColumn_ >= 0) {
            // The datum nearest to the mean weighted by 1 / K_ii: differences from a datum are exact where
            // values are close, and zero where they are equal.
            const VectorXd precision = (scale_ / scale_.maxCoeff()).array().square();
            const double mean = (z / valueScale_[c]).dot(precision) / precision.sum();
            Index nearest = 0;
            (z.array() / valueScale_[c] - mean).abs().minCoeff(&nearest);
            reference_[c] = z[nearest];
        }
        values_.col(c) = scale_.array() * (z.array() / valueScale_[c] - reference_[c] / valueScale_[c]);
    }
}

void CovarianceSystem::describe() {
    std::ostringstream text;
    const auto separate = [&]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
    if (report_.degenerate) separate() << "some data have no variance at all";
    if (report_.jitter > 0)
        separate() << "jitter " << report_.jitter << " on the unit diagonal"
                   << (report_.indefinite ? ": the covariances are indefinite" : "");
    if (report_.droppedDrift > 0) separate() << report_.droppedDrift << " dependent drift column(s) dropped";
    report_.message = text.str();
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

MatrixXd CovarianceSystem::solve(const MatrixXd& c0, const MatrixXd& f0) const {
    MatrixXd multipliers = MatrixXd::Zero(f0.rows(), c0.cols());
    // Adds the solution of [K F; F' 0] [v; mu] = [c; f].
    const auto addSolution = [&](const MatrixXd& c, const MatrixXd& f, MatrixXd& v) {
        MatrixXd x = c;
        solveLower(x);
        MatrixXd t = f;
        r_.triangularView<Eigen::Upper>().transpose().solveInPlace(t);
        t.noalias() -= q_.transpose() * x;
        x.noalias() += q_ * t;
        solveUpper(x);
        v += x;
        r_.triangularView<Eigen::Upper>().solveInPlace(t);
        multipliers -= t;
    };
    MatrixXd v = MatrixXd::Zero(c0.rows(), c0.cols());
    addSolution(c0, f0, v);
    if (report_.conditionEstimate > 1e4 && !report_.degenerate) {
        MatrixXd c = c0;
        c.noalias() -= covariance_ * v;
        c.noalias() -= keptDrift_ * multipliers;
        MatrixXd f = f0;
        f.noalias() -= keptDrift_.transpose() * v;
        addSolution(c, f, v);
    }
    return v;
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
    const MatrixXd v = solve(c0, f0.kept);
    const MatrixXd kv = covariance_ * v;
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
        const RowVectorXd residual = v.col(t).transpose() * values_;
        out.estimate.row(t) = reference_ * f0.constant[t] + residual.cwiseProduct(valueScale_);
        const double variance = targets.variance[t] + v.col(t).dot(kv.col(t) - 2 * c0.col(t));
        out.lowestVariance = std::min(out.lowestVariance, variance);
        out.variance[t] = std::max(0.0, variance);
        if (options.weights) out.weights.row(t) = v.col(t).cwiseProduct(scale_).transpose();
    }
    return out;
}

DriftEstimate CovarianceSystem::drift() const {
    const Index p = driftColumns_, columns = rawValues_.cols();
    DriftEstimate out{MatrixXd::Zero(p, columns), MatrixXd::Zero(p, p)};
    if (!report_.ok() || p == 0) return out;
    const auto rank = static_cast<Index>(kept_.size());
    const MatrixXd v = solve(MatrixXd::Zero(covariance_.rows(), rank), MatrixXd::Identity(rank, rank));
    const MatrixXd beta = v.transpose() * values_;
    const MatrixXd covariance = v.transpose() * covariance_ * v;
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
