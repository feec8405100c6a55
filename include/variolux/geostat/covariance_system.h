#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

/// The linear algebra of kriging, for covariances that the caller has already computed. KrigingSystem
/// (kriging.h) fills these matrices from positions and a variogram model; use this level for a covariance of
/// your own.
///
/// Every kind of kriging is one problem: data z with E[z] = F beta and Var[z] = K (error variances on its
/// diagonal), a target with E = f0' beta, variance C00 and covariances c0 with the data. The best linear
/// unbiased estimate is w'z, where the weights minimise the kriging variance
///     sigma^2 = C00 - 2 w'c0 + w'K w      subject to   F'w = f0
/// (Matheron 1969; Cressie 1993, section 3.4; Chiles and Delfiner 2012, section 3.4):
///   F has no columns        simple kriging (values are residuals from the known mean)
///   one column of ones      ordinary kriging
///   polynomials             universal kriging
///   any other functions     kriging with external drift
///   c0 = 0, C00 = 0         the drift f0'beta itself: kriging of the mean (generalised least squares)
///
/// How it is solved. The bordered matrix [K F; F' 0] is indefinite; this class never forms it:
///   1. Equilibrate, D K D with D = 2^-round(log2(K_ii) / 2): error variances of 1e-12 beside 1e12 are
///      harmless (van der Sluis 1969), and powers of two round nothing.
///   2. Cholesky, D K D = L L'. Accepted when the smallest squared pivot is above rounding noise.
///      Otherwise a relative jitter goes on the unit diagonal, from eps n upwards in powers of ten, and is
///      reported; weights are then refined against the matrix without jitter.
///   3. The drift by pivoted QR, L^-1 D F P = Q R, its columns centred and scaled beforehand.
///      Dependent columns are dropped and reported; a target whose drift can still be estimated is exact,
///      any other is flagged.
///   4. Weights from two triangular solves; one step of iterative refinement where the condition number asks
///      for it; the variance from the quadratic form above, in which errors of w enter squared.
///   5. A bound of the error. With the dual weights y, K y + F b = z, F'y = 0, an error dK of the entries or
///   of
///      the factorisation changes the estimate by -y'dK w and the variance by w'dK w, and what is left of the
///      equations, c0 - K w - F m = r and f0 - F'w = s, by y'r + b's: bounds in the 1-norms of y and w, with
///      |dK_ij| <= (entryError + sqrt(n) eps) sqrt(K_ii K_jj) (Higham 2002, sections 7.1 and 10.1; the root
///      of n after Higham and Mary 2019). They hold to first order: where eps times the condition number is
///      not small, or jitter was needed, there is no bound and it is infinite.
namespace vlx {

enum class KrigingStatus {
    Ok,            ///< predictions are valid; fallbacks, if any, are listed in the report
    InvalidInput,  ///< a value, variance, position or parameter is not usable: `message` names it
    TooFewData,    ///< no data, and no known mean to fall back to
};

/// Double: the factor is double. Single: the factor is float where the condition estimate allows it, with
/// refinement by residuals in double until the weights are as good as the double factor's; where it does not,
/// or refinement does not converge, the factor is double and the report says so.
enum class KrigingPrecision { Double, Single };

/// How good an answer must be, and what that may cost. An error is allowed where it is at most `tolerance`
/// times the larger of the answer's own size and its scale (of estimates: the largest |value - reference|; of
/// variances: the field's variance), or a few units of the answer's last place.
///
/// Where the bound of the error is larger, KrigingSystem solves the system again with 50, 100, 200, 400
/// decimal digits, covariances included, until two answers in a row agree. That takes some thousand times as
/// long (tests/bench/solver_bench.cpp measures it).
struct KrigingAccuracy {
    double tolerance = 1e-9;      ///< >= 0
    int mostDigits = 400;         ///< decimal digits to go to; below 50: double precision only
    Eigen::Index mostData = 512;  ///< larger systems stay in double precision
};

/// What building a system found. Anything but zero or false below is a documented fallback, meant to be
/// counted.
struct KrigingReport {
    KrigingStatus status = KrigingStatus::Ok;
    std::string message;  ///< in words: the error, or the fallbacks taken; empty if none

    Eigen::Index used = 0;     ///< rows of the factorised system
    Eigen::Index merged = 0;   ///< data that were folded into a coincident one
    Eigen::Index ignored = 0;  ///< data of infinite error variance
    int droppedDrift = 0;      ///< linearly dependent drift columns
    double jitter = 0;  ///< added to the double factor's unit diagonal (relative to each datum's variance)
    bool indefinite = false;  ///< the jitter needed exceeds rounding: the covariances are not a covariance
    bool degenerate = false;  ///< some datum has no variance at all (zero sill and zero error)
    bool generalisedCovariance = false;  ///< increments instead of covariances: long ranges, unbounded models
    bool singlePrecision = false;        ///< the factor in use is float
    double conditionEstimate = 0;        ///< of the equilibrated matrix, usually within a factor n

    bool ok() const { return status == KrigingStatus::Ok; }
};

enum class TargetStatus {
    Ok,
    Exact,          ///< the target is bitwise at an error-free datum: its value, variance 0
    NotEstimable,   ///< its drift is outside what the data determine: the estimate uses the kept columns only
    InvalidTarget,  ///< a coordinate, drift or covariance is not finite: estimate and variance are NaN
    Inaccurate,     ///< the error may be larger than was asked for: see the bound beside the answer
};

struct KrigingPrediction {
    Eigen::MatrixXd estimate;          ///< targets x value columns
    Eigen::VectorXd variance;          ///< kriging variance of each target, >= 0 always
    Eigen::MatrixXd weights;           ///< targets x data; empty unless asked for
    std::vector<TargetStatus> status;  ///< of each target
    double lowestVariance = 0;         ///< the most negative variance before clamping at 0: rounding, <= 0

    Eigen::MatrixXd estimateError;  ///< bound of each estimate's error, infinite if there is none
    Eigen::VectorXd varianceError;  ///< bound of each variance's error, likewise
    Eigen::Index moreDigits = 0;    ///< targets that were solved with more digits than a double has
    int digits = 16;                ///< the most decimal digits that any target was solved with
};

struct PredictOptions {
    bool weights = false;  ///< return the weights too
};

/// Generalised least squares: beta and its covariance matrix.
struct DriftEstimate {
    Eigen::MatrixXd coefficients;      ///< drift columns x value columns; 0 for dropped columns
    Eigen::MatrixXd covariance;        ///< drift columns x drift columns
    Eigen::MatrixXd coefficientError;  ///< bound of each coefficient's error, infinite if there is none
    Eigen::VectorXd varianceError;     ///< bound of the error of each variance (covariance's diagonal)
    bool accurate = true;              ///< all bounds are as small as was asked for
    int digits = 16;                   ///< decimal digits that it was solved with
};

struct LeaveOneOut {
    Eigen::MatrixXd estimate;          ///< data x value columns: datum i from all others
    Eigen::VectorXd variance;          ///< of the residual z_i - estimate_i (the datum's own error included)
    std::vector<TargetStatus> status;  ///< NotEstimable: the others do not determine the drift there (NaN)
    Eigen::MatrixXd estimateError;     ///< bound of each estimate's error, infinite if there is none
    Eigen::VectorXd varianceError;     ///< bound of each variance's error, likewise
    int digits = 16;                   ///< decimal digits that it was solved with
};

struct CovarianceProblem {
    Eigen::MatrixXd covariance;  ///< K, n x n, error variances on the diagonal; only the lower half is read
    Eigen::MatrixXd drift;       ///< F, n x p; p = 0 for simple kriging
    Eigen::MatrixXd values;      ///< z, n x c: one factorisation serves all columns
    KrigingPrecision precision = KrigingPrecision::Double;
    /// Error of K_ij relative to sqrt(K_ii K_jj): by default each entry has been rounded once.
    double entryError = 0x1p-53;
    double tolerance = KrigingAccuracy{}.tolerance;  ///< a target with a larger bound of error is Inaccurate
};

/// The targets of CovarianceSystem::predict, one a column of `covariance`.
struct CovarianceTargets {
    Eigen::MatrixXd covariance;  ///< c0, n x m: with the data, never with error variances
    Eigen::MatrixXd drift;       ///< f0, m x p
    Eigen::VectorXd variance;    ///< C00, m
    /// Empty, or for each target the datum whose value it is by definition (same place, no error), or -1.
    std::vector<Eigen::Index> exactDatum;
    /// Empty, or for each target the absolute error of its c0 and C00; empty: each has been rounded once.
    Eigen::VectorXd entryError;
};

/// A factorised kriging system. Building costs n^3 / 3 flops, a target 2 n^2 to 6 n^2. Immutable; safe to
/// share between threads. All results depend on the input alone, bit by bit.
class CovarianceSystem {
  public:
    CovarianceSystem() = default;

    /// Never throws for bad numbers: see report().status.
    explicit CovarianceSystem(CovarianceProblem problem);

    const KrigingReport& report() const { return report_; }

    /// Estimates, variances and weights. If !report().ok(), or shapes do not match, every target is
    /// InvalidTarget.
    KrigingPrediction predict(const CovarianceTargets& targets, const PredictOptions& options = {}) const;

    /// Kriging of the mean: beta = (F'K^-1 F)^-1 F'K^-1 z with covariance (F'K^-1 F)^-1.
    DriftEstimate drift() const;

    /// Every datum predicted from all others, from this factorisation (Dubrule 1983):
    ///     z_i - estimate_i = (Q z)_i / Q_ii,   variance_i = 1 / Q_ii,
    ///     Q = K^-1 - K^-1 F (F'K^-1 F)^-1 F'K^-1.
    LeaveOneOut leaveOneOut() const;

    /// Columns of F that are linearly independent, in order of elimination.
    const std::vector<Eigen::Index>& independentDrift() const { return kept_; }

    /// The error that `tolerance` allows for an estimate of a value column, or for a variance of a field of
    /// variance `scale`.
    double allowedEstimateError(Eigen::Index column, double estimate) const;
    double allowedVarianceError(double variance, double scale) const;

    /// Error of K_ij relative to sqrt(K_ii K_jj), the factorisation's included: entryError + sqrt(n) eps.
    double entryNoise() const;

  private:
    /// Targets' drift in the factorised basis, and whether it can be estimated.
    struct TargetDrift {
        Eigen::MatrixXd kept;         // rank x m
        Eigen::RowVectorXd constant;  // m: multiple of the constant function
        std::vector<bool> estimable;
    };

    /// Equilibrated weights v = D^-1 w and multipliers; explained = C00 - variance, by the direct formula.
    struct Solution {
        Eigen::MatrixXd weights, multipliers;
        Eigen::RowVectorXd explained;
        double change = 0;  // the last refinement's, relative to the weights
    };

    /// Bounds of errors, in equilibrated units.
    struct Bounds {
        Eigen::MatrixXd estimate;     // value columns x m
        Eigen::RowVectorXd variance;  // m
    };
    /// Right-hand sides, one a column: equilibrated c0, internal drift, C00, and the entries' absolute error.
    struct Right {
        Eigen::MatrixXd covariance, drift;
        Eigen::RowVectorXd variance, entryError;
    };

    bool validate(const CovarianceProblem& problem);
    void equilibrate();
    void centreDrift(const Eigen::MatrixXd& drift);
    bool factoriseSingle();
    void factoriseDouble();
    bool decomposeDrift();
    bool orthogonaliseDrift();
    Eigen::MatrixXd carriedRows(Eigen::Index first, Eigen::Index count) const;
    void centreValues();
    void describe();
    bool careful() const;
    bool boundable() const;
    double inverseNorm() const;
    Eigen::RowVectorXd dualNormsAtMost() const;
    Eigen::RowVectorXd dualNorms() const;
    Bounds quickBounds(const Solution& solution, const Right& right, const Eigen::RowVectorXd& y) const;
    Bounds closeBounds(const Solution& solution, const Right& right) const;
    double smallestVariance() const;
    CovarianceSystem inDouble() const;
    template <class Scalar>
    double factoriseWith(Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& factor, double jitter) const;
    template <class Scalar>
    double estimateCondition(const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& factor) const;
    TargetDrift targetDrift(const Eigen::MatrixXd& drift) const;
    void solveLower(Eigen::MatrixXd& x) const;
    void solveUpper(Eigen::MatrixXd& x) const;
    Solution solveOnce(const Eigen::MatrixXd& c0, const Eigen::MatrixXd& f0) const;
    Solution solve(const Eigen::MatrixXd& c0, const Eigen::MatrixXd& f0) const;

    KrigingReport report_;
    Eigen::MatrixXd covariance_;  // D K D, lower half, without jitter
    Eigen::VectorXd scale_;       // D
    Eigen::MatrixXd factor_;      // L in its first n rows, lower half; (L^-1 D F)' and (L^-1 values_)' below
    Eigen::MatrixXf factorSingle_;  // the same, if report_.singlePrecision

    // Internal drift column j = (F_j - centre_j F_constant) * columnScale_j.
    Eigen::Index driftColumns_ = 0;
    Eigen::Index constantColumn_ = -1;  // of F, -1 if none
    double constant_ = 1;               // its value
    Eigen::RowVectorXd centre_, columnScale_;
    Eigen::MatrixXd drift_;                     // D F in the internal basis
    Eigen::MatrixXd keptDrift_;                 // its linearly independent columns
    Eigen::MatrixXd q_, r_;                     // L^-1 keptDrift_ = Q R
    Eigen::MatrixXd dependence_;                // dropped columns = kept columns * dependence_
    std::vector<Eigen::Index> kept_, dropped_;  // columns of F

    Eigen::MatrixXd rawValues_;
    Eigen::MatrixXd values_;                              // D (z - reference) / valueScale
    Eigen::RowVectorXd reference_, valueScale_, spread_;  // spread: largest |z - reference|
    Eigen::RowVectorXd dualNorm_;                         // |(I - Q Q') L^-1 values_| of each column

    double entryError_ = 0, tolerance_ = 0;
};

}  // namespace vlx
