#include "reconstruct/common/inspection.h"

#include <cmath>

namespace vlx {

void setVariogram(RegionInspection& inspection, const EmpiricalVariogram& variogram,
                  const Eigen::MatrixXd& positions, const Eigen::MatrixXd& colours,
                  const Eigen::VectorXd& errorVariances) {
    inspection.classes = variogram.bins;
    const double reach = variogram.bins.empty() ? 0 : variogram.bins.back().upper;
    const std::vector<VariogramCloudPoint> cloud = variogramCloud(positions, colours, reach, errorVariances);
    inspection.pairs = static_cast<std::int64_t>(cloud.size());
    const std::size_t step = (cloud.size() + kCloudPoints - 1) / kCloudPoints;
    for (std::size_t i = 0; i < cloud.size(); i += step)
        inspection.cloud.push_back({cloud[i].distance, cloud[i].semivariance});
}

CrossValidation crossValidate(const LeaveOneOut& left, const Eigen::MatrixXd& colours) {
    CrossValidation result;
    double squares = 0;
    for (Eigen::Index i = 0; i < left.estimate.rows() && i < colours.rows(); ++i) {
        const double square = (left.estimate.row(i).head(3) - colours.row(i)).squaredNorm();
        if (!std::isfinite(square) || !(left.variance[i] > 0)) continue;
        ++result.data;
        squares += square;
        result.meanSquareScore += square / left.variance[i];
    }
    if (result.data == 0) return result;
    result.rmse = std::sqrt(squares / result.data);
    result.meanSquareScore /= result.data;
    return result;
}

}  // namespace vlx
