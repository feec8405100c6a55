#include "geostat/separable_fit.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geostat/simplex.h"

namespace vlx::separable {

Space makeSpace(const FitOptions& options, const Classes& classes) {
    Space space;
    const bool fast = options.search == FitSearch::Fast;
    for (std::size_t s = 0; s < options.structures.size(); ++s) {
        const FitStructure& structure = options.structures[s];
        space.fixed[s] = {1, structure.minShape};
        if (structure.type == StructureType::Linear) continue;
        const double lower = structure.minRange > 0 ? structure.minRange / classes.distanceScale
                                                    : (fast ? 0.1 : 1e-3) * classes.shortest;
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

namespace {

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

}  // namespace

std::vector<double> coordinates(const Space& space, const Solution& solution) {
    std::vector<double> x;
    for (const Variable& v : space.variables) {
        const Shape& shape = solution.shapes[v.structure];
        x.push_back(std::clamp(v.isRange ? std::log(shape.range) : shape.shape, v.lower, v.upper));
    }
    return x;
}

namespace {

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
    constexpr int ranges = 28, shapes = 8;
    Solution best;
    std::vector<double> x(space.variables.size());
    const bool freeShape = space.variables.size() == 2;
    const std::vector<double> rangePoints = gridPoints(space.variables[0], ranges);
    const std::vector<double> shapePoints =
        freeShape ? gridPoints(space.variables[1], shapes) : std::vector<double>{space.fixed[0].shape};
    const bool stable = problem.options().structures[0].type == StructureType::Stable;
    std::vector<double> power(problem.rows(), 1.0);
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
            const Solution s = problem.solveDecay(power.data(), ratio);
            if (!(s.sse < best.sse)) continue;
            best = s;
            best.shapes = space.at(x);
        }
    }
    // Golden section in the range; with a free shape, golden section in the shape over the best range of each
    // (the two are strongly correlated), and the bounds of the shape, which it never reaches.
    const double rangeStep = rangePoints[1] - rangePoints[0];
    const auto bestRange = [&](const std::vector<double>& centre, int steps) {
        return golden(problem, space, centre, 0, std::max(space.variables[0].lower, centre[0] - rangeStep),
                      std::min(space.variables[0].upper, centre[0] + rangeStep), steps);
    };
    best = better(best, bestRange(coordinates(space, best), 8));
    if (!freeShape) return best;
    const std::vector<double> centre = coordinates(space, best);
    const double shapeStep = shapePoints[1] - shapePoints[0];
    double lower = std::max(space.variables[1].lower, centre[1] - shapeStep);
    double upper = std::min(space.variables[1].upper, centre[1] + shapeStep);
    const auto profile = [&](double shape) {
        std::vector<double> at = coordinates(space, best);
        at[1] = shape;
        const Solution s = bestRange(at, 6);
        best = better(best, s);
        return s.sse;
    };
    if (lower == space.variables[1].lower) profile(lower);
    if (upper == space.variables[1].upper) profile(upper);
    constexpr double ratio = 0.6180339887498949;
    double s = upper - ratio * (upper - lower), t = lower + ratio * (upper - lower);
    double fs = profile(s), ft = profile(t);
    for (int i = 0; i < 5; ++i) {
        if (fs <= ft) {
            upper = t, t = s, ft = fs;
            fs = profile(s = upper - ratio * (upper - lower));
        } else {
            lower = s, s = t, fs = ft;
            ft = profile(t = lower + ratio * (upper - lower));
        }
    }
    return best;
}

}  // namespace

Solution search(Problem& problem, const Space& space, const Classes& classes) {
    problem.setWeights();
    const bool fast = problem.options().search == FitSearch::Fast &&
                      problem.options().structures.size() == 1 &&
                      (space.variables.empty() || space.variables[0].isRange);
    return fast ? searchFast(problem, space, classes) : searchGlobal(problem, space);
}

}  // namespace vlx::separable
