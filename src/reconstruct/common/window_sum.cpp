#include "reconstruct/common/window_sum.h"

#include "reconstruct/common/planes.h"

namespace vlx {

namespace {

using simd::Eight;
using simd::load;
using simd::store;

int lanesUp(int n) { return (n + 7) / 8 * 8; }

constexpr int kChunk = 4;  // vectors that are summed at once
// A window this wide changes so little over a block of pixels that it is summed and evaluated block by block,
// and what lies between their centres is drawn straight.
constexpr int kWideReach = 128;
constexpr int kBlock = 8;

/// out[i] = sum over k of weights[k] in[i + k]; both have room for whole chunks.
VLX_WIDE void convolve(const float* in, const float* weights, int taps, int n, float* out) {
    for (int i = 0; i < n; i += 8 * kChunk) {
        Eight sum[kChunk] = {};
        for (int k = 0; k < taps; ++k)
            for (int v = 0; v < kChunk; ++v) sum[v] += weights[k] * load<Eight>(in + i + k + 8 * v);
        for (int v = 0; v < kChunk; ++v) store(out + i + 8 * v, sum[v]);
    }
}

/// Rows of planes, `stride` apart, with room for the window on both sides.
struct AlikeRows {
    const float *here, *scales, *there, *values;
    int stride, features, reach, width;
};

template <int Channels>
[[gnu::always_inline]] inline void addAlike(const AlikeRows& of, float* sums) {
    for (int i = 0; i < of.width; i += 8) {
        Eight sum[Channels];
        for (int c = 0; c < Channels; ++c) sum[c] = load<Eight>(sums + c * of.stride + i);
        for (int k = i; k <= i + 2 * of.reach; ++k) {
            Eight d = {};
            for (int f = 0; f < of.features; ++f) {
                const int row = f * of.stride;
                const Eight apart = load<Eight>(of.there + row + k) - load<Eight>(of.here + row + i);
                d += apart * apart * load<Eight>(of.scales + row + i);
            }
            const Eight weight = simd::nearExp(d);
            for (int c = 0; c < Channels; ++c) sum[c] += weight * load<Eight>(of.values + c * of.stride + k);
        }
        for (int c = 0; c < Channels; ++c) store(sums + c * of.stride + i, sum[c]);
    }
}

VLX_WIDE void addAlike(const AlikeRows& of, int channels, float* sums) {
    switch (channels) {
        case 4:
            return addAlike<4>(of, sums);
        default:
            return addAlike<6>(of, sums);
    }
}

/// sumAround() of values `step` apart.
std::vector<float> sumAt(const std::vector<float>& in, int reach, int step, bool squared) {
    const auto n = static_cast<int>(in.size());
    const int taps = reach / step, padded = (n + 8 * kChunk - 1) / (8 * kChunk) * 8 * kChunk;
    std::vector<float> around(static_cast<std::size_t>(padded + 2 * taps)), weights,
        sums(static_cast<std::size_t>(padded));
    std::copy(in.begin(), in.end(), around.begin() + taps);
    for (int k = -taps; k <= taps; ++k) {
        const float g = windowWeight(step * k, reach);
        weights.push_back(squared ? g * g : g);
    }
    convolve(around.data(), weights.data(), 2 * taps + 1, n, sums.data());
    sums.resize(in.size());
    return sums;
}

}  // namespace

void sumAround(const std::vector<float>& in, int reach, bool squared, float* out) {
    if (reach < kWideReach || in.size() < 2 * kBlock) {
        const std::vector<float> sums = sumAt(in, reach, 1, squared);
        std::copy(sums.begin(), sums.end(), out);
        return;
    }
    std::vector<float> blocks((in.size() + kBlock - 1) / kBlock);
    for (std::size_t i = 0; i < in.size(); ++i) blocks[i / kBlock] += in[i];
    const std::vector<float> sums = sumAt(blocks, reach, kBlock, squared);
    for (std::size_t i = 0; i < in.size(); ++i) {
        // Between the centres of two blocks, or beyond the last.
        const float at = (static_cast<float>(i) + 0.5f) / kBlock - 0.5f;
        const auto left = static_cast<std::size_t>(std::clamp(at, 0.f, static_cast<float>(sums.size() - 2)));
        out[i] = sums[left] + (at - static_cast<float>(left)) * (sums[left + 1] - sums[left]);
    }
}

void sumAlike(const RowRing& features, int featureCount, int reach, int channels,
              const std::function<void(int row, int c, float* q)>& fill, int y, int width, int height,
              float* out) {
    constexpr int kMostChannels = 6;
    const int stride = lanesUp(width + 2 * reach) + 8;
    const auto planes = [&](int count) {
        return std::vector<float>(static_cast<std::size_t>(count * stride));
    };
    std::vector<float> here = planes(featureCount), scales = planes(featureCount),
                       there = planes(featureCount), values = planes(kMostChannels),
                       sums = planes(kMostChannels);
    for (int f = 0; f < featureCount; ++f) {
        std::copy_n(features.row(f, y), width, here.data() + f * stride);
        const float* const errors = features.row(FeaturePlanes{featureCount}.error(f), y);
        for (int i = 0; i < width; ++i)
            scales[static_cast<std::size_t>(f * stride + i)] = 1 / (kAlikeFeatures2 + 2 * errors[i]);
    }
    for (int row = std::max(0, y - reach); row <= std::min(height - 1, y + reach); ++row) {
        for (int f = 0; f < featureCount; ++f)
            std::copy_n(features.row(f, row), width, there.data() + f * stride + reach);
        // Beyond the row there is nothing: zeros are summed.
        for (int c = 0; c < channels; ++c) fill(row, c, values.data() + c * stride + reach);
        addAlike(
            {here.data(), scales.data(), there.data(), values.data(), stride, featureCount, reach, width},
            channels, sums.data());
    }
    for (int c = 0; c < channels; ++c)
        std::copy_n(sums.data() + c * stride, width,
                    out + static_cast<std::size_t>(c) * static_cast<std::size_t>(width));
}

}  // namespace vlx
