#pragma once

#include "variolux/geostat/kriging.h"

namespace vlx::testing {

/// Kriging as the textbook writes it, in 400 digits: the bordered matrix by Gaussian elimination. Written
/// apart from the library, and slow. Shape of Matern: 1/2, 3/2, 5/2 or 7/2. Coincident data only with errors.
struct ExactKriging {
    Eigen::MatrixXd estimate;  ///< targets x value columns
    Eigen::VectorXd variance;
};
ExactKriging exactKriging(const KrigingProblem& problem, const KrigingTargets& targets);

/// Coefficients of the drift in powers of x - origin and their variances (bounded models).
ExactKriging exactDrift(const KrigingProblem& problem, const Eigen::VectorXd& origin);

/// The problem without datum i, which becomes the target: a point without the nugget's share.
std::pair<KrigingProblem, KrigingTargets> leftOut(const KrigingProblem& problem, Eigen::Index datum);

}  // namespace vlx::testing
