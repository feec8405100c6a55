#include "reconstruct/drift/patch_similarity.h"

#include <algorithm>
#include <cstdlib>

#include "base/simd.h"

namespace vlx {

namespace {

using simd::Eight;
using simd::load;
using simd::store;

constexpr int kSpan = kTile + 2 * kPatchRadius;  // pixels whose differences a tile's patches use
constexpr int kSpanStride = (kSpan + 7) / 8 * 8;
constexpr float kRelativeFloor = 1e-6f;
constexpr int kPatchPixels = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);
constexpr int kCorner = (kTileMargin - kPatchRadius) * (kTileSide + 1);

/// What two pixels differ by, of the squares of their values' differences.
[[gnu::always_inline]] inline Eight difference(Eight squares, Eight noise, Eight otherNoise, Eight scales) {
    return (squares - (noise + simd::minimum(noise, otherNoise))) / scales;
}

/// Differences of kSpan rows of pixels from those `shift` further on.
template <int Channels>
[[gnu::always_inline]] inline void sumDifferences(const PatchTile& tile, int shift, float* out) {
    const float *const z = tile.values(0), *const v = tile.noise.data(), *const s = tile.scale.data();
    for (int row = 0; row < kSpan; ++row)
        for (int i = 0; i < kSpanStride; i += 8) {
            const int here = kCorner + row * kTileSide + i, there = here + shift;
            Eight squares = {};
            for (int c = 0; c < Channels; ++c) {
                const float* const of = z + PatchTile::plane(c);
                const Eight d = load<Eight>(of + here) - load<Eight>(of + there);
                squares += d * d;
            }
            store(out + row * kSpanStride + i,
                  difference(squares, load<Eight>(v + here), load<Eight>(v + there),
                             load<Eight>(s + here) + load<Eight>(s + there)));
        }
}

VLX_WIDE void sumDifferences(const PatchTile& tile, int shift, float* out) {
    switch (tile.channels) {
        case 1:
            return sumDifferences<1>(tile, shift, out);
        case 2:
            return sumDifferences<2>(tile, shift, out);
        default:
            return sumDifferences<3>(tile, shift, out);
    }
}

/// Sums over patches: kSpan rows to kTile x kTile; seven are three pairs and one, and pairs are summed once.
/// In passes over the whole tile: what was just stored is not loaded again at once.
VLX_WIDE void sumPatches(const float* __restrict in, float scale, float* __restrict scratch,
                         float* __restrict out) {
    static_assert(kPatchRadius == 3);
    constexpr int kPairs = (kSpan - 1) * kSpanStride, kColumns = kTile * kSpanStride;
    float* __restrict pairs = scratch;  // of rows r and r + 1
    float* __restrict columns = pairs + kPairs;
    float* __restrict two = columns + kColumns + 8;
    for (int i = 0; i < kPairs; ++i) pairs[i] = in[i] + in[i + kSpanStride];
    for (int i = 0; i < kColumns; ++i)
        columns[i] =
            (pairs[i] + pairs[i + 2 * kSpanStride]) + (pairs[i + 4 * kSpanStride] + in[i + 6 * kSpanStride]);
    for (int i = 0; i < kColumns; ++i) two[i] = columns[i] + columns[i + 1];
    for (int row = 0; row < kTile; ++row)
        for (int i = 0; i < kTile; ++i) {
            const int at = row * kSpanStride + i;
            out[row * kTile + i] = ((two[at] + two[at + 2]) + (two[at + 4] + columns[at + 6])) * scale;
        }
}
constexpr std::size_t kPatchScratch = (kSpan - 1 + 2 * kTile) * kSpanStride + 16;

/// patchDistancesFrom() in rows of Vectors vectors.
template <int Vectors>
[[gnu::always_inline]] inline void distancesFrom(const PatchTile& tile, int here, int reach, float scale,
                                                 float* out) {
    const float *const z = tile.values(0), *const v = tile.noise.data(), *const s = tile.scale.data();
    for (int dy = -reach; dy <= reach; ++dy) {
        const int there = here + dy * kTileSide - reach;
        Eight sum[Vectors] = {};
        for (int row = -kPatchRadius; row <= kPatchRadius; ++row)
            for (int i = row * kTileSide - kPatchRadius; i <= row * kTileSide + kPatchRadius; ++i)
                for (int k = 0; k < Vectors; ++k) {
                    const int at = there + i + 8 * k;
                    Eight squares = {};
                    for (int c = 0; c < 3; ++c) {
                        const float* const of = z + PatchTile::plane(c);
                        const Eight d = of[here + i] - load<Eight>(of + at);
                        squares += d * d;
                    }
                    sum[k] += difference(squares, v[here + i] + Eight{}, load<Eight>(v + at),
                                         s[here + i] + load<Eight>(s + at));
                }
        for (int k = 0; k < Vectors; ++k) store(out + 8 * k, sum[k] * scale);
        out += 8 * Vectors;
    }
}

VLX_WIDE void distancesFrom(const PatchTile& tile, int here, int reach, int vectors, float scale,
                            float* out) {
    switch (vectors) {
        case 1:
            return distancesFrom<1>(tile, here, reach, scale, out);
        case 2:
            return distancesFrom<2>(tile, here, reach, scale, out);
        case 3:
            return distancesFrom<3>(tile, here, reach, scale, out);
        default:
            return distancesFrom<4>(tile, here, reach, scale, out);
    }
}

/// Sums of `in` over the patches of a lattice's pixels: one at `out` for each, `step` apart.
VLX_WIDE void sumLattice(const float* in, const int* columns, std::size_t columnCount, const int* rows,
                         std::size_t rowCount, float scale, float* out, std::size_t step) {
    static_assert(kPatchRadius == 3);
    for (std::size_t j = 0; j < rowCount; ++j) {
        alignas(32) float sums[kSpanStride];
        for (int i = 0; i < kSpanStride; i += 8) {
            const float* const at = in + rows[j] * kSpanStride + i;
            const auto row = [&](int r) __attribute__((always_inline)) {
                return load<Eight>(at + r * kSpanStride);
            };
            store(sums + i, ((row(0) + row(1)) + (row(2) + row(3))) + ((row(4) + row(5)) + row(6)));
        }
        for (std::size_t i = 0; i < columnCount; ++i) {
            const float* const s = sums + columns[i];
            *out = (((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + s[6])) * scale;
            out += step;
        }
    }
}

constexpr float kPerPatch = 1.f / kPatchPixels;

}  // namespace

void copyTile(const RowRing& ring, int plane, int x, int y, int width, int height, float* out) {
    for (int row = 0; row < kTileSide; ++row) {
        const float* in = ring.row(plane, std::clamp(y - kTileMargin + row, 0, height - 1));
        if (x >= kTileMargin && x - kTileMargin + kTileSide <= width) {
            out = std::copy_n(in + x - kTileMargin, kTileSide, out);
            continue;
        }
        for (int i = 0; i < kTileSide; ++i) *out++ = in[std::clamp(x - kTileMargin + i, 0, width - 1)];
    }
}

void PatchTile::resize(int count) {
    constexpr std::size_t kPast = 8;
    channels = count;
    for (auto* planes : {&value, &variance}) planes->resize(plane(count) + kPast);
    for (auto* planes : {&noise, &scale}) planes->resize(plane(1) + kPast);
}

void PatchTile::setScale(float absoluteFloor) {
    std::fill(noise.begin(), noise.end(), 0.f);
    std::fill(scale.begin(), scale.end(), 0.f);
    float *const sum = noise.data(), *const out = scale.data();
    for (int c = 0; c < channels; ++c) {  // one after the other: in vectors
        const float *const z = values(c), *const v = variances(c);
        for (std::size_t i = 0; i < plane(1); ++i) {
            sum[i] += v[i];
            out[i] += absoluteFloor / 2 + kRelativeFloor * z[i] * z[i] + v[i];
        }
    }
}

void patchDistances(const PatchTile& tile, int dx, int dy, std::vector<float>& scratch, float* out) {
    scratch.resize(kSpan * kSpanStride + kPatchScratch);
    sumDifferences(tile, dy * kTileSide + dx, scratch.data());
    sumPatches(scratch.data(), kPerPatch, scratch.data() + kSpan * kSpanStride, out);
}

void patchDistancesFrom(const PatchTile& tile, int column, int row, const Surroundings& around, float* out) {
    distancesFrom(tile, (row + kTileMargin) * kTileSide + column + kTileMargin, around.reach,
                  around.stride() / 8, kPerPatch, out);
}

void latticeDistances(const PatchTile& tile, std::span<PatchLattice* const> lattices,
                      std::vector<float>& scratch) {
    scratch.resize(kSpan * kSpanStride);
    int reach = 0;
    for (PatchLattice* const lattice : lattices) {
        reach = std::max(reach, lattice->around.reach);
        lattice->distances.resize(lattice->columns.size() * lattice->rows.size() *
                                  static_cast<std::size_t>(lattice->around.size()));
    }
    for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx) {
            sumDifferences(tile, dy * kTileSide + dx, scratch.data());
            for (PatchLattice* const lattice : lattices)
                if (std::max(std::abs(dx), std::abs(dy)) <= lattice->around.reach)
                    sumLattice(scratch.data(), lattice->columns.data(), lattice->columns.size(),
                               lattice->rows.data(), lattice->rows.size(), kPerPatch,
                               lattice->distances.data() + lattice->around.at(dx, dy),
                               static_cast<std::size_t>(lattice->around.size()));
        }
}

}  // namespace vlx
