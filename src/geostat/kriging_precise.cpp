// KrigingSystem's answers with more digits, where double precision has lost too many.
#include <algorithm>
#include <cmath>
#include <mutex>

#include "geostat/kriging_names.h"
#include "geostat/more_digits.h"
#include "geostat/precise_kriging.h"
#include "variolux/geostat/kriging.h"

namespace vlx {

struct KrigingSystem::Lazy {
    std::once_flag once;
    std::unique_ptr<PreciseKriging> precise;
};

const KrigingSystem::MoreDigits& KrigingSystem::moreDigits() {
    static constexpr MoreDigits table = {&KrigingSystem::prepareMoreDigits, &KrigingSystem::predictPrecisely,
                                         &KrigingSystem::estimateDriftPrecisely,
                                         &KrigingSystem::leaveOneOutPrecisely};
    return table;
}

bool KrigingSystem::mayUseMoreDigits() const {
    const Index n = errors_.size();
    return n > 0 && n <= problem_.accuracy.mostData && problem_.accuracy.mostDigits >= 50 &&
           !report_.degenerate;
}

void KrigingSystem::prepareMoreDigits() {
    if (!report_.ok() || !mayUseMoreDigits()) return;
    lazy_ = std::make_shared<Lazy>();
    if (report_.droppedDrift == 0) return;
    const Index n = errors_.size();
    CovarianceProblem problem;
    problem.covariance = MatrixXd::Identity(n, n);
    problem.drift = driftRows(positions_.transpose(), external_);
    problem.values = MatrixXd(n, 0);
    CovarianceSystem alone(std::move(problem));
    if (alone.report().droppedDrift >= report_.droppedDrift) return;
    report_.droppedDrift = alone.report().droppedDrift;
    driftAlone_ = std::make_shared<const CovarianceSystem>(std::move(alone));
}

const PreciseKriging& KrigingSystem::precise() const {
    std::call_once(lazy_->once, [&] {
        const CovarianceSystem& system = driftAlone_ ? *driftAlone_ : system_;
        lazy_->precise = std::make_unique<PreciseKriging>(problem_, origin_, row_, system.independentDrift());
    });
    return *lazy_->precise;
}

void KrigingSystem::predictPrecisely(const KrigingTargets& targets, const KrigingPredictOptions& options,
                                     const CovarianceTargets& lower, KrigingPrediction& prediction) const {
    if (!lazy_) return;
    const Index m = prediction.estimate.rows();
    std::vector<Index> which;
    for (Index t = 0; t < m; ++t) {
        const TargetStatus status = prediction.status[static_cast<std::size_t>(t)];
        const bool doubtful =
            driftAlone_ && (status == TargetStatus::Ok || status == TargetStatus::NotEstimable);
        if (status == TargetStatus::Inaccurate || doubtful) which.push_back(t);
    }
    if (which.empty()) return;
    std::vector<TargetStatus> estimable(static_cast<std::size_t>(m), TargetStatus::Ok);
    if (driftAlone_) {
        CovarianceTargets drift = lower;
        drift.covariance.setZero();
        drift.exactDatum.clear();
        estimable = driftAlone_->predict(drift).status;
    }
    PreciseAnswer known;
    known.estimate = prediction.estimate(which, Eigen::all);
    known.variance = prediction.variance(which);
    const PreciseAnswer answer = precise().predict(known, targets, which, options);
    for (std::size_t k = 0; k < which.size(); ++k) {
        const Index t = which[k], row = static_cast<Index>(k);
        TargetStatus& status = prediction.status[static_cast<std::size_t>(t)];
        if (driftAlone_) status = TargetStatus::Inaccurate;
        if (answer.accurate.empty()) continue;
        prediction.estimate.row(t) = answer.estimate.row(row);
        prediction.variance[t] = std::max(0.0, answer.variance[row]);
        prediction.estimateError.row(t) = answer.estimateError.row(row);
        prediction.varianceError[t] = answer.varianceError[row];
        if (options.weights) prediction.weights.row(t) = answer.matrix.row(row);
        status = answer.accurate[k] ? TargetStatus::Ok : TargetStatus::Inaccurate;
        if (estimable[static_cast<std::size_t>(t)] == TargetStatus::NotEstimable)
            status = TargetStatus::NotEstimable;
        ++prediction.moreDigits;
    }
    prediction.digits = std::max(prediction.digits, answer.digits);
}

void KrigingSystem::estimateDriftPrecisely(DriftEstimate& estimate) const {
    if (!lazy_ || (estimate.accurate && !driftAlone_)) return;
    const std::vector<Index>& columns =
        driftAlone_ ? driftAlone_->independentDrift() : system_.independentDrift();
    PreciseAnswer known;
    known.estimate = estimate.coefficients(columns, Eigen::all);
    known.variance = estimate.covariance.diagonal()(columns);
    const PreciseAnswer answer = precise().drift(known);
    if (answer.accurate.empty()) return;
    estimate.digits = answer.digits;
    estimate.accurate =
        std::find(answer.accurate.begin(), answer.accurate.end(), false) == answer.accurate.end();
    estimate.coefficients.setZero();
    estimate.covariance.setZero();
    estimate.coefficients(columns, Eigen::all) = answer.estimate;
    estimate.covariance(columns, columns) = answer.matrix;
    estimate.coefficientError(columns, Eigen::all) = answer.estimateError;
    estimate.varianceError(columns) = answer.varianceError;
    if (model_.bounded()) return;
    const Index constant = constantColumn();
    estimate.coefficients.row(constant).setConstant(kNaN);
    estimate.coefficientError.row(constant).setConstant(kNaN);
    estimate.covariance(constant, constant) = kInfinity;
    estimate.varianceError[constant] = kNaN;
}

/// Of the merged data, in the system's own units: values less the known mean, scaled variances.
void KrigingSystem::leaveOneOutPrecisely(LeaveOneOut& merged) const {
    const auto& status = merged.status;
    const bool doubtful = std::find(status.begin(), status.end(), TargetStatus::Inaccurate) != status.end();
    if (!lazy_ || (!doubtful && !driftAlone_)) return;
    const bool known = driftColumns() == 0 && problem_.drift.mean.size() > 0;
    PreciseAnswer first;
    first.estimate = merged.estimate;
    if (known) first.estimate.rowwise() += problem_.drift.mean;
    first.variance = merged.variance / varianceScale_;
    for (const TargetStatus s : status) first.determined.push_back(s != TargetStatus::NotEstimable);
    const PreciseAnswer answer = precise().leaveOneOut(first);
    if (answer.accurate.empty()) return;
    merged.digits = answer.digits;
    merged.estimate = answer.estimate;
    if (known) merged.estimate.rowwise() -= problem_.drift.mean;
    merged.variance = answer.variance * varianceScale_;
    merged.estimateError = answer.estimateError;
    merged.varianceError = answer.varianceError * varianceScale_;
    for (std::size_t i = 0; i < status.size(); ++i)
        merged.status[i] = !answer.determined[i] ? TargetStatus::NotEstimable
                           : answer.accurate[i]  ? TargetStatus::Ok
                                                 : TargetStatus::Inaccurate;
}

}  // namespace vlx
