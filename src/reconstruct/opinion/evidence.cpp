#include "reconstruct/opinion/evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/common/window_sum.h"
#include "variolux/base/parallel.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {

namespace {

constexpr int kPooledReach = 5;  // few pixels of few samples may all be dark by chance, and look sure
constexpr int kNearReach = 1;    // but beside an edge, or in the brighter of two textures, noise is their own
constexpr double kNoNoise = 1e-4;  // of the picture's mean level, squared: samples that agree are not certain
constexpr int kShapeReaches[] = {2, 7, 15};
constexpr int kBiasReach = 60;
constexpr float kSignificance = 3;  // standard errors: every window of a picture is looked at
// Least variance of a squared Gaussian deviate, mean of three colours of which all are one: 2; independent:
// 2/3. Few pixels may show less by chance.
constexpr float kLeastScatter = 2.f / 3;

/// Sums of planes down the rows of a window around row y, and along it. `squared`: of g^2.
class RowSums {
  public:
    RowSums(int width, int height, int y, int reach)
        : width_(width), height_(height), y_(y), reach_(reach), column_(static_cast<std::size_t>(width)) {}
    std::vector<float> of(const std::vector<float>& plane, bool squared) {
        std::fill(column_.begin(), column_.end(), 0.f);
        for (int row = std::max(0, y_ - reach_); row <= std::min(height_ - 1, y_ + reach_); ++row) {
            const float g = windowWeight(row - y_, reach_);
            addScaled(plane.data() + static_cast<std::size_t>(row) * static_cast<std::size_t>(width_),
                      squared ? g * g : g, width_, column_.data());
        }
        std::vector<float> sums(column_.size());
        sumAround(column_, reach_, squared, sums.data());
        return sums;
    }

  private:
    int width_, height_, y_, reach_;
    std::vector<float> column_;
};

}  // namespace

SampleMeans sampleMeans(const SampleSource& source) {
    const Image image = reconstruct(source, Mean{.empty = std::numeric_limits<float>::quiet_NaN()}).image;
    SampleMeans result;
    result.width = image.data.width;
    result.height = image.data.height;
    const std::size_t pixels = static_cast<std::size_t>(image.data.pixels());
    const auto channels = static_cast<std::size_t>(image.channelCount());
    const auto stddev = static_cast<std::size_t>(image.channel("stddev.R"));
    double level = 0, known = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        result.mean[c].resize(pixels);
        result.variance[c].resize(pixels);
        for (std::size_t p = 0; p < pixels; ++p) {
            result.mean[c][p] = image.pixels[p * channels + c];
            if (!result.known(p)) continue;
            level += std::abs(static_cast<double>(result.mean[c][p]));
            ++known;
        }
    }
    level = known > 0 ? level / known : 0;
    const auto least = static_cast<float>(std::max(kNoNoise * level * level, 1e-30));
    parallelFor(0, result.height, [&](std::int64_t line) {
        const auto y = static_cast<int>(line);
        for (int x = 0; x < result.width; ++x)
            for (const int reach : {kPooledReach, kNearReach}) {
                double sum[3] = {}, count = 0;
                for (int row = std::max(0, y - reach); row <= std::min(result.height - 1, y + reach); ++row)
                    for (int col = std::max(0, x - reach); col <= std::min(result.width - 1, x + reach);
                         ++col) {
                        const std::size_t p = result.at(col, row);
                        if (!result.known(p)) continue;
                        ++count;
                        for (std::size_t c = 0; c < 3; ++c) {
                            const auto s = static_cast<double>(image.pixels[p * channels + stddev + c]);
                            sum[c] += s * s;
                        }
                    }
                for (std::size_t c = 0; c < 3; ++c) {
                    float& variance = result.variance[c][result.at(x, y)];
                    variance = std::max(variance, least + static_cast<float>(count > 0 ? sum[c] / count : 0));
                }
            }
    });
    return result;
}

std::vector<float> certainError(const SampleMeans& samples, const Image& image) {
    const int width = samples.width, height = samples.height;
    const std::size_t pixels = samples.mean[0].size();
    const auto channels = static_cast<std::size_t>(image.channelCount());
    std::vector<float> known(pixels), excess(pixels), excess2(pixels), variance(pixels), apart[3];
    for (auto& a : apart) a.resize(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t c = 0; c < 3; ++c) variance[p] += samples.variance[c][p] / 3;
        if (!samples.known(p)) continue;
        known[p] = 1;
        float square = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            apart[c][p] = samples.mean[c][p] - image.pixels[p * channels + c];
            square += apart[c][p] * apart[c][p] / 3;
        }
        excess[p] = square / variance[p] - 1;
        excess2[p] = excess[p] * excess[p];
    }
    std::vector<float> result(pixels);
    parallelFor(0, height, [&](std::int64_t line) {
        const auto y = static_cast<int>(line);
        float* const out = result.data() + samples.at(0, y);
        const auto w = static_cast<std::size_t>(width);
        for (const int reach : kShapeReaches) {
            RowSums sums(width, height, y, reach);
            const std::vector<float> count = sums.of(known, false), count2 = sums.of(known, true),
                                     sum = sums.of(excess, false), sum2 = sums.of(excess2, true);
            for (std::size_t x = 0; x < w; ++x) {
                if (!(count[x] > 0)) continue;
                const float t = sum[x] / count[x];
                const float scatter = std::max(sum2[x] - t * t * count2[x], kLeastScatter * count2[x]);
                const float sure = t - kSignificance * std::sqrt(scatter) / count[x];
                out[x] = std::max(out[x], sure * variance[samples.at(0, y) + x]);
            }
        }
        RowSums sums(width, height, y, kBiasReach);
        const std::vector<float> count = sums.of(known, false);
        std::vector<float> bias(w);
        for (std::size_t c = 0; c < 3; ++c) {
            const std::vector<float> sum = sums.of(apart[c], false),
                                     noise = sums.of(samples.variance[c], true);
            for (std::size_t x = 0; x < w; ++x) {
                if (!(count[x] > 0)) continue;
                const float sure =
                    std::max(0.f, std::abs(sum[x]) - kSignificance * std::sqrt(noise[x])) / count[x];
                bias[x] += sure * sure / 3;
            }
        }
        for (std::size_t x = 0; x < w; ++x) out[x] = std::max(out[x], bias[x]);
    });
    return result;
}

}  // namespace vlx
