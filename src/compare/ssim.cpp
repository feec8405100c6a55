#include "compare/ssim.h"

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "variolux/base/parallel.h"
#include "variolux/compare/metrics.h"

namespace vlx {

namespace {

constexpr int kSize = 11;
constexpr double kSigma = 1.5;
constexpr double kC1 = 0.01 * 0.01;
constexpr double kC2 = 0.03 * 0.03;

std::array<double, kSize> windowWeights() {
    std::array<double, kSize> weights{};
    double sum = 0;
    for (int i = 0; i < kSize; ++i) {
        const double d = (i - kSize / 2) / kSigma;
        sum += weights[static_cast<std::size_t>(i)] = std::exp(-0.5 * d * d);
    }
    for (double& weight : weights) weight /= sum;
    return weights;
}

/// Weighted first and second moments of a pair of values.
struct Moments {
    double x = 0, r = 0, xx = 0, rr = 0, xr = 0;

    void add(double weight, double value, double reference) {
        x += weight * value;
        r += weight * reference;
        xx += weight * value * value;
        rr += weight * reference * reference;
        xr += weight * value * reference;
    }
    void add(double weight, const Moments& other) {
        x += weight * other.x;
        r += weight * other.r;
        xx += weight * other.xx;
        rr += weight * other.rr;
        xr += weight * other.xr;
    }
    double similarity() const {
        const double varianceX = xx - x * x;
        const double varianceR = rr - r * r;
        const double covariance = xr - x * r;
        return (2 * x * r + kC1) * (2 * covariance + kC2) /
               ((x * x + r * r + kC1) * (varianceX + varianceR + kC2));
    }
};

/// Tone-mapped values, three a pixel; whether all are finite is kept beside them.
struct Encoded {
    std::vector<double> values;
    std::vector<char> finite;
};

Encoded encode(const Image& image) {
    Encoded encoded{std::vector<double>(image.pixels.size()), std::vector<char>(image.pixels.size() / 3)};
    const std::size_t width = static_cast<std::size_t>(image.data.width);
    parallelFor(0, image.data.height, [&](std::int64_t row) {
        for (std::size_t p = static_cast<std::size_t>(row) * width, end = p + width; p < end; ++p) {
            encoded.finite[p] = 1;
            for (std::size_t i = 3 * p; i < 3 * p + 3; ++i) {
                encoded.values[i] = toneMapped(image.pixels[i]);
                if (!std::isfinite(image.pixels[i])) encoded.finite[p] = 0;
            }
        }
    });
    return encoded;
}

}  // namespace

SsimResult structuralSimilarity(const Image& reference, const Image& image) {
    const int rows = image.data.height - kSize + 1;
    const int columns = image.data.width - kSize + 1;
    if (rows <= 0 || columns <= 0) return {std::numeric_limits<double>::quiet_NaN(), 0};
    const std::array<double, kSize> weights = windowWeights();
    const Encoded x = encode(image);
    const Encoded r = encode(reference);
    const auto width = static_cast<std::size_t>(image.data.width);

    std::vector<double> rowSums(static_cast<std::size_t>(rows));
    std::vector<std::int64_t> rowWindows(static_cast<std::size_t>(rows));
    parallelFor(0, rows, [&](std::int64_t row) {
        // The window is separable: moments down the columns first, then across.
        std::vector<Moments> down(width * 3);
        std::vector<char> usable(width, 1);
        for (std::size_t k = 0; k < kSize; ++k) {
            const std::size_t start = (static_cast<std::size_t>(row) + k) * width;
            for (std::size_t i = 0; i < width * 3; ++i)
                down[i].add(weights[k], x.values[start * 3 + i], r.values[start * 3 + i]);
            for (std::size_t i = 0; i < width; ++i)
                usable[i] = usable[i] && x.finite[start + i] && r.finite[start + i];
        }
        double sum = 0;
        std::int64_t windows = 0;
        std::size_t unusableUntil = 0;  // windows that start before this column hold an excluded pixel
        for (std::size_t i = 0; i < width; ++i) {
            if (!usable[i]) unusableUntil = i + 1;
            if (i + 1 < kSize) continue;
            const std::size_t start = i + 1 - kSize;
            if (start < unusableUntil) continue;
            for (std::size_t c = 0; c < 3; ++c) {
                Moments moments;
                for (std::size_t k = 0; k < kSize; ++k) moments.add(weights[k], down[(start + k) * 3 + c]);
                sum += moments.similarity();
            }
            ++windows;
        }
        rowSums[static_cast<std::size_t>(row)] = sum;
        rowWindows[static_cast<std::size_t>(row)] = windows;
    });

    double sum = 0;
    std::int64_t windows = 0;
    for (std::size_t row = 0; row < rowSums.size(); ++row) {
        sum += rowSums[row];
        windows += rowWindows[row];
    }
    return {sum / (3.0 * static_cast<double>(windows)), windows};  // 0 / 0 is the NaN that is promised
}

}  // namespace vlx
