#include "reconstruct/common/pixel_statistics.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/text.h"
#include "variolux/dump/format.h"

namespace vlx {

namespace {

constexpr int kScaleRows = 16;
constexpr double kScalePercentile = 0.99;
constexpr float kMostMotion = 1e5f;  // pixels: what moves farther in a frame is not known
constexpr float kMedians = 4;        // of a feature's magnitude: its scale, at most

void addFeatures(const DumpHeader& header, const std::vector<std::string>& channels, SampleLayout& layout) {
    for (const std::string& channel : channels)
        if (findChannel(header, channel) < 0) return;
    for (const std::string& channel : channels) {
        layout.names.push_back(channel);
        layout.group.push_back(layout.groups);
        layout.scale.push_back(1);
        ++layout.features;
    }
    ++layout.groups;
}

void requireChannel(const SampleSource& dump, const SampleLayout& layout, const std::string& channel,
                    const std::string& option) {
    if (findChannel(dump.header(), channel) < 0)
        throw Error(dump.path(),
                    "expected a channel '" + channel + "' (for " + option + "), found none of that name");
    if (std::find(layout.names.begin(), layout.names.end(), channel) != layout.names.end())
        throw Error(
            dump.path(),
            "channel '" + channel + "' is used already and cannot be named again by --feature or --radiance");
}

/// Whether the radiance of a sample is finite and at most kMostRadiance, its channels those from `first` on;
/// alpha is none.
bool usable(const SampleBand& band, const SampleLayout& layout, std::size_t first, std::size_t sample) {
    for (int c = 0; c < layout.radiance; ++c)
        if (c != layout.alpha &&
            !(std::abs(band.values[first + static_cast<std::size_t>(c)][sample]) <= kMostRadiance))
            return false;
    return true;
}

/// The greatest magnitude of a sample's radiance; not finite where one of its channels is not.
float greatestRadiance(const SampleBand& band, const SampleLayout& layout, std::size_t sample) {
    float most = 0;
    for (int c = 0; c < layout.radiance; ++c) {
        const float value = std::abs(band.values[static_cast<std::size_t>(c)][sample]);
        if (c != layout.alpha && !(value <= most)) most = value;
        if (!std::isfinite(most)) break;
    }
    return most;
}

/// 99th percentiles of the magnitudes of features `first` and on, over rows spread evenly.
void measureScales(const SampleSource& dump, SampleLayout& layout, std::size_t first) {
    const std::size_t measured = layout.scale.size() - first;
    if (measured == 0) return;
    std::vector<std::string> channels(
        layout.names.begin() + layout.radiance + static_cast<std::ptrdiff_t>(first),
        layout.names.begin() + layout.radiance + layout.features);
    // Radiance too: samples that are dropped say nothing about features either.
    channels.insert(channels.end(), layout.names.begin(), layout.names.begin() + layout.radiance);
    std::vector<std::vector<float>> magnitudes(measured);
    const Window& window = dump.header().data;
    const int rows = std::min(kScaleRows, window.height);
    for (int i = 0; i < rows; ++i) {
        const auto row =
            static_cast<int>((2 * i + 1) * static_cast<std::int64_t>(window.height) / (2 * rows));
        const SampleBand band = dump.read(window.y + row, 1, channels);
        for (std::size_t s = 0; s < band.samples(); ++s) {
            if (!usable(band, layout, measured, s)) continue;
            for (std::size_t c = 0; c < measured; ++c)
                if (const float value = band.values[c][s]; std::isfinite(value))
                    magnitudes[c].push_back(std::abs(value));
        }
    }
    for (std::size_t c = 0; c < measured; ++c) {
        std::vector<float>& values = magnitudes[c];
        if (values.empty()) continue;
        const auto percentile = [&](double share) {
            const auto nth =
                values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
            std::nth_element(values.begin(), nth, values.end());
            return *nth;
        };
        const float most = percentile(kScalePercentile), median = percentile(0.5);
        const float scale = median > 0 ? std::min(most, kMedians * median) : most;
        if (scale > 0) layout.scale[first + c] = scale;
    }
}

/// Whether every sample says how uncertain it is.
bool varianceKnown(const SampleBand& band, const SampleLayout& layout,
                   const std::vector<std::size_t>& samples) {
    if (layout.variance < 0 || samples.empty()) return false;
    for (std::size_t c = 0; c < 3; ++c)
        for (const std::size_t s : samples) {
            const float v = band.values[static_cast<std::size_t>(layout.variance) + c][s];
            if (!(v >= 0 && v <= kMostRadiance * kMostRadiance)) return false;
        }
    return true;
}

/// The sum of squares that as many samples with the same error of their mean would have: the mean of samples
/// with error variances v has sum v / n^2; that is S / (n (n - 1)), with S / 1 for one sample.
double knownSquares(const SampleBand& band, const SampleLayout& layout,
                    const std::vector<std::size_t>& samples, std::size_t c) {
    double sum = 0;
    for (const std::size_t s : samples)
        sum += static_cast<double>(band.values[static_cast<std::size_t>(layout.variance) + c][s]);
    const auto n = static_cast<double>(samples.size());
    return sum / n * std::max(1.0, n - 1);
}

/// What values count as: 0 where they are not finite; features, which have a scale, saturated(value / scale).
void countedValues(const float* in, std::size_t n, float scale, float* out) {
    for (std::size_t i = 0; i < n; ++i) out[i] = std::isfinite(in[i]) ? in[i] : 0.f;
    if (scale == 0) return;
    bool beyond = false;
    for (std::size_t i = 0; i < n; ++i) {
        out[i] /= scale;
        beyond |= std::abs(out[i]) > 1;
    }
    for (std::size_t i = 0; beyond && i < n; ++i) out[i] = saturated(out[i]);
}

}  // namespace

void RadianceRange::add(const RadianceRange& other) {
    finite += other.finite;
    beyond += other.beyond;
    most = std::max(most, other.most);
}

bool RadianceRange::exceeded() const {
    constexpr std::int64_t kFireflies = 16, kOneIn = 1000;
    return beyond > kFireflies && beyond > finite / kOneIn;
}

void RadianceRange::require(const std::string& path, const std::string& where) const {
    if (!exceeded()) return;
    throw Error(path,
                "expected radiance up to 2^50 (1.1e+15), of which floats hold the squares, found up to " +
                    formatted("%.3g", static_cast<double>(most)) + ": " + std::to_string(beyond) + " of " +
                    std::to_string(finite) + " samples " + where +
                    " are beyond. A lower exposure or weaker lights where it is rendered help, of a "
                    "flat image also --map R=1e-12*R (G, B likewise, variance.R=1e-24*variance.R) with "
                    "--drop-layers; --method mean, gaussian and paper take it as it is");
}

std::vector<std::string> furtherRadiance(const DumpHeader& header, const Drift& options) {
    std::vector<std::string> names, further;
    for (const DumpChannel& channel : header.channels) names.push_back(channel.name);
    for (const std::string& wanted : options.radiance) {
        const std::vector<std::string> channels = radianceChannels(names, wanted);
        if (channels.empty()) further.push_back(wanted);  // chooseSampleLayout() says what is wrong
        further.insert(further.end(), channels.begin(), channels.end());
    }
    return further;
}

SampleLayout chooseSampleLayout(const SampleSource& dump, const Drift& options) {
    const DumpHeader& header = dump.header();
    SampleLayout layout;
    layout.names = {"R", "G", "B"};
    if (findChannel(header, "A") >= 0) {
        layout.alpha = static_cast<int>(layout.names.size());
        layout.names.emplace_back("A");
    }
    for (const std::string& channel : furtherRadiance(header, options)) {
        requireChannel(dump, layout, channel, "--radiance");
        layout.names.push_back(channel);
    }
    layout.radiance = static_cast<int>(layout.names.size());
    if (options.standardFeatures) {
        addFeatures(header, {"albedo.R", "albedo.G", "albedo.B"}, layout);
        addFeatures(header, {"N.X", "N.Y", "N.Z"}, layout);
    }
    const std::size_t first = layout.scale.size();
    if (options.standardFeatures) addFeatures(header, {"Z"}, layout);
    for (const std::string& channel : options.features) {
        requireChannel(dump, layout, channel, "--feature");
        addFeatures(header, {channel}, layout);
    }
    measureScales(dump, layout, first);
    if (findChannel(header, "sample.replicate") >= 0) {
        layout.replicate = static_cast<int>(layout.names.size());
        layout.names.emplace_back("sample.replicate");
    }
    // Parts of pixels do not keep the order.
    layout.independentHalves = header.independentHalves && options.scale == 1;
    if (options.scale > 1) {
        for (const char* channel : {"sample.x", "sample.y"})
            requireChannel(dump, layout, channel, "--scale, which needs positions");
        layout.position = static_cast<int>(layout.names.size());
        layout.names.insert(layout.names.end(), {"sample.x", "sample.y"});
    }
    if (options.temporal > 0 &&
        std::all_of(std::begin(kMotionChannels), std::end(kMotionChannels), [&](std::string_view channel) {
            return findChannel(header, std::string(channel)) >= 0;
        })) {
        layout.motion = static_cast<int>(layout.names.size());
        layout.names.insert(layout.names.end(), std::begin(kMotionChannels), std::end(kMotionChannels));
    }
    if (std::all_of(
            std::begin(kVarianceChannels), std::end(kVarianceChannels),
            [&](std::string_view channel) { return findChannel(header, std::string(channel)) >= 0; })) {
        layout.variance = static_cast<int>(layout.names.size());
        layout.names.insert(layout.names.end(), std::begin(kVarianceChannels), std::end(kVarianceChannels));
    }
    return layout;
}

void gatherMotion(const SampleBand& band, const SampleLayout& layout, int bandRow, int scale, RowRing& ring,
                  int y) {
    const std::size_t start = static_cast<std::size_t>(bandRow) * static_cast<std::size_t>(band.width);
    for (int x = 0; x < band.width; ++x) {
        double sum[MotionPlanes::kChannels] = {}, count[MotionPlanes::kChannels] = {};
        const std::size_t pixel = start + static_cast<std::size_t>(x);
        for (std::size_t s = band.offsets[pixel]; s < band.offsets[pixel + 1]; ++s)
            for (std::size_t k = 0; k < MotionPlanes::kChannels; ++k) {
                const float value = band.values[static_cast<std::size_t>(layout.motion) + k][s];
                if (!(std::abs(value) <= kMostMotion)) continue;
                sum[k] += static_cast<double>(value);
                ++count[k];
            }
        for (std::size_t k = 0; k < MotionPlanes::kChannels; ++k)
            ring.row(static_cast<int>(k), y)[x] = count[k] > 0 ? static_cast<float>(scale * sum[k] / count[k])
                                                               : std::numeric_limits<float>::quiet_NaN();
    }
}

GatherCounts gatherRow(const SampleBand& band, const SampleLayout& layout, const GatheredPlanes& planes,
                       int bandRow, double clamp, RowRing& ring, int y) {
    GatherCounts counts;
    const auto radiance = static_cast<std::size_t>(layout.radiance);
    const auto features = static_cast<std::size_t>(layout.features);
    std::vector<double> first(radiance + features), sum[2], square(radiance + features), factors;
    for (auto& s : sum) s.resize(radiance + features);
    const std::size_t alpha = layout.alpha < 0 ? radiance + features : static_cast<std::size_t>(layout.alpha);
    // All values of the row as they count.
    const std::size_t start = static_cast<std::size_t>(bandRow) * static_cast<std::size_t>(band.width),
                      firstSample = band.offsets[start],
                      samples = band.offsets[start + static_cast<std::size_t>(band.width)] - firstSample;
    std::vector<float> values((radiance + features) * samples);
    for (std::size_t c = 0; c < radiance + features; ++c)
        countedValues(band.values[c].data() + firstSample, samples,
                      c < radiance ? 0 : layout.scale[c - radiance], values.data() + c * samples);
    std::vector<float*> out;
    for (int k = 0; k < planes.channels(); ++k) out.push_back(ring.row(k, y));
    std::vector<std::size_t> taken, halves[2];
    std::vector<std::pair<std::uint64_t, std::size_t>> order;
    int singles = y;  // pixels of one sample so far, the first of them in half A or B by turns
    for (int x = 0; x < band.width; ++x) {
        const std::size_t pixel = start + static_cast<std::size_t>(x);
        taken.clear();
        for (std::size_t s = band.offsets[pixel]; s < band.offsets[pixel + 1]; ++s) {
            ++counts.samples;
            if (usable(band, layout, 0, s)) {
                taken.push_back(s);
                continue;
            }
            ++counts.dropped;
            if (const float most = greatestRadiance(band, layout, s); std::isfinite(most))
                counts.range.add({1, 1, most});
        }
        counts.range.finite += static_cast<std::int64_t>(taken.size());
        halves[0].clear();
        halves[1].clear();
        if (layout.replicate >= 0)
            for (const std::size_t s : taken)
                halves[replicateNumber(band.values[static_cast<std::size_t>(layout.replicate)][s]).value() %
                       2]
                    .push_back(s);
        else if (layout.independentHalves && taken.size() > 1)
            for (const std::size_t s : taken) halves[(s - band.offsets[pixel]) % 2].push_back(s);
        if (halves[0].empty() || halves[1].empty()) {  // no replicates, or only one
            order.clear();
            for (std::size_t i = 0; i < taken.size(); ++i)
                order.emplace_back(hashOf(x, y, static_cast<std::int64_t>(i)), taken[i]);
            std::sort(order.begin(), order.end());
            halves[0].clear();
            halves[1].clear();
            const std::size_t startHalf = taken.size() == 1 ? static_cast<std::size_t>(singles++) % 2 : 0;
            for (std::size_t i = 0; i < order.size(); ++i)
                halves[(startHalf + i) % 2].push_back(order[i].second);
        }
        const auto n = static_cast<double>(taken.size());
        if (taken.empty()) ++counts.empty;

        double rgb[3] = {}, light = 0, lightSquares = 0;
        std::size_t bright = 0;
        float most = -1, second = -1;
        int brightHalf = 0;
        const auto value = [&](std::size_t c, std::size_t s) {
            return static_cast<double>(values[c * samples + s - firstSample]);
        };
        factors.clear();
        for (int half = 0; half < 2; ++half)
            for (const std::size_t s : halves[half]) {
                for (std::size_t c = 0; c < 3; ++c) rgb[c] = value(c, s);
                const double brightness = luminance(rgb);
                const double factor = clamp > 0 && brightness > clamp ? clamp / brightness : 1;
                factors.push_back(factor);
                counts.luminance += brightness;
                const double signedLight = luminance(rgb[0], rgb[1], rgb[2]);
                light += signedLight;
                lightSquares += signedLight * signedLight;
                counts.removed += brightness * (1 - factor);
                counts.limited += factor < 1;
                const auto l = static_cast<float>(brightness * factor);
                if (l > most) {
                    second = most;
                    most = l;
                    bright = s;
                    brightHalf = half;
                } else {
                    second = std::max(second, l);
                }
            }
        for (std::size_t c = 0; c < radiance + features; ++c) {
            first[c] = taken.empty() ? 0 : value(c, taken[0]);
            const bool limited = c < radiance && c != alpha;
            const double* factor = factors.data();
            double squares = 0;
            for (int half = 0; half < 2; ++half) {
                double total = 0;
                for (const std::size_t s : halves[half]) {
                    const double d = value(c, s) * (limited ? *factor : 1) - first[c];
                    ++factor;
                    total += d;
                    squares += d * d;
                }
                sum[half][c] = total;
            }
            square[c] = squares;
        }

        counts.light += light;
        if (n > 1) counts.noise += std::max(0.0, lightSquares - light * light / n) * n / (n - 1);
        const bool known = varianceKnown(band, layout, taken);
        const auto put = [&](int plane, double v) {
            out[static_cast<std::size_t>(plane)][x] = static_cast<float>(v);
        };
        const auto nA = static_cast<double>(halves[0].size());
        const auto nB = static_cast<double>(halves[1].size());
        put(planes.count(), n);
        put(planes.halfCount(0), nA);
        put(planes.halfCount(1), nB);
        put(planes.stated(), known);
        put(planes.freedom(), known ? std::max(1.0, n - 1) : std::max(0.0, n - 1));
        for (std::size_t c = 0; c < radiance; ++c) {
            const double a = nA > 0 ? first[c] + sum[0][c] / nA : 0;
            put(planes.mean(0) + static_cast<int>(c), a);
            put(planes.mean(1) + static_cast<int>(c), nB > 0 ? first[c] + sum[1][c] / nB : 0);
        }
        for (std::size_t c = 0; c < radiance + features; ++c) {
            const double total = sum[0][c] + sum[1][c];
            double squares = n > 0 ? std::max(0.0, square[c] - total * total / n) : 0;
            if (c < 3 && known) squares = knownSquares(band, layout, taken, c);
            if (c < 3) put(planes.squares() + static_cast<int>(c), squares);
            if (c < radiance) continue;
            const int f = static_cast<int>(c - radiance);
            put(planes.feature() + f, n > 0 ? first[c] + total / n : 0);
            put(planes.featureError() + f, n > 1 ? squares / (n * (n - 1)) : 0);
            put(planes.featureDifference() + f, nA > 0 && nB > 0 ? (sum[0][c] / nA - sum[1][c] / nB) / 2 : 0);
        }
        for (std::size_t c = 0; c < radiance; ++c)
            put(planes.brightest() + static_cast<int>(c), taken.empty() ? 0 : value(c, bright));
        put(planes.brightestLuminance(), std::max(0.f, most));
        put(planes.secondLuminance(), std::max(0.f, second));
        put(planes.brightestHalf(), brightHalf);
    }
    return counts;
}

}  // namespace vlx
