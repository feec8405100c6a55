#pragma once

#include <Eigen/Core>
#include <cstddef>

#include "variolux/geostat/covariance_system.h"
#include "variolux/reconstruct/inspection.h"

namespace vlx {

/// Most points of a cloud that are kept.
inline constexpr std::size_t kCloudPoints = 800;

/// The cloud of data at `positions` (n x d) with `colours` (n x 3) and summed error variances (n), and the
/// classes of `variogram`, put into `inspection`.
void setVariogram(RegionInspection& inspection, const EmpiricalVariogram& variogram,
                  const Eigen::MatrixXd& positions, const Eigen::MatrixXd& colours,
                  const Eigen::VectorXd& errorVariances);

/// From a kriging system's leave-one-out of data whose first three value columns are `colours` (n x 3); what
/// is not a number is left out.
CrossValidation crossValidate(const LeaveOneOut& left, const Eigen::MatrixXd& colours);

}  // namespace vlx
