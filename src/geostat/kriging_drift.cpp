// KrigingSystem's drift coefficients and leave-one-out.
#include <algorithm>
#include <cmath>

#include "geostat/kriging_names.h"
#include "geostat/more_digits.h"
#include "variolux/geostat/kriging.h"

namespace vlx {

DriftEstimate KrigingSystem::drift() const {
    const Index p = std::max(Index{0}, driftColumns());
    DriftEstimate out;
    if (!report_.ok()) {
        out.coefficients = out.coefficientError = MatrixXd::Constant(p, problem_.values.cols(), kNaN);
        out.covariance = MatrixXd::Constant(p, p, kNaN);
        out.varianceError = VectorXd::Constant(p, kNaN);
        out.accurate = false;
        return out;
    }
    out = report_.generalisedCovariance ? generalisedDrift() : system_.drift();
    // The polynomial columns are in scaled coordinates.
    VectorXd unit = VectorXd::Ones(p);
    if (problem_.drift.polynomial >= DriftPolynomial::Linear)
        unit.segment(1, problem_.drift.axes).setConstant(coordinateScale_);
    if (problem_.drift.polynomial == DriftPolynomial::Quadratic)
        unit.segment(1 + problem_.drift.axes, problem_.drift.axes * (problem_.drift.axes + 1) / 2)
            .setConstant(coordinateScale_ * coordinateScale_);
    out.coefficients = unit.asDiagonal() * out.coefficients;
    out.covariance = unit.asDiagonal() * out.covariance * unit.asDiagonal() / varianceScale_;
    out.coefficientError = unit.asDiagonal() * out.coefficientError;
    out.varianceError = unit.cwiseAbs2().asDiagonal() * out.varianceError / varianceScale_;
    if (moreDigits_) (this->*moreDigits_->drift)(out);
    return out;
}

/// Each coefficient as a target of its own; their covariance w'K w in the field's own covariance,
/// K = sill - gamma + errors.
DriftEstimate KrigingSystem::generalisedDrift() const {
    const Index n = errors_.size(), constant = constantColumn();
    CovarianceTargets targets;
    const Index p = driftColumns();
    targets.drift = MatrixXd::Identity(p, p);
    targets.variance = VectorXd::Zero(p);
    targets.covariance = MatrixXd::Zero(n, p);
    VectorXd sum = VectorXd::Zero(p);
    sum[constant] = problem_.drift.polynomial == DriftPolynomial::None ? 1 / external_(0, constant) : 1;
    targets.covariance.col(constant) = level_ + sum[constant] * centreGamma_.array();
    const KrigingPrediction prediction = system_.predict(targets, {.weights = true});
    DriftEstimate out;
    out.coefficients = prediction.estimate;
    out.coefficientError = prediction.estimateError;
    for (const TargetStatus status : prediction.status)
        out.accurate = out.accurate && status != TargetStatus::Inaccurate;
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
    // Rounding, and the weights' error, which the bound for the generalised variance has.
    const RowVectorXd size = prediction.weights.cwiseAbs().rowwise().sum().transpose();
    const double largest = gamma.size() > 0 ? gamma.cwiseAbs().maxCoeff() : 0;
    out.varianceError = prediction.varianceError;
    for (Index j = 0; j < p; ++j) {
        out.varianceError[j] += system_.entryNoise() * largest * size[j] * size[j];
        if (j == constant && !model_.bounded()) continue;
        out.accurate =
            out.accurate && out.varianceError[j] <=
                                problem_.accuracy.tolerance * std::max(out.covariance(j, j), structureSill_);
    }
    if (!model_.bounded()) {
        out.coefficients.row(constant).setConstant(kNaN);
        out.coefficientError.row(constant).setConstant(kNaN);
        out.varianceError[constant] = kNaN;
    }
    return out;
}

LeaveOneOut KrigingSystem::leaveOneOut() const {
    const auto n = problem_.values.rows();
    LeaveOneOut merged = system_.leaveOneOut();
    LeaveOneOut out;
    out.estimate = MatrixXd::Constant(n, problem_.values.cols(), kNaN);
    out.variance = VectorXd::Constant(n, kNaN);
    out.status.assign(static_cast<std::size_t>(n), TargetStatus::NotEstimable);
    out.estimateError = out.estimate;
    out.varianceError = out.variance;
    if (!report_.ok()) return out;
    if (moreDigits_) (this->*moreDigits_->leaveOneOut)(merged);
    out.digits = merged.digits;
    const RowVectorXd mean = driftColumns() == 0 && problem_.drift.mean.size() > 0
                                 ? problem_.drift.mean
                                 : RowVectorXd(RowVectorXd::Zero(problem_.values.cols()));
    for (Index i = 0; i < n; ++i) {
        const auto at = static_cast<std::size_t>(i);
        const Index r = row_[at];
        if (r < 0) {  // ignored: every other datum predicts it
            KrigingTargets target;
            target.points = problem_.positions.row(i);
            target.externalDrift = problem_.drift.external.row(i);
            const KrigingPrediction prediction = predict(target);
            out.estimate.row(i) = prediction.estimate.row(0);
            out.estimateError.row(i) = prediction.estimateError.row(0);
            out.varianceError[i] = 0;
            out.digits = std::max(out.digits, prediction.digits);
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
            const double v = problem_.errorVariances[other] * varianceScale_;
            if (v == 0) {
                exact += 1;
                average += problem_.values.row(other);
            } else {
                precision += 1 / v;
                weighted += problem_.values.row(other) / v;
            }
        }
        const double error = problem_.errorVariances[i] * varianceScale_;
        const TargetStatus status = merged.status[static_cast<std::size_t>(r)];
        const bool estimable = status != TargetStatus::NotEstimable;
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
        // Twins only shrink the share that the others' prediction has.
        const bool alone = exact > 0 || !estimable;
        out.status[at] = alone ? TargetStatus::Ok : status;
        out.variance[i] = (variance + error) / varianceScale_;
        out.varianceError[i] = (alone ? 0 : merged.varianceError[r]) / varianceScale_;
        if (alone)
            out.estimateError.row(i) = 4 * kEpsilon * out.estimate.row(i).cwiseAbs();
        else
            out.estimateError.row(i) = merged.estimateError.row(r);
    }
    return out;
}

}  // namespace vlx
