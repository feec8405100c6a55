#include "reconstruct/drift/half_resolution.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace vlx {

namespace {

constexpr double kPrior = 10;  // l, in data: of a weight of one half

}  // namespace

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
        const double n = samplesIn(fine_.data.row(data.count(), y)[x]);
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
