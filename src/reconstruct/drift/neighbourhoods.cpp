#include "reconstruct/drift/neighbourhoods.h"

#include <algorithm>
#include <vector>

#include "base/simd.h"
#include "reconstruct/drift/centre.h"

namespace vlx {

namespace {

using simd::Eight;
using simd::load;

constexpr float kCoveringWeight = 0.2f;    // a pixel less like the centres around it gets its own
constexpr float kCoveringVariance = 0.5f;  // likewise when they are noisier than it by more than this
/// Whether distances of a model's regular centres are found together: where their patches overlap, and so do
/// the pixels that they are compared with, they share what pixels differ by.
bool isClose(const NeighbourhoodModel& model) {
    return model.reach <= 8 && model.stride <= 2 * kPatchRadius + 1;
}

/// What a composite distance is made of: colour patches of the other half, in rows of whole vectors, and,
/// where a model has them, features (FeaturePlanes, `plane` apart) with their error variances.
struct CompositeDistance {
    const float* patches;
    float perPatches;
    const float* features;
    int count;
    std::size_t plane;
};

/// alike = nearExp(d) of the pixels around `centre`, d = patches / k^2 + sum of squared differences of
/// features over what they may differ by.
VLX_WIDE void rateSurroundings(const CompositeDistance& of, int centre, const Surroundings& around,
                               float* alike) {
    for (int dy = -around.reach; dy <= around.reach; ++dy)
        for (int dx = -around.reach; dx <= around.reach; dx += 8) {
            const int at = around.at(dx, dy), there = centre + dy * kTileSide + dx;
            Eight d = simd::maximum(load<Eight>(of.patches + at) * of.perPatches, Eight{});
            for (int f = 0; f < of.count; ++f) {
                const float* const values = of.features + static_cast<std::size_t>(f) * of.plane;
                const float* const errors = values + static_cast<std::size_t>(of.count) * of.plane;
                const Eight apart = load<Eight>(values + there) - values[centre];
                d += apart * apart / (kFeatureWidth2 + 2 * (errors[centre] + load<Eight>(errors + there)));
            }
            simd::store(alike + at, simd::nearExp(d));
        }
}

/// One tile's data with their margin, in local planes of kTileSide x kTileSide.
class Tile {
  public:
    /// Takes a tile up, unless it is there; what it needs of memory is kept for the next.
    void load(const TileInput& input, int x, int y) {
        if (input.number == in_.number && x == x_ && y == y_) return;
        in_ = input;
        x_ = x;
        y_ = y;
        const int c = input.planes.radiance;
        for (int half = 0; half < 2; ++half) {
            means_[half].resize(plane(c) + kPast);
            counts_[half].resize(plane(1) + kPast);
            errors_[half].assign(plane(1) + kPast, 0.f);
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
                    const float n = samplesIn(counts_[half][i]);
                    errors_[half][i] += guide.variances(k)[i] / (3 * n);
                    guide.variances(k)[i] /= n;
                }
            }
            guide.setScale(kLeastSquare);
        }
        references_.resize(plane(c) + kPast);
        for (std::size_t i = 0; i < plane(c); ++i) references_[i] = std::min(means_[0][i], means_[1][i]);
        features_.resize(plane(2 * input.featureCount) + kPast);
        for (int f = 0; f < 2 * input.featureCount; ++f)
            copy(*input.features, f, features_.data() + plane(f));
    }

    /// All neighbourhoods of one half, of all models.
    void krige(const std::vector<NeighbourhoodModel>& models, int half, std::vector<RowRing>& estimates,
               NeighbourhoodCounts& counts) {
        half_ = half;
        lattices_.resize(models.size());
        std::vector<PatchLattice*> close;
        for (std::size_t m = 0; m < models.size(); ++m) {
            PatchLattice& lattice = lattices_[m];
            lattice.around = {models[m].reach};
            lattice.columns = regular(0, columns(), x_, models[m].stride);
            lattice.rows = regular(0, rows(), y_, models[m].stride);
            if (isClose(models[m])) close.push_back(&lattice);
        }
        latticeDistances(guides_[1 - half], close, scratch_);
        for (std::size_t m = 0; m < models.size(); ++m) {
            model_ = models[m];
            sums_.assign(plane(EstimatePlanes{in_.planes.radiance}.perHalf()) + kPast, 0.f);
            covered_.assign(kTile * kTile, 0);
            krigeRegular(lattices_[m], counts);
            coverFromOutside();
            krigeOwn(counts);
            flush(EstimatePlanes{in_.planes.radiance}, estimates[m]);
        }
    }

  private:
    static constexpr std::size_t kPast = 8;  // planes are read in whole vectors

    static std::size_t plane(int k) { return TilePlanes::plane(k); }
    static int inner(int col, int row) { return (row + kTileMargin) * kTileSide + col + kTileMargin; }
    int columns() const { return std::min(kTile, in_.width - x_); }
    int rows() const { return std::min(kTile, in_.height - y_); }
    void copy(const RowRing& ring, int k, float* out) const {
        copyTile(ring, k, x_, y_, in_.width, in_.height, out);
    }

    /// Places from `first` up to `end` from the tile's corner whose place in the picture `stride` divides.
    static std::vector<int> regular(int first, int end, int corner, int stride) {
        std::vector<int> places;
        for (int i = first; i < end; ++i)
            if ((corner + i) % stride == 0) places.push_back(i);
        return places;
    }

    void krigeRegular(PatchLattice& lattice, NeighbourhoodCounts& counts) {
        for (std::size_t j = 0; j < lattice.rows.size(); ++j)
            for (std::size_t i = 0; i < lattice.columns.size(); ++i) {
                const int col = lattice.columns[i], row = lattice.rows[j];
                const float* distances = lattice.of(i, j);
                if (!isClose(model_)) distances = distancesFrom(col, row, lattice.around);
                rate(col, row, lattice.around, distances);
                cover(col, row, lattice.around);
                krigeCentre(col, row, lattice.around, counts);
            }
    }

    /// Centres of their own for what no other covers.
    void krigeOwn(NeighbourhoodCounts& counts) {
        const Surroundings around{model_.reach};
        for (int row = 0; row < rows(); ++row)
            for (int col = 0; col < columns(); ++col) {
                if (covered_[static_cast<std::size_t>(row * kTile + col)] != 0) continue;
                ++counts.own;
                rate(col, row, around, distancesFrom(col, row, around));
                if (model_.ownCover) cover(col, row, around);
                krigeCentre(col, row, around, counts);
            }
    }

    /// Regular centres of other tiles cover pixels of this one as well.
    void coverFromOutside() {
        const Surroundings around{model_.stride - 1};
        const auto places = [&](int corner, int size) {
            return regular(std::max(-around.reach, -corner), std::min(kTile + around.reach, size - corner),
                           corner, model_.stride);
        };
        const auto inside = [](int i) { return i >= 0 && i < kTile; };
        const std::vector<int> across = places(x_, in_.width);
        for (const int row : places(y_, in_.height))
            for (const int col : across) {
                if (inside(col) && inside(row)) continue;
                rate(col, row, around, distancesFrom(col, row, around));
                cover(col, row, around);
            }
    }

    const float* distancesFrom(int col, int row, const Surroundings& around) {
        distances_.resize(static_cast<std::size_t>(around.size()));
        patchDistancesFrom(guides_[1 - half_], col, row, around, distances_.data());
        return distances_.data();
    }

    /// What the pixels around are like the one at (col, row); beyond the picture they are not.
    void rate(int col, int row, const Surroundings& around, const float* distances) {
        alike_.resize(static_cast<std::size_t>(around.size()));
        rateSurroundings({distances, 1 / (model_.tolerance * model_.tolerance), features_.data(),
                          model_.features ? in_.featureCount : 0, plane(1)},
                         inner(col, row), around, alike_.data());
        const int left = std::max(-around.reach, -(x_ + col)),
                  right = std::min(around.reach, in_.width - 1 - x_ - col);
        for (int dy = -around.reach; dy <= around.reach; ++dy) {
            float* const of = alike_.data() + around.at(-around.reach, dy);
            const bool within = y_ + row + dy >= 0 && y_ + row + dy < in_.height;
            std::fill_n(of, within ? left + around.reach : around.stride(), 0.f);
            if (within) std::fill(of + right + around.reach + 1, of + around.stride(), 0.f);
        }
    }

    /// Pixels of the tile nearer than the next regular centre that are like this one, and not much less
    /// noisy, need none of their own.
    void cover(int col, int row, const Surroundings& around) {
        const int reach = std::min(model_.stride - 1, around.reach);
        const float noise = kCoveringVariance * errors_[half_][static_cast<std::size_t>(inner(col, row))];
        for (int r = std::max(0, row - reach); r <= std::min(rows() - 1, row + reach); ++r)
            for (int c = std::max(0, col - reach); c <= std::min(columns() - 1, col + reach); ++c)
                if (alike_[static_cast<std::size_t>(around.at(c - col, r - row))] > kCoveringWeight &&
                    errors_[half_][static_cast<std::size_t>(inner(c, r))] >= noise)
                    covered_[static_cast<std::size_t>(r * kTile + c)] = 1;
    }

    void krigeCentre(int col, int row, const Surroundings& around, NeighbourhoodCounts& counts) {
        covered_[static_cast<std::size_t>(row * kTile + col)] = 1;
        TilePlanes planes;
        planes.means = means_[half_].data();
        planes.counts = counts_[half_].data();
        planes.errors = errors_[half_].data();
        planes.references = references_.data();
        planes.features = features_.data();
        planes.radiance = in_.planes.radiance;
        planes.featureCount = in_.featureCount;
        planes.group = &in_.group;
        planes.groups = in_.groups;
        centre_.krige(planes, inner(col, row), around, alike_.data(), sums_.data(), counts);
    }

    void flush(const EstimatePlanes& out, RowRing& estimates) const {
        const int reach = model_.reach;
        const int left = std::max(0, x_ - reach), right = std::min(in_.width, x_ + kTile + reach);
        for (int row = std::max(0, y_ - reach); row < std::min(in_.height, y_ + kTile + reach); ++row)
            for (int k = 0; k < out.perHalf(); ++k) {
                const float* from = sums_.data() + plane(k) + inner(-x_, row - y_);
                float* to = estimates.row(half_ * out.perHalf() + k, row);
                for (int i = left; i < right; ++i) to[i] += from[i];
            }
    }

    TileInput in_;
    int x_ = 0, y_ = 0, half_ = 0;
    NeighbourhoodModel model_;
    PatchTile guides_[2];
    std::vector<float> means_[2], counts_[2], errors_[2], references_, features_, scratch_;

    std::vector<PatchLattice> lattices_;    // of regular centres, for each model
    std::vector<float> distances_, alike_;  // of one centre
    std::vector<char> covered_;             // pixels that need no centre of their own
    std::vector<float> sums_;               // EstimatePlanes of one half
    Centre centre_;
};

}  // namespace

NeighbourhoodCounts krigeTile(const TileInput& input, const std::vector<NeighbourhoodModel>& models, int x,
                              int y, int half, std::vector<RowRing>& estimates) {
    static thread_local Tile tile;  // megabytes: worth keeping
    tile.load(input, x, y);
    NeighbourhoodCounts counts;
    tile.krige(models, half, estimates, counts);
    return counts;
}

}  // namespace vlx
