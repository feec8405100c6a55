#include "variolux/geostat/kriging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "kernels.h"

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// 2^-floor(log2(x)): brings x > 0 into [1, 2) without rounding anything.
double unitScale(double x) {
    return x > 0 && std::isfinite(x) ? std::ldexp(1.0, std::clamp(-std::ilogb(x), -1000, 1000)) : 1;
}

std::string invalidDatum(Index datum, const char* field, double found, const char* expected) {
    std::ostringstream text;
    text << "datum " << datum << ": " << field << " must be " << expected << ", found " << found;
    return text.str();
}

}  // namespace

/// One target: a point, or the points of a block with weights that sum to 1.
struct KrigingSystem::Block {
    MatrixXd points;   // k x d
    VectorXd weights;  // k
    bool isPoint = true;
    bool valid = true;
};

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

KrigingSystem::KrigingSystem(const KrigingProblem& problem) {
    if (!validate(problem)) {
        report_.status = KrigingStatus::InvalidInput;
        return;
    }
    chooseScales(problem);
    merge();
    assemble(problem.precision);
    completeReport();
}

bool KrigingSystem::validate(const KrigingProblem& problem) {
    const Index n = problem.positions.rows(), d = problem.positions.cols();
    const auto fail = [&](std::string message) {
        report_.message = std::move(message);
        return false;
    };
    if (const auto broken = problem.model.validate()) return fail("model: " + *broken);
    const bool shapes = (d > 0 || n == 0) && problem.values.rows() == n &&
                        (problem.errorVariances.size() == 0 || problem.errorVariances.size() == n) &&
                        (problem.drift.external.size() == 0 || problem.drift.external.rows() == n);
    if (!shapes)
        return fail("positions, values, error variances and external drift must have one row a datum");
    if (problem.transform.size() > 0 && (problem.transform.cols() != d || !problem.transform.allFinite()))
        return fail("the transform must be finite, with one column a coordinate");
    if (problem.drift.axes < 0 || problem.drift.axes > d)
        return fail("the drift's axes must be between 0 and the number of coordinates");
    if (problem.drift.mean.size() != 0 &&
        (problem.drift.mean.size() != problem.values.cols() || !problem.drift.mean.allFinite()))
        return fail("the known mean must be finite, one number a value column");
    const bool good = problem.positions.allFinite() && problem.values.allFinite() &&
                      problem.drift.external.allFinite() && (problem.errorVariances.array() >= 0).all();
    for (Index i = 0; !good && i < n; ++i) {  // which one
        for (Index j = 0; j < d; ++j)
            if (!std::isfinite(problem.positions(i, j)))
                return fail(invalidDatum(i, "coordinate", problem.positions(i, j), "finite"));
        for (Index j = 0; j < problem.values.cols(); ++j)
            if (!std::isfinite(problem.values(i, j)))
                return fail(invalidDatum(i, "value", problem.values(i, j), "finite"));
        for (Index j = 0; j < problem.drift.external.cols(); ++j)
            if (!std::isfinite(problem.drift.external(i, j)))
                return fail(invalidDatum(i, "external drift", problem.drift.external(i, j), "finite"));
        if (problem.errorVariances.size() > 0 && !(problem.errorVariances[i] >= 0))
            return fail(invalidDatum(i, "error variance", problem.errorVariances[i], ">= 0"));
    }
    drift_ = problem.drift;
    dataExternal_ = problem.drift.external.size() > 0 ? problem.drift.external : MatrixXd(n, 0);
    drift_.external.resize(0, dataExternal_.cols());
    if (drift_.axes == 0) drift_.axes = d;
    dataPositions_ = problem.positions;
    dataValues_ = problem.values;
    dataErrors_ = problem.errorVariances.size() > 0 ? problem.errorVariances : VectorXd(VectorXd::Zero(n));
    dimension_ = d;
    if (!problem.model.bounded() && constantColumn() < 0)
        return fail("an unbounded variogram needs a constant among the drift functions");
    return true;
}

/// The drift column that is constant over the data, or -1: what the generalised covariance needs.
Index KrigingSystem::constantColumn() const {
    if (drift_.polynomial != DriftPolynomial::None) return 0;
    for (Index j = 0; j < dataExternal_.cols() && dataExternal_.rows() > 0; ++j)
        if (dataExternal_(0, j) != 0 && (dataExternal_.col(j).array() == dataExternal_(0, j)).all()) return j;
    return -1;
}

void KrigingSystem::chooseScales(const KrigingProblem& problem) {
    const Index n = dataPositions_.rows();
    transform_ = problem.transform;
    origin_ = VectorXd::Zero(dimension_);
    double extent = 0;
    for (Index j = 0; n > 0 && j < dimension_; ++j) {
        const double low = dataPositions_.col(j).minCoeff(), high = dataPositions_.col(j).maxCoeff();
        origin_[j] = low == high ? low : low / 2 + high / 2;
        extent = std::max(extent, high / 2 - low / 2);
    }
    coordinateScale_ = unitScale(extent);

    model_ = problem.model;
    double sill = model_.nugget;
    for (const VariogramStructure& s : model_.structures) sill += s.sill;
    if (sill == 0)
        for (Index i = 0; i < n; ++i)
            if (std::isfinite(dataErrors_[i])) sill = std::max(sill, dataErrors_[i]);
    varianceScale_ = unitScale(sill);
    nugget_ = model_.nugget * varianceScale_;
    model_.nugget = 0;
    std::erase_if(model_.structures, [](const VariogramStructure& s) { return s.sill == 0; });
    for (VariogramStructure& s : model_.structures) {
        s.sill *= varianceScale_;
        s.range = std::clamp(s.range * coordinateScale_, 1e-300, 1e300);
        structureSill_ += s.sill;
    }
}

/// Data sorted by a sum of their coordinates: coincident data have equal sums, and whether equal sums are
/// coincident is then looked at. Ignored data are left out.
std::vector<std::pair<double, Index>> KrigingSystem::sortedSums() const {
    std::vector<std::pair<double, Index>> sums;
    sums.reserve(row_.size());
    for (Index i = 0; i < dataPositions_.rows(); ++i) {
        if (!std::isfinite(dataErrors_[i] * varianceScale_)) continue;
        double sum = 0, factor = 1;
        for (Index j = 0; j < dimension_; ++j, factor *= 0.6180339887498949)
            sum += factor * (dataPositions_(i, j) * coordinateScale_);
        sums.emplace_back(sum, i);
    }
    std::sort(sums.begin(), sums.end());
    return sums;
}

void KrigingSystem::merge() {
    const Index n = dataPositions_.rows();
    row_.assign(static_cast<std::size_t>(n), -1);
    share_ = VectorXd::Zero(n);
    const auto sums = sortedSums();
    report_.ignored = n - static_cast<Index>(sums.size());
    const auto equal = [](const auto& a, const auto& b) { return a.first == b.first; };
    if (report_.ignored == 0 && std::adjacent_find(sums.begin(), sums.end(), equal) == sums.end()) {
        std::iota(row_.begin(), row_.end(), Index{0});
        share_.setOnes();
        positions_ = dataPositions_.transpose();
        external_ = dataExternal_;
        errors_ = dataErrors_ * varianceScale_;
        values_ = dataValues_;
    } else {
        mergeGroups(sums);
    }
    // Padded with zeros to whole vectors.
    const Index rows = errors_.size();
    places_ = MatrixXd::Zero((rows + 7) / 8 * 8, transform_.size() > 0 ? transform_.rows() : dimension_);
    places_.topRows(rows) = place(positions_.transpose());
}

void KrigingSystem::mergeGroups(const std::vector<std::pair<double, Index>>& sums) {
    const Index d = dimension_, q = dataExternal_.cols();
    const auto samePlace = [&](Index a, Index b) { return dataPositions_.row(a) == dataPositions_.row(b); };
    const auto sameDrift = [&](Index a, Index b) {
        return q == 0 || dataExternal_.row(a) == dataExternal_.row(b);
    };
    std::vector<std::vector<Index>> groups;      // of coincident data, each in the order given
    std::vector<std::pair<Index, Index>> twins;  // at one place, with different drift
    groups.reserve(sums.size());
    for (std::size_t first = 0, last = 0; first < sums.size(); first = last) {
        const std::size_t run = groups.size();
        for (last = first; last < sums.size() && sums[last].first == sums[first].first; ++last) {
            const Index i = sums[last].second;
            std::size_t g = run;
            for (; g < groups.size(); ++g) {
                if (!samePlace(groups[g][0], i)) continue;
                if (sameDrift(groups[g][0], i)) break;
                twins.emplace_back(groups[g][0], i);
            }
            if (g == groups.size())
                groups.push_back({i});
            else
                groups[g].push_back(i);
        }
    }
    std::sort(groups.begin(), groups.end());
    const auto rows = static_cast<Index>(groups.size());
    report_.merged = static_cast<Index>(sums.size()) - rows;

    positions_.resize(d, rows);
    external_.resize(rows, q);
    errors_.resize(rows);
    values_.resize(rows, dataValues_.cols());
    for (Index r = 0; r < rows; ++r) {
        const std::vector<Index>& group = groups[static_cast<std::size_t>(r)];
        positions_.col(r) = dataPositions_.row(group[0]).transpose();
        external_.row(r) = dataExternal_.row(group[0]);
        double lowest = kInfinity;
        for (const Index i : group) lowest = std::min(lowest, dataErrors_[i]);
        double sum = 0;
        for (const Index i : group) {
            row_[static_cast<std::size_t>(i)] = r;
            share_[i] = lowest > 0 ? lowest / dataErrors_[i] : (dataErrors_[i] == 0 ? 1 : 0);
            sum += share_[i];
        }
        errors_[r] = lowest * varianceScale_ / sum;
        // Differences from one member: equal values merge exactly.
        const RowVectorXd first = dataValues_.row(group[0]);
        RowVectorXd mean = RowVectorXd::Zero(first.size());
        if (group.size() > 1)
            for (const Index i : group) {
                share_[i] /= sum;
                mean += share_[i] * (dataValues_.row(i) - first);
            }
        values_.row(r) = first + mean;
    }
    for (const auto& [a, b] : twins)
        if (row_[static_cast<std::size_t>(a)] != row_[static_cast<std::size_t>(b)])
            twins_.emplace_back(row_[static_cast<std::size_t>(a)], row_[static_cast<std::size_t>(b)]);
}

/// Scaled and transformed coordinates, one point a row. Untransformed coordinates are scaled but not
/// centred: their differences are then as exact as the input.
MatrixXd KrigingSystem::place(const MatrixXd& points) const {
    if (transform_.size() == 0) return points * coordinateScale_;
    return (points.rowwise() - origin_.transpose()) * (coordinateScale_ * transform_).transpose();
}

MatrixXd KrigingSystem::driftRows(const MatrixXd& points, const MatrixXd& external) const {
    const Index m = points.rows(), d = drift_.axes;
    Index columns = 0;
    if (drift_.polynomial != DriftPolynomial::None) columns = 1;
    if (drift_.polynomial >= DriftPolynomial::Linear) columns += d;
    if (drift_.polynomial == DriftPolynomial::Quadratic) columns += d * (d + 1) / 2;
    MatrixXd rows(m, columns + external.cols());
    rows.rightCols(external.cols()) = external;
    if (columns > 0) rows.col(0).setOnes();
    if (columns > 1) {
        const MatrixXd x = (points.leftCols(d).rowwise() - origin_.head(d).transpose()) * coordinateScale_;
        rows.middleCols(1, d) = x;
        if (drift_.polynomial == DriftPolynomial::Quadratic) {
            Index column = 1 + d;
            for (Index a = 0; a < d; ++a)
                for (Index b = a; b < d; ++b) rows.col(column++) = x.col(a).cwiseProduct(x.col(b));
        }
    }
    return rows;
}

void KrigingSystem::assemble(KrigingPrecision precision) {
    const Index n = errors_.size();
    CovarianceProblem problem;
    problem.precision = precision;
    problem.drift = driftRows(positions_.transpose(), external_);
    problem.values = values_;
    if (problem.drift.cols() == 0 && drift_.mean.size() > 0) problem.values.rowwise() -= drift_.mean;

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
    system_ = CovarianceSystem(std::move(problem));
}

void KrigingSystem::completeReport() {
    KrigingReport system = system_.report();
    system.merged = report_.merged;
    system.ignored = report_.ignored;
    system.generalisedCovariance = report_.generalisedCovariance;
    report_ = system;
    if (system.ignored == 0 && system.merged == 0 && !system.generalisedCovariance) return;
    std::ostringstream text;
    const auto separate = [&]() -> std::ostream& { return text << (text.tellp() > 0 ? "; " : ""); };
    if (system.ignored > 0) separate() << system.ignored << " data of infinite error variance ignored";
    if (system.merged > 0) separate() << system.merged << " coincident data merged";
    if (system.generalisedCovariance) separate() << "generalised covariance";
    if (!system.message.empty()) separate() << system.message;
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

KrigingPrediction KrigingSystem::predict(const KrigingTargets& targets,
                                         const KrigingPredictOptions& options) const {
    const Index m = targets.count(), n = errors_.size(), q = external_.cols();
    const bool generalised = report_.generalisedCovariance;
    const bool field = options.quantity == KrigingQuantity::Field;
    const bool shapes = report_.ok() && targets.points.cols() == dimension_ &&
                        (targets.weights.size() == 0 || targets.weights.size() == targets.points.rows()) &&
                        (q == 0 || (targets.externalDrift.rows() == m && targets.externalDrift.cols() == q));

    CovarianceTargets lower;
    lower.covariance = MatrixXd::Zero(n, m);
    lower.variance = VectorXd::Constant(m, kNaN);
    lower.exactDatum.assign(static_cast<std::size_t>(m), -1);
    const Index columns = driftRows(MatrixXd(0, dimension_), MatrixXd(0, q)).cols();
    lower.drift = MatrixXd::Zero(m, columns);
    const VectorXd centre = place(origin_.transpose()).transpose();
    VectorXd column(places_.rows() + 8);  // whole vectors are written
    for (Index t = 0; shapes && t < m; ++t) {
        const Block target = block(targets, t);
        if (!target.valid) continue;
        const MatrixXd external = q > 0 ? MatrixXd(targets.externalDrift.row(t)) : MatrixXd(1, 0);
        lower.drift.row(t) = target.weights.transpose() *
                             driftRows(target.points, external.replicate(target.points.rows(), 1));
        // Sum of weights that the drift imposes: 1 but for an external constant with another value.
        double sum = 1;
        if (generalised && drift_.polynomial == DriftPolynomial::None)
            sum = external(0, constantColumn()) / external_(0, constantColumn());
        if (generalised && !model_.bounded() && (sum != 1 || !field)) continue;

        auto c0 = lower.covariance.col(t);
        if (generalised) c0 = level_ + sum * centreGamma_.array();
        if (!field) {
            lower.variance[t] = generalised ? structureSill_ * sum * sum + level_ * (2 * sum - sum * sum) : 0;
            continue;
        }
        const MatrixXd places = place(target.points);
        double within = 0;   // mean covariance, or semivariance, inside the block
        double outward = 0;  // generalised: mean semivariance between centre and block
        for (Index a = 0; a < places.rows(); ++a) {
            const VectorXd point = places.row(a).transpose();
            if (generalised) {
                // The increment's form gamma(x - centre) - gamma(x - x_i) stays small for far targets.
                const double g = semivariance(model_, (point - centre).norm());
                outward += target.weights[a] * g;
                columns_->semivariances(places_.data(), places_.rows(), places_.cols(), point.data(), 0, n,
                                        column.data());
                c0.array() += target.weights[a] * (g - column.head(n).array());
            } else {
                columns_->covariances(places_.data(), places_.rows(), places_.cols(), point.data(), 0, n,
                                      column.data());
                c0 += target.weights[a] * column.head(n);
            }
            for (Index b = 0; b < a; ++b) {
                const double h = (places.row(a) - places.row(b)).norm();
                within += 2 * target.weights[a] * target.weights[b] *
                          (generalised ? semivariance(model_, h) : covariance(model_, h));
            }
            if (!generalised) within += target.weights[a] * target.weights[a] * structureSill_;
        }
        lower.variance[t] = within;
        if (generalised)
            lower.variance[t] = (model_.bounded() ? structureSill_ * (1 - sum) * (1 - sum) : 0) +
                                level_ * (2 * sum - sum * sum) + 2 * sum * outward - within;
        if (!target.isPoint) continue;
        lower.variance[t] += nugget_;
        const VectorXd point = target.points.row(0).transpose();
        for (Index i = 0; i < n; ++i) {
            if (positions_.col(i) != point) continue;
            c0[i] += nugget_;
            if (errors_[i] == 0 && (external_.row(i).array() == external.row(0).array()).all())
                lower.exactDatum[static_cast<std::size_t>(t)] = i;
        }
    }

    KrigingPrediction out = system_.predict(lower, {.weights = options.weights});
    out.variance /= varianceScale_;
    out.lowestVariance /= varianceScale_;
    for (Index t = 0; t < m; ++t) {
        const auto at = static_cast<std::size_t>(t);
        if (out.status[at] == TargetStatus::Exact)
            out.estimate.row(t) = values_.row(lower.exactDatum[at]);
        else if (columns == 0 && drift_.mean.size() > 0)
            out.estimate.row(t) += drift_.mean;
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
    return out;
}

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
