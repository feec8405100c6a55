#include "reconstruct/common/gap_field.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/common/rebin.h"

namespace vlx {

namespace {

constexpr int kBlock = 8;

/// Blocks of one scale: weighted sums, then means, of `values` numbers each.
struct BlockGrid {
    int columns, rows;
    std::vector<float> sums, weights;

    float* at(int col, int row, int values) {
        return sums.data() + static_cast<std::size_t>(row * columns + col) * static_cast<std::size_t>(values);
    }
    float& weight(int col, int row) { return weights[static_cast<std::size_t>(row * columns + col)]; }
};

BlockGrid makeGrid(int columns, int rows, int values) {
    const auto blocks = static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows);
    return {columns, rows, std::vector<float>(blocks * static_cast<std::size_t>(values)),
            std::vector<float>(blocks)};
}

/// The two blocks that a place (in blocks, centres at halves) lies between, and the share of the second.
struct Between {
    int first, second;
    float share;
};

Between between(double place, int blocks) {
    const double from = std::clamp(place - 0.5, 0.0, blocks - 1.0);
    const int first = static_cast<int>(from);
    return {first, std::min(first + 1, blocks - 1), static_cast<float>(from - first)};
}

/// From the centre of each block to that of the nearest one with samples, in pixels: the chamfer distance of
/// steps of 1 and sqrt(2) blocks, in two passes (Borgefors 1986); at most 8 % too long.
std::vector<float> distances(const BlockGrid& grid) {
    constexpr float kStep = kBlock, kDiagonal = 1.41421356f * kBlock;
    std::vector<float> result(grid.weights.size());
    for (std::size_t b = 0; b < result.size(); ++b) result[b] = grid.weights[b] > 0 ? 0 : 1e9f;
    const auto pass = [&](int col, int row, int side) {  // side -1: from above, 1: from below
        float& here = result[static_cast<std::size_t>(row * grid.columns + col)];
        const auto look = [&](int dx, int dy, float step) {
            const int x = col + dx, y = row + dy;
            if (x < 0 || x >= grid.columns || y < 0 || y >= grid.rows) return;
            here = std::min(here, result[static_cast<std::size_t>(y * grid.columns + x)] + step);
        };
        look(side, 0, kStep);
        look(0, side, kStep);
        look(side, side, kDiagonal);
        look(-side, side, kDiagonal);
    };
    for (int row = 0; row < grid.rows; ++row)
        for (int col = 0; col < grid.columns; ++col) pass(col, row, -1);
    for (int row = grid.rows; row-- > 0;)
        for (int col = grid.columns; col-- > 0;) pass(col, row, 1);
    return result;
}

}  // namespace

GapField::GapField(const SampleSource& dump, const SampleLayout& layout, const GatheredPlanes& planes)
    : values_(layout.radiance + layout.features + 1) {
    const DumpHeader& header = dump.header();
    const int width = header.data.width, height = header.data.height, distance = values_ - 1;
    std::vector<BlockGrid> grids;
    grids.push_back(makeGrid((width + kBlock - 1) / kBlock, (height + kBlock - 1) / kBlock, values_));
    RowRing ring(width, planes.channels(), 1);
    SampleBand band;
    for (int y = 0; y < height; ++y) {
        if (y % kBlock == 0) band = readRows(dump, layout, 1, y, std::min(kBlock, height - y));
        gatherRow(band, layout, planes, y % kBlock, 0, ring, 0);
        for (int x = 0; x < width; ++x) {
            const auto of = [&](int plane) { return ring.row(plane, 0)[x]; };
            if (of(planes.count()) == 0) continue;
            float* sums = grids[0].at(x / kBlock, y / kBlock, values_);
            ++grids[0].weight(x / kBlock, y / kBlock);
            for (int c = 0; c < layout.radiance; ++c)
                sums[c] += (of(planes.halfCount(0)) * of(planes.mean(0) + c) +
                            of(planes.halfCount(1)) * of(planes.mean(1) + c)) /
                           of(planes.count());
            for (int f = 0; f < layout.features; ++f) sums[layout.radiance + f] += of(planes.feature() + f);
        }
    }
    const std::vector<float> far = distances(grids[0]);
    // Pull: a block of the next scale is the mean of its four, each counting no more than a full one.
    while (true) {
        BlockGrid& fine = grids.back();
        for (std::size_t b = 0; b < fine.weights.size(); ++b) {
            float* sums = fine.sums.data() + b * static_cast<std::size_t>(values_);
            if (fine.weights[b] == 0) continue;
            for (int k = 0; k < distance; ++k) sums[k] /= fine.weights[b];
            fine.weights[b] = std::min(1.f, fine.weights[b]);
        }
        if (fine.columns == 1 && fine.rows == 1) break;
        BlockGrid coarse = makeGrid((fine.columns + 1) / 2, (fine.rows + 1) / 2, values_);
        for (int row = 0; row < fine.rows; ++row)
            for (int col = 0; col < fine.columns; ++col) {
                const float w = fine.weight(col, row);
                float* to = coarse.at(col / 2, row / 2, values_);
                const float* from = fine.at(col, row, values_);
                for (int k = 0; k < distance; ++k) to[k] += w * from[k];
                coarse.weight(col / 2, row / 2) += w;
            }
        grids.push_back(std::move(coarse));
    }
    // Push: blocks without samples are read off the next scale, between its blocks.
    for (std::size_t l = grids.size() - 1; l-- > 0;) {
        BlockGrid &fine = grids[l], &coarse = grids[l + 1];
        for (int row = 0; row < fine.rows; ++row)
            for (int col = 0; col < fine.columns; ++col) {
                if (fine.weight(col, row) > 0) continue;
                const Between x = between((col + 0.5) / 2, coarse.columns),
                              y = between((row + 0.5) / 2, coarse.rows);
                float* to = fine.at(col, row, values_);
                for (int k = 0; k < values_; ++k) {
                    const auto line = [&](int r) {
                        return (1 - x.share) * coarse.at(x.first, r, values_)[k] +
                               x.share * coarse.at(x.second, r, values_)[k];
                    };
                    to[k] = (1 - y.share) * line(y.first) + y.share * line(y.second);
                }
            }
    }
    columns_ = grids[0].columns;
    rows_ = grids[0].rows;
    blocks_ = std::move(grids[0].sums);
    for (std::size_t b = 0; b < far.size(); ++b)
        blocks_[b * static_cast<std::size_t>(values_) + static_cast<std::size_t>(distance)] = far[b];
}

double GapField::at(double x, double y, std::vector<float>& values) const {
    const Between h = between(x / kBlock, columns_), v = between(y / kBlock, rows_);
    const auto value = [&](int col, int row, int k) {
        return blocks_[static_cast<std::size_t>((row * columns_ + col) * values_ + k)];
    };
    values.resize(static_cast<std::size_t>(values_));
    for (int k = 0; k < values_; ++k) {
        const auto line = [&](int row) {
            return (1 - h.share) * value(h.first, row, k) + h.share * value(h.second, row, k);
        };
        values[static_cast<std::size_t>(k)] = (1 - v.share) * line(v.first) + v.share * line(v.second);
    }
    const double distance = static_cast<double>(values.back());
    values.pop_back();
    return std::max(0.0, distance - kBlock / 2.0);  // samples reach to their blocks' borders
}

std::uint64_t GapField::bytes(const SampleSource& dump, const SampleLayout& layout) {
    const auto blocks = [](int pixels) { return static_cast<std::uint64_t>(pixels / kBlock + 1); };
    return 2 * blocks(dump.header().data.width) * blocks(dump.header().data.height) *
           static_cast<std::uint64_t>(layout.radiance + layout.features + 2) * sizeof(float);
}

}  // namespace vlx
