#include "variolux/geostat/covariance_system.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "kernels.h"

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
/// Below these a float factor converges by refinement; a double factor needs none.
constexpr double kLargestSingleCondition = 1e5;
constexpr double kLargestPlainCondition = 1e4;
constexpr int kMostSingleSteps = 8;
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
    covariance_ = std::move(problem.covariance);
    equilibrate();
    centreDrift(problem.drift);
    if (problem.precision == KrigingPrecision::Double || !factoriseSingle() || !decomposeDrift()) {
        report_.singlePrecision = false;
        factorSingle_.resize(0, 0);
        factoriseDouble();
        if (!report_.ok()) return;
        decomposeDrift();
    }
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
    for (const std::string& text :
         {firstNotFinite(problem.drift, "drift"), firstNotFinite(rawValues_, "value"),
          firstNotFinite(problem.covariance.diagonal(), "variance")})
        if (!text.empty()) return fail(KrigingStatus::InvalidInput, text);
    for (Index i = 0; i < n; ++i)
        if (problem.covariance(i, i) < 0)
            return fail(KrigingStatus::InvalidInput,
                        "the variance of datum " + std::to_string(i) + " must be >= 0");
    return true;
}

void CovarianceSystem::equilibrate() {
    const Index n = covariance_.rows();
    const double largest = n > 0 ? covariance_.diagonal().maxCoeff() : 0;
    scale_.resize(n);
    for (Index i = 0; i < n; ++i) {
        const double variance = covariance_(i, i);
        if (variance > 0) {
            scale_[i] = equilibrator(variance);
        } else {
            // A datum without any variance: the limit of a vanishing one. It is factorised with a unit
            // diagonal, so that such data outweigh all others, and are equal among themselves.
            report_.degenerate = true;
            scale_[i] = largest > 0 ? equilibrator(largest) * 0x1p50 : 1;
        }
    }
    for (Index j = 0; j < n; ++j)
        covariance_.col(j).tail(n - j).array() *= scale_[j] * scale_.tail(n - j).array();
    if (!report_.degenerate) return;
    for (Index i = 0; i < n; ++i)
        if (covariance_(i, i) == 0) {
            covariance_.row(i).setZero();
            covariance_.col(i).setZero();
        }
}

void CovarianceSystem::centreDrift(const MatrixXd& drift) {
    const Index n = scale_.size(), p = driftColumns_;
    centre_ = RowVectorXd::Zero(p);
    columnScale_ = RowVectorXd::Ones(p);
    drift_.resize(n, p);
    if (p == 0) return;
    for (Index j = 0; j < p && constantColumn_ < 0; ++j)
        if (drift(0, j) != 0 && (drift.col(j).array() == drift(0, j)).all()) constantColumn_ = j;
    if (constantColumn_ >= 0) constant_ = drift(0, constantColumn_);

    // Centred at the mean weighted by 1 / K_ii, so that a few precise data do not make columns parallel.
    const VectorXd precision = (scale_ / scale_.maxCoeff()).array().square();
    const double sum = precision.sum();
    for (Index j = 0; j < p; ++j) {
        if (j == constantColumn_) {
            drift_.col(j) = scale_;
            continue;
        }
        const double magnitude = drift.col(j).cwiseAbs().maxCoeff();
        const double unit = magnitude > 0 ? powerOfTwo(magnitude) : 1;
        if (constantColumn_ >= 0) centre_[j] = unit * (drift.col(j) / unit).dot(precision) / sum;
        drift_.col(j) = (drift.col(j).array() - centre_[j]) / unit;
        // What is left of a constant after centring is rounding.
        if (constantColumn_ >= 0 && drift_.col(j).cwiseAbs().maxCoeff() <= 4 * kEpsilon)
            drift_.col(j).setZero();
        drift_.col(j).array() *= scale_.array();
        columnScale_[j] = 1 / unit;
    }
}

/// The matrix to factorise, with the drift's columns as rows below it: the factorisation carries them along.
template <class Scalar>
double CovarianceSystem::factoriseWith(Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& factor,
                                       double jitter) const {
    const Index n = covariance_.rows(), p = driftColumns_;
    const Index leading = kernels::leadingDimension(n + p);
    factor.resize(leading, n);
    for (Index j = 0; j < n; ++j) {
        // Vectors of rows begin above the diagonal and end below the last row: both must be finite.
        const Index begin = j / 32 * 32;
        factor.col(j).segment(begin, j - begin).setZero();
        factor.col(j).segment(j, n - j) = covariance_.col(j).tail(n - j).template cast<Scalar>();
        factor.col(j).segment(n, p) = drift_.row(j).transpose().template cast<Scalar>();
        factor.col(j).tail(leading - n - p).setZero();
        const double diagonal = covariance_(j, j) > 0 ? covariance_(j, j) : 1;
        factor(j, j) = static_cast<Scalar>(diagonal * (1 + jitter));
    }
    return static_cast<double>(kernels::cholesky(factor.data(), n, n + p, leading));
}

/// ||K^-1|| >= ||L^-T e_k||^2 with k the smallest pivot, ||K|| <= trace; their product is usually between the
/// condition number and its n-th part, so the root of n goes to each side.
template <class Scalar>
double CovarianceSystem::estimateCondition(
    const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& factor) const {
    const Index n = covariance_.rows();
    Index k = 0;
    factor.diagonal().head(n).minCoeff(&k);
    Eigen::Matrix<Scalar, Eigen::Dynamic, 1> x = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>::Unit(k + 1, k);
    factor.topLeftCorner(k + 1, k + 1).template triangularView<Eigen::Lower>().transpose().solveInPlace(x);
    const double size = covariance_.diagonal().sum() / std::sqrt(static_cast<double>(n));
    return std::max(1.0, size * static_cast<double>(x.squaredNorm()));
}

bool CovarianceSystem::factoriseSingle() {
    const Index n = covariance_.rows();
    if (n == 0 || report_.degenerate) return false;
    const double lowest = factoriseWith(factorSingle_, 0);
    const double noise = 4 * 0x1p-23 * std::max(1.0, static_cast<double>(n) / 8);
    if (lowest > noise) report_.conditionEstimate = estimateCondition(factorSingle_);
    report_.singlePrecision = lowest > noise && report_.conditionEstimate < kLargestSingleCondition;
    return report_.singlePrecision;
}

void CovarianceSystem::factoriseDouble() {
    const Index n = covariance_.rows();
    if (n == 0) return;
    const double noise = 4 * kEpsilon * std::max(1.0, static_cast<double>(n) / 8);
    double jitter = 0;
    for (;;) {
        const double lowest = factoriseWith(factor_, jitter);
        if (lowest > noise || (lowest > 0 && jitter >= 1)) break;
        if (jitter == 0) {
            // A covariance that is not finite ends here too.
            const MatrixXd lower = covariance_.triangularView<Eigen::Lower>();
            const std::string text = firstNotFinite(lower, "covariance");
            if (!text.empty()) {
                report_.status = KrigingStatus::InvalidInput;
                report_.message = text;
                return;
            }
        }
        jitter = jitter == 0 ? kEpsilon * static_cast<double>(n) : 10 * jitter;
    }
    report_.jitter = jitter;
    report_.indefinite = jitter > 1e5 * kEpsilon * static_cast<double>(n);
    report_.conditionEstimate = estimateCondition(factor_);
}

/// Ill-conditioned, or only approximately factorised: refine weights, and take variances from the quadratic
/// form.
bool CovarianceSystem::careful() const {
    return report_.singlePrecision || report_.degenerate || report_.jitter > 0 ||
           report_.conditionEstimate > kLargestPlainCondition;
}

namespace {

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

/// False if the drift's columns are too nearly dependent for a float factor.
bool CovarianceSystem::decomposeDrift() {
    const Index n = covariance_.rows(), p = driftColumns_;
    kept_.clear();
    dropped_.clear();
    if (p == 0) {
        q_ = keptDrift_ = MatrixXd(n, 0);
        return true;
    }
    MatrixXd a = report_.singlePrecision ? MatrixXd(factorSingle_.middleRows(n, p).transpose().cast<double>())
                                         : MatrixXd(factor_.middleRows(n, p).transpose());
    for (Index j = 0; j < p; ++j) {
        const double norm = a.col(j).norm();
        const double scale = norm > 0 ? 1 / powerOfTwo(norm) : 1;
        a.col(j) *= scale;
        drift_.col(j) *= scale;
        columnScale_[j] *= scale;
    }
    if (p == 1 && a.squaredNorm() > 0) {  // ordinary kriging: no pivoting to do
        const double norm = a.norm();
        r_ = MatrixXd::Constant(1, 1, norm);
        q_ = a / norm;
        dependence_.resize(1, 0);
        kept_ = {0};
        keptDrift_ = drift_;
        return true;
    }
    const Eigen::ColPivHouseholderQR<MatrixXd> qr(a);
    const double tolerance = 100 * kEpsilon * static_cast<double>(std::max(n, p));
    const auto pivot = [&](Index k) { return std::abs(qr.matrixQR()(k, k)); };
    Index rank = 0;
    while (rank < std::min(n, p) && pivot(rank) > tolerance * pivot(0)) ++rank;
    if (report_.singlePrecision && (rank < p || pivot(p - 1) < 1e-3 * pivot(0))) return false;
    const auto& order = qr.colsPermutation().indices();
    for (Index j = 0; j < p; ++j) (j < rank ? kept_ : dropped_).push_back(order[j]);
    report_.droppedDrift = static_cast<int>(p - rank);

    r_ = qr.matrixQR().topLeftCorner(rank, rank).triangularView<Eigen::Upper>();
    q_ = MatrixXd::Identity(n, rank);
    q_.applyOnTheLeft(qr.householderQ());
    dependence_ = qr.matrixQR().topRightCorner(rank, p - rank);
    r_.triangularView<Eigen::Upper>().solveInPlace(dependence_);
    keptDrift_ = drift_(Eigen::all, kept_);
    return true;
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
    if (!report_.degenerate && report_.jitter == 0 && report_.droppedDrift == 0) return;
    std::ostringstream text;
    const auto separate = [&]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
    if (report_.degenerate) separate() << "some data have no variance at all";
    if (report_.jitter > 0)
        separate() << "jitter " << report_.jitter << " on the unit diagonal"
                   << (report_.indefinite ? ": the covariances are indefinite" : "");
    if (report_.droppedDrift > 0) separate() << report_.droppedDrift << " dependent drift column(s) dropped";
    report_.message = text.str();
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
