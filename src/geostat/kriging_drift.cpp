// KrigingSystem's drift coefficients and leave-one-out.
#include <algorithm>
#include <cmath>

#include "kriging_names.h"
#include "variolux/geostat/kriging.h"

namespace vlx {

DriftEstimate KrigingSystem::drift() const {
    if (!report_.ok()) return {};
    DriftEstimate out = report_.generalisedCovariance ? generalisedDrift() : system_.drift();
    const Index p = out.coefficients.rows();
    // The polynomial columns are in scaled coordinates.
    VectorXd unit = VectorXd::Ones(p);
    if (drift_.polynomial >= DriftPolynomial::Linear)
        unit.segment(1, drift_.axes).setConstant(coordinateScale_);
    if (drift_.polynomial == DriftPolynomial::Quadratic)
        unit.segment(1 + drift_.axes, drift_.axes * (drift_.axes + 1) / 2)
            .setConstant(coordinateScale_ * coordinateScale_);
    out.coefficients = unit.asDiagonal() * out.coefficients;
    out.covariance = unit.asDiagonal() * out.covariance * unit.asDiagonal() / varianceScale_;
    return out;
}

/// Each coefficient as a target of its own; their covariance w'K w in the field's own covariance,
/// K = sill - gamma + errors.
DriftEstimate KrigingSystem::generalisedDrift() const {
    const Index n = errors_.size(), constant = constantColumn();
    CovarianceTargets targets;
    const Index p = driftRows(MatrixXd(0, dimension_), MatrixXd(0, external_.cols())).cols();
    targets.drift = MatrixXd::Identity(p, p);
    targets.variance = VectorXd::Zero(p);
    targets.covariance = MatrixXd::Zero(n, p);
    VectorXd sum = VectorXd::Zero(p);
    sum[constant] = drift_.polynomial == DriftPolynomial::None ? 1 / external_(0, constant) : 1;
    targets.covariance.col(constant) = level_ + sum[constant] * centreGamma_.array();
    const KrigingPrediction prediction = system_.predict(targets, {.weights = true});
    DriftEstimate out{prediction.estimate, {}};
    MatrixXd gamma(n, n);
    for (Index j = 0; j < n; ++j)
        for (Index i = 0; i < n; ++i) {
            gamma(i, j) = semivariance(model_, (places_.row(i) - places_.row(j)).norm());
            if (i == j) gamma(i, j) -= errors_[i];
            if (positions_.col(i) == positions_.col(j)) gamma(i, j) -= nugget_;
        }
    out.covariance = -prediction.weights * gamma * prediction.weights.transpose();
    const double sill = model_.bounded() ? structureSill_ : kInfinity;
    out.covariance(constant, constant) += sill * sum[constant] * sum[constant];
    if (!model_.bounded()) out.coefficients.row(constant).setConstant(kNaN);
    return out;
}

LeaveOneOut KrigingSystem::leaveOneOut() const {
    const auto n = static_cast<Index>(row_.size());
    const LeaveOneOut merged = system_.leaveOneOut();
    LeaveOneOut out;
    out.estimate = MatrixXd::Constant(n, dataValues_.cols(), kNaN);
    out.variance = VectorXd::Constant(n, kNaN);
    out.status.assign(static_cast<std::size_t>(n), TargetStatus::NotEstimable);
    if (!report_.ok()) return out;
    const RowVectorXd mean = driftRows(MatrixXd(0, dimension_), MatrixXd(0, external_.cols())).cols() == 0 &&
                                     drift_.mean.size() > 0
                                 ? drift_.mean
                                 : RowVectorXd(RowVectorXd::Zero(dataValues_.cols()));
    for (Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const Index r = row_[at];
        if (r < 0) {  // ignored: every other datum predicts it
            KrigingTargets target;
            target.points = dataPositions_.row(i);
            target.externalDrift = dataExternal_.row(i);
            const KrigingPrediction prediction = predict(target);
            out.estimate.row(i) = prediction.estimate.row(0);
            out.status[at] = prediction.status[0];
            out.variance[i] = kInfinity;
            continue;
        }
        // What the coincident others say of the field here: mean and variance.
        double precision = 0, exact = 0;
        RowVectorXd weighted = RowVectorXd::Zero(mean.size()), average = weighted;
        for (std::size_t j = 0; j < row_.size(); ++j) {
            if (row_[j] != r || j == at) continue;
            const auto other = static_cast<Index>(j);
            const double v = dataErrors_[other] * varianceScale_;
            if (v == 0) {
                exact += 1;
                average += dataValues_.row(other);
            } else {
                precision += 1 / v;
                weighted += dataValues_.row(other) / v;
            }
        }
        const double error = dataErrors_[i] * varianceScale_;
        const bool estimable = merged.status[static_cast<std::size_t>(r)] == TargetStatus::Ok;
        double variance = 0;  // of the field here, from all others
        if (exact > 0) {
            out.estimate.row(i) = average / exact;
        } else if (!estimable) {
            if (precision == 0) continue;
            out.estimate.row(i) = weighted / precision;
            variance = 1 / precision;
        } else {
            const double prior = std::max(0.0, merged.variance[r] - errors_[r]);
            const RowVectorXd prediction = merged.estimate.row(r) + mean;
            const double gain = prior / (1 + prior * precision);
            out.estimate.row(i) = prediction + gain * (weighted - precision * prediction);
            variance = precision == 0 ? merged.variance[r] - error : gain;
        }
        out.status[at] = TargetStatus::Ok;
        out.variance[i] = (variance + error) / varianceScale_;
    }
    return out;
}

}  // namespace vlx
