#include "variolux/geostat/variogram_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

#include "geostat/separable_fit.h"

namespace vlx {
namespace {

using namespace separable;

VariogramModel toModel(const Solution& solution, const FitOptions& options, const Classes& classes) {
    VariogramModel model;
    model.nugget = solution.nugget * classes.valueScale;
    for (std::size_t s = 0; s < options.structures.size(); ++s)
        model.structures.push_back({options.structures[s].type, solution.sills[s] * classes.valueScale,
                                    solution.shapes[s].range * classes.distanceScale,
                                    solution.shapes[s].shape});
    return model;
}

/// The weights of everything but the iterated kind, for which they are those of `model`.
void setWeights(Classes& classes, const FitOptions& options, const VariogramModel& model) {
    // Floor: a model near zero in a class must not make it all that counts.
    double largest = 0;
    std::vector<double> total(classes.size());
    for (std::size_t b = 0; b < classes.size(); ++b) {
        total[b] =
            semivariance(model, classes.h[b] * classes.distanceScale) / classes.valueScale + classes.noise[b];
        largest = std::max(largest, total[b]);
    }
    for (std::size_t b = 0; b < classes.size(); ++b) {
        double w = classes.pairs[b];
        if (options.weights == FitWeights::Equal) w = 1;
        if (options.weights == FitWeights::PairsPerSquaredDistance) w /= classes.h[b] * classes.h[b];
        if (options.weights == FitWeights::PairsPerSquaredSemivariance ||
            options.weights == FitWeights::PairsPerSquaredReference) {
            const double t = std::max(total[b], 1e-6 * largest);
            if (t > 0) w /= t * t;
        }
        classes.w[b] = w;
    }
}

/// Units of w (gamma)^2 in terms of the scaled ones.
double sseScale(const Classes& classes, FitWeights weights) {
    switch (weights) {
        case FitWeights::Equal:
        case FitWeights::Pairs:
            return classes.valueScale * classes.valueScale;
        case FitWeights::PairsPerSquaredDistance: {
            const double ratio = classes.valueScale / classes.distanceScale;
            return ratio * ratio;
        }
        default:
            return 1;
    }
}

Eigen::VectorXd parameterErrors(const VariogramFit& fit, const FitOptions& options, const Classes& classes,
                                const Space& space, const Solution& solution) {
    const Eigen::Index all = 1 + 3 * static_cast<Eigen::Index>(options.structures.size());
    Eigen::VectorXd errors = Eigen::VectorXd::Constant(all, std::numeric_limits<double>::quiet_NaN());
    std::vector<Eigen::Index> free;
    if (fit.model.nugget > 0) free.push_back(0);
    for (std::size_t s = 0; s < options.structures.size(); ++s)
        if (solution.sills[s] > 0) free.push_back(1 + 3 * static_cast<Eigen::Index>(s));
    const std::vector<double> x = coordinates(space, solution);
    for (std::size_t v = 0; v < x.size(); ++v) {
        const Variable& variable = space.variables[v];
        const double margin = 1e-6 * (variable.upper - variable.lower);
        if (solution.sills[variable.structure] > 0 && x[v] > variable.lower + margin &&
            x[v] < variable.upper - margin)
            free.push_back(1 + 3 * static_cast<Eigen::Index>(variable.structure) +
                           (variable.isRange ? 1 : 2));
    }
    const Eigen::Index p = static_cast<Eigen::Index>(free.size()),
                       k = static_cast<Eigen::Index>(classes.size());
    if (p == 0 || k <= p) return errors;
    // In scaled units: columns are d gamma / d parameter, divided by the value scale.
    Eigen::MatrixXd jacobian(k, p);
    for (Eigen::Index b = 0; b < k; ++b) {
        const std::size_t at = static_cast<std::size_t>(b);
        const Eigen::VectorXd gradient =
            semivarianceGradient(fit.model, classes.h[at] * classes.distanceScale);
        jacobian.row(b) = std::sqrt(classes.w[at]) * gradient(free).transpose() / classes.valueScale;
    }
    const Eigen::VectorXd norms = jacobian.colwise().norm();
    if (!(norms.minCoeff() > 0) || !norms.allFinite()) return errors;
    jacobian *= norms.cwiseInverse().asDiagonal();
    const Eigen::LLT<Eigen::MatrixXd> factor(jacobian.transpose() * jacobian);
    if (factor.info() != Eigen::Success) return errors;
    const Eigen::MatrixXd inverse = factor.solve(Eigen::MatrixXd::Identity(p, p));
    const double variance = solution.sse / static_cast<double>(k - p);
    for (Eigen::Index i = 0; i < p; ++i)
        errors[free[static_cast<std::size_t>(i)]] =
            std::sqrt(std::max(0.0, variance * inverse(i, i))) / norms[i];
    return errors;
}

bool sameModel(const VariogramModel& a, const VariogramModel& b, const Classes& classes) {
    for (std::size_t i = 0; i < classes.size(); ++i) {
        const double h = classes.h[i] * classes.distanceScale;
        if (std::abs(semivariance(a, h) - semivariance(b, h)) > 1e-7 * classes.valueScale) return false;
    }
    return true;
}

}  // namespace

std::optional<std::string> FitOptions::validate() const {
    if (structures.empty() || structures.size() > kMaxStructures)
        return "structures must be 1 to 3, found " + std::to_string(structures.size());
    if (!(level > 0 && level < 1)) return "level must be in (0, 1), found " + std::to_string(level);
    for (const FitStructure& s : structures) {
        if (!(s.minRange >= 0) || !(s.maxRange >= 0) || !std::isfinite(s.minRange) ||
            !std::isfinite(s.maxRange))
            return "range bounds must be >= 0 and finite";
        if (s.maxRange > 0 && s.minRange > s.maxRange) return "minRange must not exceed maxRange";
        const bool shaped = s.type == StructureType::Stable || s.type == StructureType::Matern;
        if (!shaped) continue;
        const double limit = s.type == StructureType::Stable ? 2 : kInfinity;
        if (!(s.minShape > 0 && s.minShape <= s.maxShape && s.maxShape <= limit && std::isfinite(s.maxShape)))
            return "shape bounds must be positive, ordered" +
                   std::string(s.type == StructureType::Stable ? " and at most 2" : "");
    }
    if (weights == FitWeights::PairsPerSquaredReference)
        if (const auto broken = reference.validate()) return "reference: " + *broken;
    return std::nullopt;
}

std::string VariogramFit::message() const {
    std::ostringstream text;
    switch (status) {
        case FitStatus::Ok:
            text << "fitted to " << classes << " classes, SSE " << sse;
            break;
        case FitStatus::TooFewClasses:
            text << "a fit needs 2 lag classes with pairs, found " << classes;
            break;
        case FitStatus::NotFinite:
            text << "a lag class has a semivariance that is not finite";
            break;
        case FitStatus::Zero:
            text << "no semivariance above zero in " << classes << " classes";
            break;
        case FitStatus::WeightsUnconverged:
            text << "fitted to " << classes << " classes, but the weights had not settled; SSE " << sse;
            break;
    }
    if (rangeAtBound) text << "; range at its bound";
    return text.str();
}

VariogramFit fitVariogram(const EmpiricalVariogram& variogram, const FitOptions& options) {
    assert(!options.validate());
    VariogramFit fit;
    Classes classes;
    double longest = 0, shortest = kInfinity, largest = 0;
    for (const VariogramBin& bin : variogram.bins) {
        if (!(bin.pairs > 0) || !(bin.distance > 0) || !std::isfinite(bin.distance)) continue;
        if (!std::isfinite(bin.semivariance) || !std::isfinite(bin.noise)) {
            fit.status = FitStatus::NotFinite;
            return fit;
        }
        classes.h.push_back(bin.distance);
        classes.g.push_back(bin.semivariance);
        classes.noise.push_back(bin.noise);
        classes.pairs.push_back(bin.pairs);
        longest = std::max(longest, bin.distance);
        shortest = std::min(shortest, bin.distance);
        largest = std::max(largest, std::abs(bin.semivariance));
    }
    fit.classes = static_cast<int>(classes.size());
    if (classes.size() < 2) return fit;
    classes.distanceScale = longest;
    classes.valueScale = largest > 0 ? largest : 1;
    classes.shortest = shortest / longest;
    classes.w.resize(classes.size());
    for (std::size_t b = 0; b < classes.size(); ++b) {
        classes.h[b] /= classes.distanceScale;
        classes.g[b] /= classes.valueScale;
        classes.noise[b] /= classes.valueScale;
    }

    const Space space = makeSpace(options, classes);
    Problem problem(classes, options);
    const bool iterated = options.weights == FitWeights::PairsPerSquaredSemivariance;
    FitOptions first = options;
    if (iterated) first.weights = FitWeights::Pairs;
    setWeights(classes, first, options.reference);
    Solution best = search(problem, space, classes);
    fit.model = toModel(best, options, classes);
    fit.status = FitStatus::Ok;
    if (iterated && best.nugget + *std::max_element(best.sills.begin(), best.sills.end()) > 0) {
        fit.status = FitStatus::WeightsUnconverged;
        const bool fast = options.search == FitSearch::Fast;
        for (int i = 0; i < (fast ? 3 : 20) && fit.status != FitStatus::Ok; ++i) {
            setWeights(classes, options, fit.model);
            best = search(problem, space, classes);
            const VariogramModel next = toModel(best, options, classes);
            if ((fast && i == 2) || sameModel(fit.model, next, classes)) fit.status = FitStatus::Ok;
            fit.model = next;
        }
    }
    fit.sse = best.sse * sseScale(classes, options.weights);
    fit.evaluations = problem.evaluations();
    double total = best.nugget;
    for (const double sill : best.sills) total += sill;
    if (!(total > 0)) fit.status = FitStatus::Zero;
    const std::vector<double> x = coordinates(space, best);
    for (std::size_t v = 0; v < x.size(); ++v) {
        const Variable& variable = space.variables[v];
        const double margin = 1e-6 * (variable.upper - variable.lower);
        fit.rangeAtBound =
            fit.rangeAtBound || (variable.isRange && best.sills[variable.structure] > 0 &&
                                 (x[v] < variable.lower + margin || x[v] > variable.upper - margin));
    }
    if (options.search == FitSearch::Global)
        fit.standardErrors = parameterErrors(fit, options, classes, space, best);
    if (options.sillTest) fit.sillTest = sillTest(variogram, options.level);
    return fit;
}

}  // namespace vlx
