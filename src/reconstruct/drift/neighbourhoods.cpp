#include "reconstruct/drift/neighbourhoods.h"

#include <algorithm>
#include <array>

#include "base/simd.h"
#include "reconstruct/drift/centre.h"

namespace vlx {

namespace {

// Distances up to here are computed for all pixels at once, farther ones for the few centres that need them.
constexpr int kNearReach = 8;
constexpr std::size_t kNearOffsets = (2 * kNearReach + 1) * (2 * kNearReach + 1);
constexpr float kLeastWeight = 0.01f;      // of a datum: nearExp(kFarthest)
constexpr float kCoveringWeight = 0.2f;    // a pixel less like its regular centres gets its own
constexpr float kCoveringVariance = 0.5f;  // likewise when they are noisier than it by more than this

/// One tile's data with their margin, in local planes of kTileSide x kTileSide.
class Tile {
  public:
    /// Takes a tile up; what it needs of memory is kept for the next.
    void load(const TileInput& input, int x, int y) {
        in_ = input;
        x_ = x;
        y_ = y;
        const int c = input.planes.radiance;
        for (int half = 0; half < 2; ++half) {
            means_[half].resize(plane(c));
            counts_[half].resize(plane(1));
            errors_[half].assign(plane(1), 0.f);
            PatchTile& guide = guides_[half];
            guide.x = x;
            guide.y = y;
            guide.resize(3);
            for (int k = 0; k < c; ++k)
                copy(*input.data, input.planes.mean(half) + k, means_[half].data() + plane(k));
            copy(*input.data, input.planes.halfCount(half), counts_[half].data());
            std::copy_n(means_[half].data(), plane(3), guide.value.data());
            for (int k = 0; k < 3; ++k) {
                copy(*input.variances, k, guide.variances(k));
                for (std::size_t i = 0; i < plane(1); ++i) {
                    const float n = std::max(1.f, counts_[half][i]);
                    errors_[half][i] += guide.variances(k)[i] / (3 * n);
                    guide.variances(k)[i] /= n;
                }
            }
            guide.setScale(kLeastSquare);
        }
        references_.resize(plane(c));
        for (std::size_t i = 0; i < references_.size(); ++i)
            references_[i] = std::min(means_[0][i], means_[1][i]);
        features_.resize(plane(2 * input.featureCount));
        for (int f = 0; f < 2 * input.featureCount; ++f)
            copy(*input.features, f, features_.data() + plane(f));

        for (int half = 0; half < 2; ++half) {
            distances_[half].resize(kNearOffsets * kTile * kTile);
            for (int dy = -kNearReach; dy <= kNearReach; ++dy)
                for (int dx = -kNearReach; dx <= kNearReach; ++dx)
                    patchDistances(guides_[half], dx, dy, scratch_,
                                   distances_[half].data() + offset(dx, dy) * kTile, kNearOffsets * kTile);
        }
    }

    NeighbourhoodCounts krige(const NeighbourhoodModel& model, RowRing& estimates) {
        const EstimatePlanes out{in_.planes.radiance};
        NeighbourhoodCounts counts;
        const int right = std::min(kTile, in_.width - x_), bottom = std::min(kTile, in_.height - y_);
        for (int half = 0; half < 2; ++half) {
            sums_.assign(plane(out.perHalf()), 0.f);
            own_.assign(kTile * kTile, 0);
            for (int row = 0; row < bottom; ++row)
                for (int col = 0; col < right; ++col) {
                    const bool regular = (x_ + col) % model.stride == 0 && (y_ + row) % model.stride == 0;
                    if (!regular) {
                        if (covered(model, half, col, row)) continue;
                        own_[static_cast<std::size_t>(row * kTile + col)] = 1;
                        ++counts.own;
                    }
                    krigeCentre(model, half, col, row, counts);
                }
            flush(half, model.reach, out, estimates);
        }
        return counts;
    }

  private:
    static std::size_t plane(int k) { return TilePlanes::plane(k); }
    static int inner(int col, int row) { return (row + kTileMargin) * kTileSide + col + kTileMargin; }
    static std::size_t offset(int dx, int dy) {
        return static_cast<std::size_t>((dy + kNearReach) * (2 * kNearReach + 1) + dx + kNearReach);
    }
    void copy(const RowRing& ring, int k, float* out) const {
        copyTile(ring, k, x_, y_, in_.width, in_.height, out);
    }
    float nearDistance(int guide, int col, int row, int dx, int dy) const {
        return distances_[guide][(static_cast<std::size_t>(row) * kNearOffsets + offset(dx, dy)) * kTile +
                                 static_cast<std::size_t>(col)];
    }

    /// The composite distance of a datum from a centre at (col, row): colour patches of the other half and,
    /// where the model has them, features with their error variances.
    float compositeDistance(const NeighbourhoodModel& model, float patches, std::size_t here,
                            std::size_t there) const {
        float d = std::max(0.f, patches / (model.tolerance * model.tolerance));
        if (!model.features || d > kFarthest) return d;
        for (int f = 0; f < in_.featureCount; ++f) {
            const float* values = features_.data() + plane(f);
            const float* errors = features_.data() + plane(in_.featureCount + f);
            const float difference = values[there] - values[here];
            d += difference * difference / (kFeatureWidth2 + 2 * (errors[here] + errors[there]));
        }
        return d;
    }

    /// Is the pixel like one of the regular centres around it, and not much less noisy? Or like one of the
    /// tile's own centres so far; not of tolerant models, to which much is alike.
    bool covered(const NeighbourhoodModel& model, int half, int col, int row) const {
        const auto here = static_cast<std::size_t>(inner(col, row));
        const auto coveredFrom = [&](int dx, int dy) {
            const auto there = static_cast<std::size_t>(inner(col + dx, row + dy));
            const float patches = nearDistance(1 - half, col, row, dx, dy);
            return simd::nearExp(compositeDistance(model, patches, here, there)) > kCoveringWeight &&
                   errors_[half][here] >= kCoveringVariance * errors_[half][there];
        };
        const int left = (x_ + col) % model.stride, up = (y_ + row) % model.stride;
        for (const int dy : {-up, model.stride - up})
            for (const int dx : {-left, model.stride - left})
                if (x_ + col + dx < in_.width && y_ + row + dy < in_.height && coveredFrom(dx, dy))
                    return true;
        if (model.tolerance > 1) return false;
        const int most = std::min(model.stride - 1, model.reach);
        for (int dy = -std::min(most, row); dy <= 0; ++dy)
            for (int dx = -std::min(most, col); dx <= std::min(most, kTile - 1 - col); ++dx)
                if (own_[static_cast<std::size_t>((row + dy) * kTile + col + dx)] && coveredFrom(dx, dy))
                    return true;
        return false;
    }

    void krigeCentre(const NeighbourhoodModel& model, int half, int col, int row,
                     NeighbourhoodCounts& counts) {
        const int reach = model.reach;
        TilePlanes planes;
        planes.means = means_[half].data();
        planes.counts = counts_[half].data();
        planes.errors = errors_[half].data();
        planes.references = references_.data();
        planes.features = features_.data();
        planes.radiance = in_.planes.radiance;
        planes.featureCount = in_.featureCount;
        planes.group = &in_.group;
        planes.groups = in_.groups;
        const int here = inner(col, row);
        centre_.begin(planes, here, reach);
        const bool far = reach > kNearReach;
        if (far) patchDistancesFrom(guides_[1 - half], col, row, far_.data());
        for (int dy = std::max(-reach, -(y_ + row)); dy <= std::min(reach, in_.height - 1 - y_ - row); ++dy)
            for (int dx = std::max(-reach, -(x_ + col)); dx <= std::min(reach, in_.width - 1 - x_ - col);
                 ++dx) {
                const float patches =
                    far ? far_[static_cast<std::size_t>((dy + kMaxReach) * kDistanceStride + dx + kMaxReach)]
                        : nearDistance(1 - half, col, row, dx, dy);
                const float alike =
                    simd::nearExp(compositeDistance(model, patches, static_cast<std::size_t>(here),
                                                    static_cast<std::size_t>(here + dy * kTileSide + dx)));
                if (alike >= kLeastWeight) centre_.add(dx, dy, alike);
            }
        centre_.krige(sums_.data(), counts);
    }

    void flush(int half, int reach, const EstimatePlanes& out, RowRing& estimates) const {
        const int left = std::max(0, x_ - reach), right = std::min(in_.width, x_ + kTile + reach);
        for (int row = std::max(0, y_ - reach); row < std::min(in_.height, y_ + kTile + reach); ++row)
            for (int k = 0; k < out.perHalf(); ++k) {
                const float* from = sums_.data() + plane(k) + inner(-x_, row - y_);
                float* to = estimates.row(half * out.perHalf() + k, row);
                for (int i = left; i < right; ++i) to[i] += from[i];
            }
    }

    TileInput in_;
    int x_ = 0, y_ = 0;
    PatchTile guides_[2];
    std::vector<float> means_[2], counts_[2], errors_[2], distances_[2], references_, features_, scratch_;

    std::array<float, (2 * kMaxReach + 1) * kDistanceStride> far_;  // of a centre: patchDistancesFrom()
    std::vector<char> own_;    // the pixels that have a centre of their own
    std::vector<float> sums_;  // EstimatePlanes of one half
    Centre centre_;
};

}  // namespace

NeighbourhoodCounts krigeTile(const TileInput& input, const std::vector<NeighbourhoodModel>& models, int x,
                              int y, std::vector<RowRing>& estimates) {
    static thread_local Tile tile;  // megabytes: worth keeping
    tile.load(input, x, y);
    NeighbourhoodCounts counts;
    for (std::size_t m = 0; m < models.size(); ++m) {
        const NeighbourhoodCounts of = tile.krige(models[m], estimates[m]);
        counts.neighbourhoods += of.neighbourhoods;
        counts.own += of.own;
        counts.failed += of.failed;
        counts.effective += of.effective;
        counts.features += of.features;
    }
    return counts;
}

}  // namespace vlx
