#pragma once

#include <memory>
#include <vector>

#include "variolux/geostat/kriging.h"

namespace vlx {

/// Answers to one question, one a row, by the digits that they were found with.
struct PreciseAnswer {
    int digits = 16;
    Eigen::MatrixXd estimate;  ///< rows x value columns
    Eigen::VectorXd variance;
    Eigen::MatrixXd
        estimateError;  ///< difference from the answer with fewer digits, infinite if there is none
    Eigen::VectorXd varianceError;
    Eigen::MatrixXd estimateScale;  ///< sizes that the tolerance is relative to
    Eigen::VectorXd varianceScale;
    std::vector<bool> accurate;    ///< the errors are within the tolerance
    std::vector<bool> determined;  ///< leave-one-out: the other data determine the drift
    /// predict: rows x data, if asked for; drift: the covariance of the coefficients.
    Eigen::MatrixXd matrix;
};

/// A kriging problem solved in 50, 100, 200 and 400 decimal digits, one after the other, until two answers
/// agree; the first to compare with is the one in double precision. All numbers of the problem are taken as
/// exact, and everything that follows from them (merged data, distances, covariances, drift) is computed with
/// the digits of the solution. Each factorisation is kept. Safe to share between threads.
class PreciseKriging {
  public:
    /// row[i]: the row of datum i in the system, coincident data sharing one; -1 = ignored. drift: the
    /// columns to use, in the order polynomial (in x - origin), external.
    PreciseKriging(const KrigingProblem& problem, const Eigen::VectorXd& origin,
                   const std::vector<Eigen::Index>& row, const std::vector<Eigen::Index>& drift);
    ~PreciseKriging();

    /// The targets `which` of `targets`, which must be valid. `known` is the answer in double precision.
    PreciseAnswer predict(const PreciseAnswer& known, const KrigingTargets& targets,
                          const std::vector<Eigen::Index>& which, const KrigingPredictOptions& options) const;
    /// The coefficients of the chosen drift columns.
    PreciseAnswer drift(const PreciseAnswer& known) const;
    /// Every row of the system (coincident data together) from all others.
    PreciseAnswer leaveOneOut(const PreciseAnswer& known) const;

  private:
    struct Levels;
    std::unique_ptr<Levels> levels_;
};

}  // namespace vlx
