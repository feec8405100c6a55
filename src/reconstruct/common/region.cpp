#include "reconstruct/common/region.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <map>
#include <optional>
#include <vector>

namespace vlx {

namespace {

int cellAlong(double position, int pixel, int cells) {
    return static_cast<int>(std::clamp(std::floor((position - pixel) * cells), 0.0, cells - 1.0));
}

/// The samples of a region, summed by cell: a grid of cells, row by row.
struct Grid {
    int pixelsWide, pixelsHigh, cells;  // cells along a pixel's side
    std::vector<double> count;
    Eigen::ArrayXXd sum, square;  // channels x cells, about a reference value

    Grid(const Window& region, int cellsPerPixel, Eigen::Index channels)
        : pixelsWide(region.width),
          pixelsHigh(region.height),
          cells(cellsPerPixel),
          count(static_cast<std::size_t>(size())),
          sum(Eigen::ArrayXXd::Zero(channels, size())),
          square(sum) {}

    Eigen::Index width() const { return Eigen::Index{pixelsWide} * cells; }
    Eigen::Index size() const { return width() * pixelsHigh * cells; }
    Eigen::Index pixels() const { return Eigen::Index{pixelsWide} * pixelsHigh; }
    /// The cell (cx, cy) of a pixel, and the pixel of a cell.
    Eigen::Index cell(Eigen::Index pixel, int cx, int cy) const {
        return (pixel / pixelsWide * cells + cy) * width() + pixel % pixelsWide * cells + cx;
    }
    Eigen::Index pixel(Eigen::Index cell) const {
        return cell / width() / cells * pixelsWide + cell % width() / cells;
    }
    double at(Eigen::Index cell) const { return count[static_cast<std::size_t>(cell)]; }
};

/// Sums over some cells.
struct Group {
    double count = 0;
    Eigen::ArrayXd sum, square;

    explicit Group(Eigen::Index channels)
        : sum(Eigen::ArrayXd::Zero(channels)), square(Eigen::ArrayXd::Zero(channels)) {}

    /// Adds size x size cells of a pixel.
    void add(const Grid& grid, Eigen::Index pixel, int cx, int cy, int size) {
        for (int i = 0; i < size * size; ++i) {
            const Eigen::Index cell = grid.cell(pixel, cx + i % size, cy + i / size);
            count += grid.at(cell);
            sum += grid.sum.col(cell);
            square += grid.square.col(cell);
        }
    }
    void clear() {
        count = 0;
        sum.setZero();
        square.setZero();
    }
    auto squaresAboutMean() const { return (square - sum * sum / count).max(0.0); }
};

/// The pooled variance of one sample within the cells of `pixels`, of the finest size that holds two samples
/// on average; nothing when no pixel holds two.
std::optional<Eigen::VectorXd> varianceWithin(const Grid& grid, const std::vector<Eigen::Index>& pixels) {
    for (int size = 1; size <= grid.cells && grid.cells % size == 0; size *= 2) {
        Eigen::ArrayXd squares = Eigen::ArrayXd::Zero(grid.sum.rows());
        double freedom = 0, samples = 0;
        Group group(grid.sum.rows());
        for (const Eigen::Index pixel : pixels)
            for (int y = 0; y < grid.cells; y += size)
                for (int x = 0; x < grid.cells; x += size) {
                    group.clear();
                    group.add(grid, pixel, x, y, size);
                    if (group.count == 0) continue;
                    squares += group.squaresAboutMean();
                    freedom += group.count - 1;
                    samples += group.count;
                }
        const bool enough = 2 * freedom >= samples;
        if (freedom > 0 && (enough || size == grid.cells)) return (squares / freedom).matrix();
    }
    return std::nullopt;
}

/// The variance between the means of `pixels`, image and noise together.
Eigen::VectorXd varianceBetween(const Grid& grid, const std::vector<Eigen::Index>& pixels) {
    Group means(grid.sum.rows());
    for (const Eigen::Index pixel : pixels) {
        Group group(grid.sum.rows());
        group.add(grid, pixel, 0, 0, grid.cells);
        means.count += 1;
        means.sum += group.sum / group.count;
        means.square += (group.sum / group.count).square();
    }
    return (means.squaresAboutMean() / (means.count - 1)).matrix();
}

/// Which pixels were sampled alike: counts from 3 * 4^k to less than four times that, so that a power of two
/// less a few dropped samples stays with its like.
int samplingClass(double count) { return static_cast<int>(std::floor(std::log2(count / 3) / 2)); }

/// Fills errorVariances and varianceKnown, given the rest.
void estimateErrors(RegionData& data, const Grid& grid, const std::vector<Eigen::Index>& pixelOfDatum) {
    std::vector<double> pixelCount(static_cast<std::size_t>(grid.pixels()));
    for (std::size_t i = 0; i < pixelOfDatum.size(); ++i)
        pixelCount[static_cast<std::size_t>(pixelOfDatum[i])] += data.counts[static_cast<Eigen::Index>(i)];
    std::map<int, std::vector<Eigen::Index>> classes;
    for (Eigen::Index p = 0; p < grid.pixels(); ++p)
        if (const double count = pixelCount[static_cast<std::size_t>(p)]; count > 0)
            classes[samplingClass(count)].push_back(p);

    std::map<int, Eigen::VectorXd> variances;
    for (const auto& [key, pixels] : classes)
        if (auto variance = varianceWithin(grid, pixels)) variances[key] = std::move(*variance);
    data.errorVariances = Eigen::MatrixXd::Zero(data.size(), grid.sum.rows());
    data.varianceKnown = !variances.empty();
    if (!data.varianceKnown) return;
    for (const auto& [key, pixels] : classes)
        if (!variances.contains(key))
            variances[key] = pixels.size() > 1 ? varianceBetween(grid, pixels) : variances.begin()->second;
    for (Eigen::Index i = 0; i < data.size(); ++i) {
        const auto pixel = static_cast<std::size_t>(pixelOfDatum[static_cast<std::size_t>(i)]);
        data.errorVariances.row(i) =
            variances.at(samplingClass(pixelCount[pixel])).transpose() / data.counts[i];
    }
}

}  // namespace

int RegionData::pixelOf(Eigen::Index i) const {
    // Clamped before it is an int: positions of other conventions may be anywhere.
    const auto within = [](double position, int first, int count) {
        return static_cast<int>(std::clamp(std::floor(position) - first, 0.0, count - 1.0));
    };
    return within(positions(i, 1), pixels.y, pixels.height) * pixels.width +
           within(positions(i, 0), pixels.x, pixels.width);
}

RegionData gatherRegion(const SampleBand& band, const BandLayout& layout, const Window& region,
                        int cellsPerPixel) {
    assert(region.x >= band.x && region.x + region.width <= band.x + band.width);
    assert(region.y >= band.y && region.y + region.height <= band.y + band.height);
    const bool positioned = layout.x >= 0 && layout.y >= 0;
    const int cells = positioned ? cellsPerPixel : 1;
    const auto channels = static_cast<Eigen::Index>(layout.radiance.size());

    RegionData data;
    data.pixels = region;
    data.cellsPerPixel = cells;
    Grid grid(region, cells, channels);
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
                if (!z.head(std::min<Eigen::Index>(3, channels)).isFinite().all()) {
                    ++data.dropped;
                    continue;
                }
                z = z.isFinite().select(z, 0.0);  // a bad alpha does not cost the radiance
                int cx = cells / 2, cy = cx;
                if (positioned) {
                    const auto px = static_cast<double>(band.values[static_cast<std::size_t>(layout.x)][s]);
                    const auto py = static_cast<double>(band.values[static_cast<std::size_t>(layout.y)][s]);
                    if (std::isfinite(px) && std::isfinite(py)) {
                        cx = cellAlong(px, column, cells);
                        cy = cellAlong(py, row, cells);
                    }
                }
                if (data.samples++ == 0) reference = z;
                z -= reference;
                const Eigen::Index cell =
                    grid.cell(Eigen::Index{row - region.y} * region.width + column - region.x, cx, cy);
                grid.count[static_cast<std::size_t>(cell)] += 1;
                grid.sum.col(cell) += z;
                grid.square.col(cell) += z * z;
            }
        }

    const auto n = static_cast<Eigen::Index>(
        std::count_if(grid.count.begin(), grid.count.end(), [](double k) { return k > 0; }));
    data.positions.resize(n, 2);
    data.means.resize(n, channels);
    data.counts.resize(n);
    std::vector<Eigen::Index> pixelOfDatum;
    for (Eigen::Index cell = 0, i = 0; cell < grid.size(); ++cell) {
        const double k = grid.at(cell);
        if (k == 0) continue;
        data.positions.row(i) << region.x + (static_cast<double>(cell % grid.width()) + 0.5) / cells,
            region.y + (static_cast<double>(cell / grid.width()) + 0.5) / cells;
        data.means.row(i) = (reference + grid.sum.col(cell) / k).matrix().transpose();
        data.counts[i++] = k;
        pixelOfDatum.push_back(grid.pixel(cell));
    }
    estimateErrors(data, grid, pixelOfDatum);
    return data;
}

}  // namespace vlx
