#include "reconstruct/common/window_sum.h"

#include "reconstruct/common/planes.h"

namespace vlx {

namespace {

using simd::Eight;
using simd::load;
using simd::store;

int lanesUp(int n) { return (n + 7) / 8 * 8; }

constexpr int kChunk = 4;  // vectors that are summed at once

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

}  // namespace

void sumAround(const std::vector<float>& in, int reach, bool squared, float* out) {
    const auto n = static_cast<int>(in.size());
    const int padded = (n + 8 * kChunk - 1) / (8 * kChunk) * 8 * kChunk;
    std::vector<float> around(static_cast<std::size_t>(padded + 2 * reach)), weights,
        sums(static_cast<std::size_t>(padded));
    std::copy(in.begin(), in.end(), around.begin() + reach);
    for (int d = -reach; d <= reach; ++d) {
        const float g = windowWeight(d, reach);
        weights.push_back(squared ? g * g : g);
    }
    convolve(around.data(), weights.data(), 2 * reach + 1, n, sums.data());
    std::copy_n(sums.data(), n, out);
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
