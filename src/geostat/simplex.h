#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace vlx {

/// Nelder and Mead's simplex method (Computer Journal 7, 1965) in a box, by clamping; restarted from the best
/// point until a restart gains nothing, since a simplex can collapse against a bound. `objective` maps a
/// point to a finite value; `steps` are the edges of the first simplex. Returns the best point.
template <class Objective>
std::vector<double> minimizeSimplex(Objective&& objective, std::vector<double> start,
                                    const std::vector<double>& steps, const std::vector<double>& lower,
                                    const std::vector<double>& upper) {
    struct Vertex {
        std::vector<double> x;
        double value;
    };
    const std::size_t d = start.size();
    const auto evaluate = [&](std::vector<double> x) {
        for (std::size_t i = 0; i < d; ++i) x[i] = std::clamp(x[i], lower[i], upper[i]);
        const double value = objective(x);
        return Vertex{std::move(x), value};
    };
    const auto byValue = [](const Vertex& a, const Vertex& b) { return a.value < b.value; };
    double scale = 1;
    double previous = 0;
    for (int restart = 0; restart < 12; ++restart) {
        std::vector<Vertex> simplex{evaluate(start)};
        for (std::size_t i = 0; i < d; ++i) {
            std::vector<double> x = start;
            // Inwards, so that the first simplex is never flat.
            const double step = scale * steps[i] * (restart % 2 == 0 ? 1 : -1);
            x[i] += x[i] + step <= upper[i] && x[i] + step >= lower[i] ? step : -step;
            simplex.push_back(evaluate(x));
        }
        for (int iteration = 0; iteration < 200 * static_cast<int>(d); ++iteration) {
            std::stable_sort(simplex.begin(), simplex.end(), byValue);
            double extent = 0;
            for (std::size_t i = 0; i < d; ++i)
                for (const Vertex& v : simplex)
                    extent = std::max(extent, std::abs(v.x[i] - simplex[0].x[i]) / steps[i]);
            if (extent < 1e-9) break;
            std::vector<double> centre(d, 0.0);
            for (std::size_t v = 0; v < d; ++v)
                for (std::size_t i = 0; i < d; ++i) centre[i] += simplex[v].x[i] / static_cast<double>(d);
            Vertex& worst = simplex[d];
            const auto along = [&](double t) {
                std::vector<double> x(d);
                for (std::size_t i = 0; i < d; ++i) x[i] = centre[i] + t * (worst.x[i] - centre[i]);
                return evaluate(x);
            };
            Vertex reflected = along(-1);
            if (reflected.value < simplex[0].value) {
                Vertex expanded = along(-2);
                worst = expanded.value < reflected.value ? expanded : reflected;
            } else if (reflected.value < simplex[d - 1].value) {
                worst = reflected;
            } else {
                Vertex contracted = along(reflected.value < worst.value ? -0.5 : 0.5);
                if (contracted.value < std::min(worst.value, reflected.value)) {
                    worst = contracted;
                } else {
                    for (std::size_t v = 1; v <= d; ++v) {
                        std::vector<double> x(d);
                        for (std::size_t i = 0; i < d; ++i) x[i] = 0.5 * (simplex[v].x[i] + simplex[0].x[i]);
                        simplex[v] = evaluate(x);
                    }
                }
            }
        }
        std::stable_sort(simplex.begin(), simplex.end(), byValue);
        start = simplex[0].x;
        if (restart > 0 && !(simplex[0].value < previous - 1e-10 * std::abs(previous))) break;
        previous = simplex[0].value;
        scale = 0.25;
    }
    return start;
}

}  // namespace vlx
