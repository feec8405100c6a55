#pragma once

#include <array>
#include <optional>
#include <vector>

#include "variolux/base/image.h"
#include "variolux/compare/metrics.h"

/// Whether the error that an image predicts for itself (its layer stddev) is the error it has.
namespace vlx {

/// What a stddev layer says of the whole image, in the units of two metrics.
struct PredictedError {
    double rmse = 0;            ///< sqrt(mean s^2)
    double relMse = 0;          ///< mean s^2 / (x^2 + 0.01): x in place of the unknown reference
    std::int64_t values = 0;    ///< pixels times channels that count; NaN above when there are none
    std::int64_t excluded = 0;  ///< x or s not finite, or s negative
};

/// Throws Error when the data windows differ. Both as readColour returns them.
PredictedError predictedError(const Image& image, const Image& stddev, const std::string& path = {});

/// One group of values with similar predicted errors.
struct ReliabilityBin {
    double predicted = 0;  ///< root mean square of s
    double actual = 0;     ///< root mean square of x - r
    std::int64_t values = 0;
};

inline constexpr int kReliabilityBins = 16;
inline constexpr int kScoreBins = 48;   ///< of the histogram of z, of width 1/4
inline constexpr double kScoreEnd = 6;  ///< it goes from -6 to 6

/// The error predicted against the error made, in detail.
struct Reliability {
    Calibration calibration;
    /// Groups of equally many values in the order of s. Well calibrated: predicted = actual in each.
    std::vector<ReliabilityBin> bins;
    /// The shares of z = (x - r) / s in each class, of those beyond the ends, and of values with s = 0, which
    /// have no z. Well calibrated and normal: a standard normal bell.
    std::array<double, kScoreBins> scores{};
    double below = 0, above = 0, certain = 0;
    double meanScore = 0;        ///< mean z, likewise: 0 without bias
    double meanSquareScore = 0;  ///< mean z^2: 1 when s is right, more when it is too small; s > 0 only
    /// The share of |z| <= Phi^-1 of the levels 0.05, 0.10, ..., 0.95: `coverage[i]` should be 0.05 (i + 1).
    std::array<double, 19> coverage{};
};

/// The variances of `referenceStddev`, when given, are added to s^2. Throws as checkCalibration.
Reliability reliabilityOf(const Image& reference, const Image& image, const Image& stddev,
                          const std::optional<Image>& referenceStddev = {}, const std::string& path = {});

}  // namespace vlx
