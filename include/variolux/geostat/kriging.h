#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "variolux/geostat/covariance_system.h"
#include "variolux/geostat/variogram_model.h"

/// Kriging of scattered data: best linear unbiased prediction of a random field Z from data
///     z_i = Z(x_i) + e_i,    Var[e_i] = v_i known (measurement-error variance, 0 = exact),
///     Z(x) = drift(x) + residual with variogram gamma(h), h = |T (x - y)|.
/// Sources: Matheron 1971; Cressie, Statistics for Spatial Data (1993), 3.2 to 3.4; Chiles and Delfiner,
/// Geostatistics (2nd ed. 2012), ch. 3; Wackernagel, Multivariate Geostatistics; Yue and Nishita's eq. (1) to
/// (11), with the error variances where they belong: plus on the covariance diagonal (minus on a variogram
/// diagonal).
///
/// Nugget or error? The *nugget* belongs to the field: two data at one place share it, a target that is
/// bitwise at a datum sees it (so that error-free data are reproduced exactly), block averages do not, but
/// those of cells (KrigingTargets::cellAxes). An
/// *error variance* belongs to one datum: it is on the diagonal only, twins at one place have independent
/// errors, and the prediction is of Z, without error. Monte Carlo noise is an error variance.
///
/// Limits of the answer are documented conventions, not accidents:
///   coincident data          merged by inverse variance (a sufficient statistic); error-free twins are
///                            averaged and win over any with errors
///   infinite error variance  the datum is ignored, whatever its other numbers (NaN too)
///   zero sill, zero error    the limit of equal small variances: the drift's least squares fit, variance 0
///   unbounded model          generalised covariance (needs a constant in the drift)
///   range >> domain          the same, so that no digits are lost in sill - gamma
///   dependent drift columns  dropped; targets that need them are flagged NotEstimable
///   no data                  known mean: the mean and the sill; otherwise TooFewData
///   digits lost in double    solved again with more (KrigingAccuracy), counted in the answer; a target that
///   is
///                            still not as good as was asked for is flagged Inaccurate, with its error's
///                            bound
namespace vlx {

namespace kernels {
class ModelColumns;
}
class PreciseKriging;

/// Polynomial part of the drift. `None` is a known mean (simple kriging) unless external columns are given.
enum class DriftPolynomial {
    None,       ///< known mean, DriftModel::mean
    Constant,   ///< 1: ordinary kriging
    Linear,     ///< 1, x, y, ...: universal kriging
    Quadratic,  ///< 1, x, y, ..., x^2, xy, y^2, ...
};

/// E[Z(x)] as a linear combination of known functions with unknown coefficients.
struct DriftModel {
    DriftPolynomial polynomial = DriftPolynomial::Constant;
    /// The polynomial uses the first `axes` coordinates; 0 uses all. (With a composite distance the later
    /// coordinates are features, not places.)
    Eigen::Index axes = 0;
    /// External drift: one column a function, one row a datum (n x q); n x 0 or empty if none. Targets bring
    /// their own rows.
    Eigen::MatrixXd external;
    /// Known mean of each value column; empty = 0. Used when there is no drift column at all.
    Eigen::RowVectorXd mean;
};

struct KrigingProblem {
    VariogramModel model;            ///< units: values squared, coordinates
    Eigen::MatrixXd positions;       ///< n x d, any d >= 1; far from the origin does no harm
    Eigen::MatrixXd values;          ///< n x c: columns that share positions, errors and model (R, G, B, ...)
    Eigen::VectorXd errorVariances;  ///< n, >= 0, +inf = ignore the datum; empty = all exact
    DriftModel drift;
    /// T of h = |T (x - y)|, k x d: anisotropyTransform(), or the weights of a composite distance; empty =
    /// identity.
    Eigen::MatrixXd transform;
    KrigingPrecision precision = KrigingPrecision::Double;
    KrigingAccuracy accuracy;  ///< of estimates, variances, drift and leave-one-out
};

/// Where to predict: points, or averages of Z over blocks (change of support).
struct KrigingTargets {
    Eigen::MatrixXd points;  ///< k x d
    /// Empty: each point is a target of its own (m = k). Otherwise m + 1 increasing indices: block t is the
    /// points [begin[t], begin[t + 1]), as a weighted mean. A block of one point is Z there without its
    /// nugget.
    std::vector<Eigen::Index> begin;
    /// Of the nugget of a block's points, each at a place of its own: 0: none. Otherwise they stand for cells
    /// with a nugget each, shared by the data whose first `cellAxes` coordinates are bitwise theirs (the
    /// others may be features).
    Eigen::Index cellAxes = 0;
    Eigen::VectorXd weights;        ///< k, of each point in its block (normalised here); empty = equal
    Eigen::MatrixXd externalDrift;  ///< m x q: the external functions at the target (averaged over its block)

    Eigen::Index count() const {
        return begin.empty() ? points.rows() : static_cast<Eigen::Index>(begin.size()) - 1;
    }
};

/// Blocks that are one footprint (offsets k x d, e.g. a pixel filter's nodes, and weights k) moved to each
/// centre (m x d).
KrigingTargets blockTargets(const Eigen::MatrixXd& centres, const Eigen::MatrixXd& offsets,
                            const Eigen::VectorXd& weights = {});

/// What to predict at the targets.
enum class KrigingQuantity {
    Field,  ///< Z
    Drift,  ///< its expectation, f0' beta: kriging of the mean where the drift is constant
};

struct KrigingPredictOptions {
    KrigingQuantity quantity = KrigingQuantity::Field;
    bool weights = false;  ///< return the weights of all data (merged data share theirs by inverse variance)
};

/// Data, model and drift, factorised once; then any number of targets, the drift's coefficients, and
/// leave-one-out.
///
///     KrigingProblem problem;
///     problem.model = {.nugget = 0, .structures = {{StructureType::Stable, 0.4, 2.5, 1.2}}};
///     problem.positions = ...; problem.values = ...; problem.errorVariances = ...;
///     const KrigingSystem system(problem);                     // ordinary kriging
///     if (!system.report().ok()) ...                           // system.report().message says why
///     const KrigingPrediction prediction = system.predict({.points = targets});
///
/// Immutable; safe to share between threads.
class KrigingSystem {
  public:
    explicit KrigingSystem(const KrigingProblem& problem) : KrigingSystem(problem, &moreDigits()) {}

    /// In double precision only, as with accuracy.mostDigits = 0. A program that makes all its systems so
    /// does not link the arithmetic with more digits, whose tables take it some tenths of a second at each
    /// start.
    static KrigingSystem inDouble(const KrigingProblem& problem) { return KrigingSystem(problem, nullptr); }

    const KrigingReport& report() const { return report_; }

    /// Estimates and kriging variances of the targets, within the problem's accuracy where their status is
    /// Ok. Wrong shapes, and a system that is not ok(), make every target InvalidTarget: NaN, in the usual
    /// shapes.
    KrigingPrediction predict(const KrigingTargets& targets, const KrigingPredictOptions& options = {}) const;

    /// Coefficients of the drift (kriging of the mean) with their covariance, in the order polynomial,
    /// external. The polynomial is in x - driftOrigin(): raw powers of coordinates far from the origin would
    /// lose all digits. A constant drift's only coefficient is the GLS mean. NaN if the system is not ok().
    DriftEstimate drift() const;
    const Eigen::VectorXd& driftOrigin() const { return origin_; }

    /// Every datum from all others; coincident data are left out one at a time. NaN if the system is not
    /// ok().
    LeaveOneOut leaveOneOut() const;

  private:
    struct Block;
    struct MoreDigits;
    KrigingSystem(const KrigingProblem& problem, const MoreDigits* moreDigits);
    static const MoreDigits& moreDigits();
    bool validate();
    void chooseScales();
    bool ignored(Eigen::Index datum) const;
    std::vector<std::pair<double, Eigen::Index>> sortedSums() const;
    void merge();
    void mergeGroups(const std::vector<std::pair<double, Eigen::Index>>& sums);
    void assemble();
    double entryError() const;
    void completeReport();
    Eigen::MatrixXd place(const Eigen::MatrixXd& points) const;
    Eigen::MatrixXd driftRows(const Eigen::MatrixXd& points, const Eigen::MatrixXd& external) const;
    Eigen::Index driftColumns() const;
    Eigen::Index constantColumn() const;
    DriftEstimate generalisedDrift() const;
    Block block(const KrigingTargets& targets, Eigen::Index target) const;
    CovarianceTargets lowerTargets(const KrigingTargets& targets, KrigingQuantity quantity) const;
    bool mayUseMoreDigits() const;
    void prepareMoreDigits();
    const PreciseKriging& precise() const;
    void predictPrecisely(const KrigingTargets& targets, const KrigingPredictOptions& options,
                          const CovarianceTargets& lower, KrigingPrediction& prediction) const;
    void estimateDriftPrecisely(DriftEstimate& estimate) const;
    void leaveOneOutPrecisely(LeaveOneOut& merged) const;

    KrigingProblem problem_;  // as given, with an error variance for each datum
    KrigingReport report_;
    VariogramModel model_;  // ranges in scaled coordinates, sills in scaled variances
    std::shared_ptr<const kernels::ModelColumns> columns_;
    double nugget_ = 0, structureSill_ = 0;
    Eigen::VectorXd origin_;
    double coordinateScale_ = 1, varianceScale_ = 1;  // powers of two: scaled = original * scale

    // Factorised data, after merging.
    Eigen::MatrixXd positions_;                                 // d x n, as given
    Eigen::MatrixXd places_;                                    // n (rounded up) x k: scaled and transformed
    std::vector<std::pair<Eigen::Index, Eigen::Index>> twins_;  // at one place, not merged
    Eigen::VectorXd errors_;                                    // scaled variances
    Eigen::MatrixXd external_;                                  // n x q
    Eigen::MatrixXd values_;                                    // n x c
    Eigen::VectorXd centreGamma_;                               // generalised covariance: gamma(x_i - centre)
    double level_ = 0;                                          // and its constant, max centreGamma_

    // Data as given: one entry a datum.
    std::vector<Eigen::Index> row_;  // its factorised datum, -1 = ignored
    Eigen::VectorXd share_;          // its share of that datum's weight

    CovarianceSystem system_;

    const MoreDigits* moreDigits_;  // null: none
    struct Lazy;
    std::shared_ptr<Lazy> lazy_;  // the system with more digits, once it has been needed
    /// Where double precision finds drift columns dependent: the drift alone, by least squares, to say
    /// whether the columns are, or only seem to be through an ill-conditioned covariance.
    std::shared_ptr<const CovarianceSystem> driftAlone_;
};

}  // namespace vlx
