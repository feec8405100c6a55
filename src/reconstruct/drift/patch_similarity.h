#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "reconstruct/common/row_ring.h"
#include "reconstruct/drift/gram.h"

/// Distances between the patches of pixels of a tile, in units of their noise.
namespace vlx {

inline constexpr int kTile = 32;        ///< side of a tile in pixels
inline constexpr int kPatchRadius = 3;  ///< patches of 7 x 7 pixels
inline constexpr int kMaxReach = 15;    ///< farthest pixel compared, along each axis
inline constexpr int kTileMargin = kMaxReach + kPatchRadius;
inline constexpr int kTileSide = kTile + 2 * kTileMargin;  ///< with the margin: 68

/// A tile with its margin, channel by channel; coordinates beyond the image repeat its border.
struct PatchTile {
    int x = 0, y = 0;  ///< the tile's first pixel, without margin
    int channels = 0;
    /// channels * kTileSide * kTileSide each, and a vector's length to be read past.
    std::vector<float> value, variance;
    /// Over channels, sums of v, and of floor / 2 + 1e-6 z^2 + v: a thousandth of the value is no difference.
    std::vector<float> noise, scale;

    void resize(int count);
    void setScale(float absoluteFloor);  ///< noise and scale, of what values and variances are

    float* values(int channel) { return value.data() + plane(channel); }
    float* variances(int channel) { return variance.data() + plane(channel); }
    const float* values(int channel) const { return value.data() + plane(channel); }
    const float* variances(int channel) const { return variance.data() + plane(channel); }
    static std::size_t plane(int channel) {
        return static_cast<std::size_t>(channel) * kTileSide * kTileSide;
    }
};

/// Copies a tile with its margin out of one plane. The ring must hold its rows.
void copyTile(const RowRing& ring, int plane, int x, int y, int width, int height, float* out);

/// For each pixel p of the tile the distance to p + (dx, dy), |dx|, |dy| <= kMaxReach:
///     d = mean over the patch of (sum over channels of (z1 - z2)^2 - (n1 + min(n1, n2))) / (scale1 +
///     scale2).
/// May be negative. out: kTile x kTile. scratch: any.
void patchDistances(const PatchTile& tile, int dx, int dy, std::vector<float>& scratch, float* out);

/// The same of one pixel, from the tile's corner, to all in its surroundings: that to p + (dx, dy) is
/// out[around.at(dx, dy)]. The pixel may lie kTileMargin - kPatchRadius - reach outside the tile.
void patchDistancesFrom(const PatchTile& tile, int column, int row, const Surroundings& around, float* out);

/// Pixels of the tile, at every one of the columns and rows, and their distances as above.
struct PatchLattice {
    std::vector<int> columns, rows;
    Surroundings around{0};
    std::vector<float> distances;

    /// Those of the pixel at columns[i], rows[j].
    float* of(std::size_t i, std::size_t j) {
        return distances.data() + (j * columns.size() + i) * static_cast<std::size_t>(around.size());
    }
};

/// Fills the distances of lattices: what pixels differ by is found once for all.
void latticeDistances(const PatchTile& tile, std::span<PatchLattice* const> lattices,
                      std::vector<float>& scratch);

}  // namespace vlx
