#include "reconstruct/sequence/likeness.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/drift/centre.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

/// Of one neighbour: where a pixel's point is there, and how unlike it is.
struct ApartPlanes {
    static constexpr int kColumn = 0, kRow = 1;                     // kNowhere: not in the picture
    static constexpr int difference(int half) { return 2 + half; }  // e: of the halves' means
    static constexpr int known(int half) { return 4 + half; }       // 1 where there is one
    static constexpr int around(int half) { return 6 + half; }      // s^2 - 1 / 25
    static constexpr int aroundKnown(int half) { return 8 + half; }
    static constexpr int kBeyond = 10, kBeyondKnown = 11;  // squares that features differ by
    static constexpr int kUnlike = 12;                     // by motion
    static constexpr int kChannels = 13;
};

constexpr float kNowhere = -1;
constexpr float kWild = 3;     // standard deviations: beyond them is an outlier, how far says nothing
constexpr int kMeanReach = 2;  // of means of differences: what they are off by is seen sooner in these
constexpr float kMeanArea = (2 * kMeanReach + 1) * (2 * kMeanReach + 1);
constexpr int kWideReach = 10;  // a change too small to be seen in a patch is in more pixels
// Kriging leaves a twentieth of a datum's variance, or less: what a merged one is off by must be as small.
constexpr float kSharpness = 20;
// A pixel that knows its features wants their like; within five standard errors of its own others may be.
constexpr float kOwnErrors = 25;
// Of what lies beyond the four pixels in many pixels, which no interpolation explains.
constexpr float kBeyondWidth2 = 0.03f * 0.03f;
constexpr int kComparedRows = 112;  // those filled at a time, and windows around

bool isInside(float place, int size) { return place > -0.5f && place < static_cast<float>(size) - 0.5f; }

float smoothstep(float t) { return t * t * (3 - 2 * t); }

}  // namespace

float rescaled(float value, float ratio) {
    if (ratio == 1) return value;
    const float magnitude = std::abs(value);
    const float linear = magnitude > 1 ? std::exp(magnitude - 1) : magnitude;
    return saturated(std::copysign(linear * ratio, value));
}

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

Likeness::Likeness(const SampledFrame& own, std::vector<Neighbour> before, std::vector<Neighbour> after)
    : frame_(own),
      layout_(own.frame().layout()),
      planes_{layout_.radiance},
      features_{layout_.features},
      before_(std::move(before)),
      after_(std::move(after)),
      width_(own.frame().width()),
      height_(own.frame().height()),
      apart_(width_, ApartPlanes::kChannels * static_cast<int>(neighbours()),
             std::min(kComparedRows, height_)) {}

void Likeness::startAbove(int first) {
    averagedRows_ = std::max(0, first - kWideReach);
    comparedRows_ = std::max(0, averagedRows_ - kMeanReach);
}

void Likeness::fill(int end) {
    const int averaged = std::min(height_, end + kWideReach);
    const int compared = std::min(height_, averaged + kMeanReach);
    apart_.claim(comparedRows_, compared);
    parallelFor(comparedRows_, compared, [&](std::int64_t y) { followRow(static_cast<int>(y)); });
    comparedRows_ = compared;
    parallelFor(averagedRows_, averaged, [&](std::int64_t y) { averageRow(static_cast<int>(y)); });
    averagedRows_ = averaged;
}

float Likeness::featureWeight(int x, int y, std::size_t k, int column, int row) const {
    const auto w = static_cast<std::size_t>(width_);
    if (layout_.features == 0) return 1;  // there are no rows of them
    const float* const mine = frame_.frame().fine().features().row(0, y) + x;
    const float* const theirs = neighbour(k).frame->frame().fine().features().row(0, row) + column;
    const std::vector<float>& scale = neighbour(k).frame->frame().layout().scale;
    float distance = 0;
    for (int f = 0; f < layout_.features; ++f) {
        const auto i = static_cast<std::size_t>(f), error = static_cast<std::size_t>(features_.error(f));
        const float ratio = scale[i] / layout_.scale[i];
        const float d = mine[i * w] - rescaled(theirs[i * w], ratio);
        const float u1 = mine[error * w], u2 = ratio * ratio * theirs[error * w];
        distance += (d * d - u1 - u2) / (kFeatureWidth2 + kOwnErrors * u1);
    }
    return std::exp(-std::max(0.f, distance));
}

bool Likeness::place(int x, int y, std::size_t k, float* column, float* row) const {
    const int first = ApartPlanes::kChannels * static_cast<int>(k);
    *column = apart_.row(first + ApartPlanes::kColumn, y)[x];
    *row = apart_.row(first + ApartPlanes::kRow, y)[x];
    return *column != kNowhere;
}

/// The places of row y in all neighbours, path by path, and what compareRow() says of them.
void Likeness::followRow(int y) {
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

void Likeness::compareRow(int y, std::size_t k, const std::vector<float>& places) {
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
            float difference = 0, deviation = 0;  // colours of a sample go together
            for (int c = 0; c < 3; ++c) {
                const float z = a[plane(planes_.mean(half) + c)], t = b[plane(planes_.mean(half) + c)];
                // Of the two frames' notions of the noise the smaller: large ones are often ignorance.
                const float v = std::min(va[plane(c)], vb[plane(c)]) * (1 / samplesIn(n) + 1 / samplesIn(m));
                difference += z - t;
                deviation += std::sqrt(kLeastSquare + 1e-6f * (z * z + t * t) + v);
            }
            out(ApartPlanes::difference(half))[x] = std::clamp(difference / deviation, -kWild, kWild);
            out(ApartPlanes::known(half))[x] = 1;
        }
        const float* const fa = layout_.features > 0 ? at(own.features(), y, x) : nullptr;
        const std::array<Corner, 4> corners = cornersOf(place[0], place[1], width_, height_);
        float squares = 0, noise = 0, sum = kLeastSquare;
        for (int f = 0; f < layout_.features; ++f) {
            const auto i = static_cast<std::size_t>(f);
            const float ratio = scale[i] / layout_.scale[i];
            const float mine = fa[plane(f)], error = fa[plane(features_.error(f))];
            float least = std::numeric_limits<float>::max(), most = -least, spread = error;
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
        out(ApartPlanes::kBeyond)[x] = std::min(kWild * kWild, (squares - noise) / sum);
        out(ApartPlanes::kBeyondKnown)[x] = a[plane(planes_.count())] > 0 && b[plane(planes_.count())] > 0;
    }
}

/// Squares of the means of differences over kMeanReach around the pixels of row y, without what noise adds.
void Likeness::averageRow(int y) {
    const auto w = static_cast<std::size_t>(width_);
    for (std::size_t k = 0; k < neighbours(); ++k)
        for (int half = 0; half < 2; ++half) {
            const int first = ApartPlanes::kChannels * static_cast<int>(k);
            const WindowSums of = sumsAround(y, first + ApartPlanes::difference(half),
                                             first + ApartPlanes::known(half), kMeanReach);
            float* const square = apart_.row(first + ApartPlanes::around(half), y);
            float* const known = apart_.row(first + ApartPlanes::aroundKnown(half), y);
            for (std::size_t x = 0; x < w; ++x) {
                known[x] = of.count[x] > 0;
                square[x] = of.count[x] > 0 ? (of.sum[x] * of.sum[x] / of.count[x] - 1) / of.count[x] : 0;
            }
        }
}

/// Sums of two planes of apart_ within `reach` of the pixels of row y.
Likeness::WindowSums Likeness::sumsAround(int y, int plane, int known, int reach) const {
    const auto w = static_cast<std::size_t>(width_);
    WindowSums columns{std::vector<float>(w), std::vector<float>(w)}, result = columns;
    for (int row = std::max(0, y - reach); row <= std::min(height_ - 1, y + reach); ++row) {
        const float *const d = apart_.row(plane, row), *const n = apart_.row(known, row);
        for (std::size_t x = 0; x < w; ++x) {
            columns.sum[x] += d[x];
            columns.count[x] += n[x];
        }
    }
    for (int x = 0; x < width_; ++x)
        for (int i = std::max(0, x - reach); i <= std::min(width_ - 1, x + reach); ++i) {
            result.sum[static_cast<std::size_t>(x)] += columns.sum[static_cast<std::size_t>(i)];
            result.count[static_cast<std::size_t>(x)] += columns.count[static_cast<std::size_t>(i)];
        }
    return result;
}

/// Of each neighbour and half, row by row of pixels.
std::vector<float> Likeness::weightsOf(int y) const {
    const auto w = static_cast<std::size_t>(width_);
    std::vector<float> weights(2 * neighbours() * w), beyond(w);
    for (std::size_t k = 0; k < neighbours(); ++k) {
        const int first = ApartPlanes::kChannels * static_cast<int>(k);
        const float* const column = apart_.row(first + ApartPlanes::kColumn, y);
        const float* const unlike = apart_.row(first + ApartPlanes::kUnlike, y);
        // What chance does not explain of a plane's mean; each `area` pixels of it are known as well as one.
        const auto addExcess = [&](int plane, int known, float area, float* out) {
            for (const int reach : {kPatchRadius, kWideReach}) {
                const WindowSums of = sumsAround(y, first + plane, first + known, reach);
                for (std::size_t x = 0; x < w; ++x)
                    if (of.count[x] > 0)
                        out[x] += std::max(0.f, of.sum[x] / of.count[x] -
                                                    std::sqrt(2 * area / std::max(area, of.count[x])) / area);
            }
        };
        beyond.assign(w, 0.f);
        addExcess(ApartPlanes::kBeyond, ApartPlanes::kBeyondKnown, 1, beyond.data());
        for (int half = 0; half < 2; ++half) {
            float* const out = weights.data() + (2 * k + static_cast<std::size_t>(1 - half)) * w;
            std::copy(beyond.begin(), beyond.end(), out);
            addExcess(ApartPlanes::around(half), ApartPlanes::aroundKnown(half), kMeanArea, out);
            for (int x = 0; x < width_; ++x)
                out[x] = column[x] == kNowhere ? 0 : std::exp(-kSharpness * out[x] - unlike[x]);
        }
    }
    return weights;
}

}  // namespace vlx
