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

constexpr int kComparedRows = 112;  // a tile's, patches around, and as far ahead
constexpr int kMergedRows = 300;

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

Merge::Merge(const SampleLayout& layout, const LevelData& own, std::vector<Neighbour> before,
             std::vector<Neighbour> after)
    : layout_(layout),
      planes_{layout.radiance},
      featurePlanes_{layout.features},
      own_(own),
      before_(std::move(before)),
      after_(std::move(after)),
      width_(own.width()),
      height_(own.height()),
      apart_(width_, ApartPlanes::kChannels * static_cast<int>(neighbours()),
             std::min(kComparedRows, height_)),
      merged_{RowRing(width_, planes_.count() + 1, std::min(kMergedRows, height_)),
              RowRing(width_, featurePlanes_.channels(), std::min(kMergedRows, height_))} {}

void Merge::startAbove(int first) {
    mergedRows_ = std::max(0, first);
    comparedRows_ = std::max(0, mergedRows_ - kPatchRadius);
}

void Merge::fill(int until) {
    until = std::min(until, height_);
    while (mergedRows_ < until) {
        const int end = std::min(until, mergedRows_ + kTile), compared = std::min(height_, end + kPatchRadius);
        apart_.claim(comparedRows_, compared);
        parallelFor(comparedRows_, compared, [&](std::int64_t y) { compareRow(static_cast<int>(y)); });
        comparedRows_ = compared;
        for (RowRing* ring : {&merged_.data, &merged_.features}) ring->claim(mergedRows_, end);
        parallelFor(mergedRows_, end, [&](std::int64_t y) { mergeRow(static_cast<int>(y)); });
        mergedRows_ = end;
    }
}

void Merge::compareRow(int y) {
    static const float mismatch = environment("VLX_MISMATCH", 0);
    for (const auto* list : {&before_, &after_}) {
        const bool back = list == &before_;
        std::vector<float> column(static_cast<std::size_t>(width_)), row(column.size());
        for (int x = 0; x < width_; ++x) {
            column[static_cast<std::size_t>(x)] = static_cast<float>(x);
            row[static_cast<std::size_t>(x)] = static_cast<float>(y);
        }
        const LevelData* from = &own_;
        for (std::size_t k = 0; k < list->size(); ++k) {
            const LevelData& there = *(*list)[k].data;
            const std::vector<float>& scale = *(*list)[k].scale;
            const int first = ApartPlanes::kChannels * static_cast<int>(back ? k : before_.size() + k);
            const auto out = [&](int plane) { return apart_.row(first + plane, y); };
            for (int x = 0; x < width_; ++x) {
                const auto i = static_cast<std::size_t>(x);
                for (int plane = 0; plane < ApartPlanes::kChannels; ++plane) out(plane)[x] = 0;
                out(ApartPlanes::kColumn)[x] = -1;
                if (!(column[i] > -0.5f && column[i] < static_cast<float>(width_) - 0.5f && row[i] > -0.5f &&
                      row[i] < static_cast<float>(height_) - 0.5f)) {
                    column[i] = -1;
                    continue;
                }
                const int fromX = static_cast<int>(std::lround(column[i])),
                          fromY = static_cast<int>(std::lround(row[i]));
                if (from->motion().channels() > 0) {
                    column[i] += from->motion().row(MotionPlanes::x(!back), fromY)[fromX];
                    row[i] += from->motion().row(MotionPlanes::y(!back), fromY)[fromX];
                }
                if (!(column[i] > -0.5f && column[i] < static_cast<float>(width_) - 0.5f && row[i] > -0.5f &&
                      row[i] < static_cast<float>(height_) - 0.5f)) {
                    column[i] = -1;
                    continue;
                }
                const int toX = static_cast<int>(std::lround(column[i])),
                          toY = static_cast<int>(std::lround(row[i]));
                out(ApartPlanes::kColumn)[x] = static_cast<float>(toX);
                out(ApartPlanes::kRow)[x] = static_cast<float>(toY);
                for (int half = 0; half < 2; ++half) {
                    const float n = own_.data().row(planes_.halfCount(half), y)[x],
                                m = there.data().row(planes_.halfCount(half), toY)[toX];
                    if (n <= 0 || m <= 0) continue;
                    float squares = 0, noise = 0, other = 0, sum = 0;
                    for (int c = 0; c < 3; ++c) {
                        const float a = own_.data().row(planes_.mean(half) + c, y)[x],
                                    b = there.data().row(planes_.mean(half) + c, toY)[toX];
                        const float u = own_.variances().row(c, y)[x] / std::max(1.f, n),
                                    v = there.variances().row(c, toY)[toX] / std::max(1.f, m);
                        squares += (a - b) * (a - b);
                        noise += u;
                        other += v;
                        sum += kLeastSquare + 1e-6f * (a * a + b * b) + u + v;
                    }
                    out(ApartPlanes::difference(half))[x] = (squares - (noise + other)) / sum;
                    out(ApartPlanes::known(half))[x] = 1;
                }
                float distance = 0;
                for (int f = 0; f < layout_.features; ++f) {
                    const float ratio =
                        scale[static_cast<std::size_t>(f)] / layout_.scale[static_cast<std::size_t>(f)];
                    const float d = own_.features().row(f, y)[x] -
                                    rescaled(there.features().row(f, toY)[toX], ratio);
                    distance += d * d /
                                (kFeatureWidth2 +
                                 2 * (own_.features().row(featurePlanes_.error(f), y)[x] +
                                      ratio * ratio * there.features().row(featurePlanes_.error(f), toY)[toX]));
                }
                if (mismatch > 0 && there.motion().channels() > 0) {
                    const float ex = there.motion().row(MotionPlanes::x(back), toY)[toX] +
                                     from->motion().row(MotionPlanes::x(!back), fromY)[fromX],
                                ey = there.motion().row(MotionPlanes::y(back), toY)[toX] +
                                     from->motion().row(MotionPlanes::y(!back), fromY)[fromX];
                    const float e = ex * ex + ey * ey;
                    distance += e == e ? mismatch * e : 100;
                }
                out(ApartPlanes::kFeatures)[x] = distance;
            }
            from = &there;
        }
    }
}

void Merge::mergeRow(int y) {
    static const float sharp = environment("VLX_SHARP", 2), features = environment("VLX_FEATURES", 1);
    const int radiance = layout_.radiance;
    const auto w = static_cast<std::size_t>(width_);
    // Sums over patches of differences and of how many there are.
    std::vector<float> weights(2 * neighbours() * w), columns(2 * w);
    for (std::size_t k = 0; k < neighbours(); ++k) {
        const int first = ApartPlanes::kChannels * static_cast<int>(k);
        for (int half = 0; half < 2; ++half) {
            std::fill(columns.begin(), columns.end(), 0.f);
            for (int row = std::max(0, y - kPatchRadius); row <= std::min(height_ - 1, y + kPatchRadius); ++row) {
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
                for (int i = std::max(0, x - kPatchRadius); i <= std::min(width_ - 1, x + kPatchRadius); ++i) {
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
    std::vector<float> value(static_cast<std::size_t>(std::max(radiance, 2 * layout_.features)));
    for (int x = 0; x < width_; ++x) {
        const auto at = [&](std::size_t k, int half) {
            return weights[(2 * k + static_cast<std::size_t>(half)) * w + static_cast<std::size_t>(x)];
        };
        const auto place = [&](std::size_t k, int plane) {
            return static_cast<int>(apart_.row(ApartPlanes::kChannels * static_cast<int>(k) + plane, y)[x]);
        };
        for (int half = 0; half < 2; ++half) {
            const float n = own_.data().row(planes_.halfCount(half), y)[x];
            float total = n, squares = n;
            for (int c = 0; c < radiance; ++c)
                value[static_cast<std::size_t>(c)] = n * own_.data().row(planes_.mean(half) + c, y)[x];
            for (std::size_t k = 0; k < neighbours(); ++k) {
                const float weight = at(k, half);
                if (weight <= 0) continue;
                const RowRing& data = neighbour(k).data->data();
                const int col = place(k, ApartPlanes::kColumn), row = place(k, ApartPlanes::kRow);
                const float m = data.row(planes_.halfCount(half), row)[col];
                if (m <= 0) continue;
                total += weight * m;
                squares += weight * weight * m;
                for (int c = 0; c < radiance; ++c)
                    value[static_cast<std::size_t>(c)] += weight * m * data.row(planes_.mean(half) + c, row)[col];
            }
            for (int c = 0; c < radiance; ++c)
                merged_.data.row(planes_.mean(half) + c, y)[x] =
                    total > 0 ? value[static_cast<std::size_t>(c)] / total
                              : own_.data().row(planes_.mean(half) + c, y)[x];
            merged_.data.row(planes_.halfCount(half), y)[x] = total > 0 ? total * total / squares : 0;
        }
        merged_.data.row(planes_.count(), y)[x] = merged_.data.row(planes_.halfCount(0), y)[x] +
                                                  merged_.data.row(planes_.halfCount(1), y)[x];
        const float n =
            own_.data().row(planes_.halfCount(0), y)[x] + own_.data().row(planes_.halfCount(1), y)[x];
        float total = n > 0 ? n : 1e-3f;
        for (int f = 0; f < layout_.features; ++f) {
            value[static_cast<std::size_t>(f)] = total * own_.features().row(f, y)[x];
            value[static_cast<std::size_t>(layout_.features + f)] =
                total * total * own_.features().row(featurePlanes_.error(f), y)[x];
        }
        for (std::size_t k = 0; k < neighbours(); ++k) {
            if (at(k, 0) + at(k, 1) <= 0) continue;
            const Neighbour& of = neighbour(k);
            const int col = place(k, ApartPlanes::kColumn), row = place(k, ApartPlanes::kRow);
            float weight = 0;
            for (int half = 0; half < 2; ++half)
                weight += at(k, half) * of.data->data().row(planes_.halfCount(half), row)[col];
            total += weight;
            for (int f = 0; f < layout_.features; ++f) {
                const float ratio =
                    (*of.scale)[static_cast<std::size_t>(f)] / layout_.scale[static_cast<std::size_t>(f)];
                value[static_cast<std::size_t>(f)] +=
                    weight * rescaled(of.data->features().row(f, row)[col], ratio);
                value[static_cast<std::size_t>(layout_.features + f)] +=
                    weight * weight * ratio * ratio *
                    of.data->features().row(featurePlanes_.error(f), row)[col];
            }
        }
        for (int f = 0; f < layout_.features; ++f) {
            merged_.features.row(f, y)[x] = value[static_cast<std::size_t>(f)] / total;
            merged_.features.row(featurePlanes_.error(f), y)[x] =
                value[static_cast<std::size_t>(layout_.features + f)] / (total * total);
        }
    }
}

}  // namespace vlx
