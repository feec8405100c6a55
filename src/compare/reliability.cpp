#include "variolux/compare/reliability.h"

#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <limits>

namespace vlx {

namespace {

struct Scored {
    double deviation;  // s
    double error;      // x - r
};

/// q with P(|z| <= q) = level for a standard normal z.
double normalQuantile(double level) { return boost::math::quantile(boost::math::normal(), (1 + level) / 2); }

std::vector<Scored> usableValues(const Image& reference, const Image& image, const Image& stddev,
                                 const std::optional<Image>& referenceStddev) {
    std::vector<Scored> values;
    values.reserve(image.pixels.size());
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double error = static_cast<double>(image.pixels[i]) - reference.pixels[i];
        const double own = stddev.pixels[i];
        const double theirs = referenceStddev ? referenceStddev->pixels[i] : 0.0;
        if (std::isfinite(error) && std::isfinite(own) && std::isfinite(theirs) && own >= 0 && theirs >= 0)
            values.push_back({std::hypot(own, theirs), error});
    }
    return values;
}

std::vector<ReliabilityBin> binned(std::vector<Scored> values) {
    // Errors break ties, so that the groups do not depend on the order of pixels.
    std::sort(values.begin(), values.end(), [](const Scored& a, const Scored& b) {
        return a.deviation != b.deviation ? a.deviation < b.deviation : a.error < b.error;
    });
    std::vector<ReliabilityBin> bins;
    const std::size_t count = values.size();
    for (std::size_t b = 0; b < kReliabilityBins; ++b) {
        const std::size_t begin = count * b / kReliabilityBins, end = count * (b + 1) / kReliabilityBins;
        if (begin == end) continue;
        double predicted = 0, actual = 0;
        for (std::size_t i = begin; i < end; ++i) {
            predicted += values[i].deviation * values[i].deviation;
            actual += values[i].error * values[i].error;
        }
        const auto n = static_cast<double>(end - begin);
        bins.push_back(
            {std::sqrt(predicted / n), std::sqrt(actual / n), static_cast<std::int64_t>(end - begin)});
    }
    return bins;
}

}  // namespace

PredictedError predictedError(const Image& image, const Image& stddev, const std::string& path) {
    // The image as its own reference: windows are checked, and s^2 summed, where that is done already.
    const Calibration self = checkCalibration(image, image, stddev, {}, path);
    PredictedError result{self.predictedRmse, 0, self.values, self.excluded};
    double sum = 0;
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double x = image.pixels[i], s = stddev.pixels[i];
        if (std::isfinite(x) && std::isfinite(s) && s >= 0) sum += s * s / (x * x + 0.01);
    }
    result.relMse = sum / static_cast<double>(result.values);  // 0 / 0 is NaN
    return result;
}

Reliability reliabilityOf(const Image& reference, const Image& image, const Image& stddev,
                          const std::optional<Image>& referenceStddev, const std::string& path) {
    Reliability result;
    result.calibration = checkCalibration(reference, image, stddev, referenceStddev, path);
    std::vector<Scored> values = usableValues(reference, image, stddev, referenceStddev);
    std::array<double, 19> limits{};
    for (std::size_t i = 0; i < limits.size(); ++i)
        limits[i] = normalQuantile(0.05 * (static_cast<double>(i) + 1));
    double scored = 0;
    for (const Scored& v : values) {
        for (std::size_t i = 0; i < limits.size(); ++i)
            result.coverage[i] += std::abs(v.error) <= limits[i] * v.deviation;
        if (v.deviation == 0) {
            ++result.certain;
            continue;
        }
        const double z = v.error / v.deviation;
        ++scored;
        result.meanScore += z;
        result.meanSquareScore += z * z;
        if (z < -kScoreEnd)
            ++result.below;
        else if (z >= kScoreEnd)
            ++result.above;
        else
            ++result.scores[static_cast<std::size_t>((z + kScoreEnd) / (2 * kScoreEnd) * kScoreBins)];
    }
    const auto count = static_cast<double>(values.size());
    for (double* share : {&result.below, &result.above, &result.certain}) *share /= count;
    for (double& share : result.scores) share /= count;
    for (double& share : result.coverage) share /= count;
    result.meanScore /= scored;
    result.meanSquareScore /= scored;
    result.bins = binned(std::move(values));
    return result;
}

}  // namespace vlx
