#pragma once

#include <optional>
#include <span>
#include <vector>

/// What a few repeated measurements say: means, slopes and ratios with 95 % intervals.
namespace vlx {

/// A value and its 95 % interval. The bounds are NaN where one measurement alone was made: its uncertainty is
/// unknown, not zero.
struct Interval {
    double value = 0;
    double lower = 0;
    double upper = 0;
    int count = 0;  ///< measurements
};

/// The quantile of Student's t that a two-sided 95 % interval needs: P(|T| <= t) = 0.95 with `degrees` >= 1
/// degrees of freedom.
double studentQuantile95(int degrees);

/// The mean and its interval, value +- t s / sqrt(n). Values that are not finite make the value NaN.
Interval meanInterval(std::span<const double> values);

/// The same of the logarithms, taken back: the geometric mean, and an interval that is symmetric as a ratio;
/// for what varies by factors (errors, times). If a value is not positive, meanInterval().
Interval geometricInterval(std::span<const double> values);

/// The ratio of two sums over blocks, such as tiles of a picture: the mean of values of which block i has
/// `counts[i]`, with sum `sums[i]`. The interval is of its logarithm, as geometricInterval()'s, from the
/// scatter of the blocks about the ratio (the delta method), with Student's t: it holds for independent
/// blocks, whatever goes on inside them. Blocks without values do not count. A ratio that is not positive has
/// no interval.
Interval ratioInterval(std::span<const double> sums, std::span<const double> counts);

/// A straight line y = intercept + slope x by least squares.
struct LineFit {
    Interval slope;        ///< interval from the scatter about the line: t of n - 2 degrees of freedom
    double intercept = 0;  ///< value at x = 0
};

/// The line through n points, or nothing when fewer than two of the x differ. Two points have a slope without
/// interval. The interval holds for independent points scattered normally and evenly about a true line.
std::optional<LineFit> fitLine(std::span<const double> x, std::span<const double> y);

/// A point of an error-against-cost curve: the logarithms, and the variance of the mean log error over
/// repeated runs (0 when it is not known).
struct CurvePoint {
    double logCost = 0;
    double logError = 0;
    double variance = 0;
};

/// A value read off a curve, as a logarithm with its variance.
struct CurveValue {
    double log = 0;
    double variance = 0;
    bool extrapolated = false;
};

/// The cost at which a curve reaches an error: the first crossing of the broken line through the points in
/// the order of their cost; beyond its ends the least-squares line of all points, marked as extrapolated.
/// Variances of the curve's errors and of `logError` itself become the cost's by the slope at the place (the
/// delta method). Nothing when the curve is needed beyond its ends and does not fall, or has fewer than two
/// costs.
std::optional<CurveValue> costAtError(std::span<const CurvePoint> curve, double logError,
                                      double errorVariance = 0);

/// The error at a cost, by the same line, never extrapolated: nothing beyond the ends (a part in a thousand
/// is forgiven).
std::optional<CurveValue> errorAtCost(std::span<const CurvePoint> curve, double logCost);

/// Indices of the points that no other point beats or equals in both cost and error, by increasing cost (of
/// equal points the first). Points that are not finite never count.
std::vector<std::size_t> paretoFront(std::span<const double> cost, std::span<const double> error);

}  // namespace vlx
