#include "variolux/compare/metrics.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "compare/constants.h"
#include "compare/ssim.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

void requireSameWindow(const Image& reference, const Image& image, const std::string& path) {
    if (image.data != reference.data)
        throw Error(path, "expected the reference's data window, " + windowText(reference.data) + ", found " +
                              windowText(image.data));
}

bool isFinite(const float* pixel) {
    return std::isfinite(pixel[0]) && std::isfinite(pixel[1]) && std::isfinite(pixel[2]);
}

/// Wrong by a factor of two: Metric::Gross.
bool isGross(const float* image, const float* reference) {
    constexpr double kDark = 0.03;
    const auto mean = [](const float* pixel) {
        return (static_cast<double>(pixel[0]) + pixel[1] + pixel[2]) / 3;
    };
    const double x = mean(image), r = mean(reference);
    return (x < r / 2 && r > kDark) || x > 2 * r + kDark;
}

bool isNegative(const float* pixel) { return pixel[0] < 0 || pixel[1] < 0 || pixel[2] < 0; }

/// Sums over a row of pixels; rows are added up in order, so threads cannot change a result.
struct Sums {
    double squared = 0;
    double relative = 0;
    double absolute = 0;
    double toneMapped = 0;
    double image = 0;
    double reference = 0;
    double referenceMagnitude = 0;
    std::int64_t used = 0;
    std::int64_t gross = 0;
    std::int64_t nonFinite = 0;
    std::int64_t negative = 0;
    std::int64_t referenceNonFinite = 0;
    std::int64_t referenceNegative = 0;

    Sums& operator+=(const Sums& other) {
        squared += other.squared;
        relative += other.relative;
        absolute += other.absolute;
        toneMapped += other.toneMapped;
        image += other.image;
        reference += other.reference;
        referenceMagnitude += other.referenceMagnitude;
        used += other.used;
        gross += other.gross;
        nonFinite += other.nonFinite;
        negative += other.negative;
        referenceNonFinite += other.referenceNonFinite;
        referenceNegative += other.referenceNegative;
        return *this;
    }
};

/// Mean of the values that stay when the ceil(n / 1000) highest go.
double trimmedMean(std::vector<double> values) {
    const std::size_t dropped = (values.size() + 999) / 1000;
    const std::size_t kept = values.size() - dropped;
    if (kept == 0) return kNan;
    std::vector<double> ordered = values;
    const auto last = ordered.begin() + static_cast<std::ptrdiff_t>(kept) - 1;
    std::nth_element(ordered.begin(), last, ordered.end());
    const double highest = *last;
    // Summed in the order of the image; values that tie with the highest kept one are as good as each other.
    double sum = 0;
    std::size_t below = 0;
    for (const double value : values)
        if (value < highest) {
            sum += value;
            ++below;
        }
    return (sum + static_cast<double>(kept - below) * highest) / static_cast<double>(kept);
}

}  // namespace

const std::array<MetricInfo, kMetricCount>& metricInfos() {
    static constexpr std::array<MetricInfo, kMetricCount> infos = {{
        {Metric::Mse, "mse", "MSE", false},
        {Metric::Rmse, "rmse", "RMSE", false},
        {Metric::RelMse, "relmse", "relMSE", false},
        {Metric::RelMseTrimmed, "relmse_trimmed", "relMSE -0.1%", false},
        {Metric::Mape, "mape", "MAPE", false},
        {Metric::RmseToneMapped, "rmse_tm", "RMSE tm", false},
        {Metric::Psnr, "psnr", "PSNR dB", true},
        {Metric::Ssim, "ssim", "SSIM", true},
        {Metric::Bias, "bias", "bias", false},
        {Metric::Gross, "gross", "gross", false},
        {Metric::NonFinite, "nonfinite", "non-finite", false},
        {Metric::Negative, "negative", "negative", false},
    }};
    return infos;
}

std::optional<Metric> findMetric(std::string_view name) {
    for (const MetricInfo& info : metricInfos())
        if (info.name == name) return info.metric;
    return std::nullopt;
}

double toneMapped(double linear) {
    if (!(linear > 0)) return 0;
    return linear >= 1 ? 1 : std::pow(linear, 1 / 2.2);
}

Comparison compareColour(const Image& reference, const Image& image, const std::string& path) {
    requireSameWindow(reference, image, path);
    const int width = image.data.width;
    const auto height = static_cast<std::size_t>(image.data.height);
    std::vector<Sums> rows(height);
    std::vector<std::vector<double>> rowErrors(height);
    parallelFor(0, image.data.height, [&](std::int64_t row) {
        Sums& sums = rows[static_cast<std::size_t>(row)];
        std::vector<double>& errors = rowErrors[static_cast<std::size_t>(row)];
        errors.reserve(static_cast<std::size_t>(width));
        for (int col = 0; col < width; ++col) {
            const float* x = image.at(col, static_cast<int>(row));
            const float* r = reference.at(col, static_cast<int>(row));
            const bool finite = isFinite(x);
            const bool referenceFinite = isFinite(r);
            sums.nonFinite += !finite;
            sums.negative += finite && isNegative(x);
            sums.referenceNonFinite += !referenceFinite;
            sums.referenceNegative += referenceFinite && isNegative(r);
            if (!finite || !referenceFinite) continue;
            double relative = 0;
            for (int c = 0; c < 3; ++c) {
                const double value = x[c];
                const double truth = r[c];
                const double squared = (value - truth) * (value - truth);
                const double displayed = toneMapped(value) - toneMapped(truth);
                relative += squared / (truth * truth + kRelativeFloor);
                sums.squared += squared;
                sums.absolute += std::abs(value - truth) / (std::abs(truth) + kRelativeFloor);
                sums.toneMapped += displayed * displayed;
                sums.image += value;
                sums.reference += truth;
                sums.referenceMagnitude += std::abs(truth);
            }
            sums.relative += relative;
            sums.gross += isGross(x, r);
            errors.push_back(relative / 3);
            ++sums.used;
        }
    });

    Sums sums;
    std::vector<double> errors;
    for (std::size_t row = 0; row < height; ++row) {
        sums += rows[row];
        errors.insert(errors.end(), rowErrors[row].begin(), rowErrors[row].end());
    }

    Comparison result;
    result.pixels = image.data.pixels();
    result.excluded = result.pixels - sums.used;
    result.referenceNonFinite = sums.referenceNonFinite;
    result.referenceNegative = sums.referenceNegative;
    result.values.fill(kNan);
    const auto set = [&](Metric metric, double value) {
        result.values[static_cast<std::size_t>(metric)] = value;
    };
    set(Metric::NonFinite, static_cast<double>(sums.nonFinite));
    set(Metric::Negative, static_cast<double>(sums.negative));
    if (sums.used == 0) return result;

    const double count = 3.0 * static_cast<double>(sums.used);
    const double toneMappedRmse = std::sqrt(sums.toneMapped / count);
    set(Metric::Gross, static_cast<double>(sums.gross) / static_cast<double>(sums.used));
    set(Metric::Mse, sums.squared / count);
    set(Metric::Rmse, std::sqrt(sums.squared / count));
    set(Metric::RelMse, sums.relative / count);
    set(Metric::RelMseTrimmed, trimmedMean(std::move(errors)));
    set(Metric::Mape, sums.absolute / count);
    set(Metric::RmseToneMapped, toneMappedRmse);
    set(Metric::Psnr, -20 * std::log10(toneMappedRmse));
    if (sums.referenceMagnitude > 0)
        set(Metric::Bias, (sums.image - sums.reference) / sums.referenceMagnitude);
    const SsimResult ssim = structuralSimilarity(reference, image);
    set(Metric::Ssim, ssim.value);
    result.ssimWindows = ssim.windows;
    return result;
}

Calibration checkCalibration(const Image& reference, const Image& image, const Image& stddev,
                             const std::optional<Image>& referenceStddev, const std::string& path) {
    requireSameWindow(reference, image, path);
    requireSameWindow(reference, stddev, path);
    if (referenceStddev) requireSameWindow(reference, *referenceStddev, path);
    Calibration result;
    std::int64_t one = 0, two = 0;
    double predicted = 0, actual = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double error = std::abs(static_cast<double>(image.pixels[i]) - reference.pixels[i]);
        const double own = stddev.pixels[i];
        const double theirs = referenceStddev ? referenceStddev->pixels[i] : 0.0;
        if (!std::isfinite(error) || !std::isfinite(own) || !std::isfinite(theirs) || own < 0 || theirs < 0) {
            ++result.excluded;
            continue;
        }
        const double variance = own * own + theirs * theirs;
        one += error * error <= variance;
        two += error * error <= 4 * variance;
        predicted += variance;
        actual += error * error;
        ++result.values;
    }
    const auto count = static_cast<double>(result.values);  // 0 / 0 is the NaN that is promised
    result.withinOne = static_cast<double>(one) / count;
    result.withinTwo = static_cast<double>(two) / count;
    result.predictedRmse = std::sqrt(predicted / count);
    result.actualRmse = std::sqrt(actual / count);
    return result;
}

}  // namespace vlx
