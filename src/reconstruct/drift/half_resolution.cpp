#include "reconstruct/drift/half_resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace vlx {

namespace {

constexpr double kPrior = 10;  // l, in data: of a weight of one half

/// Calls f(x, y) for the fine pixels that a coarse pixel stands for.
template <class F>
void forParts(int width, int height, int x, int y, F f) {
    for (int row = 2 * y; row < std::min(height, 2 * y + 2); ++row)
        for (int col = 2 * x; col < std::min(width, 2 * x + 2); ++col) f(col, row);
}

}  // namespace

void halveRow(const PixelRows& fine, int width, int height, int radiance, int features, int y,
              PixelRows& coarse) {
    const DataPlanes planes{radiance};
    const RowRing& data = fine.data;
    for (int x = 0; 2 * x < width; ++x) {
        const auto put = [&](RowRing& ring, int plane, double value) {
            ring.row(plane, y)[x] = static_cast<float>(value);
        };
        double parts = 0, stated = 1, count = 0, gap = std::numeric_limits<double>::infinity();
        forParts(width, height, x, y, [&](int col, int row) {
            ++parts;
            stated = std::min(stated, static_cast<double>(data.row(planes.stated(), row)[col]));
            gap = std::min(gap, static_cast<double>(data.row(planes.gap(), row)[col]));
        });
        for (int half = 0; half < 2; ++half) {
            double known = 0, inverse = 0;
            forParts(width, height, x, y, [&](int col, int row) {
                const float n = data.row(planes.halfCount(half), row)[col];
                if (n <= 0) return;
                ++known;
                inverse += 1 / static_cast<double>(n);
            });
            const double samples = known > 0 ? known * known / inverse : 0;
            put(coarse.data, planes.halfCount(half), samples);
            count += samples;
            for (int c = 0; c < planes.radiance; ++c) {
                double sum = 0;
                forParts(width, height, x, y, [&](int col, int row) {
                    if (known > 0 && data.row(planes.halfCount(half), row)[col] <= 0) return;
                    sum += static_cast<double>(data.row(planes.mean(half) + c, row)[col]);
                });
                put(coarse.data, planes.mean(half) + c, sum / (known > 0 ? known : parts));
            }
        }
        put(coarse.data, planes.count(), count);
        put(coarse.data, planes.stated(), stated);
        put(coarse.data, planes.gap(), gap / 2);
        for (int k = 0; k < SquaresPlanes::kChannels; ++k) {
            double sum = 0;
            forParts(width, height, x, y,
                     [&](int col, int row) { sum += static_cast<double>(fine.squares.row(k, row)[col]); });
            put(coarse.squares, k, sum);
        }
        const FeaturePlanes raw{features};
        for (int f = 0; f < features; ++f) {
            double value = 0, error = 0, ofHalf[2] = {}, known[2] = {};
            forParts(width, height, x, y, [&](int col, int row) {
                const double mean = fine.raw.row(raw.value(f), row)[col];
                const double difference = fine.raw.row(raw.difference(f), row)[col];
                value += mean;
                error += static_cast<double>(fine.raw.row(raw.error(f), row)[col]);
                for (int half = 0; half < 2; ++half) {
                    if (data.row(planes.halfCount(half), row)[col] <= 0) continue;
                    ofHalf[half] += half == 0 ? mean + difference : mean - difference;
                    ++known[half];
                }
            });
            put(coarse.raw, raw.value(f), value / parts);
            put(coarse.raw, raw.error(f), error / (parts * parts));
            const bool both = known[0] > 0 && known[1] > 0;
            put(coarse.raw, raw.difference(f), both ? (ofHalf[0] / known[0] - ofHalf[1] / known[1]) / 2 : 0);
        }
    }
}

void Correction::differenceRow(int y) {
    const int width = coarse_.width, planes = planes_.radiance + 6;  // the value's and the halves'
    // C - down(K) of the two coarse rows around y, weighted; then between columns.
    const int near = y / 2, next = std::clamp(near + (y % 2 == 1 ? 1 : -1), 0, coarse_.height - 1);
    std::vector<double> low(static_cast<std::size_t>(width));
    for (int k = 0; k < planes; ++k) {
        for (int x = 0; x < width; ++x) {
            const auto apart = [&](int row) {
                double sum = 0, parts = 0;
                forParts(fine_.width, fine_.height, x, row, [&](int i, int j) {
                    sum += static_cast<double>(fine_.combined.row(k, j)[i]);
                    ++parts;
                });
                return static_cast<double>(coarse_.combined.row(k, row)[x]) - sum / parts;
            };
            low[static_cast<std::size_t>(x)] = 0.75 * apart(near) + 0.25 * apart(next);
        }
        float* const out = differences_.row(k, y);
        for (int x = 0; x < fine_.width; ++x) {
            const int beside = std::clamp(x / 2 + (x % 2 == 1 ? 1 : -1), 0, width - 1);
            out[x] = static_cast<float>(0.75 * low[static_cast<std::size_t>(x / 2)] +
                                        0.25 * low[static_cast<std::size_t>(beside)]);
        }
    }
    const DataPlanes data{planes_.radiance};
    for (int x = 0; x < fine_.width; ++x) {
        const double n = std::max(1.f, fine_.data.row(data.count(), y)[x]);
        double variance = 0, top = 0, gain = 0, square = 0;
        for (int c = 0; c < 3; ++c) {
            variance += 2 * static_cast<double>(fine_.variances.row(c, y)[x]) / n / 3;
            for (int half = 0; half < 2; ++half) {
                const double k = fine_.combined.row(planes_.half(half) + c, y)[x];
                const double d = differences_.row(apart_.half(half) + c, y)[x];
                top = std::max({top, k * k, (k + d) * (k + d)});
                if (fine_.data.row(data.halfCount(1 - half), y)[x] == 0) continue;
                gain += d * (static_cast<double>(fine_.data.row(data.mean(1 - half) + c, y)[x]) - k);
                square += d * d;
            }
        }
        const double unit = 1 / (variance + 1e-8 * top + 1e-300);
        differences_.row(apart_.gain(), y)[x] = static_cast<float>(gain * unit);
        differences_.row(apart_.square(), y)[x] = static_cast<float>(square * unit);
    }
}

void Correction::correctRow(int y) {
    const int width = fine_.width, height = fine_.height;
    const auto side = [](int d) { return (kReach + 1.0 - std::abs(d)) / (kReach + 1.0); };
    std::vector<double> gains(static_cast<std::size_t>(width)), squares(gains.size());
    for (int row = std::max(0, y - kReach); row <= std::min(height - 1, y + kReach); ++row)
        for (int x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(x);
            gains[i] += side(row - y) * static_cast<double>(differences_.row(apart_.gain(), row)[x]);
            squares[i] += side(row - y) * static_cast<double>(differences_.row(apart_.square(), row)[x]);
        }
    for (int x = 0; x < width; ++x) {
        double gain = 0, square = 0;
        for (int col = std::max(0, x - kReach); col <= std::min(width - 1, x + kReach); ++col) {
            gain += side(col - x) * gains[static_cast<std::size_t>(col)];
            square += side(col - x) * squares[static_cast<std::size_t>(col)];
        }
        const double w = std::clamp((gain + kPrior / 2) / (square + kPrior), 0.0, 1.0);
        for (int k = 0; k < planes_.radiance + 6; ++k)
            corrected_.row(k, y)[x] = static_cast<float>(fine_.combined.row(k, y)[x] +
                                                         w * static_cast<double>(differences_.row(k, y)[x]));
        for (int c = 0; c < 3; ++c) {
            const double d = differences_.row(apart_.value() + c, y)[x];
            const double ofFine = fine_.combined.row(planes_.variance() + c, y)[x];
            const double ofCoarse =
                std::min<double>(ofFine, coarse_.combined.row(planes_.variance() + c, y / 2)[x / 2]);
            const double kept = (1 - w) * (1 - w);
            corrected_.row(planes_.variance() + c, y)[x] =
                static_cast<float>(kept * ofFine + (1 - kept) * ofCoarse + w * (1 - w) * d * d);
        }
        corrected_.row(planes_.leverage(), y)[x] = fine_.combined.row(planes_.leverage(), y)[x];
    }
}

}  // namespace vlx
