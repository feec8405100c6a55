#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <sstream>

#include "hard_case.h"

namespace vlx::testing {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

struct Answer {
    KrigingReport report;
    KrigingPrediction prediction;
};

class Checker {
  public:
    Checker(const HardCase& hardCase, KrigingPrecision precision) : case_(hardCase) {
        case_.problem.precision = precision;
    }

    std::vector<std::string> run() {
        const Answer answer = solve(case_.problem, case_.targets);
        const bool ok = answer.report.ok();
        if (case_.status == "error") {
            expect(!ok, "an error was expected");
            return failures_;
        }
        if (case_.status == "ok") expect(ok, "status: " + answer.report.message);
        if (!ok) {
            expect(!answer.report.message.empty(), "an error without a message");
            return failures_;
        }
        checkFinite(answer);
        checkVariance(answer);
        if (case_.status == "error_or_fallback") {
            checkFlagged(answer);
            return failures_;
        }
        checkExtraTarget(answer);
        checkConstraint(answer);
        if (case_.has("rank_deficiency_reported"))
            expect(answer.report.droppedDrift > 0, "rank deficiency is not reported");
        const bool masked = case_.status == "error_or_masked";
        if (case_.has("within_tolerance") || masked || case_.has("finite_or_error")) checkExact(answer);
        if (case_.has("exact_at_data")) checkExactAtData(answer);
        checkInvariances(answer);
        if (case_.has("within_tolerance")) checkFarTarget();
        return failures_;
    }

  private:
    Answer solve(const KrigingProblem& problem, const KrigingTargets& targets) const {
        const KrigingSystem system(problem);
        KrigingPredictOptions options;
        options.weights = true;
        return {system.report(), system.predict(targets, options)};
    }

    void expect(bool condition, const std::string& failure) {
        if (!condition) failures_.push_back(failure);
    }

    void expectNear(double found, double wanted, double tolerance, const std::string& what) {
        if (std::abs(found - wanted) <= tolerance) return;
        std::ostringstream text;
        text.precision(17);
        text << what << ": found " << found << ", expected " << wanted << " within " << tolerance
             << " (off by " << std::abs(found - wanted) << ")";
        failures_.push_back(text.str());
    }

    Index targetCount() const { return case_.targets.points.rows() - (case_.extraTargetIsInvalid ? 1 : 0); }

    double tolerance(const std::string& name) const {
        const auto found = case_.tolerance.find(name);
        return found == case_.tolerance.end() ? 0 : found->second;
    }

    /// S = max(1, sum |w|).
    static double weightSize(const Answer& answer, Index t) {
        return std::max(1.0, answer.prediction.weights.row(t).cwiseAbs().sum());
    }

    double valueRange() const {
        const auto& z = case_.problem.values;
        const double range = z.maxCoeff() - z.minCoeff();
        return range > 0 ? range : z.cwiseAbs().maxCoeff();
    }

    double processVariance() const {
        double sill = case_.problem.model.nugget;
        for (const VariogramStructure& s : case_.problem.model.structures) sill += s.sill;
        return sill;
    }

    /// The size of variances: the field's, or for a pure-error model the smallest error.
    double varianceSize() const {
        const double v = processVariance();
        return v > 0 ? v : case_.problem.errorVariances.maxCoeff();
    }

    void checkFinite(const Answer& a) {
        const Index m = targetCount();
        expect(a.prediction.estimate.topRows(m).allFinite() && a.prediction.variance.head(m).allFinite() &&
                   a.prediction.weights.topRows(m).allFinite(),
               "not finite");
    }

    void checkVariance(const Answer& a) {
        double size = 1;
        for (Index t = 0; t < targetCount(); ++t) {
            expect(a.prediction.variance[t] >= 0, "negative variance");
            size = std::max(size, weightSize(a, t));
        }
        expect(a.prediction.lowestVariance >= -1e-12 * varianceSize() * size * size,
               "unclamped variance " + std::to_string(a.prediction.lowestVariance));
    }

    void checkFlagged(const Answer& a) {
        bool flagged = a.report.droppedDrift > 0 || a.report.jitter > 0 || a.report.degenerate;
        for (const TargetStatus s : a.prediction.status) flagged |= s == TargetStatus::NotEstimable;
        expect(flagged, "a fallback without a flag");
    }

    void checkExtraTarget(const Answer& a) {
        if (!case_.extraTargetIsInvalid) return;
        const Index m = targetCount();
        expect(a.prediction.status.back() == TargetStatus::InvalidTarget &&
                   std::isnan(a.prediction.estimate(m, 0)) && std::isnan(a.prediction.variance[m]),
               "the invalid target is not flagged");
    }

    /// F'w = f0: weights_sum, drift_reproduced.
    void checkConstraint(const Answer& a) {
        const DriftModel& drift = case_.problem.drift;
        if (drift.polynomial == DriftPolynomial::None && drift.external.size() == 0) return;
        for (Index t = 0; t < targetCount(); ++t) {
            const VectorXd w = a.prediction.weights.row(t).transpose();
            const double size = weightSize(a, t);
            if (drift.polynomial != DriftPolynomial::None)
                expectNear(w.sum(), 1, 1e-10 * size, "sum of weights");
            if (drift.polynomial >= DriftPolynomial::Linear)
                for (Index axis = 0; axis < 2; ++axis) {
                    // In coordinates centred at the target, as large coordinates round.
                    const VectorXd x =
                        case_.problem.positions.col(axis).array() - case_.targets.points(t, axis);
                    expectNear(w.dot(x), 0, 1e-10 * size * x.cwiseAbs().maxCoeff(), "linear drift");
                    if (drift.polynomial == DriftPolynomial::Quadratic)
                        expectNear(w.dot(x.cwiseAbs2()), 0, 1e-10 * size * x.cwiseAbs2().maxCoeff(),
                                   "quadratic drift");
                }
            for (Index k = 0; k < drift.external.cols(); ++k)
                expectNear(w.dot(drift.external.col(k)), case_.targets.externalDrift(t, k),
                           1e-10 * size * drift.external.col(k).cwiseAbs().maxCoeff(), "external drift");
        }
    }

    void checkExact(const Answer& a) {
        const bool generalised =
            a.report.generalisedCovariance && tolerance("prediction_abs_generalised") > 0;
        for (Index t = 0; t < targetCount(); ++t) {
            const double z = case_.prediction[t], v = case_.variance[t];
            double zTolerance =
                std::max(tolerance("prediction_abs"), tolerance("prediction_rel") * std::abs(z));
            double vTolerance = std::max(tolerance("variance_abs"), tolerance("variance_rel") * std::abs(v));
            if (generalised) {
                zTolerance = tolerance("prediction_abs_generalised");
                vTolerance = tolerance("variance_rel_generalised") * std::abs(v);
            }
            expectNear(a.prediction.estimate(t, 0), z, zTolerance, "estimate");
            expectNear(a.prediction.variance[t], std::max(0.0, v), vTolerance, "variance");
            if (case_.condition < 1e6 && case_.weights.cols() == a.prediction.weights.cols())
                expectNear((case_.weights.row(t) - a.prediction.weights.row(t)).cwiseAbs().maxCoeff(), 0,
                           1e-9 * weightSize(a, t), "weights");
        }
    }

    void checkExactAtData(const Answer& a) {
        for (Index t = 0; t < targetCount(); ++t)
            for (Index i = 0; i < case_.problem.positions.rows(); ++i) {
                if (case_.problem.positions.row(i) != case_.targets.points.row(t)) continue;
                if (case_.problem.errorVariances[i] != 0) continue;
                expect(a.prediction.estimate(t, 0) == case_.problem.values(i, 0) &&
                           a.prediction.variance[t] == 0 &&
                           a.prediction.status[static_cast<std::size_t>(t)] == TargetStatus::Exact,
                       "a datum is not reproduced bitwise");
            }
    }

    void compare(const Answer& a, const KrigingProblem& problem, const KrigingTargets& targets,
                 const std::string& what, double rounding, double factor = 1, double offset = 0,
                 double varianceFactor = 1) {
        const Answer b = solve(problem, targets);
        if (!b.report.ok()) {
            failures_.push_back(what + ": " + b.report.message);
            return;
        }
        const double tolerance = std::max(1e-9, rounding);
        for (Index t = 0; t < targetCount(); ++t) {
            const double size = weightSize(a, t);
            expectNear(b.prediction.estimate(t, 0), factor * a.prediction.estimate(t, 0) + offset,
                       tolerance * valueRange() * std::abs(factor) * size +
                           8 * kEpsilon * std::abs(b.prediction.estimate(t, 0)),
                       what + ", estimate");
            expectNear(b.prediction.variance[t], varianceFactor * a.prediction.variance[t],
                       tolerance * varianceSize() * varianceFactor * size * size, what + ", variance");
        }
    }

    /// How much rounding coordinates to `coordinate` changes the smallest distance, relative to it.
    double relativeRounding(double coordinate) const {
        double smallest = std::numeric_limits<double>::infinity();
        const auto& x = case_.problem.positions;
        const auto visit = [&](const Eigen::RowVectorXd& d) {
            const double h = d.stableNorm();
            if (h > 0) smallest = std::min(smallest, h);
        };
        for (Index i = 0; i < x.rows(); ++i) {
            for (Index j = 0; j < i; ++j) visit(x.row(i) - x.row(j));
            for (Index t = 0; t < targetCount(); ++t) visit(x.row(i) - case_.targets.points.row(t));
        }
        return kEpsilon * coordinate / smallest;
    }

    void checkInvariances(const Answer& a) {
        const KrigingProblem& problem = case_.problem;
        const KrigingTargets& targets = case_.targets;
        const Index n = problem.positions.rows();
        const double condition = std::min(case_.condition, a.report.conditionEstimate);
        if (n == 0 || !case_.has("within_tolerance") || !(condition < 1e6)) return;
        const auto finite = targets.points.topRows(targetCount());
        const double extent =
            (problem.positions.colwise().maxCoeff() - problem.positions.colwise().minCoeff()).maxCoeff();
        const double reach = std::max(problem.positions.cwiseAbs().maxCoeff(), finite.cwiseAbs().maxCoeff());

        if (case_.has("permutation")) {
            std::vector<Index> order(static_cast<std::size_t>(n));
            std::iota(order.begin(), order.end(), Index{0});
            std::reverse(order.begin(), order.end());
            std::rotate(order.begin(), order.begin() + n / 3, order.end());
            KrigingProblem p = problem;
            p.positions = problem.positions(order, Eigen::all);
            p.values = problem.values(order, Eigen::all);
            p.errorVariances = problem.errorVariances(order);
            if (problem.drift.external.rows() == n)
                p.drift.external = problem.drift.external(order, Eigen::all);
            compare(a, p, targets, "permutation", 0);
        }
        if (case_.has("rotation")) {
            Eigen::Matrix2d rotation;
            rotation << std::cos(0.7), std::sin(0.7), -std::sin(0.7), std::cos(0.7);
            KrigingProblem p = problem;
            KrigingTargets t = targets;
            // Element by element: coincident points must stay bitwise coincident.
            const auto rotate = [&](MatrixXd& x) {
                for (Index i = 0; i < x.rows(); ++i)
                    x.row(i) = Eigen::RowVector2d(x(i, 0) * rotation(0, 0) + x(i, 1) * rotation(1, 0),
                                                  x(i, 0) * rotation(0, 1) + x(i, 1) * rotation(1, 1));
            };
            rotate(p.positions);
            rotate(t.points);
            compare(a, p, t, "rotation", 20 * relativeRounding(reach));
        }
        if (case_.has("translation")) {
            const double shift = 1024 * (extent > 0 ? extent : 1);
            KrigingProblem p = problem;
            KrigingTargets t = targets;
            p.positions.array() += shift;
            t.points.array() += shift;
            compare(a, p, t, "translation", 20 * relativeRounding(shift + reach));
        }
        if (case_.has("affine_values")) {
            KrigingProblem p = problem;
            p.values = -3 * problem.values.array() + 7;
            if (p.drift.mean.size() > 0) p.drift.mean = -3 * problem.drift.mean.array() + 7;
            const double rounding = 8 * kEpsilon * problem.values.cwiseAbs().maxCoeff() / valueRange();
            compare(a, p, targets, "affine values", rounding, -3,
                    problem.drift.polynomial == DriftPolynomial::None && problem.drift.external.size() > 0
                        ? 0
                        : 7);
        }
        {
            KrigingProblem p = problem;
            p.model.nugget *= 5;
            for (VariogramStructure& s : p.model.structures) s.sill *= 5;
            p.errorVariances *= 5;
            compare(a, p, targets, "model * 5", 0, 1, 0, 5);
        }
        {
            KrigingProblem p = problem;
            KrigingTargets t = targets;
            p.positions *= 3;
            t.points *= 3;
            for (VariogramStructure& s : p.model.structures) s.range *= 3;
            compare(a, p, t, "coordinates * 3", 20 * relativeRounding(3 * reach));
        }
    }

    /// Far from all data an ordinary-kriging estimate is the GLS mean; its variance adds the field's.
    void checkFarTarget() {
        const KrigingProblem& problem = case_.problem;
        if (problem.drift.polynomial != DriftPolynomial::Constant || case_.beta.size() != 1 ||
            case_.betaVariance.size() != 1 || !problem.model.bounded())
            return;
        double distance = 0;
        for (const VariogramStructure& s : problem.model.structures) {
            double u = 1e3;
            if (s.type == StructureType::Stable) u = std::pow(60.0, 1 / s.shape);
            distance = std::max(distance, u * s.range);
        }
        const double extent =
            (problem.positions.colwise().maxCoeff() - problem.positions.colwise().minCoeff()).maxCoeff();
        if (!(distance < 1e150)) return;
        KrigingTargets far;
        far.points = problem.positions.row(0);
        far.points(0, 0) += distance + 2 * extent;
        const KrigingSystem system(problem);
        const KrigingPrediction prediction = system.predict(far);
        const double size = varianceSize();
        const double zTolerance = std::max(tolerance("prediction_abs"), 1e-9 * valueRange());
        const double vTolerance = std::max(tolerance("variance_abs"), 1e-9 * size);
        expectNear(prediction.estimate(0, 0), case_.beta[0], zTolerance, "far target, estimate");
        expectNear(prediction.variance[0], processVariance() + case_.betaVariance[0], vTolerance,
                   "far target, variance");
        const DriftEstimate drift = system.drift();
        expectNear(drift.coefficients(0, 0), case_.beta[0], zTolerance, "drift, estimate");
        expectNear(drift.covariance(0, 0), case_.betaVariance[0], vTolerance, "drift, variance");
        far.points = problem.positions.topRows(1);
        KrigingPredictOptions mean;
        mean.quantity = KrigingQuantity::Drift;
        const KrigingPrediction trend = system.predict(far, mean);
        expectNear(trend.estimate(0, 0), case_.beta[0], zTolerance, "drift at a datum, estimate");
        expectNear(trend.variance[0], case_.betaVariance[0], vTolerance, "drift at a datum, variance");
    }

    HardCase case_;
    std::vector<std::string> failures_;
};

}  // namespace

std::vector<std::string> checkHardCase(const HardCase& hardCase, KrigingPrecision precision) {
    return Checker(hardCase, precision).run();
}

}  // namespace vlx::testing
