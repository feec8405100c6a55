#include "reconstruct/drift/patch_similarity.h"

#include <algorithm>
#include <cstring>

#include "base/simd.h"

namespace vlx {

namespace {

constexpr int kSpan = kTile + 2 * kPatchRadius;  // pixels whose differences a tile's patches use
constexpr float kRelativeFloor = 1e-6f;
constexpr int kPatchPixels = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);

/// Adds one channel's differences over kSpan x kSpan pixels.
VLX_WIDE void addDifferences(const float* z1, const float* z2, const float* v1, const float* v2,
                             const float* s1, const float* s2, float* out) {
    for (int row = 0; row < kSpan; ++row) {
        const float* __restrict a = z1 + row * kTileSide;
        const float* __restrict b = z2 + row * kTileSide;
        const float* __restrict va = v1 + row * kTileSide;
        const float* __restrict vb = v2 + row * kTileSide;
        const float* __restrict sa = s1 + row * kTileSide;
        const float* __restrict sb = s2 + row * kTileSide;
        float* __restrict o = out + row * kSpan;
        for (int i = 0; i < kSpan; ++i) {
            const float d = a[i] - b[i];
            const float least = va[i] < vb[i] ? va[i] : vb[i];
            o[i] += (d * d - (va[i] + least)) / (sa[i] + sb[i]);
        }
    }
}

/// Sums over patches: kSpan x kSpan to kTile x kTile; seven are three pairs and one, and pairs are
/// summed once.
VLX_WIDE void sumPatches(const float* __restrict in, float scale, float* __restrict scratch,
                         float* __restrict out, std::size_t outStride) {
    static_assert(kPatchRadius == 3);
    float* __restrict pairs = scratch;  // of rows r and r + 1
    float* __restrict columns = scratch + kSpan * kSpan;
    float* __restrict two = columns + kSpan;
    for (int i = 0; i < (kSpan - 1) * kSpan; ++i) pairs[i] = in[i] + in[i + kSpan];
    for (int row = 0; row < kTile; ++row) {
        const float* __restrict p = pairs + row * kSpan;
        const float* __restrict last = in + (row + 6) * kSpan;
        for (int i = 0; i < kSpan; ++i) columns[i] = (p[i] + p[i + 2 * kSpan]) + (p[i + 4 * kSpan] + last[i]);
        for (int i = 0; i < kSpan - 1; ++i) two[i] = columns[i] + columns[i + 1];
        for (int i = 0; i < kTile; ++i)
            out[i] = ((two[i] + two[i + 2]) + (two[i + 4] + columns[i + 6])) * scale;
        out += outStride;
    }
}

/// Eight floats: the same sums on every instruction set.
typedef float Eight __attribute__((vector_size(32)));

Eight eightAt(const float* p) {
    Eight x;
    std::memcpy(&x, p, sizeof x);
    return x;
}

/// One row of patchDistancesFrom(): `here` is the pixel's place in a plane, `there` that of the row's first.
VLX_WIDE void addPatchRow(const PatchTile& tile, int here, int there, float scale, float* out) {
    constexpr int kVectors = kDistanceStride / 8;
    Eight sum[kVectors] = {};
    for (int c = 0; c < tile.channels; ++c) {
        const float *const z = tile.values(c), *const v = tile.variances(c), *const s = tile.scales(c);
        for (int row = -kPatchRadius; row <= kPatchRadius; ++row)
            for (int i = row * kTileSide - kPatchRadius; i <= row * kTileSide + kPatchRadius; ++i) {
                const float za = z[here + i], va = v[here + i], sa = s[here + i];
                for (int k = 0; k < kVectors; ++k) {
                    const int at = there + i + 8 * k;
                    const Eight d = za - eightAt(z + at), vb = eightAt(v + at);
                    const Eight least = vb < va ? vb : va + Eight{};
                    sum[k] += (d * d - (va + least)) / (sa + eightAt(s + at));
                }
            }
    }
    for (int k = 0; k < kVectors; ++k) {
        sum[k] *= scale;
        std::memcpy(out + 8 * k, &sum[k], sizeof sum[k]);
    }
}

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
    for (auto* planes : {&value, &variance, &scale}) planes->resize(plane(count) + kPast);
}

void PatchTile::setScale(float absoluteFloor) {
    for (std::size_t i = 0; i < value.size(); ++i)
        scale[i] = absoluteFloor / 2 + kRelativeFloor * value[i] * value[i] + variance[i];
}

void patchDistances(const PatchTile& tile, int dx, int dy, std::vector<float>& scratch, float* out,
                    std::size_t outStride) {
    scratch.resize(2 * kSpan * kSpan + 2 * kSpan);
    std::fill_n(scratch.data(), kSpan * kSpan, 0.f);
    constexpr int kCorner = (kTileMargin - kPatchRadius) * (kTileSide + 1);
    const int shift = dy * kTileSide + dx;
    for (int c = 0; c < tile.channels; ++c)
        addDifferences(tile.values(c) + kCorner, tile.values(c) + kCorner + shift,
                       tile.variances(c) + kCorner, tile.variances(c) + kCorner + shift,
                       tile.scales(c) + kCorner, tile.scales(c) + kCorner + shift, scratch.data());
    sumPatches(scratch.data(), 1.f / static_cast<float>(kPatchPixels * tile.channels),
               scratch.data() + kSpan * kSpan, out, outStride);
}

void patchDistancesFrom(const PatchTile& tile, int column, int row, float* out) {
    const int here = (row + kTileMargin) * kTileSide + column + kTileMargin;
    for (int dy = -kMaxReach; dy <= kMaxReach; ++dy)
        addPatchRow(tile, here, here + dy * kTileSide - kMaxReach,
                    1.f / static_cast<float>(kPatchPixels * tile.channels),
                    out + (dy + kMaxReach) * kDistanceStride);
}

}  // namespace vlx
