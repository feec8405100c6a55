#include "variolux/geostat/kriging_batch.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>

#include "geostat/batch_bounds.h"

namespace vlx {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using kernels::Batch;
using kernels::LaneBounds;

constexpr Index kMostData = 128;
constexpr Index kMostDrift = 16;
/// Pivots and drift columns below these fractions go to the general solver.
constexpr double kSmallestPivot = 1e-3;
constexpr double kSmallestDrift = 1e-3;

/// What systems must have in common to share vectors.
struct Shape {
    Index n = 0, axes = 0, drift = 0, columns = 0, targets = 0;
    std::vector<std::pair<StructureType, double>> structures;  ///< with nu of Matern

    bool operator==(const Shape&) const = default;
};

bool ordinary(double x) { return x == 0 || (std::abs(x) > 1e-60 && std::abs(x) < 1e60); }

Index polynomialColumns(const DriftModel& drift, Index dimension) {
    const Index d = drift.axes == 0 ? dimension : drift.axes;
    switch (drift.polynomial) {
        case DriftPolynomial::None:
            return 0;
        case DriftPolynomial::Constant:
            return 1;
        case DriftPolynomial::Linear:
            return 1 + d;
        case DriftPolynomial::Quadratic:
            return 1 + d + d * (d + 1) / 2;
    }
    return 0;
}

/// Whether the vector path may try, by everything but the data's numbers. Shape of the system if so.
bool plain(const KrigingProblem& p, const KrigingTargets& t, Shape& shape) {
    const Index n = p.positions.rows(), d = p.positions.cols(), q = p.drift.external.cols();
    const Index m = t.points.rows();
    if (n < 1 || n > kMostData || d < 1 || m < 1 || !t.begin.empty() || t.points.cols() != d) return false;
    if (p.values.rows() != n || p.values.cols() < 1) return false;
    if (p.errorVariances.size() != 0 && p.errorVariances.size() != n) return false;
    if (q > 0 && (p.drift.external.rows() != n || t.externalDrift.rows() != m || t.externalDrift.cols() != q))
        return false;
    if (p.transform.size() > 0 && p.transform.cols() != d) return false;
    if (p.drift.axes < 0 || p.drift.axes > d) return false;
    if (p.drift.mean.size() != 0 && p.drift.mean.size() != p.values.cols()) return false;
    if (p.model.validate() || !p.model.bounded() || !ordinary(p.model.nugget)) return false;
    shape.structures.clear();
    for (const VariogramStructure& s : p.model.structures) {
        if (s.sill == 0) continue;
        if (!ordinary(s.sill) || !ordinary(s.range) || s.type == StructureType::Linear) return false;
        const bool matern = s.type == StructureType::Matern;
        if (matern && s.shape != 0.5 && s.shape != 1.5 && s.shape != 2.5) return false;
        shape.structures.emplace_back(s.type, matern ? s.shape : 0);
    }
    if (shape.structures.empty()) return false;
    shape.n = (n + 3) / 4 * 4;
    shape.axes = p.transform.size() > 0 ? p.transform.rows() : d;
    shape.drift = polynomialColumns(p.drift, d) + q;
    shape.columns = p.values.cols();
    shape.targets = m;
    return shape.drift <= kMostDrift;
}

/// Writes one system into one lane.
class LaneWriter {
  public:
    LaneWriter(Batch& batch, Index lane) : b_(batch), lane_(lane) {}

    /// False if the data's numbers need the general solver.
    bool write(const KrigingProblem& p, const KrigingTargets& t) {
        const Index n = p.positions.rows();
        bounds(p.positions);
        if (!model(p) || !places(p, t) || !errors(p)) return false;
        for (Index i = 0; i < b_.n; ++i) at(b_.active, i) = i < n ? 1 : 0;
        if (!p.drift.external.allFinite() || !t.externalDrift.allFinite()) return false;
        driftRows(p, t);
        return values(p);
    }

    /// The reference that was subtracted from each value column, and the largest difference from it.
    struct Lane {
        Eigen::RowVectorXd reference, spread;
        double placeError = 0;
    };
    const Lane& lane() const { return out_; }

  private:
    double& at(std::vector<double>& array, Index entry) {
        return array[static_cast<std::size_t>(entry * b_.lanes + lane_)];
    }
    double& at(double* row, Index entry) { return row[entry * b_.lanes + lane_]; }

    void bounds(const MatrixXd& positions) {
        const Index d = positions.cols();
        origin_.resize(d);
        double extent = 0;
        for (Index j = 0; j < d; ++j) {
            const double low = positions.col(j).minCoeff(), high = positions.col(j).maxCoeff();
            origin_[j] = low / 2 + high / 2;
            extent = std::max(extent, high / 2 - low / 2);
        }
        unit_ = extent > 0 && std::isfinite(extent) ? std::ldexp(1.0, -std::ilogb(extent)) : 1;
    }

    bool model(const KrigingProblem& p) {
        Index s = 0;
        for (const VariogramStructure& structure : p.model.structures) {
            if (structure.sill == 0) continue;
            at(b_.sill, s) = structure.sill;
            at(b_.inverseSquaredRange, s) = 1 / (structure.range * structure.range);
            at(b_.halfShape, s) = structure.type == StructureType::Stable ? structure.shape / 2 : 1;
            sill_ += structure.sill;
            ++s;
        }
        return true;
    }

    bool places(const KrigingProblem& p, const KrigingTargets& t) {
        const Index n = p.positions.rows();
        const bool transformed = p.transform.size() > 0;
        MatrixXd x, y;
        if (transformed) {
            x = (p.positions.rowwise() - origin_.transpose()) * p.transform.transpose();
            y = (t.points.rowwise() - origin_.transpose()) * p.transform.transpose();
        }
        const MatrixXd& data = transformed ? x : p.positions;
        const MatrixXd& points = transformed ? y : t.points;
        if (!data.allFinite()) return false;
        double squaredExtent = 0;
        for (Index k = 0; k < b_.axes; ++k) {
            double low = data(0, k), high = low;
            for (Index i = 0; i < n; ++i) {
                const double v = data(i, k);
                low = std::min(low, v);
                high = std::max(high, v);
                at(b_.places, i * b_.axes + k) = v;
            }
            if (!ordinary(low) || !ordinary(high)) return false;
            // Padding lies elsewhere, so that no two places coincide.
            for (Index i = n; i < b_.n; ++i)
                at(b_.places, i * b_.axes + k) =
                    high + (std::abs(high) + (high - low) + 1) * static_cast<double>(i - n + 1);
            for (Index j = 0; j < b_.targets; ++j) {
                const double v = points(j, k);
                if (!ordinary(v)) return false;
                at(b_.points, j * b_.axes + k) = v;
            }
            squaredExtent += (high - low) * (high - low);
        }
        if (transformed)
            out_.placeError =
                placeError(p.model, std::max(data.cwiseAbs().maxCoeff(), points.cwiseAbs().maxCoeff()));
        // Long ranges lose digits in the covariance form: KrigingSystem has another.
        return b_.drift == 0 ||
               !(semivariance(p.model, std::sqrt(squaredExtent)) - p.model.nugget < 0.1 * sill_);
    }

    bool errors(const KrigingProblem& p) {
        const Index n = p.positions.rows();
        for (Index i = 0; i < b_.n; ++i) {
            const double v = i < n && p.errorVariances.size() > 0 ? p.errorVariances[i] : 0;
            if (!(v >= 0) || !ordinary(v)) return false;
            at(b_.diagonal, i) = p.model.nugget + v;
            at(b_.special, i) = i < n && (v == 0 || p.model.nugget > 0) ? 1 : 0;
        }
        return true;
    }

    /// Polynomials in centred, scaled coordinates; external columns less their mean where there is a
    /// constant.
    void driftRows(const KrigingProblem& p, const KrigingTargets& t) {
        if (b_.drift == 0) return;
        const Index n = p.positions.rows(), d = p.drift.axes == 0 ? p.positions.cols() : p.drift.axes;
        const auto put = [&](Index column, auto&& data, auto&& target) {
            double* row = b_.row(b_.driftRow() + column);
            for (Index i = 0; i < n; ++i) at(row, i) = data(i);
            for (Index i = n; i < b_.n; ++i) at(row, i) = 0;
            for (Index j = 0; j < b_.targets; ++j) at(b_.f0, j * b_.drift + column) = target(j);
        };
        Index column = 0;
        const bool constant = p.drift.polynomial != DriftPolynomial::None;
        const auto one = [](Index) { return 1.0; };
        if (constant) put(column++, one, one);
        const auto coordinate = [&](const MatrixXd& x, Index axis) {
            return [&x, axis, this](Index i) { return (x(i, axis) - origin_[axis]) * unit_; };
        };
        if (p.drift.polynomial >= DriftPolynomial::Linear)
            for (Index a = 0; a < d; ++a) put(column++, coordinate(p.positions, a), coordinate(t.points, a));
        if (p.drift.polynomial == DriftPolynomial::Quadratic)
            for (Index a = 0; a < d; ++a)
                for (Index c = a; c < d; ++c) {
                    const auto product = [&](const MatrixXd& x) {
                        return [&x, a, c, &coordinate](Index i) {
                            return coordinate(x, a)(i) * coordinate(x, c)(i);
                        };
                    };
                    put(column++, product(p.positions), product(t.points));
                }
        for (Index k = 0; k < p.drift.external.cols(); ++k) {
            const double mean = constant ? p.drift.external.col(k).mean() : 0;
            put(
                column++, [&](Index i) { return p.drift.external(i, k) - mean; },
                [&](Index j) { return t.externalDrift(j, k) - mean; });
        }
    }

    /// Differences from the known mean, or from the datum nearest to the mean where there is a constant:
    /// exact where values are close.
    bool values(const KrigingProblem& p) {
        const Index n = p.positions.rows();
        Eigen::RowVectorXd& reference = out_.reference;
        reference = out_.spread = Eigen::RowVectorXd::Zero(b_.columns);
        if (b_.drift == 0 && p.drift.mean.size() > 0) reference = p.drift.mean;
        for (Index c = 0; c < b_.columns; ++c) {
            if (p.drift.polynomial != DriftPolynomial::None) {
                double mean = 0;
                for (Index i = 0; i < n; ++i) mean += p.values(i, c);
                mean /= static_cast<double>(n);
                double nearest = std::numeric_limits<double>::infinity();
                for (Index i = 0; i < n; ++i) {
                    const double gap = std::abs(p.values(i, c) - mean);
                    if (gap < nearest) {
                        nearest = gap;
                        reference[c] = p.values(i, c);
                    }
                }
            }
            double* row = b_.row(b_.valueRow() + c);
            for (Index i = 0; i < n; ++i) {
                if (!ordinary(p.values(i, c))) return false;
                at(row, i) = p.values(i, c) - reference[c];
                out_.spread[c] = std::max(out_.spread[c], std::abs(p.values(i, c) - reference[c]));
            }
            for (Index i = n; i < b_.n; ++i) at(row, i) = 0;
        }
        return true;
    }

    Batch& b_;
    Index lane_;
    double sill_ = 0, unit_ = 1;
    VectorXd origin_;
    Lane out_;
};

/// The answer of one lane, or nothing if it needs the general solver.
bool readLane(const Batch& b, Index lane, const KrigingProblem& problem, const LaneWriter::Lane& written,
              KrigingBatchAnswer& answer) {
    const Eigen::RowVectorXd& reference = written.reference;
    const auto at = [&](const std::vector<double>& array, Index entry) {
        return array[static_cast<std::size_t>(entry * b.lanes + lane)];
    };
    const double lowest = at(b.lowest, 0);
    if (!(lowest > kSmallestPivot) || (b.drift > 0 && !(at(b.dependence, 0) > kSmallestDrift))) return false;
    answer.batched = true;
    answer.report.used = problem.positions.rows();
    answer.report.conditionEstimate = std::sqrt(static_cast<double>(problem.positions.rows())) / lowest;
    KrigingPrediction& p = answer.prediction;
    p.estimate.resize(b.targets, b.columns);
    p.variance.resize(b.targets);
    p.estimateError.resize(b.targets, b.columns);
    p.varianceError.resize(b.targets);
    p.status.assign(static_cast<std::size_t>(b.targets), TargetStatus::Ok);
    const LaneBounds bounds(b, lane, problem, written.placeError, lowest);
    const double tolerance = problem.accuracy.tolerance;
    for (Index t = 0; t < b.targets; ++t) {
        const double variance = at(b.variance, t) + problem.model.nugget;
        p.lowestVariance = std::min(p.lowestVariance, variance);
        p.variance[t] = std::max(0.0, variance);
        const double weights = bounds.weights(variance);
        p.varianceError[t] = bounds.variance(weights) + 2 * kEpsilon * p.variance[t];
        const double scale = std::max({p.variance[t], bounds.smallestVariance(), problem.model.sill()});
        if (!(p.varianceError[t] <= (tolerance + 4 * kEpsilon) * scale)) return false;
        for (Index c = 0; c < b.columns; ++c) {
            const double difference = at(b.estimate, t * b.columns + c);
            p.estimate(t, c) = reference[c] + difference;
            const double size = std::max(std::abs(p.estimate(t, c)), std::abs(reference[c]));
            p.estimateError(t, c) = bounds.estimate(c, weights) + 2 * kEpsilon * size;
            if (!(p.estimateError(t, c) <=
                  tolerance * std::max(written.spread[c], std::abs(difference)) + 4 * kEpsilon * size))
                return false;
        }
    }
    return p.estimate.allFinite() && p.variance.allFinite();
}

KrigingBatchAnswer general(const KrigingProblem& problem, const KrigingTargets& targets) {
    const KrigingSystem system(problem);
    return {system.report(), system.predict(targets), false};
}

void solveGroup(const Shape& shape, const std::vector<std::size_t>& members, Index lanes,
                const std::vector<KrigingProblem>& problems, const std::vector<KrigingTargets>& targets,
                std::vector<KrigingBatchAnswer>& answers) {
    Batch batch;
    batch.lanes = lanes;
    batch.n = shape.n;
    batch.axes = shape.axes;
    batch.drift = shape.drift;
    batch.columns = shape.columns;
    batch.targets = shape.targets;
    for (const auto& structure : shape.structures) batch.types.push_back(structure.first);
    batch.resize();
    for (std::size_t s = 0; s < shape.structures.size(); ++s)
        batch.fixedShape[s] = shape.structures[s].second;

    std::size_t next = 0;
    while (next < members.size()) {
        std::vector<std::size_t> inLane;
        std::vector<LaneWriter::Lane> written;
        while (next < members.size() && static_cast<Index>(inLane.size()) < lanes) {
            const std::size_t i = members[next++];
            LaneWriter writer(batch, static_cast<Index>(inLane.size()));
            if (writer.write(problems[i], targets[i])) {
                inLane.push_back(i);
                written.push_back(writer.lane());
            } else {
                answers[i] = general(problems[i], targets[i]);
            }
        }
        if (inLane.empty()) break;
        // Spare lanes repeat the first system.
        for (Index lane = static_cast<Index>(inLane.size()); lane < lanes; ++lane)
            LaneWriter(batch, lane).write(problems[inLane[0]], targets[inLane[0]]);
        kernels::solveBatch(batch);
        for (std::size_t lane = 0; lane < inLane.size(); ++lane) {
            const std::size_t i = inLane[lane];
            if (!readLane(batch, static_cast<Index>(lane), problems[i], written[lane], answers[i]))
                answers[i] = general(problems[i], targets[i]);
        }
    }
}

}  // namespace

std::vector<KrigingBatchAnswer> krigeBatch(const std::vector<KrigingProblem>& problems,
                                           const std::vector<KrigingTargets>& targets,
                                           const KrigingBatchOptions& options) {
    assert(problems.size() == targets.size());
    Index lanes = kernels::batchLanes();
    while (options.lanes > 0 && lanes > std::max(2, options.lanes)) lanes /= 2;

    std::vector<KrigingBatchAnswer> answers(problems.size());
    std::vector<std::pair<Shape, std::vector<std::size_t>>> groups;
    std::size_t last = 0;
    Shape shape;
    for (std::size_t i = 0; i < problems.size(); ++i) {
        if (!plain(problems[i], targets[i], shape)) {
            answers[i] = general(problems[i], targets[i]);
            continue;
        }
        if (last >= groups.size() || !(groups[last].first == shape)) {
            last = 0;
            while (last < groups.size() && !(groups[last].first == shape)) ++last;
            if (last == groups.size()) groups.push_back({shape, {}});
        }
        groups[last].second.push_back(i);
    }
    for (const auto& [groupShape, members] : groups)
        solveGroup(groupShape, members, lanes, problems, targets, answers);
    return answers;
}

}  // namespace vlx
