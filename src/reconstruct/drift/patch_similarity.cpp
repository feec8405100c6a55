#include "reconstruct/drift/patch_similarity.h"

#include <algorithm>

#include "base/simd.h"

namespace vlx {

namespace {

constexpr int kSpan = kTile + 2 * kPatchRadius;  // pixels whose differences a tile's patches use
constexpr float kRelativeFloor = 1e-6f;
constexpr int kPatchPixels = (2 * kPatchRadius + 1) * (2 * kPatchRadius + 1);

/// Adds one channel's differences over kSpan x kSpan pixels.
VLX_WIDE void addDifferences(const float* z1, const float* z2, const float* v1, const float* v2, float floor,
                             float* out) {
    for (int row = 0; row < kSpan; ++row) {
        const float* __restrict a = z1 + row * kTileSide;
        const float* __restrict b = z2 + row * kTileSide;
        const float* __restrict va = v1 + row * kTileSide;
        const float* __restrict vb = v2 + row * kTileSide;
        float* __restrict o = out + row * kSpan;
        for (int i = 0; i < kSpan; ++i) {
            const float d = a[i] - b[i];
            const float least = va[i] < vb[i] ? va[i] : vb[i];
            o[i] += (d * d - (va[i] + least)) /
                    (floor + kRelativeFloor * (a[i] * a[i] + b[i] * b[i]) + va[i] + vb[i]);
        }
    }
}

/// Sums over patches: kSpan x kSpan to kTile x kTile.
VLX_WIDE void sumPatches(const float* __restrict in, float scale, float* __restrict columns,
                         float* __restrict out, std::size_t outStride) {
    for (int row = 0; row < kTile; ++row) {
        for (int i = 0; i < kSpan; ++i) {
            float sum = 0;
            for (int k = 0; k <= 2 * kPatchRadius; ++k) sum += in[(row + k) * kSpan + i];
            columns[i] = sum;
        }
        for (int i = 0; i < kTile; ++i) {
            float sum = 0;
            for (int k = 0; k <= 2 * kPatchRadius; ++k) sum += columns[i + k];
            out[i] = sum * scale;
        }
        out += outStride;
    }
}

}  // namespace

void copyTile(const RowRing& ring, int plane, int x, int y, int width, int height, float* out) {
    for (int row = 0; row < kTileSide; ++row) {
        const float* in = ring.row(plane, std::clamp(y - kTileMargin + row, 0, height - 1));
        for (int i = 0; i < kTileSide; ++i) *out++ = in[std::clamp(x - kTileMargin + i, 0, width - 1)];
    }
}

void patchDistances(const PatchTile& tile, int dx, int dy, float absoluteFloor, std::vector<float>& scratch,
                    float* out, std::size_t outStride) {
    scratch.assign(kSpan * kSpan + kSpan, 0.f);
    constexpr int kCorner = (kTileMargin - kPatchRadius) * (kTileSide + 1);
    const int shift = dy * kTileSide + dx;
    for (int c = 0; c < tile.channels; ++c)
        addDifferences(tile.values(c) + kCorner, tile.values(c) + kCorner + shift,
                       tile.variances(c) + kCorner, tile.variances(c) + kCorner + shift, absoluteFloor,
                       scratch.data());
    sumPatches(scratch.data(), 1.f / static_cast<float>(kPatchPixels * tile.channels),
               scratch.data() + kSpan * kSpan, out, outStride);
}

}  // namespace vlx
