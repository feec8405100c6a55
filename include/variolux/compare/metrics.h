#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "variolux/base/image.h"

namespace vlx {

/// What one number says about an image x beside its reference r. Sums run over the three channels c and the
/// n pixels p in which both images are finite in all three; "mean" divides by 3 n (or n, where said).
enum class Metric {
    Mse,             ///< mean (x - r)^2
    Rmse,            ///< sqrt(Mse)
    RelMse,          ///< mean (x - r)^2 / (r^2 + 0.01): weighs an error by how bright the place is
    RelMseTrimmed,   ///< as RelMse, without the worst 0.1 % of pixels: see compareColour
    Mape,            ///< mean |x - r| / (|r| + 0.01): mean absolute percentage error, as a fraction
    RmseToneMapped,  ///< sqrt(mean (t(x) - t(r))^2), t = toneMapped
    Psnr,            ///< -20 log10(RmseToneMapped), decibels; infinite for equal images. Higher is better
    Ssim,            ///< structural similarity of t(x) and t(r): see compareColour. Higher is better
    Bias,            ///< (mean x - mean r) / mean |r|: energy gained or lost; its magnitude counts
    Gross,           ///< fraction of pixels wrong by a factor of two: with x and r means over the channels,
                     ///< x < r / 2 where r > 0.03, or x > 2 r + 0.03. Black dots, fireflies
    NonFinite,       ///< pixels of x with a NaN or infinite channel
    Negative,        ///< finite pixels of x with a channel below zero
};
inline constexpr std::size_t kMetricCount = 12;

/// How a metric is named and read.
struct MetricInfo {
    Metric metric;
    std::string_view name;   ///< on the command line and in JSON, for example "relmse_trimmed"
    std::string_view title;  ///< in tables, for example "relMSE -0.1 %"
    bool higherIsBetter;
};

/// All metrics, in the order of the enum.
const std::array<MetricInfo, kMetricCount>& metricInfos();

/// The metric of this name, if there is one.
std::optional<Metric> findMetric(std::string_view name);

/// The display encoding that tone-mapped metrics use: max(x, 0)^(1 / 2.2), at most 1. No exposure: figures of
/// different runs stay comparable.
double toneMapped(double linear);

/// The metrics of one image, and what they rest on.
struct Comparison {
    std::array<double, kMetricCount> values{};  ///< NaN where undefined (nothing to compare, too small)
    std::int64_t pixels = 0;                    ///< of the data window
    std::int64_t excluded = 0;            ///< pixels non-finite in either image: in no metric but NonFinite
    std::int64_t referenceNonFinite = 0;  ///< pixels of the reference with a NaN or infinite channel
    std::int64_t referenceNegative = 0;   ///< finite pixels of the reference with a channel below zero
    std::int64_t ssimWindows = 0;         ///< windows that Ssim averages over

    double operator[](Metric metric) const { return values[static_cast<std::size_t>(metric)]; }
};

/// Every metric of `image` against `reference`, both R, G, B as readColour() returns them.
///
/// RelMseTrimmed: a pixel's value is the mean over its channels of (x - r)^2 / (r^2 + 0.01); the
/// ceil(n / 1000) highest are left out, and the mean is over those that stay. Told beside RelMse, it says how
/// much of the error sits in a few outliers (fireflies).
///
/// Ssim: Wang, Bovik, Sheikh, Simoncelli, "Image quality assessment: from error visibility to structural
/// similarity", IEEE TIP 13(4), 2004: Gaussian window 11 x 11, sigma 1.5, K1 = 0.01, K2 = 0.03, dynamic range
/// 1; on each tone-mapped channel, then the mean over channels and over all windows that lie inside the data
/// window and contain no excluded pixel. No downsampling. NaN below 11 x 11 pixels.
///
/// Throws Error, naming `path` and both windows, when the data windows differ. Bit-identical for any number
/// of threads.
Comparison compareColour(const Image& reference, const Image& image, const std::string& path = {});

/// How well a standard deviation predicts the error that was made.
struct Calibration {
    double withinOne = 0;  ///< fraction of values with |x - r| <= s; 0.683 if errors are normal and s right
    double withinTwo = 0;  ///< fraction with |x - r| <= 2 s; 0.954 likewise
    double predictedRmse = 0;   ///< sqrt(mean s^2)
    double actualRmse = 0;      ///< sqrt(mean (x - r)^2), over the same values
    std::int64_t values = 0;    ///< pixels times channels that count; the fractions are NaN when none do
    std::int64_t excluded = 0;  ///< values left out: x, r or s not finite, or s negative
};

/// Coverage of the error bars x +- s, s = `stddev` (ColourImage::stddev). When the reference is itself
/// uncertain by `referenceStddev`, s^2 is the sum of both variances. Throws Error when data windows differ.
Calibration checkCalibration(const Image& reference, const Image& image, const Image& stddev,
                             const std::optional<Image>& referenceStddev = {}, const std::string& path = {});

}  // namespace vlx
