#include "variolux/reconstruct/region.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

namespace vlx {

namespace {

int cellAlong(double position, int pixel, int cells) {
    return static_cast<int>(std::clamp(std::floor((position - pixel) * cells), 0.0, cells - 1.0));
}

/// Sums over square groups of cells, 2^level cells wide, of a region's grid.
struct Pooled {
    Eigen::VectorXd squares;  // within groups, a channel
    double freedom = 0;       // samples - groups
    double samples = 0;
};

Pooled poolWithinGroups(const std::vector<double>& count, const Eigen::ArrayXXd& sum,
                        const Eigen::ArrayXXd& square, int gridWidth, int gridHeight, int group) {
    const Eigen::Index channels = sum.rows();
    Pooled pooled;
    pooled.squares = Eigen::VectorXd::Zero(channels);
    for (int y0 = 0; y0 < gridHeight; y0 += group)
        for (int x0 = 0; x0 < gridWidth; x0 += group) {
            double n = 0;
            Eigen::ArrayXd s = Eigen::ArrayXd::Zero(channels), q = Eigen::ArrayXd::Zero(channels);
            for (int y = y0; y < y0 + group; ++y)
                for (int x = x0; x < x0 + group; ++x) {
                    const int cell = y * gridWidth + x;
                    if (count[static_cast<std::size_t>(cell)] == 0) continue;
                    n += count[static_cast<std::size_t>(cell)];
                    s += sum.col(cell);
                    q += square.col(cell);
                }
            if (n == 0) continue;
            pooled.samples += n;
            pooled.freedom += n - 1;
            if (n > 1) pooled.squares.array() += (q - s * s / n).max(0.0);
        }
    return pooled;
}

}  // namespace

RegionData gatherRegion(const SampleBand& band, const BandLayout& layout, const Window& region,
                        int cellsPerPixel) {
    assert(region.x >= band.x && region.x + region.width <= band.x + band.width);
    assert(region.y >= band.y && region.y + region.height <= band.y + band.height);
    const bool positioned = layout.x >= 0 && layout.y >= 0;
    const int cells = positioned ? cellsPerPixel : 1;
    const int gridWidth = region.width * cells, gridHeight = region.height * cells;
    const auto channels = static_cast<Eigen::Index>(layout.radiance.size());

    RegionData data;
    data.pixels = region;
    data.cellsPerPixel = cells;

    const Eigen::Index grid = Eigen::Index{gridWidth} * gridHeight;
    std::vector<double> count(static_cast<std::size_t>(grid), 0.0);
    Eigen::ArrayXXd sum = Eigen::ArrayXXd::Zero(channels, grid);
    Eigen::ArrayXXd square = Eigen::ArrayXXd::Zero(channels, grid);
    Eigen::ArrayXd reference(channels), z(channels);

    for (int row = region.y; row < region.y + region.height; ++row)
        for (int column = region.x; column < region.x + region.width; ++column) {
            const std::size_t pixel =
                static_cast<std::size_t>(row - band.y) * static_cast<std::size_t>(band.width) +
                static_cast<std::size_t>(column - band.x);
            for (std::uint64_t s = band.offsets[pixel]; s < band.offsets[pixel + 1]; ++s) {
                for (Eigen::Index c = 0; c < channels; ++c)
                    z[c] = static_cast<double>(band.values[static_cast<std::size_t>(
                        layout.radiance[static_cast<std::size_t>(c)])][s]);
                int cx = 0, cy = 0;
                bool usable = z.isFinite().all();
                if (positioned && usable) {
                    const auto px = static_cast<double>(band.values[static_cast<std::size_t>(layout.x)][s]);
                    const auto py = static_cast<double>(band.values[static_cast<std::size_t>(layout.y)][s]);
                    usable = std::isfinite(px) && std::isfinite(py);
                    if (usable) {
                        cx = cellAlong(px, column, cells);
                        cy = cellAlong(py, row, cells);
                    }
                }
                if (!usable) {
                    ++data.dropped;
                    continue;
                }
                if (data.samples++ == 0) reference = z;
                z -= reference;
                const int cell =
                    ((row - region.y) * cells + cy) * gridWidth + (column - region.x) * cells + cx;
                count[static_cast<std::size_t>(cell)] += 1;
                sum.col(cell) += z;
                square.col(cell) += z * z;
            }
        }

    const auto n =
        static_cast<Eigen::Index>(std::count_if(count.begin(), count.end(), [](double k) { return k > 0; }));
    data.positions.resize(n, 2);
    data.means.resize(n, channels);
    data.counts.resize(n);
    Eigen::Index i = 0;
    for (int gy = 0; gy < gridHeight; ++gy)
        for (int gx = 0; gx < gridWidth; ++gx) {
            const int cell = gy * gridWidth + gx;
            const double k = count[static_cast<std::size_t>(cell)];
            if (k == 0) continue;
            data.positions.row(i) << region.x + (gx + 0.5) / cells, region.y + (gy + 0.5) / cells;
            data.means.row(i) = (reference + sum.col(cell) / k).matrix().transpose();
            data.counts[i++] = k;
        }

    data.sampleVariance = Eigen::VectorXd::Zero(channels);
    for (int group = 1; group <= cells; group *= 2) {
        if (cells % group != 0) break;
        const Pooled pooled = poolWithinGroups(count, sum, square, gridWidth, gridHeight, group);
        // freedom >= samples / 2 means two samples a group or more; the whole pixel is the last resort.
        const bool enough = 2 * pooled.freedom >= pooled.samples;
        if (pooled.freedom > 0 && (enough || group == cells)) {
            data.sampleVariance = pooled.squares / pooled.freedom;
            data.varianceKnown = true;
            break;
        }
    }
    return data;
}

}  // namespace vlx
