#pragma once

#include <array>
#include <vector>

#include "geostat/kriging_names.h"
#include "variolux/geostat/variogram_fit.h"

/// The search behind fitVariogram(): separable least squares over the classes of an empirical variogram.
namespace vlx::separable {

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
    Problem(const Classes& classes, const FitOptions& options);

    const FitOptions& options() const { return options_; }
    int evaluations() const { return evaluations_; }

    /// Takes over the weights of the classes.
    void setWeights();

    Solution solve(const Shapes& shapes);

    /// As solve() of one structure whose unit semivariances are 1 - exp(-power), but for the shapes; then
    /// multiplies the powers by `ratio`. `power`: rows() of them.
    Solution solveDecay(double* power, double ratio);

    /// Classes, filled up to whole vectors by ones of weight 0.
    std::size_t rows() const { return squared_.size(); }

  private:
    double sse(double nugget, const std::array<double, kMaxStructures>& sills) const;
    Solution solveColumns();
    Solution solveOne() const;
    Solution solveSubsets() const;

    const Classes& classes_;
    const FitOptions& options_;
    std::vector<double> squared_, w_, g_;  // rows(): squared distances, weights, semivariances
    std::vector<double> columns_;          // rows() of each structure
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

Space makeSpace(const FitOptions& options, const Classes& classes);

/// The inverse of Space::at().
std::vector<double> coordinates(const Space& space, const Solution& solution);

/// The minimum, to the accuracy of FitOptions::search.
Solution search(Problem& problem, const Space& space, const Classes& classes);

}  // namespace vlx::separable
