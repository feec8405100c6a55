#pragma once

#include <Eigen/Core>
#include <limits>

/// Names that the source files of this library share.
namespace vlx {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

inline constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
inline constexpr double kInfinity = std::numeric_limits<double>::infinity();
inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Refinement of a float factor's weights has converged: their last change, relative to them.
inline constexpr double kConverged = 1e-12;

}  // namespace vlx
