#include "variolux/geostat/kriging.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

#include "geostat/entry_error.h"
#include "geostat/kernels.h"
#include "geostat/kriging_names.h"
#include "geostat/more_digits.h"

namespace vlx {
/// One target: a point, or the points of a block with weights that sum to 1.
struct KrigingSystem::Block {
    MatrixXd points;   // k x d
    VectorXd weights;  // k
    bool isPoint = true;
    bool valid = true;
};

namespace {

/// Points, one a row, with rows of zeros up to whole vectors.
MatrixXd padded(const MatrixXd& points) {
    MatrixXd out = MatrixXd::Zero((points.rows() + 7) / 8 * 8, points.cols());
    out.topRows(points.rows()) = points;
    return out;
}

/// The mean covariance, or semivariance, between the points of a block. Blocks that are one footprint moved
/// have the same: it is computed once.
class Footprint {
  public:
    double meanInside(const MatrixXd& places, const VectorXd& weights, const kernels::ModelColumns& model,
                      bool semivariances) {
        MatrixXd offsets = places.rowwise() - places.row(0);
        if (offsets.rows() == offsets_.rows() && offsets == offsets_ && weights == weights_) return mean_;
        offsets_ = std::move(offsets);
        weights_ = weights;
        const MatrixXd to = padded(offsets_);
        VectorXd means(to.rows());
        model.ofBlock(to.data(), to.rows(), offsets_, weights_.data(), offsets_.rows(), semivariances,
                      means.data());
        mean_ = weights_.dot(means.head(offsets_.rows()));
        return mean_;
    }

  private:
    MatrixXd offsets_;
    VectorXd weights_;
    double mean_ = 0;
};

}  // namespace

KrigingTargets blockTargets(const MatrixXd& centres, const MatrixXd& offsets, const VectorXd& weights) {
    KrigingTargets targets;
    const Index m = centres.rows(), k = offsets.rows();
    targets.points.resize(m * k, centres.cols());
    targets.begin.push_back(0);
    for (Index t = 0; t < m; ++t) {
        targets.points.middleRows(t * k, k) = offsets.rowwise() + centres.row(t);
        targets.begin.push_back((t + 1) * k);
    }
    if (weights.size() > 0) targets.weights = weights.replicate(m, 1);
    return targets;
}

KrigingSystem::KrigingSystem(const KrigingProblem& problem, const MoreDigits* moreDigits)
    : problem_(problem), moreDigits_(moreDigits) {
    if (!validate()) {
        report_.status = KrigingStatus::InvalidInput;
        return;
    }
    chooseScales();
    merge();
    assemble();
    completeReport();
}

/// Scaled and transformed coordinates, one point a row. Untransformed coordinates are scaled but not
/// centred: their differences are then as exact as the input.
MatrixXd KrigingSystem::place(const MatrixXd& points) const {
    if (problem_.transform.size() == 0) return points * coordinateScale_;
    return (points.rowwise() - origin_.transpose()) * (coordinateScale_ * problem_.transform).transpose();
}

Index KrigingSystem::driftColumns() const {
    const Index d = problem_.drift.axes;
    Index columns = problem_.drift.external.cols();
    if (problem_.drift.polynomial != DriftPolynomial::None) columns += 1;
    if (problem_.drift.polynomial >= DriftPolynomial::Linear) columns += d;
    if (problem_.drift.polynomial == DriftPolynomial::Quadratic) columns += d * (d + 1) / 2;
    return columns;
}

MatrixXd KrigingSystem::driftRows(const MatrixXd& points, const MatrixXd& external) const {
    const Index m = points.rows(), d = problem_.drift.axes;
    const Index columns = driftColumns() - external.cols();
    MatrixXd rows(m, columns + external.cols());
    rows.rightCols(external.cols()) = external;
    if (columns > 0) rows.col(0).setOnes();
    if (columns > 1) {
        const MatrixXd x = (points.leftCols(d).rowwise() - origin_.head(d).transpose()) * coordinateScale_;
        rows.middleCols(1, d) = x;
        if (problem_.drift.polynomial == DriftPolynomial::Quadratic) {
            Index column = 1 + d;
            for (Index a = 0; a < d; ++a)
                for (Index b = a; b < d; ++b) rows.col(column++) = x.col(a).cwiseProduct(x.col(b));
        }
    }
    return rows;
}

/// Of the covariance matrix, relative to its diagonal. Increments add up to four semivariances.
double KrigingSystem::entryError() const {
    const bool transformed = problem_.transform.size() > 0 && places_.size() > 0;
    const double places = transformed ? placeError(model_, places_.cwiseAbs().maxCoeff()) : 0;
    if (report_.generalisedCovariance) return 2 * kEntryRounding + places / level_;
    return kEntryRounding + (structureSill_ > 0 ? places / structureSill_ : 0);
}

void KrigingSystem::assemble() {
    const Index n = errors_.size();
    CovarianceProblem problem;
    problem.precision = problem_.precision;
    problem.tolerance = problem_.accuracy.tolerance;
    problem.drift = driftRows(positions_.transpose(), external_);
    problem.values = values_;
    if (problem.drift.cols() == 0 && problem_.drift.mean.size() > 0)
        problem.values.rowwise() -= problem_.drift.mean;

    columns_ = std::make_shared<kernels::ModelColumns>(model_);
    const auto semivariancesTo = [&](const VectorXd& point, Index first, double* out) {
        columns_->semivariances(places_.data(), places_.rows(), places_.cols(), point.data(), first, n, out);
    };
    VectorXd column(places_.rows() + 8);  // whole vectors are written
    if (n > 0 && constantColumn() >= 0) {
        const VectorXd centre = place(origin_.transpose()).transpose();
        const double radius =
            std::sqrt((places_.topRows(n).rowwise() - centre.transpose()).rowwise().squaredNorm().maxCoeff());
        if (!model_.bounded() || (radius > 0 && semivariance(model_, 2 * radius) < 0.1 * structureSill_)) {
            report_.generalisedCovariance = true;
            semivariancesTo(centre, 0, column.data());
            centreGamma_ = column.head(n);
            level_ = centreGamma_.maxCoeff();
            if (level_ == 0) level_ = structureSill_;
        }
    }
    MatrixXd& k = problem.covariance;
    k.resize(n, n);
    VectorXd point(places_.cols());
    for (Index j = 0; j < n; ++j) {
        point = places_.row(j).transpose();
        auto lower = k.col(j).tail(n - j);
        if (report_.generalisedCovariance) {
            semivariancesTo(point, j, column.data());
            lower = (level_ + centreGamma_[j]) + centreGamma_.tail(n - j).array() -
                    column.segment(j, n - j).array();
            k(j, j) = level_ + 2 * centreGamma_[j];
        } else {
            columns_->covariances(places_.data(), places_.rows(), places_.cols(), point.data(), j, n,
                                  column.data());
            lower = column.segment(j, n - j);
            k(j, j) = structureSill_;
        }
        k(j, j) += nugget_ + errors_[j];
    }
    // Data at one place that were not merged (their external drift differs) share the nugget.
    for (const auto& [i, j] : twins_) k(std::max(i, j), std::min(i, j)) += nugget_;
    problem.entryError = entryError();
    system_ = CovarianceSystem(std::move(problem));
}

void KrigingSystem::completeReport() {
    KrigingReport system = system_.report();
    system.merged = report_.merged;
    system.ignored = report_.ignored;
    system.generalisedCovariance = report_.generalisedCovariance;
    report_ = system;
    std::ostringstream text;
    const auto separate = [&]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
    if (system.ignored > 0) separate() << system.ignored << " data of infinite error variance ignored";
    if (system.merged > 0) separate() << system.merged << " coincident data merged";
    if (system.generalisedCovariance) separate() << "generalised covariance";
    if (!system.message.empty()) separate() << system.message;
    if (moreDigits_) (this->*moreDigits_->prepare)();
    if (report_.droppedDrift < system.droppedDrift)
        separate() << system.droppedDrift - report_.droppedDrift << " of them kept with more digits";
    report_.message = text.str();
}

KrigingSystem::Block KrigingSystem::block(const KrigingTargets& targets, Index target) const {
    Block out;
    out.isPoint = targets.begin.empty();
    const auto at = static_cast<std::size_t>(target);
    const Index first = out.isPoint ? target : targets.begin[at];
    const Index last = out.isPoint ? target + 1 : targets.begin[at + 1];
    if (first < 0 || last <= first || last > targets.points.rows()) {
        out.valid = false;
        return out;
    }
    out.points = targets.points.middleRows(first, last - first);
    out.weights = out.isPoint || targets.weights.size() == 0
                      ? VectorXd(VectorXd::Ones(last - first))
                      : VectorXd(targets.weights.segment(first, last - first));
    out.weights /= out.weights.sum();
    out.valid = out.points.allFinite() && out.weights.allFinite();
    return out;
}

CovarianceTargets KrigingSystem::lowerTargets(const KrigingTargets& targets, KrigingQuantity quantity) const {
    const Index m = targets.count(), n = errors_.size(), q = external_.cols();
    const bool generalised = report_.generalisedCovariance;
    const bool field = quantity == KrigingQuantity::Field;
    const bool shapes = targets.points.cols() == problem_.positions.cols() && targets.cellAxes >= 0 &&
                        targets.cellAxes <= targets.points.cols() &&
                        (targets.weights.size() == 0 || targets.weights.size() == targets.points.rows()) &&
                        (q == 0 || (targets.externalDrift.rows() == m && targets.externalDrift.cols() == q));

    CovarianceTargets lower;
    lower.covariance = MatrixXd::Zero(n, m);
    lower.variance = VectorXd::Constant(m, kNaN);
    lower.exactDatum.assign(static_cast<std::size_t>(m), -1);
    lower.entryError = VectorXd::Zero(m);
    lower.drift = MatrixXd::Zero(m, driftColumns());
    const VectorXd centre = place(origin_.transpose()).transpose();
    VectorXd column(places_.rows() + 8);  // whole vectors are written
    Footprint footprint;
    // Data by their first coordinate, where any may be at a target.
    const bool sharing = nugget_ > 0 || targets.begin.empty();
    std::vector<Index> order(static_cast<std::size_t>(sharing ? n : 0));
    std::iota(order.begin(), order.end(), Index{0});
    std::stable_sort(order.begin(), order.end(),
                     [&](Index i, Index j) { return positions_(0, i) < positions_(0, j); });
    const auto alongFirstAxis = [&](double x) {
        const auto first = std::lower_bound(order.begin(), order.end(), x,
                                            [&](Index i, double value) { return positions_(0, i) < value; });
        const auto last = std::upper_bound(first, order.end(), x,
                                           [&](double value, Index i) { return value < positions_(0, i); });
        return std::pair{first, last};
    };
    for (Index t = 0; shapes && t < m; ++t) {
        const Block target = block(targets, t);
        if (!target.valid) continue;
        const MatrixXd external = q > 0 ? MatrixXd(targets.externalDrift.row(t)) : MatrixXd(1, 0);
        lower.drift.row(t) = target.weights.transpose() *
                             driftRows(target.points, external.replicate(target.points.rows(), 1));
        // Sum of weights that the drift imposes: 1 but for an external constant with another value.
        double sum = 1;
        if (generalised && problem_.drift.polynomial == DriftPolynomial::None)
            sum = external(0, constantColumn()) / external_(0, constantColumn());
        if (generalised && !model_.bounded() && (sum != 1 || !field)) continue;

        auto c0 = lower.covariance.col(t);
        if (generalised) c0 = level_ + sum * centreGamma_.array();
        if (!field) {
            lower.variance[t] = generalised ? structureSill_ * sum * sum + level_ * (2 * sum - sum * sum) : 0;
            continue;
        }
        const MatrixXd places = place(target.points);
        const double within = footprint.meanInside(places, target.weights, *columns_, generalised);
        double outward = 0;  // generalised: mean semivariance between centre and block
        columns_->ofBlock(places_.data(), places_.rows(), places, target.weights.data(), n, generalised,
                          column.data());
        if (generalised) {
            // The increment's form gamma(x - centre) - gamma(x - x_i) stays small for far targets.
            const MatrixXd from = padded(places);
            VectorXd toCentre(from.rows());
            columns_->semivariances(from.data(), from.rows(), from.cols(), centre.data(), 0, places.rows(),
                                    toCentre.data());
            outward = target.weights.dot(toCentre.head(places.rows()));
            c0.array() += outward - column.head(n).array();
        } else {
            c0 = column.head(n);
        }
        lower.entryError[t] = kEntryRounding * (generalised ? 4 * level_ + 3 * outward : structureSill_);
        if (problem_.transform.size() > 0)
            lower.entryError[t] +=
                placeError(model_, std::max(places.cwiseAbs().maxCoeff(), places_.cwiseAbs().maxCoeff()));
        lower.variance[t] = within;
        if (generalised)
            lower.variance[t] = (model_.bounded() ? structureSill_ * (1 - sum) * (1 - sum) : 0) +
                                level_ * (2 * sum - sum * sum) + 2 * sum * outward - within;
        const Index axes = target.isPoint ? targets.points.cols() : targets.cellAxes;
        if (!sharing) continue;
        for (Index a = 0; a < places.rows() && axes > 0; ++a) {
            const double weight = target.weights[a];
            lower.variance[t] += weight * weight * nugget_;
            const auto [begin, end] = alongFirstAxis(target.points(a, 0));
            for (auto at = begin; at != end; ++at) {
                const Index i = *at;
                if (positions_.col(i).head(axes) != target.points.row(a).head(axes).transpose()) continue;
                c0[i] += weight * nugget_;
                if (target.isPoint && errors_[i] == 0 &&
                    (external_.row(i).array() == external.row(0).array()).all())
                    lower.exactDatum[static_cast<std::size_t>(t)] = i;
            }
        }
    }

    return lower;
}

KrigingPrediction KrigingSystem::predict(const KrigingTargets& targets,
                                         const KrigingPredictOptions& options) const {
    const Index m = targets.count();
    if (!report_.ok()) {
        KrigingPrediction none;
        none.estimate = none.estimateError = MatrixXd::Constant(m, problem_.values.cols(), kNaN);
        none.variance = none.varianceError = VectorXd::Constant(m, kNaN);
        if (options.weights) none.weights = MatrixXd::Constant(m, problem_.positions.rows(), kNaN);
        none.status.assign(static_cast<std::size_t>(m), TargetStatus::InvalidTarget);
        return none;
    }
    const CovarianceTargets lower = lowerTargets(targets, options.quantity);
    KrigingPrediction out = system_.predict(lower, {.weights = options.weights});
    out.variance /= varianceScale_;
    out.varianceError /= varianceScale_;
    out.lowestVariance /= varianceScale_;
    for (Index t = 0; t < m; ++t) {
        const auto at = static_cast<std::size_t>(t);
        if (out.status[at] == TargetStatus::Exact)
            out.estimate.row(t) = values_.row(lower.exactDatum[at]);
        else if (driftColumns() == 0 && problem_.drift.mean.size() > 0)
            out.estimate.row(t) += problem_.drift.mean;
    }
    if (options.weights) {
        const MatrixXd merged = std::move(out.weights);
        out.weights = MatrixXd::Zero(m, static_cast<Index>(row_.size()));
        for (std::size_t i = 0; i < row_.size(); ++i)
            if (row_[i] >= 0) {
                const auto datum = static_cast<Index>(i);
                out.weights.col(datum) = merged.col(row_[i]) * share_[datum];
            }
    }
    if (moreDigits_) (this->*moreDigits_->predict)(targets, options, lower, out);
    return out;
}

}  // namespace vlx
