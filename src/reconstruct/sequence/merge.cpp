#include "reconstruct/sequence/merge.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "reconstruct/drift/centre.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

/// Of one neighbour: where a pixel's point is there, and how unlike the halves are.
struct ApartPlanes {
    static constexpr int kColumn = 0, kRow = 1;                     // -1: not in the picture
    static constexpr int difference(int half) { return 2 + half; }  // in units of noise
    static constexpr int known(int half) { return 4 + half; }       // 1 where there is one
    static constexpr int kFeatures = 6;                             // squared distance of the features
    static constexpr int kChannels = 7;
};

constexpr int kComparedRows = 80;  // those filled at a time, and patches around

float environment(const char* name, float value) {
    const char* text = std::getenv(name);
    return text ? static_cast<float>(std::atof(text)) : value;
}

/// A feature in units of another scale: saturated() of what it was.
float rescaled(float value, float ratio) {
    if (ratio == 1) return value;
    const float magnitude = std::abs(value);
    const float linear = magnitude > 1 ? std::exp(magnitude - 1) : magnitude;
    return saturated(std::copysign(linear * ratio, value));
}

}  // namespace

Merge::Merge(const SampledFrame& own, std::vector<const SampledFrame*> before,
             std::vector<const SampledFrame*> after)
    : own_(own),
      layout_(own.frame().layout()),
      planes_{layout_.radiance},
      featurePlanes_{layout_.features},
      before_(std::move(before)),
      after_(std::move(after)),
      width_(own.frame().width()),
      height_(own.frame().height()),
      apart_(width_, ApartPlanes::kChannels * static_cast<int>(neighbours()),
             std::min(kComparedRows, height_)),
      counts_(own.frame().counts()) {}

void Merge::startAbove(int first) { comparedRows_ = std::max(0, first - kPatchRadius); }

void Merge::fill(int first, int end, PixelRows& out) {
    const int compared = std::min(height_, end + kPatchRadius);
    apart_.claim(comparedRows_, compared);
    parallelFor(comparedRows_, compared, [&](std::int64_t y) { compareRow(static_cast<int>(y)); });
    comparedRows_ = compared;
    parallelFor(first, end, [&](std::int64_t y) { mergeRow(static_cast<int>(y), out); });
}

void Merge::compareRow(int y) {
    std::vector<float> places(2 * static_cast<std::size_t>(width_));
    for (const auto* list : {&before_, &after_}) {
        const bool next = list == &after_;
        for (int x = 0; x < width_; ++x) {
            places[2 * static_cast<std::size_t>(x)] = static_cast<float>(x);
            places[2 * static_cast<std::size_t>(x) + 1] = static_cast<float>(y);
        }
        const SampledFrame* from = &own_;
        for (std::size_t k = 0; k < list->size(); ++k) {
            for (int x = 0; x < width_; ++x) {
                float* const place = places.data() + 2 * static_cast<std::size_t>(x);
                const auto inside = [&] {
                    return place[0] > -0.5f && place[0] < static_cast<float>(width_) - 0.5f &&
                           place[1] > -0.5f && place[1] < static_cast<float>(height_) - 0.5f;
                };
                if (inside() && from->motion().channels() > 0) {
                    const auto col = static_cast<int>(std::lround(place[0])),
                               row = static_cast<int>(std::lround(place[1]));
                    place[0] += from->motion().row(MotionPlanes::x(next), row)[col];
                    place[1] += from->motion().row(MotionPlanes::y(next), row)[col];
                }
                if (!inside()) place[0] = place[1] = -1;
            }
            compareRow(y, *(*list)[k], places.data(), next ? before_.size() + k : k);
            from = (*list)[k];
        }
    }
}

void Merge::compareRow(int y, const SampledFrame& there, const float* places, std::size_t k) {
    const LevelData &a = own_.frame().fine(), &b = there.frame().fine();
    const std::vector<float>& scale = there.frame().layout().scale;
    const auto out = [&](int plane) {
        return apart_.row(ApartPlanes::kChannels * static_cast<int>(k) + plane, y);
    };
    for (int plane = 0; plane < ApartPlanes::kChannels; ++plane) std::fill_n(out(plane), width_, 0.f);
    for (int x = 0; x < width_; ++x) {
        const auto col = static_cast<int>(std::lround(places[2 * x])),
                   row = static_cast<int>(std::lround(places[2 * x + 1]));
        out(ApartPlanes::kColumn)[x] = static_cast<float>(col);
        out(ApartPlanes::kRow)[x] = static_cast<float>(row);
        if (col < 0) continue;
        for (int half = 0; half < 2; ++half) {
            const float n = a.data().row(planes_.halfCount(half), y)[x],
                        m = b.data().row(planes_.halfCount(half), row)[col];
            if (n <= 0 || m <= 0) continue;
            float squares = 0, noise = 0, sum = 0;
            for (int c = 0; c < 3; ++c) {
                const float z = a.data().row(planes_.mean(half) + c, y)[x],
                            t = b.data().row(planes_.mean(half) + c, row)[col];
                const float v = a.variances().row(c, y)[x] / std::max(1.f, n) +
                                b.variances().row(c, row)[col] / std::max(1.f, m);
                squares += (z - t) * (z - t);
                noise += v;
                sum += kLeastSquare + 1e-6f * (z * z + t * t) + v;
            }
            out(ApartPlanes::difference(half))[x] = (squares - noise) / sum;
            out(ApartPlanes::known(half))[x] = 1;
        }
        float distance = 0;
        for (int f = 0; f < layout_.features; ++f) {
            const auto i = static_cast<std::size_t>(f);
            const float ratio = scale[i] / layout_.scale[i];
            const float d = a.features().row(f, y)[x] - rescaled(b.features().row(f, row)[col], ratio);
            distance +=
                d * d /
                (kFeatureWidth2 + 2 * (a.features().row(featurePlanes_.error(f), y)[x] +
                                       ratio * ratio * b.features().row(featurePlanes_.error(f), row)[col]));
        }
        out(ApartPlanes::kFeatures)[x] = distance;
    }
}

/// Of each neighbour and half, for the pixels of a row.
std::vector<float> Merge::weightsOf(int y) const {
    static const float sharp = environment("VLX_SHARP", 2), features = environment("VLX_FEATURES", 0.3f);
    const auto w = static_cast<std::size_t>(width_);
    std::vector<float> weights(2 * neighbours() * w), columns(2 * w);
    for (std::size_t k = 0; k < neighbours(); ++k) {
        const int first = ApartPlanes::kChannels * static_cast<int>(k);
        for (int half = 0; half < 2; ++half) {
            std::fill(columns.begin(), columns.end(), 0.f);
            for (int row = std::max(0, y - kPatchRadius); row <= std::min(height_ - 1, y + kPatchRadius);
                 ++row) {
                const float* const d = apart_.row(first + ApartPlanes::difference(half), row);
                const float* const n = apart_.row(first + ApartPlanes::known(half), row);
                for (std::size_t x = 0; x < w; ++x) {
                    columns[x] += d[x];
                    columns[w + x] += n[x];
                }
            }
            const float* const column = apart_.row(first + ApartPlanes::kColumn, y);
            const float* const unlike = apart_.row(first + ApartPlanes::kFeatures, y);
            for (int x = 0; x < width_; ++x) {
                float sum = 0, count = 0;
                for (int i = std::max(0, x - kPatchRadius); i <= std::min(width_ - 1, x + kPatchRadius);
                     ++i) {
                    sum += columns[static_cast<std::size_t>(i)];
                    count += columns[w + static_cast<std::size_t>(i)];
                }
                const float d = count > 0 ? std::max(0.f, sum / count) : 0;
                // The other half's weight: independent of what it weighs.
                weights[(2 * k + static_cast<std::size_t>(1 - half)) * w + static_cast<std::size_t>(x)] =
                    column[x] < 0 ? 0 : std::exp(-features * unlike[x]) / (1 + sharp * d);
            }
        }
    }
    return weights;
}

void Merge::mergeRow(int y, PixelRows& out) const {
    const auto w = static_cast<std::size_t>(width_);
    const std::vector<float> weights = weightsOf(y);
    const LevelData& own = own_.frame().fine();
    struct Datum {
        const PixelRows* rows;
        const std::vector<float>* scale;
        int x, y;
        float weight[2];
    };
    std::vector<Datum> data;
    for (int x = 0; x < width_; ++x) {
        data.assign(1, {&own.pixels(), &layout_.scale, x, y, {1, 1}});
        for (std::size_t k = 0; k < neighbours(); ++k) {
            const int first = ApartPlanes::kChannels * static_cast<int>(k);
            const auto col = static_cast<int>(apart_.row(first + ApartPlanes::kColumn, y)[x]),
                       row = static_cast<int>(apart_.row(first + ApartPlanes::kRow, y)[x]);
            if (col < 0) continue;
            const PixelRows& rows = neighbour(k).frame().fine().pixels();
            if (rows.data.row(planes_.count(), row)[col] <= 0) continue;
            const std::size_t at = 2 * k * w + static_cast<std::size_t>(x);
            data.push_back(
                {&rows, &neighbour(k).frame().layout().scale, col, row, {weights[at], weights[at + w]}});
        }
        const auto value = [&](const Datum& of, RowRing PixelRows::*ring, int plane) {
            return (of.rows->*ring).row(plane, of.y)[of.x];
        };
        float count = 0;
        for (int half = 0; half < 2; ++half) {
            float total = 0, squares = 0;
            for (const Datum& of : data) {
                const float n = value(of, &PixelRows::data, planes_.halfCount(half));
                total += of.weight[half] * n;
                squares += of.weight[half] * of.weight[half] * n;
            }
            for (int c = 0; c < layout_.radiance; ++c) {
                float sum = 0;
                for (const Datum& of : data)
                    sum += of.weight[half] * value(of, &PixelRows::data, planes_.halfCount(half)) *
                           value(of, &PixelRows::data, planes_.mean(half) + c);
                out.data.row(planes_.mean(half) + c, y)[x] =
                    total > 0 ? sum / total : value(data[0], &PixelRows::data, planes_.mean(half) + c);
            }
            const float samples = total > 0 ? total * total / squares : 0;
            out.data.row(planes_.halfCount(half), y)[x] = samples;
            count += samples;
        }
        out.data.row(planes_.count(), y)[x] = count;
        out.data.row(planes_.stated(), y)[x] = value(data[0], &PixelRows::data, planes_.stated());
        out.data.row(planes_.gap(), y)[x] = count > 0 ? 0 : value(data[0], &PixelRows::data, planes_.gap());
        // What both halves have in common.
        const auto share = [&](const Datum& of) { return (of.weight[0] + of.weight[1]) / 2; };
        float total = 0;
        for (const Datum& of : data) total += share(of) * value(of, &PixelRows::data, planes_.count());
        const auto weight = [&](const Datum& of) {
            return total > 0 ? share(of) * value(of, &PixelRows::data, planes_.count()) / total
                             : static_cast<float>(&of == data.data());
        };
        for (int c = 0; c < 3; ++c) {
            float sum = 0;
            for (const Datum& of : data)
                sum += weight(of) * value(of, &PixelRows::data, planes_.removed() + c);
            out.data.row(planes_.removed() + c, y)[x] = sum;
        }
        for (int k = 0; k < SquaresPlanes::kChannels; ++k) {
            float sum = 0;
            for (const Datum& of : data) sum += share(of) * value(of, &PixelRows::squares, k);
            out.squares.row(k, y)[x] = sum;
        }
        for (int f = 0; f < layout_.features; ++f) {
            float mean = 0, error = 0, difference = 0;
            for (const Datum& of : data) {
                const auto i = static_cast<std::size_t>(f);
                const float ratio = (*of.scale)[i] / layout_.scale[i], part = weight(of);
                mean += part * rescaled(value(of, &PixelRows::raw, featurePlanes_.value(f)), ratio);
                error += part * part * ratio * ratio * value(of, &PixelRows::raw, featurePlanes_.error(f));
                difference += part * ratio * value(of, &PixelRows::raw, featurePlanes_.difference(f));
            }
            out.raw.row(featurePlanes_.value(f), y)[x] = mean;
            out.raw.row(featurePlanes_.error(f), y)[x] = error;
            out.raw.row(featurePlanes_.difference(f), y)[x] = difference;
        }
    }
}

}  // namespace vlx
