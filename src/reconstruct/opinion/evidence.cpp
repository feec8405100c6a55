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
        result.own[c].resize(pixels);
        result.variance[c].resize(pixels);
        for (std::size_t p = 0; p < pixels; ++p) {
            result.mean[c][p] = image.pixels[p * channels + c];
            if (!result.known(p)) continue;
            const float s = image.pixels[p * channels + stddev + c];
            result.own[c][p] = s * s;
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
                        for (std::size_t c = 0; c < 3; ++c) sum[c] += static_cast<double>(result.own[c][p]);
                    }
                for (std::size_t c = 0; c < 3; ++c) {
                    float& variance = result.variance[c][result.at(x, y)];
                    variance = std::max(variance, least + static_cast<float>(count > 0 ? sum[c] / count : 0));
                }
            }
    });
    return result;
}

namespace {

/// How an image differs from samples' means.
struct Differences {
    std::vector<float> known, excess, excess2, variance;
    std::vector<float> unit[3];    ///< sqrt(D^2 + v): else a window's brightest pixel decided on its bias
    std::vector<float> apart[3];   ///< (z - D) / unit
    std::vector<float> spread[3];  ///< its variance, or its square if that is more: no pixel proves a bias
};

Differences differencesOf(const SampleMeans& samples, const Image& image) {
    const std::size_t pixels = samples.mean[0].size();
    const auto channels = static_cast<std::size_t>(image.channelCount());
    Differences of;
    for (auto* plane : {&of.known, &of.excess, &of.excess2, &of.variance}) plane->resize(pixels);
    for (auto* planes : {&of.unit, &of.apart, &of.spread})
        for (auto& plane : *planes) plane.resize(pixels);
    for (std::size_t p = 0; p < pixels; ++p) {
        for (std::size_t c = 0; c < 3; ++c) of.variance[p] += samples.variance[c][p] / 3;
        if (!samples.known(p)) continue;
        of.known[p] = 1;
        float square = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const float d = image.pixels[p * channels + c], v = samples.variance[c][p];
            const float difference = samples.mean[c][p] - d, unit = std::sqrt(d * d + v);
            of.unit[c][p] = unit;
            of.apart[c][p] = difference / unit;
            of.spread[c][p] = std::max(v / (unit * unit), of.apart[c][p] * of.apart[c][p]);
            square += difference * difference / 3;
        }
        of.excess[p] = square / of.variance[p] - 1;
        of.excess2[p] = of.excess[p] * of.excess[p];
    }
    return of;
}

/// A mean over windows around the pixels of a row and its standard error; none where there is no sample.
struct WindowMean {
    float mean = 0, error = 0;
};

std::vector<WindowMean> excessAlong(const Differences& of, RowSums& sums) {
    const std::vector<float> count = sums.of(of.known, false), count2 = sums.of(of.known, true),
                             sum = sums.of(of.excess, false), sum2 = sums.of(of.excess2, true);
    std::vector<WindowMean> result(count.size());
    for (std::size_t x = 0; x < count.size(); ++x) {
        if (!(count[x] > 0)) continue;
        const float t = sum[x] / count[x];
        const float scatter = std::max(sum2[x] - t * t * count2[x], kLeastScatter * count2[x]);
        result[x] = {t, std::sqrt(scatter) / count[x]};
    }
    return result;
}

std::vector<WindowMean> apartAlong(const Differences& of, std::size_t channel,
                                   const std::vector<float>& count, RowSums& sums) {
    const std::vector<float> sum = sums.of(of.apart[channel], false),
                             noise = sums.of(of.spread[channel], true);
    std::vector<WindowMean> result(count.size());
    for (std::size_t x = 0; x < count.size(); ++x)
        if (count[x] > 0) result[x] = {sum[x] / count[x], std::sqrt(noise[x]) / count[x]};
    return result;
}

/// That a normal deviate passes t standard errors.
double chanceBeyond(double t) { return 0.5 * std::erfc(t / std::sqrt(2.0)); }

}  // namespace

std::vector<float> certainError(const SampleMeans& samples, const Image& image) {
    const Differences of = differencesOf(samples, image);
    std::vector<float> result(of.known.size());
    parallelFor(0, samples.height, [&](std::int64_t line) {
        const auto y = static_cast<int>(line);
        const std::size_t first = samples.at(0, y);
        for (const int reach : kShapeReaches) {
            RowSums sums(samples.width, samples.height, y, reach);
            const std::vector<WindowMean> excess = excessAlong(of, sums);
            for (std::size_t x = 0; x < excess.size(); ++x) {
                const float sure = excess[x].mean - kSignificance * excess[x].error;
                result[first + x] = std::max(result[first + x], sure * of.variance[first + x]);
            }
        }
        RowSums sums(samples.width, samples.height, y, kBiasReach);
        const std::vector<float> count = sums.of(of.known, false);
        std::vector<float> bias(count.size());
        for (std::size_t c = 0; c < 3; ++c) {
            const std::vector<WindowMean> apart = apartAlong(of, c, count, sums);
            for (std::size_t x = 0; x < bias.size(); ++x) {
                const float sure = std::max(0.f, std::abs(apart[x].mean) - kSignificance * apart[x].error) *
                                   of.unit[c][first + x];
                bias[x] += sure * sure / 3;
            }
        }
        for (std::size_t x = 0; x < bias.size(); ++x)
            result[first + x] = std::max(result[first + x], bias[x]);
    });
    return result;
}

Doubts doubtsOf(const SampleMeans& samples, const Image& image) {
    constexpr int kReaches[] = {kShapeReaches[1], kShapeReaches[2]};  // more tells of places far away
    constexpr double kTests =
        std::size(kShapeReaches) + 2 * 3 * std::size(kReaches);  // both signs, 3 colours
    const Differences of = differencesOf(samples, image);
    Doubts result;
    for (auto& plane : result.bias) plane.resize(of.known.size());
    result.confidence.assign(of.known.size(), 1.f);
    parallelFor(0, samples.height, [&](std::int64_t line) {
        const auto y = static_cast<int>(line);
        const std::size_t first = samples.at(0, y);
        const auto doubt = [&](std::size_t x, double deviations) {
            float& least = result.confidence[first + x];
            least = std::min(least, static_cast<float>(kTests * chanceBeyond(deviations)));
        };
        for (const int reach : kShapeReaches) {
            RowSums sums(samples.width, samples.height, y, reach);
            const std::vector<WindowMean> excess = excessAlong(of, sums);
            for (std::size_t x = 0; x < excess.size(); ++x)
                if (excess[x].error > 0) doubt(x, static_cast<double>(excess[x].mean / excess[x].error));
        }
        for (const int reach : kReaches) {
            RowSums sums(samples.width, samples.height, y, reach);
            const std::vector<float> count = sums.of(of.known, false);
            for (std::size_t c = 0; c < 3; ++c) {
                const std::vector<WindowMean> apart = apartAlong(of, c, count, sums);
                float* const bias = result.bias[c].data() + first;
                for (std::size_t x = 0; x < apart.size(); ++x) {
                    const auto [mean, error] = apart[x];
                    if (!(error > 0)) continue;
                    doubt(x, static_cast<double>(std::abs(mean) / error));
                    if (bias[x] == 0 && std::abs(mean) > kSignificance * error)
                        bias[x] = (error * error / mean - mean) * of.unit[c][first + x];
                }
            }
        }
    });
    return result;
}

}  // namespace vlx
