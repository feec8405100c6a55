#include "variolux/geostat/covariance_system.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <sstream>

#include "geostat/kernels.h"
#include "geostat/kriging_names.h"

namespace vlx {
namespace {

/// Below these a float factor converges by refinement; a double factor needs none.
constexpr double kLargestSingleCondition = 1e5;
constexpr double kLargestPlainCondition = 1e4;

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
    entryError_ = problem.entryError;
    tolerance_ = problem.tolerance;
    if (!validate(problem)) return;
    covariance_ = std::move(problem.covariance);
    equilibrate();
    centreDrift(problem.drift);
    centreValues();
    if (problem.precision == KrigingPrecision::Double || !factoriseSingle() || !decomposeDrift()) {
        report_.singlePrecision = false;
        factorSingle_.resize(0, 0);
        factoriseDouble();
        if (!report_.ok()) return;
        decomposeDrift();
    }
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

/// The matrix to factorise, with the drift's and the values' columns as rows below it: the factorisation
/// carries them along.
template <class Scalar>
double CovarianceSystem::factoriseWith(Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& factor,
                                       double jitter) const {
    const Index n = covariance_.rows(), p = driftColumns_, c = values_.cols();
    const Index leading = kernels::leadingDimension(n + p + c);
    factor.resize(leading, n);
    for (Index j = 0; j < n; ++j) {
        // Vectors of rows begin above the diagonal and end below the last row: both must be finite.
        const Index begin = j / 32 * 32;
        factor.col(j).segment(begin, j - begin).setZero();
        factor.col(j).segment(j, n - j) = covariance_.col(j).tail(n - j).template cast<Scalar>();
        factor.col(j).segment(n, p) = drift_.row(j).transpose().template cast<Scalar>();
        factor.col(j).segment(n + p, c) = values_.row(j).transpose().template cast<Scalar>();
        factor.col(j).tail(leading - n - p - c).setZero();
        const double diagonal = covariance_(j, j) > 0 ? covariance_(j, j) : 1;
        factor(j, j) = static_cast<Scalar>(diagonal * (1 + jitter));
    }
    return static_cast<double>(kernels::cholesky(factor.data(), n, n + p + c, leading));
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

MatrixXd CovarianceSystem::carriedRows(Index first, Index count) const {
    const Index row = covariance_.rows() + first;
    if (report_.singlePrecision) return factorSingle_.middleRows(row, count).transpose().cast<double>();
    return factor_.middleRows(row, count).transpose();
}

/// False if the drift's columns are too nearly dependent for a float factor.
bool CovarianceSystem::decomposeDrift() {
    if (!orthogonaliseDrift()) return false;
    const Index columns = values_.cols();
    dualNorm_ = RowVectorXd::Zero(columns);
    if (covariance_.rows() == 0) return true;
    MatrixXd y = carriedRows(driftColumns_, columns);
    y -= q_.lazyProduct(q_.transpose().lazyProduct(y).eval());
    dualNorm_ = y.colwise().norm();
    return true;
}

bool CovarianceSystem::orthogonaliseDrift() {
    const Index n = covariance_.rows(), p = driftColumns_;
    kept_.clear();
    dropped_.clear();
    if (p == 0) {
        q_ = keptDrift_ = MatrixXd(n, 0);
        return true;
    }
    MatrixXd a = carriedRows(0, p);
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
    spread_ = RowVectorXd::Zero(columns);
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
        if (n > 0) spread_[c] = (z.array() - reference_[c]).abs().maxCoeff();
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

}  // namespace vlx
