#include "variolux/compare/statistics.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cassert>
#include <cmath>
#include <numeric>

#include "compare/constants.h"

namespace vlx {

namespace {

double mean(std::span<const double> values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

std::vector<CurvePoint> byCost(std::span<const CurvePoint> curve) {
    std::vector<CurvePoint> sorted(curve.begin(), curve.end());
    std::stable_sort(sorted.begin(), sorted.end(),
                     [](const CurvePoint& a, const CurvePoint& b) { return a.logCost < b.logCost; });
    return sorted;
}

/// Variance of the point at share t of the way between two independent ones.
double varianceBetween(const CurvePoint& a, const CurvePoint& b, double t) {
    return (1 - t) * (1 - t) * a.variance + t * t * b.variance;
}

}  // namespace

double studentQuantile95(int degrees) {
    assert(degrees >= 1);
    return boost::math::quantile(boost::math::students_t(degrees), 0.975);
}

Interval meanInterval(std::span<const double> values) {
    Interval result{kNan, kNan, kNan, static_cast<int>(values.size())};
    if (values.empty()) return result;
    result.value = mean(values);
    if (values.size() < 2) return result;
    double squares = 0;
    for (const double v : values) squares += (v - result.value) * (v - result.value);
    const double n = static_cast<double>(values.size());
    const double half = studentQuantile95(result.count - 1) * std::sqrt(squares / (n - 1) / n);
    result.lower = result.value - half;
    result.upper = result.value + half;
    return result;
}

Interval geometricInterval(std::span<const double> values) {
    if (std::any_of(values.begin(), values.end(), [](double v) { return !(v > 0); }))
        return meanInterval(values);
    std::vector<double> logs;
    for (const double v : values) logs.push_back(std::log(v));
    const Interval interval = meanInterval(logs);
    return {std::exp(interval.value), std::exp(interval.lower), std::exp(interval.upper), interval.count};
}

Interval ratioInterval(std::span<const double> sums, std::span<const double> counts) {
    assert(sums.size() == counts.size());
    double sum = 0, count = 0;
    Interval result{kNan, kNan, kNan, 0};
    for (std::size_t i = 0; i < sums.size(); ++i) {
        sum += sums[i];
        count += counts[i];
        result.count += counts[i] > 0;
    }
    if (result.count == 0) return result;
    result.value = sum / count;
    if (result.count < 2 || !(result.value > 0)) return result;
    double squares = 0;
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double excess = sums[i] - result.value * counts[i];
        squares += excess * excess;
    }
    const double n = result.count;
    const double deviation = std::sqrt(squares * n / (n - 1)) / sum;  // of the logarithm
    const double factor = std::exp(studentQuantile95(result.count - 1) * deviation);
    result.lower = result.value / factor;
    result.upper = result.value * factor;
    return result;
}

std::optional<LineFit> fitLine(std::span<const double> x, std::span<const double> y) {
    assert(x.size() == y.size());
    if (x.size() < 2) return std::nullopt;
    const double mx = mean(x), my = mean(y);
    double xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        xx += (x[i] - mx) * (x[i] - mx);
        xy += (x[i] - mx) * (y[i] - my);
    }
    if (!(xx > 0) || !std::isfinite(xy)) return std::nullopt;
    LineFit fit;
    const double slope = xy / xx;
    fit.intercept = my - slope * mx;
    fit.slope = {slope, kNan, kNan, static_cast<int>(x.size())};
    if (x.size() < 3) return fit;
    double residuals = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
        const double r = y[i] - fit.intercept - slope * x[i];
        residuals += r * r;
    }
    const int degrees = fit.slope.count - 2;
    const double half = studentQuantile95(degrees) * std::sqrt(residuals / degrees / xx);
    fit.slope.lower = slope - half;
    fit.slope.upper = slope + half;
    return fit;
}

std::optional<CurveValue> costAtError(std::span<const CurvePoint> curve, double logError,
                                      double errorVariance) {
    const std::vector<CurvePoint> points = byCost(curve);
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const CurvePoint &a = points[i], &b = points[i + 1];
        const double rise = b.logError - a.logError, run = b.logCost - a.logCost;
        if ((a.logError - logError) * (b.logError - logError) > 0 || rise == 0 || run == 0) continue;
        const double t = (logError - a.logError) / rise;
        const double slope = rise / run;
        return CurveValue{a.logCost + t * run, (varianceBetween(a, b, t) + errorVariance) / (slope * slope),
                          false};
    }
    std::vector<double> x, y;
    double variance = 0;
    for (const CurvePoint& p : points) {
        x.push_back(p.logCost);
        y.push_back(p.logError);
        variance += p.variance / static_cast<double>(points.size());
    }
    const auto line = fitLine(x, y);
    if (!line || !(line->slope.value < 0)) return std::nullopt;
    const double slope = line->slope.value;
    return CurveValue{(logError - line->intercept) / slope, (variance + errorVariance) / (slope * slope),
                      true};
}

std::optional<CurveValue> errorAtCost(std::span<const CurvePoint> curve, double logCost) {
    const std::vector<CurvePoint> points = byCost(curve);
    if (points.empty()) return std::nullopt;
    const double forgiven = 1e-3;
    if (logCost < points.front().logCost - forgiven || logCost > points.back().logCost + forgiven)
        return std::nullopt;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
        const CurvePoint &a = points[i], &b = points[i + 1];
        if (logCost > b.logCost && i + 2 < points.size()) continue;
        const double run = b.logCost - a.logCost;
        const double t = run > 0 ? std::clamp((logCost - a.logCost) / run, 0.0, 1.0) : 0.5;
        return CurveValue{a.logError + t * (b.logError - a.logError), varianceBetween(a, b, t), false};
    }
    return CurveValue{points.front().logError, points.front().variance, false};
}

std::vector<std::size_t> paretoFront(std::span<const double> cost, std::span<const double> error) {
    assert(cost.size() == error.size());
    std::vector<std::size_t> order;
    for (std::size_t i = 0; i < cost.size(); ++i)
        if (std::isfinite(cost[i]) && std::isfinite(error[i])) order.push_back(i);
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return cost[a] != cost[b] ? cost[a] < cost[b] : error[a] < error[b];
    });
    std::vector<std::size_t> front;
    for (const std::size_t i : order)
        if (front.empty() || error[i] < error[front.back()]) front.push_back(i);
    return front;
}

}  // namespace vlx
