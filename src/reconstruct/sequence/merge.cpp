#include "reconstruct/sequence/merge.h"

#include <algorithm>
#include <utility>

#include "reconstruct/drift/centre.h"
#include "variolux/base/parallel.h"

namespace vlx {

/// A pixel of a frame that adds to a datum. Planes lie `width` apart.
struct Merge::Tap {
    const float *data, *squares, *raw;
    const std::vector<float>* scale;  // of its features
    float part;                       // of the frame's
    float weight[2];                  // of the halves, `part` in it
};

Merge::Merge(const SampledFrame& own, std::vector<Neighbour> before, std::vector<Neighbour> after)
    : frame_(own),
      layout_(own.frame().layout()),
      planes_{layout_.radiance},
      features_{layout_.features},
      width_(own.frame().width()),
      likeness_(own, std::move(before), std::move(after)),
      counts_(own.frame().counts()) {
    counts_.luminance = counts_.light = counts_.noise = counts_.removed = 0;
}

void Merge::fill(int first, int end, PixelRows& out) {
    likeness_.fill(end);
    parallelFor(first, end, [&](std::int64_t y) { mergeRow(static_cast<int>(y), out); });
    for (int y = first; y < end; ++y)
        if (frame_.isOwn(y)) countRow(y, out);
}

void Merge::countRow(int y, const PixelRows& out) {
    const float* const own = frame_.frame().fine().data().row(planes_.count(), y);
    for (int x = 0; x < width_; ++x) {
        const auto n = static_cast<double>(out.data.row(planes_.count(), y)[x]);
        own_ += static_cast<double>(own[x]);
        merged_ += n;
        double rgb[3], lost[3];
        for (int c = 0; c < 3; ++c) {
            lost[c] = static_cast<double>(out.data.row(planes_.removed() + c, y)[x]);
            rgb[c] = plainMean(out.data, planes_, c, x, y) + lost[c];
        }
        counts_.light += n * luminance(rgb[0], rgb[1], rgb[2]);
        counts_.luminance += n * static_cast<double>(luminance(rgb));
        counts_.removed += n * static_cast<double>(luminance(lost));
    }
}

/// The four pixels around the place of (x, y) in neighbour k.
void Merge::addTaps(int x, int y, std::size_t k, const std::vector<float>& weights,
                    std::vector<Tap>& taps) const {
    const std::size_t at = 2 * k * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    const float weight[2] = {weights[at], weights[at + static_cast<std::size_t>(width_)]};
    float column, row;
    if (!likeness_.place(x, y, k, &column, &row) || std::max(weight[0], weight[1]) < kLeastWeight) return;
    const Frame& frame = likeness_.neighbour(k).frame->frame();
    const PixelRows& of = frame.fine().pixels();
    for (const auto& [c, r, part] : cornersOf(column, row, width_, frame_.frame().height())) {
        if (part <= 0 || of.data.row(planes_.count(), r)[c] <= 0) continue;
        const float like = likeness_.featureWeight(x, y, k, c, r);
        const auto whole = [&](int half) {
            return like * weight[half] < kLeastWeight ? 0 : part * like * weight[half];
        };
        taps.push_back({of.data.row(0, r) + c,
                        of.squares.row(0, r) + c,
                        layout_.features > 0 ? of.raw.row(0, r) + c : nullptr,
                        &frame.layout().scale,
                        part,
                        {whole(0), whole(1)}});
    }
}

void Merge::mergeRow(int y, PixelRows& out) const {
    const std::vector<float> weights = likeness_.weightsOf(y);
    const PixelRows& own = frame_.frame().fine().pixels();
    const auto plane = [&](int p) { return static_cast<std::size_t>(p) * static_cast<std::size_t>(width_); };
    std::vector<Tap> taps;
    for (int x = 0; x < width_; ++x) {
        taps.assign(1, {own.data.row(0, y) + x,
                        own.squares.row(0, y) + x,
                        layout_.features > 0 ? own.raw.row(0, y) + x : nullptr,
                        &layout_.scale,
                        1,
                        {1, 1}});
        for (std::size_t k = 0; k < likeness_.neighbours(); ++k) addTaps(x, y, k, weights, taps);
        float* const to = out.data.row(0, y) + x;
        if (taps.size() == 1) {  // as they came, bit for bit
            for (int p = 0; p < planes_.channels(); ++p) to[plane(p)] = taps[0].data[plane(p)];
            for (int p = 0; p < SquaresPlanes::kChannels; ++p)
                out.squares.row(p, y)[x] = taps[0].squares[plane(p)];
            for (int p = 0; p < features_.rawChannels(); ++p) out.raw.row(p, y)[x] = taps[0].raw[plane(p)];
            continue;
        }
        float count = 0;
        for (int half = 0; half < 2; ++half) {
            float total = 0;
            for (const Tap& of : taps) total += of.weight[half] * of.data[plane(planes_.halfCount(half))];
            for (int c = 0; c < layout_.radiance; ++c) {
                const std::size_t p = plane(planes_.mean(half) + c);
                float sum = 0;
                for (const Tap& of : taps)
                    sum += of.weight[half] * of.data[plane(planes_.halfCount(half))] * of.data[p];
                to[p] = total > 0 ? sum / total : taps[0].data[p];
            }
            to[plane(planes_.halfCount(half))] = total;
            count += total;
        }
        to[plane(planes_.count())] = count;
        to[plane(planes_.stated())] = taps[0].data[plane(planes_.stated())];
        to[plane(planes_.gap())] = count > 0 ? 0 : taps[0].data[plane(planes_.gap())];
        // What both halves have in common.
        const auto share = [](const Tap& of) { return (of.weight[0] + of.weight[1]) / 2; };
        float total = 0;
        for (const Tap& of : taps) total += share(of) * of.data[plane(planes_.count())];
        const auto part = [&](const Tap& of) {
            return total > 0 ? share(of) * of.data[plane(planes_.count())] / total
                             : static_cast<float>(&of == taps.data());
        };
        for (int c = 0; c < 3; ++c) {
            const std::size_t p = plane(planes_.removed() + c);
            to[p] = 0;
            for (const Tap& of : taps) to[p] += part(of) * of.data[p];
        }
        for (int p = 0; p < SquaresPlanes::kChannels; ++p) {
            const bool squared = p == SquaresPlanes::kAllSquared;  // of a sum
            float sum = 0;
            for (const Tap& of : taps) sum += (squared ? share(of) : 1) * share(of) * of.squares[plane(p)];
            out.squares.row(p, y)[x] = sum;
        }
        for (int f = 0; f < layout_.features; ++f) {
            float mean = 0, error = 0, difference = 0;
            for (const Tap& of : taps) {
                const auto i = static_cast<std::size_t>(f);
                const float ratio = (*of.scale)[i] / layout_.scale[i], p = part(of);
                mean += p * rescaled(of.raw[plane(features_.value(f))], ratio);
                error += p * p / of.part * ratio * ratio * of.raw[plane(features_.error(f))];
                difference += p * ratio * of.raw[plane(features_.difference(f))];
            }
            out.raw.row(features_.value(f), y)[x] = mean;
            out.raw.row(features_.error(f), y)[x] = error;
            out.raw.row(features_.difference(f), y)[x] = difference;
        }
    }
}

}  // namespace vlx
