#include "reconstruct/sequence/merge.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruct/drift/centre.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

/// Of one neighbour: where a pixel's point is there, and how unlike it is.
struct ApartPlanes {
    static constexpr int kColumn = 0, kRow = 1;                     // kNowhere: not in the picture
    static constexpr int difference(int half) { return 2 + half; }  // of the halves' means, in units of noise
    static constexpr int known(int half) { return 4 + half; }       // 1 where there is one
    static constexpr int kBeyond = 6, kBeyondKnown = 7;             // likewise of features
    static constexpr int kUnlike = 8;                               // by features and motion
    static constexpr int kChannels = 9;
};

constexpr float kNowhere = -1;
constexpr float kFar = 1e30f;
constexpr float kWildVariances =
    9;                          // three standard deviations: beyond it is an outlier, how far says nothing
constexpr int kWideReach = 10;  // a change too small to be seen in a patch is in more pixels
// Kriging leaves a twentieth of a datum's variance, or less: what a merged one is off by must be as small.
constexpr float kSharpness = 20;
// Wider than within a frame: the features are merged too, and the drift explains what they differ by.
constexpr float kWidth2 = 0.35f * 0.35f;
// Of what lies beyond the four pixels in many pixels, which no interpolation explains.
constexpr float kBeyondWidth2 = 0.03f * 0.03f;
constexpr int kComparedRows = 112;  // those filled at a time, and windows around

/// A feature in units of another scale: saturated() of what it was.
float rescaled(float value, float ratio) {
    if (ratio == 1) return value;
    const float magnitude = std::abs(value);
    const float linear = magnitude > 1 ? std::exp(magnitude - 1) : magnitude;
    return saturated(std::copysign(linear * ratio, value));
}

bool isInside(float place, int size) { return place > -0.5f && place < static_cast<float>(size) - 0.5f; }

float smoothstep(float t) { return t * t * (3 - 2 * t); }

/// One of the four pixels around a place, and its weight.
struct Corner {
    int column, row;
    float part;
};
std::array<Corner, 4> cornersOf(float column, float row, int width, int height) {
    const float left = std::floor(column), top = std::floor(row);
    const float beyond[2] = {smoothstep(column - left), smoothstep(row - top)};
    std::array<Corner, 4> corners;
    for (int j = 0; j < 4; ++j)
        corners[static_cast<std::size_t>(j)] = {
            std::clamp(static_cast<int>(left) + j % 2, 0, width - 1),
            std::clamp(static_cast<int>(top) + j / 2, 0, height - 1),
            (j % 2 == 0 ? 1 - beyond[0] : beyond[0]) * (j / 2 == 0 ? 1 - beyond[1] : beyond[1])};
    return corners;
}

}  // namespace

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
      before_(std::move(before)),
      after_(std::move(after)),
      width_(own.frame().width()),
      height_(own.frame().height()),
      apart_(width_, ApartPlanes::kChannels * static_cast<int>(neighbours()),
             std::min(kComparedRows, height_)),
      counts_(own.frame().counts()) {
    counts_.luminance = counts_.light = counts_.noise = counts_.removed = 0;
}

void Merge::startAbove(int first) { comparedRows_ = std::max(0, first - kWideReach); }

void Merge::fill(int first, int end, PixelRows& out) {
    const int compared = std::min(height_, end + kWideReach);
    apart_.claim(comparedRows_, compared);
    parallelFor(comparedRows_, compared, [&](std::int64_t y) { compareRow(static_cast<int>(y)); });
    comparedRows_ = compared;
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

void Merge::compareRow(int y) {
    std::vector<float> places(2 * static_cast<std::size_t>(width_));
    for (const auto* list : {&before_, &after_}) {
        const bool next = list == &after_;
        for (std::size_t x = 0; x < places.size() / 2; ++x) {
            places[2 * x] = static_cast<float>(x);
            places[2 * x + 1] = static_cast<float>(y);
        }
        const SampledFrame* from = &frame_;
        for (std::size_t k = 0; k < list->size(); ++k) {
            const SampledFrame* const to = (*list)[k].frame;
            const std::size_t number = next ? before_.size() + k : k;
            float* const unlike =
                apart_.row(ApartPlanes::kChannels * static_cast<int>(number) + ApartPlanes::kUnlike, y);
            std::fill_n(unlike, width_, 0.f);
            // One frame farther: by the motion of what is there, without one as it lies.
            const auto move = [&](const SampledFrame& of, bool forward, const float* place, float* step) {
                step[0] = step[1] = 0;
                if (of.motion().channels() == 0) return;
                const auto col = static_cast<int>(std::lround(place[0])),
                           row = static_cast<int>(std::lround(place[1]));
                step[0] = of.motion().row(MotionPlanes::x(forward), row)[col];
                step[1] = of.motion().row(MotionPlanes::y(forward), row)[col];
            };
            for (int x = 0; x < width_; ++x) {
                float* const place = places.data() + 2 * static_cast<std::size_t>(x);
                if (place[0] == kNowhere) continue;
                float there[2], back[2];
                move(*from, next, place, there);
                place[0] += there[0];
                place[1] += there[1];
                if (!isInside(place[0], width_) || !isInside(place[1], height_)) {
                    place[0] = place[1] = kNowhere;
                    continue;
                }
                move(*to, !next, place, back);
                const float apart[2] = {there[0] + back[0], there[1] + back[1]};
                const float mismatch = apart[0] * apart[0] + apart[1] * apart[1];
                if (mismatch > 0) unlike[x] = mismatch;
            }
            compareRow(y, number, places);
            from = to;
        }
    }
}

void Merge::compareRow(int y, std::size_t k, const std::vector<float>& places) {
    const LevelData &own = frame_.frame().fine(), &other = neighbour(k).frame->frame().fine();
    const std::vector<float>& scale = neighbour(k).frame->frame().layout().scale;
    const auto out = [&](int plane) {
        return apart_.row(ApartPlanes::kChannels * static_cast<int>(k) + plane, y);
    };
    for (int half = 0; half < 2; ++half) {
        std::fill_n(out(ApartPlanes::difference(half)), width_, 0.f);
        std::fill_n(out(ApartPlanes::known(half)), width_, 0.f);
    }
    std::fill_n(out(ApartPlanes::kBeyond), width_, 0.f);
    std::fill_n(out(ApartPlanes::kBeyondKnown), width_, 0.f);
    const auto w = static_cast<std::size_t>(width_);
    const auto at = [&](const RowRing& ring, int row, int col) { return ring.row(0, row) + col; };
    const auto plane = [&](int p) { return static_cast<std::size_t>(p) * w; };
    for (int x = 0; x < width_; ++x) {
        const float* const place = places.data() + 2 * static_cast<std::size_t>(x);
        out(ApartPlanes::kColumn)[x] = place[0];
        out(ApartPlanes::kRow)[x] = place[1];
        if (place[0] == kNowhere) continue;
        const auto col = static_cast<int>(std::lround(place[0])),
                   row = static_cast<int>(std::lround(place[1]));
        if (neighbour(k).sameSeed && col == x && row == y) {
            out(ApartPlanes::kColumn)[x] = kNowhere;
            continue;
        }
        const float *const a = at(own.data(), y, x), *const b = at(other.data(), row, col);
        const float *const va = at(own.variances(), y, x), *const vb = at(other.variances(), row, col);
        for (int half = 0; half < 2; ++half) {
            const float n = a[plane(planes_.halfCount(half))], m = b[plane(planes_.halfCount(half))];
            if (n <= 0 || m <= 0) continue;
            float squares = 0, noise = 0, sum = 0;
            for (int c = 0; c < 3; ++c) {
                const float z = a[plane(planes_.mean(half) + c)], t = b[plane(planes_.mean(half) + c)];
                const float v = va[plane(c)] / std::max(1.f, n) + vb[plane(c)] / std::max(1.f, m);
                squares += (z - t) * (z - t);
                noise += v;
                sum += kLeastSquare + 1e-6f * (z * z + t * t) + v;
            }
            out(ApartPlanes::difference(half))[x] = std::min(kWildVariances, (squares - noise) / sum);
            out(ApartPlanes::known(half))[x] = 1;
        }
        const float *const fa = at(own.features(), y, x), *const fb = at(other.features(), row, col);
        const std::array<Corner, 4> corners = cornersOf(place[0], place[1], width_, height_);
        float distance = 0, squares = 0, noise = 0, sum = kLeastSquare;
        for (int f = 0; f < layout_.features; ++f) {
            const auto i = static_cast<std::size_t>(f);
            const float ratio = scale[i] / layout_.scale[i];
            const float mine = fa[plane(f)], error = fa[plane(features_.error(f))];
            const float d = mine - rescaled(fb[plane(f)], ratio);
            const float u = error + ratio * ratio * fb[plane(features_.error(f))];
            distance += (d * d - u) / (kWidth2 + 2 * u);
            float least = kFar, most = -kFar, spread = error;
            for (const auto& [c, r, part] : corners) {
                const float* const of = at(other.features(), r, c);
                const float value = rescaled(of[plane(f)], ratio);
                least = std::min(least, value);
                most = std::max(most, value);
                spread += part * part * ratio * ratio * of[plane(features_.error(f))];
            }
            const float beyond = mine - std::clamp(mine, least, most);
            squares += beyond * beyond;
            noise += spread;
            sum += kBeyondWidth2 + spread;
        }
        out(ApartPlanes::kBeyond)[x] = std::min(kWildVariances, (squares - noise) / sum);
        out(ApartPlanes::kBeyondKnown)[x] = a[plane(planes_.count())] > 0 && b[plane(planes_.count())] > 0;
        out(ApartPlanes::kUnlike)[x] += std::max(0.f, distance);
    }
}

/// out += what chance does not explain of the mean of a plane of neighbour k within `reach` of row y.
void Merge::addExcess(int y, std::size_t k, int plane, int known, int reach, float* out) const {
    const auto w = static_cast<std::size_t>(width_);
    const int first = ApartPlanes::kChannels * static_cast<int>(k);
    std::vector<float> sums(w), counts(w);
    for (int row = std::max(0, y - reach); row <= std::min(height_ - 1, y + reach); ++row) {
        const float* const d = apart_.row(first + plane, row);
        const float* const n = apart_.row(first + known, row);
        for (std::size_t x = 0; x < w; ++x) {
            sums[x] += d[x];
            counts[x] += n[x];
        }
    }
    for (int x = 0; x < width_; ++x) {
        float sum = 0, count = 0;
        for (int i = std::max(0, x - reach); i <= std::min(width_ - 1, x + reach); ++i) {
            sum += sums[static_cast<std::size_t>(i)];
            count += counts[static_cast<std::size_t>(i)];
        }
        if (count > 0) out[x] += std::max(0.f, sum / count - std::sqrt(2 / count));
    }
}

/// Of each neighbour and half, row by row of pixels.
std::vector<float> Merge::weightsOf(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<float> weights(2 * neighbours() * w), beyond(w);
    for (std::size_t k = 0; k < neighbours(); ++k) {
        const int first = ApartPlanes::kChannels * static_cast<int>(k);
        const float* const column = apart_.row(first + ApartPlanes::kColumn, y);
        const float* const unlike = apart_.row(first + ApartPlanes::kUnlike, y);
        beyond.assign(w, 0.f);
        for (const int reach : {kPatchRadius, kWideReach})
            addExcess(y, k, ApartPlanes::kBeyond, ApartPlanes::kBeyondKnown, reach, beyond.data());
        for (int half = 0; half < 2; ++half) {
            float* const out = weights.data() + (2 * k + static_cast<std::size_t>(1 - half)) * w;
            std::copy(beyond.begin(), beyond.end(), out);
            for (const int reach : {kPatchRadius, kWideReach})
                addExcess(y, k, ApartPlanes::difference(half), ApartPlanes::known(half), reach, out);
            for (int x = 0; x < width_; ++x)
                out[x] = column[x] == kNowhere ? 0 : std::exp(-kSharpness * out[x] - unlike[x]);
        }
    }
    return weights;
}

/// The four pixels around the place of (x, y) in neighbour k.
void Merge::addTaps(int x, int y, std::size_t k, const std::vector<float>& weights,
                    std::vector<Tap>& taps) const {
    const int first = ApartPlanes::kChannels * static_cast<int>(k);
    const float column = apart_.row(first + ApartPlanes::kColumn, y)[x],
                row = apart_.row(first + ApartPlanes::kRow, y)[x];
    const std::size_t at = 2 * k * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
    const float weight[2] = {weights[at], weights[at + static_cast<std::size_t>(width_)]};
    if (column == kNowhere || (weight[0] <= 0 && weight[1] <= 0)) return;
    const Frame& frame = neighbour(k).frame->frame();
    const PixelRows& of = frame.fine().pixels();
    for (const auto& [c, r, part] : cornersOf(column, row, width_, height_)) {
        if (part <= 0 || of.data.row(planes_.count(), r)[c] <= 0) continue;
        taps.push_back({of.data.row(0, r) + c,
                        of.squares.row(0, r) + c,
                        layout_.features > 0 ? of.raw.row(0, r) + c : nullptr,
                        &frame.layout().scale,
                        part,
                        {part * weight[0], part * weight[1]}});
    }
}

void Merge::mergeRow(int y, PixelRows& out) const {
    const std::vector<float> weights = weightsOf(y);
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
        for (std::size_t k = 0; k < neighbours(); ++k) addTaps(x, y, k, weights, taps);
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
            float total = 0, squares = 0;
            for (const Tap& of : taps) {
                const float n = of.data[plane(planes_.halfCount(half))];
                total += of.weight[half] * n;
                squares += of.weight[half] * of.weight[half] / of.part * n;
            }
            for (int c = 0; c < layout_.radiance; ++c) {
                const std::size_t p = plane(planes_.mean(half) + c);
                float sum = 0;
                for (const Tap& of : taps)
                    sum += of.weight[half] * of.data[plane(planes_.halfCount(half))] * of.data[p];
                to[p] = total > 0 ? sum / total : taps[0].data[p];
            }
            const float n = total > 0 ? total * total / squares : 0;
            to[plane(planes_.halfCount(half))] = n;
            count += n;
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
            float sum = 0;
            for (const Tap& of : taps) sum += share(of) * of.squares[plane(p)];
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
