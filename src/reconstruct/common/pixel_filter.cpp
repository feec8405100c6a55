#include "variolux/reconstruct/pixel_filter.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "variolux/base/parallel.h"

namespace vlx {

namespace {

constexpr int kReach = 2;  // pixels
constexpr double kRadius = 1.5;

double valueAt(PixelFilter filter, double t) {
    if (filter == PixelFilter::Box) return std::abs(t) < 0.5 ? 1 : 0;
    if (std::abs(t) >= kRadius) return 0;
    if (filter == PixelFilter::Gaussian) return std::exp(-2 * t * t) - std::exp(-2 * kRadius * kRadius);
    const double u = std::numbers::pi * t / kRadius;
    return 0.35875 + 0.48829 * std::cos(u) + 0.14128 * std::cos(2 * u) + 0.01168 * std::cos(3 * u);
}

}  // namespace

std::vector<double> filterWeights(PixelFilter filter) {
    constexpr int kSteps = 1000;  // midpoints a pixel: right to 1e-6
    std::vector<double> weights(2 * kReach + 1);
    double sum = 0;
    for (int k = -kReach; k <= kReach; ++k)
        for (int i = 0; i < kSteps; ++i) {
            const double value = valueAt(filter, k - 0.5 + (i + 0.5) / kSteps);
            weights[static_cast<std::size_t>(k + kReach)] += value;
            sum += value;
        }
    for (double& weight : weights) weight /= sum;
    return weights;
}

Image applyPixelFilter(const Image& image, PixelFilter filter) {
    if (filter == PixelFilter::Box) return image;
    const std::vector<double> weights = filterWeights(filter);
    const auto weight = [&](int k) { return weights[static_cast<std::size_t>(k + kReach)]; };
    Image result = image;
    const int width = image.data.width, height = image.data.height, channels = image.channelCount();
    parallelFor(0, height, [&](std::int64_t line) {
        const int row = static_cast<int>(line);
        std::vector<double> sums(static_cast<std::size_t>(channels));
        for (int col = 0; col < width; ++col) {
            std::fill(sums.begin(), sums.end(), 0.0);
            double total = 0;
            for (int y = std::max(0, row - kReach); y <= std::min(height - 1, row + kReach); ++y)
                for (int x = std::max(0, col - kReach); x <= std::min(width - 1, col + kReach); ++x) {
                    const double w = weight(y - row) * weight(x - col);
                    const float* pixel = image.at(x, y);
                    for (int c = 0; c < channels; ++c)
                        sums[static_cast<std::size_t>(c)] += w * static_cast<double>(pixel[c]);
                    total += w;
                }
            float* out = result.at(col, row);
            for (int c = 0; c < channels; ++c)
                out[c] = static_cast<float>(sums[static_cast<std::size_t>(c)] / total);
        }
    });
    return result;
}

}  // namespace vlx
