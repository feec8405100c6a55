#pragma once

#include <cstddef>
#include <vector>

#include "reconstruct/common/row_ring.h"

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
    /// channels * kTileSide * kTileSide each, and a vector's length to be read past. scale: of differences,
    /// floor / 2 + 1e-6 z^2 + v: a thousandth of the value is no difference.
    std::vector<float> value, variance, scale;

    void resize(int count);
    void setScale(float absoluteFloor);  ///< of what values and variances are

    float* values(int channel) { return value.data() + plane(channel); }
    float* variances(int channel) { return variance.data() + plane(channel); }
    const float* values(int channel) const { return value.data() + plane(channel); }
    const float* variances(int channel) const { return variance.data() + plane(channel); }
    const float* scales(int channel) const { return scale.data() + plane(channel); }

  private:
    static std::size_t plane(int channel) {
        return static_cast<std::size_t>(channel) * kTileSide * kTileSide;
    }
};

/// Copies a tile with its margin out of one plane. The ring must hold its rows.
void copyTile(const RowRing& ring, int plane, int x, int y, int width, int height, float* out);

/// For each pixel p of the tile the distance to p + (dx, dy), |dx|, |dy| <= kMaxReach:
///     d = mean over patch and channels of ((z1 - z2)^2 - (v1 + min(v1, v2))) / (scale1 + scale2).
/// May be negative. Row r of the tile goes to out + r * outStride. scratch: any.
void patchDistances(const PatchTile& tile, int dx, int dy, std::vector<float>& scratch, float* out,
                    std::size_t outStride = kTile);

/// Length of the rows that patchDistancesFrom() writes.
inline constexpr int kDistanceStride = (2 * kMaxReach + 1 + 7) / 8 * 8;

/// The same of one pixel of the tile, from its corner, to all up to kMaxReach from it: that to p + (dx, dy)
/// is out[(dy + kMaxReach) * kDistanceStride + dx + kMaxReach].
void patchDistancesFrom(const PatchTile& tile, int column, int row, float* out);

}  // namespace vlx
