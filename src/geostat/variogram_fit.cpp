#include "variolux/geostat/variogram_fit.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

#include "simplex.h"

namespace vlx {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr int kMaxStructures = 3;

/// The classes in use, distances and semivariances scaled to at most 1.
struct Classes {
    std::vector<double> h, g, w, noise, pairs;
    double distanceScale = 1, valueScale = 1;
    double shortest = 1;  ///< scaled
    std::size_t size() const { return h.size(); }
};

/// Ranges and shapes, where they vary; scaled distances.
struct Shape {
    double range = 1, shape = 1;
};
using Shapes = std::array<Shape, kMaxStructures>;

struct Solution {
    double sse = kInfinity;
    double nugget = 0;
    std::array<double, kMaxStructures> sills{};
    Shapes shapes{};
};

/// The separable problem: linear coefficients exactly, for given shapes.
class Problem {
  public:
    Problem(const Classes& classes, const FitOptions& options)
        : classes_(classes), options_(options), columns_(options.structures.size() * classes.size()) {}

    const FitOptions& options() const { return options_; }
    int evaluations() const { return evaluations_; }

    Solution solve(const Shapes& shapes) {
        const std::size_t k = classes_.size(), m = options_.structures.size();
        for (std::size_t s = 0; s < m; ++s)
            for (std::size_t b = 0; b < k; ++b)
                columns_[s * k + b] = unitSemivariance(options_.structures[s].type, shapes[s].shape,
                                                       classes_.h[b] / shapes[s].range);
        return solveColumns(shapes);
    }

    /// As solve(), the columns being filled already.
    Solution solveColumns(const Shapes& shapes) {
        ++evaluations_;
        Solution solution = options_.structures.size() == 1 ? solveOne() : solveSubsets();
        solution.shapes = shapes;
        return solution;
    }

    double* column(std::size_t s) { return columns_.data() + s * classes_.size(); }

  private:
    double sse(double nugget, const std::array<double, kMaxStructures>& sills) const {
        const std::size_t k = classes_.size();
        double sum = 0;
        for (std::size_t b = 0; b < k; ++b) {
            double r = classes_.g[b] - nugget;
            for (std::size_t s = 0; s < options_.structures.size(); ++s) r -= sills[s] * columns_[s * k + b];
            sum += classes_.w[b] * r * r;
        }
        return sum;
    }

    /// One structure: the unconstrained minimum if it is feasible, else the better edge of the quadrant.
    Solution solveOne() const {
        double sw = 0, sg = 0, sc = 0, scc = 0, scg = 0;
        for (std::size_t b = 0; b < classes_.size(); ++b) {
            const double w = classes_.w[b], c = columns_[b], g = classes_.g[b];
            sw += w;
            sg += w * g;
            sc += w * c;
            scc += w * c * c;
            scg += w * c * g;
        }
        Solution best;
        const double meanColumn = sc / sw, meanValue = sg / sw;
        if (options_.nugget) {
            double spread = 0, slope = 0;
            for (std::size_t b = 0; b < classes_.size(); ++b) {
                const double d = columns_[b] - meanColumn;
                spread += classes_.w[b] * d * d;
                slope += classes_.w[b] * d * (classes_.g[b] - meanValue);
            }
            if (spread > 1e-20 * scc) {
                best.sills[0] = slope / spread;
                best.nugget = meanValue - best.sills[0] * meanColumn;
                if (best.sills[0] >= 0 && best.nugget >= 0) {
                    best.sse = sse(best.nugget, best.sills);
                    return best;
                }
            }
            best = {};
            best.nugget = std::max(0.0, meanValue);
            best.sse = sse(best.nugget, best.sills);
        } else {
            best.sse = sse(0, best.sills);
        }
        Solution edge;
        edge.sills[0] = scc > 0 ? std::max(0.0, scg / scc) : 0;
        edge.sse = sse(0, edge.sills);
        return edge.sse < best.sse ? edge : best;
    }

    /// Several structures: non-negative least squares by trying every set of non-zero coefficients.
    Solution solveSubsets() const {
        const int m = static_cast<int>(options_.structures.size());
        const int unknowns = m + (options_.nugget ? 1 : 0);
        const std::size_t k = classes_.size();
        const auto column = [&](int u, std::size_t b) {
            return u < m ? columns_[static_cast<std::size_t>(u) * k + b] : 1.0;
        };
        Eigen::Matrix<double, 4, 4> gram = Eigen::Matrix<double, 4, 4>::Zero();
        Eigen::Vector4d right = Eigen::Vector4d::Zero();
        for (std::size_t b = 0; b < k; ++b)
            for (int i = 0; i < unknowns; ++i) {
                right[i] += classes_.w[b] * column(i, b) * classes_.g[b];
                for (int j = 0; j < unknowns; ++j) gram(i, j) += classes_.w[b] * column(i, b) * column(j, b);
            }
        Solution best;
        best.sse = sse(0, best.sills);
        for (int set = 1; set < 1 << unknowns; ++set) {
            std::array<int, 4> index{};
            int count = 0;
            for (int u = 0; u < unknowns; ++u)
                if (set >> u & 1) index[static_cast<std::size_t>(count++)] = u;
            Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 4, 4> a(count, count);
            Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1> r(count);
            for (int i = 0; i < count; ++i) {
                r[i] = right[index[static_cast<std::size_t>(i)]];
                for (int j = 0; j < count; ++j)
                    a(i, j) = gram(index[static_cast<std::size_t>(i)], index[static_cast<std::size_t>(j)]);
            }
            const auto factor = a.ldlt();
            const auto pivots = factor.vectorD();
            if (!(pivots.minCoeff() > 1e-14 * pivots.maxCoeff())) continue;
            const Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 4, 1> x = factor.solve(r);
            if (!(x.minCoeff() >= 0)) continue;
            Solution candidate;
            for (int i = 0; i < count; ++i) {
                const int u = index[static_cast<std::size_t>(i)];
                (u < m ? candidate.sills[static_cast<std::size_t>(u)] : candidate.nugget) = x[i];
            }
            candidate.sse = sse(candidate.nugget, candidate.sills);
            if (candidate.sse < best.sse) best = candidate;
        }
        return best;
    }

    const Classes& classes_;
    const FitOptions& options_;
    std::vector<double> columns_;
    int evaluations_ = 0;
};

/// One free search variable: log range or shape of a structure.
struct Variable {
    std::size_t structure = 0;
    bool isRange = true;
    double lower = 0, upper = 0;
};

/// The search space of FitOptions in scaled distances.
struct Space {
    std::vector<Variable> variables;
    Shapes fixed{};

    Shapes at(const std::vector<double>& x) const {
        Shapes shapes = fixed;
        for (std::size_t v = 0; v < variables.size(); ++v) {
            Shape& shape = shapes[variables[v].structure];
            (variables[v].isRange ? shape.range : shape.shape) = variables[v].isRange ? std::exp(x[v]) : x[v];
        }
        return shapes;
    }
};

Space makeSpace(const FitOptions& options, const Classes& classes) {
    Space space;
    for (std::size_t s = 0; s < options.structures.size(); ++s) {
        const FitStructure& structure = options.structures[s];
        space.fixed[s] = {1, structure.minShape};
        if (structure.type == StructureType::Linear) continue;
        const double lower =
            structure.minRange > 0 ? structure.minRange / classes.distanceScale : 1e-3 * classes.shortest;
        const double upper = structure.maxRange > 0 ? structure.maxRange / classes.distanceScale : 20;
        if (lower < upper)
            space.variables.push_back({s, true, std::log(lower), std::log(upper)});
        else
            space.fixed[s].range = upper;
        const bool shaped =
            structure.type == StructureType::Stable || structure.type == StructureType::Matern;
        if (shaped && structure.minShape < structure.maxShape)
            space.variables.push_back({s, false, structure.minShape, structure.maxShape});
    }
    return space;
}

/// Points of a regular grid along one variable.
std::vector<double> gridPoints(const Variable& v, int count) {
    std::vector<double> points;
    for (int i = 0; i < count; ++i) points.push_back(v.lower + (v.upper - v.lower) * i / (count - 1));
    return points;
}

Solution better(const Solution& a, const Solution& b) { return b.sse < a.sse ? b : a; }

/// Minimises over one variable of x in [lower, upper] by golden section.
Solution golden(Problem& problem, const Space& space, std::vector<double> x, std::size_t v, double lower,
                double upper, int steps) {
    constexpr double ratio = 0.6180339887498949;
    const auto value = [&](double t) {
        x[v] = t;
        return problem.solve(space.at(x));
    };
    double a = lower, b = upper;
    double s = b - ratio * (b - a), t = a + ratio * (b - a);
    Solution fs = value(s), ft = value(t);
    for (int i = 0; i < steps; ++i) {
        if (fs.sse <= ft.sse) {
            b = t, t = s, ft = fs;
            s = b - ratio * (b - a);
            fs = value(s);
        } else {
            a = s, s = t, fs = ft;
            t = a + ratio * (b - a);
            ft = value(t);
        }
    }
    return better(fs, ft);
}

std::vector<double> coordinates(const Space& space, const Solution& solution) {
    std::vector<double> x;
    for (const Variable& v : space.variables) {
        const Shape& shape = solution.shapes[v.structure];
        x.push_back(std::clamp(v.isRange ? std::log(shape.range) : shape.shape, v.lower, v.upper));
    }
    return x;
}

/// Every basin of one variable: a grid, then golden section around each local minimum and at both ends.
Solution searchLine(Problem& problem, const Space& space, std::vector<double> x, std::size_t v, int count) {
    const std::vector<double> points = gridPoints(space.variables[v], count);
    std::vector<double> sse;
    Solution best;
    for (const double p : points) {
        x[v] = p;
        const Solution s = problem.solve(space.at(x));
        sse.push_back(s.sse);
        best = better(best, s);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool left = i == 0 || sse[i] <= sse[i - 1],
                   right = i + 1 == points.size() || sse[i] <= sse[i + 1];
        // A basin that starts far above the best cannot hold the minimum.
        if (!left || !right || sse[i] > 2 * best.sse + 1e-300) continue;
        best = better(best, golden(problem, space, x, v, points[i == 0 ? 0 : i - 1],
                                   points[std::min(i + 1, points.size() - 1)], 45));
    }
    return best;
}

/// All variables: the best grid points, each refined by the simplex; and every face where one shape is at a
/// bound, which a simplex approaches badly.
Solution searchGlobal(Problem& problem, const Space& space) {
    const std::size_t dimensions = space.variables.size();
    if (dimensions == 0) return problem.solve(space.fixed);
    if (dimensions == 1) return searchLine(problem, space, {0}, 0, 160);

    std::vector<std::vector<double>> axes;
    for (const Variable& v : space.variables)
        axes.push_back(gridPoints(v, v.isRange ? (dimensions == 2   ? 48
                                                  : dimensions == 3 ? 24
                                                                    : 14)
                                               : (dimensions == 2 ? 14 : 6)));
    std::vector<std::pair<Solution, std::vector<double>>> starts;
    std::vector<std::size_t> index(dimensions, 0);
    constexpr std::size_t keep = 8;
    for (bool more = true; more;) {
        std::vector<double> x;
        for (std::size_t v = 0; v < dimensions; ++v) x.push_back(axes[v][index[v]]);
        const Solution s = problem.solve(space.at(x));
        if (starts.size() < keep || s.sse < starts.back().first.sse) {
            const auto place =
                std::upper_bound(starts.begin(), starts.end(), s,
                                 [](const Solution& a, const auto& b) { return a.sse < b.first.sse; });
            starts.insert(place, {s, x});
            if (starts.size() > keep) starts.pop_back();
        }
        more = false;
        for (std::size_t v = 0; v < dimensions && !more; ++v) {
            more = ++index[v] < axes[v].size();
            if (!more) index[v] = 0;
        }
    }

    std::vector<double> lower, upper, steps;
    for (std::size_t v = 0; v < dimensions; ++v) {
        lower.push_back(space.variables[v].lower);
        upper.push_back(space.variables[v].upper);
        steps.push_back(axes[v][1] - axes[v][0]);
    }
    Solution best = starts.front().first;
    const auto objective = [&](const std::vector<double>& x) {
        const Solution s = problem.solve(space.at(x));
        best = better(best, s);
        return s.sse;
    };
    for (const auto& start : starts) minimizeSimplex(objective, start.second, steps, lower, upper);
    for (std::size_t v = 0; v < dimensions; ++v) {
        if (space.variables[v].isRange) continue;
        for (const double bound : {lower[v], upper[v]}) {
            std::vector<double> x = coordinates(space, best);
            x[v] = bound;
            for (std::size_t r = 0; r < dimensions; ++r)
                if (space.variables[r].isRange) best = better(best, searchLine(problem, space, x, r, 60));
        }
    }
    return best;
}

/// One structure of a class with a cheap grid: a geometric series of ranges, so that u^alpha is a product.
Solution searchFast(Problem& problem, const Space& space, const Classes& classes) {
    if (space.variables.empty()) return problem.solve(space.fixed);
    constexpr int ranges = 24, shapes = 8;
    Solution best;
    std::vector<double> x(space.variables.size());
    const bool freeShape = space.variables.size() == 2;
    const std::vector<double> rangePoints = gridPoints(space.variables[0], ranges);
    const std::vector<double> shapePoints =
        freeShape ? gridPoints(space.variables[1], shapes) : std::vector<double>{space.fixed[0].shape};
    const bool stable = problem.options().structures[0].type == StructureType::Stable;
    std::vector<double> power(classes.size());
    for (const double shape : shapePoints) {
        if (freeShape) x[1] = shape;
        const double ratio = std::exp(-shape * (rangePoints[1] - rangePoints[0]));
        for (std::size_t b = 0; stable && b < classes.size(); ++b)
            power[b] = std::pow(classes.h[b] / std::exp(rangePoints[0]), shape);
        for (const double range : rangePoints) {
            x[0] = range;
            if (!stable) {
                best = better(best, problem.solve(space.at(x)));
                continue;
            }
            double* column = problem.column(0);
            for (std::size_t b = 0; b < classes.size(); ++b) {
                column[b] = -std::expm1(-power[b]);
                power[b] *= ratio;
            }
            best = better(best, problem.solveColumns(space.at(x)));
        }
    }
    const auto refine = [&](std::size_t v, double width, int steps) {
        const Variable& variable = space.variables[v];
        const std::vector<double> centre = coordinates(space, best);
        best = better(best, golden(problem, space, centre, v, std::max(variable.lower, centre[v] - width),
                                   std::min(variable.upper, centre[v] + width), steps));
    };
    const double rangeStep = rangePoints[1] - rangePoints[0];
    refine(0, rangeStep, 8);
    if (freeShape) {
        refine(1, shapePoints[1] - shapePoints[0], 8);
        refine(0, 0.5 * rangeStep, 8);
    }
    return best;
}

Solution search(Problem& problem, const Space& space, const Classes& classes) {
    const bool fast = problem.options().search == FitSearch::Fast &&
                      problem.options().structures.size() == 1 &&
                      (space.variables.empty() || space.variables[0].isRange);
    return fast ? searchFast(problem, space, classes) : searchGlobal(problem, space);
}

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
        for (int i = 0; i < 20 && fit.status != FitStatus::Ok; ++i) {
            setWeights(classes, options, fit.model);
            best = search(problem, space, classes);
            const VariogramModel next = toModel(best, options, classes);
            if (sameModel(fit.model, next, classes)) fit.status = FitStatus::Ok;
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
    fit.sillTest = sillTest(variogram, options.level);
    return fit;
}

}  // namespace vlx
