#include "variolux/reconstruct/gaussian.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

/// Weights at distances 0 .. radius; distances beyond the image are never looked up.
std::vector<double> gaussianWeights(double sigma, int extent) {
    const double radius = std::min(std::ceil(4.0 * sigma), static_cast<double>(std::max(extent - 1, 0)));
    std::vector<double> weights(static_cast<std::size_t>(radius) + 1);
    for (std::size_t d = 0; d < weights.size(); ++d) {
        const double x = static_cast<double>(d) / sigma;
        weights[d] = std::exp(-0.5 * x * x);
    }
    return weights;
}

void addScaled(double* target, const double* source, double weight, std::int64_t count) {
    for (std::int64_t i = 0; i < count; ++i) target[i] += weight * source[i];
}

}  // namespace

std::optional<std::string> Gaussian::validate() const {
    if (sigma > 0 && std::isfinite(sigma)) return std::nullopt;
    return "expected a sigma above 0 pixels, found " + formatted("%g", sigma);
}

GaussianResult gaussianFilter(const Image& image, double sigma) {
    if (const auto broken = Gaussian{sigma}.validate()) throw Error("", *broken);

    GaussianResult result;
    result.image = image;
    const int channels = image.channelCount();
    const int width = image.data.width;
    const int height = image.data.height;
    const std::int64_t rowValues = std::int64_t{width} * channels;

    // Normalised convolution: values and their weights (1 finite, 0 not) go through the same two passes, and
    // their quotient renormalises borders and holes alike. A pixel (row) pass, then a column pass.
    std::vector<double> sums(image.pixels.size());
    std::vector<double> norms(image.pixels.size());
    std::vector<std::int64_t> rowExcluded(static_cast<std::size_t>(height));
    std::vector<std::int64_t> rowEmpty(static_cast<std::size_t>(height));

    const std::vector<double> across = gaussianWeights(sigma, width);
    parallelFor(0, height, [&](std::int64_t row) {
        const float* source = image.pixels.data() + row * rowValues;
        std::vector<double> values(static_cast<std::size_t>(rowValues));
        std::vector<double> finite(static_cast<std::size_t>(rowValues));
        for (std::size_t i = 0; i < values.size(); ++i) {
            finite[i] = std::isfinite(source[i]) ? 1.0 : 0.0;
            values[i] = finite[i] > 0 ? source[i] : 0.0;
            if (finite[i] == 0) ++rowExcluded[static_cast<std::size_t>(row)];
        }
        const int radius = static_cast<int>(across.size()) - 1;
        for (int d = -radius; d <= radius; ++d) {
            const std::int64_t shift = std::int64_t{d} * channels;
            const std::int64_t to = std::max<std::int64_t>(0, -shift);
            const std::int64_t from = std::max<std::int64_t>(0, shift);
            const double weight = across[static_cast<std::size_t>(std::abs(d))];
            addScaled(sums.data() + row * rowValues + to, values.data() + from, weight,
                      rowValues - from - to);
            addScaled(norms.data() + row * rowValues + to, finite.data() + from, weight,
                      rowValues - from - to);
        }
    });

    const std::vector<double> down = gaussianWeights(sigma, height);
    parallelFor(0, height, [&](std::int64_t row) {
        std::vector<double> sum(static_cast<std::size_t>(rowValues));
        std::vector<double> norm(static_cast<std::size_t>(rowValues));
        const std::int64_t radius = static_cast<std::int64_t>(down.size()) - 1;
        const std::int64_t last = std::min<std::int64_t>(height - 1, row + radius);
        for (std::int64_t other = std::max<std::int64_t>(0, row - radius); other <= last; ++other) {
            const double weight = down[static_cast<std::size_t>(std::abs(other - row))];
            addScaled(sum.data(), sums.data() + other * rowValues, weight, rowValues);
            addScaled(norm.data(), norms.data() + other * rowValues, weight, rowValues);
        }
        float* target = result.image.pixels.data() + row * rowValues;
        for (std::size_t i = 0; i < sum.size(); ++i) {
            target[i] = norm[i] > 0 ? static_cast<float>(sum[i] / norm[i]) : 0.0f;
            if (!(norm[i] > 0)) ++rowEmpty[static_cast<std::size_t>(row)];
        }
    });

    for (const std::int64_t count : rowExcluded) result.excluded += count;
    for (const std::int64_t count : rowEmpty) result.empty += count;
    return result;
}

}  // namespace vlx
