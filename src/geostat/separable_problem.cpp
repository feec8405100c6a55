// The least squares of a fit for given ranges and shapes.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "base/simd.h"
#include "geostat/separable_fit.h"
#include "geostat/structure_kernel.h"

namespace vlx::separable {

namespace {

using ClassLanes = simd::Vectors<double, 32>::Type;  // on every instruction set: sums of one order
constexpr std::size_t kClassLanes = simd::kLanes<ClassLanes>;

[[gnu::always_inline]] inline double sumOfLanes(ClassLanes x) { return (x[0] + x[1]) + (x[2] + x[3]); }

VLX_WIDE void unitColumn(StructureType type, double shape, double range, const double* squared,
                         std::size_t rows, double* column) {
    const double inverse = 1 / (range * range), half = type == StructureType::Stable ? shape / 2 : shape;
    for (std::size_t b = 0; b < rows; b += kClassLanes)
        simd::store(column + b,
                    kernels::structureValue<ClassLanes>(type, simd::load<ClassLanes>(squared + b) * inverse,
                                                        simd::spread<ClassLanes>(half), half, true));
}

VLX_WIDE void decayColumn(double* power, double ratio, std::size_t rows, double* column) {
    for (std::size_t b = 0; b < rows; b += kClassLanes) {
        const ClassLanes x = simd::load<ClassLanes>(power + b);
        simd::store(column + b, simd::decayComplement(x));
        simd::store(power + b, x * ratio);
    }
}

VLX_WIDE double squaredResiduals(const double* w, const double* g, const double* column, std::size_t rows,
                                 double nugget, double sill) {
    ClassLanes sum{};
    for (std::size_t b = 0; b < rows; b += kClassLanes) {
        const ClassLanes r =
            (simd::load<ClassLanes>(g + b) - nugget) - sill * simd::load<ClassLanes>(column + b);
        sum += simd::load<ClassLanes>(w + b) * r * r;
    }
    return sumOfLanes(sum);
}

/// Weighted moments of one structure's column c and the semivariances g.
struct ColumnMoments {
    double w, g, c, cc, cg;
    double spread, slope;  // about the means: of c, of c and g
};

VLX_WIDE ColumnMoments columnMoments(const double* w, const double* g, const double* column,
                                     std::size_t rows) {
    ClassLanes sw{}, sg{}, sc{}, scc{}, scg{}, spread{}, slope{};
    for (std::size_t b = 0; b < rows; b += kClassLanes) {
        const ClassLanes weight = simd::load<ClassLanes>(w + b), value = simd::load<ClassLanes>(g + b);
        const ClassLanes c = simd::load<ClassLanes>(column + b), wc = weight * c;
        sw += weight;
        sg += weight * value;
        sc += wc;
        scc += wc * c;
        scg += wc * value;
    }
    ColumnMoments m{sumOfLanes(sw), sumOfLanes(sg), sumOfLanes(sc), sumOfLanes(scc), sumOfLanes(scg), 0, 0};
    const double meanColumn = m.c / m.w, meanValue = m.g / m.w;
    for (std::size_t b = 0; b < rows; b += kClassLanes) {
        const ClassLanes d = simd::load<ClassLanes>(column + b) - meanColumn;
        const ClassLanes wd = simd::load<ClassLanes>(w + b) * d;
        spread += wd * d;
        slope += wd * (simd::load<ClassLanes>(g + b) - meanValue);
    }
    m.spread = sumOfLanes(spread);
    m.slope = sumOfLanes(slope);
    return m;
}

}  // namespace

Problem::Problem(const Classes& classes, const FitOptions& options)
    : classes_(classes),
      options_(options),
      squared_((classes.size() + kClassLanes - 1) / kClassLanes * kClassLanes, 1.0),
      w_(rows()),
      g_(rows()),
      columns_(options.structures.size() * rows()) {
    for (std::size_t b = 0; b < classes.size(); ++b) {
        squared_[b] = classes.h[b] * classes.h[b];
        g_[b] = classes.g[b];
    }
}

void Problem::setWeights() { std::copy(classes_.w.begin(), classes_.w.end(), w_.begin()); }

Solution Problem::solve(const Shapes& shapes) {
    for (std::size_t s = 0; s < options_.structures.size(); ++s) {
        const StructureType type = options_.structures[s].type;
        double* column = columns_.data() + s * rows();
        if (type == StructureType::Matern)  // 1 - rho cancels at small lags
            for (std::size_t b = 0; b < classes_.size(); ++b)
                column[b] = unitSemivariance(type, shapes[s].shape, classes_.h[b] / shapes[s].range);
        else
            unitColumn(type, shapes[s].shape, shapes[s].range, squared_.data(), rows(), column);
    }
    Solution solution = solveColumns();
    solution.shapes = shapes;
    return solution;
}

Solution Problem::solveDecay(double* power, double ratio) {
    decayColumn(power, ratio, rows(), columns_.data());
    return solveColumns();
}

Solution Problem::solveColumns() {
    ++evaluations_;
    return options_.structures.size() == 1 ? solveOne() : solveSubsets();
}

double Problem::sse(double nugget, const std::array<double, kMaxStructures>& sills) const {
    const std::size_t k = classes_.size();
    double sum = 0;
    for (std::size_t b = 0; b < k; ++b) {
        double r = g_[b] - nugget;
        for (std::size_t s = 0; s < options_.structures.size(); ++s) r -= sills[s] * columns_[s * rows() + b];
        sum += w_[b] * r * r;
    }
    return sum;
}

/// One structure: the unconstrained minimum if it is feasible, else the better edge of the quadrant.
Solution Problem::solveOne() const {
    const auto evaluate = [&](double nugget, double sill) {
        Solution solution;
        solution.nugget = nugget;
        solution.sills[0] = sill;
        solution.sse = squaredResiduals(w_.data(), g_.data(), columns_.data(), rows(), nugget, sill);
        return solution;
    };
    const ColumnMoments m = columnMoments(w_.data(), g_.data(), columns_.data(), rows());
    if (options_.nugget && m.spread > 1e-20 * m.cc) {
        const double sill = m.slope / m.spread, nugget = m.g / m.w - sill * (m.c / m.w);
        if (sill >= 0 && nugget >= 0) return evaluate(nugget, sill);
    }
    const Solution flat = evaluate(options_.nugget ? std::max(0.0, m.g / m.w) : 0, 0);
    const Solution edge = evaluate(0, m.cc > 0 ? std::max(0.0, m.cg / m.cc) : 0);
    return edge.sse < flat.sse ? edge : flat;
}

/// Several structures: non-negative least squares by trying every set of non-zero coefficients.
Solution Problem::solveSubsets() const {
    const int m = static_cast<int>(options_.structures.size());
    const int unknowns = m + (options_.nugget ? 1 : 0);
    const std::size_t k = classes_.size();
    const auto column = [&](int u, std::size_t b) {
        return u < m ? columns_[static_cast<std::size_t>(u) * rows() + b] : 1.0;
    };
    Eigen::Matrix<double, 4, 4> gram = Eigen::Matrix<double, 4, 4>::Zero();
    Eigen::Vector4d right = Eigen::Vector4d::Zero();
    for (std::size_t b = 0; b < k; ++b)
        for (int i = 0; i < unknowns; ++i) {
            right[i] += w_[b] * column(i, b) * g_[b];
            for (int j = 0; j < unknowns; ++j) gram(i, j) += w_[b] * column(i, b) * column(j, b);
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

}  // namespace vlx::separable
