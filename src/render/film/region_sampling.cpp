#include "render/film/region_sampling.h"

#include <array>
#include <bit>
#include <cassert>

#include "render/math/sampling.h"

namespace vlx::render {
namespace {

/// The float nearest to a raster position from below: rounding must not move a sample into the next cell.
float rasterFloor(double position) {
    const auto f = static_cast<float>(position);
    // Positions are not negative: the float before a positive one has the bits before its bits.
    return f > position ? std::bit_cast<float>(std::bit_cast<std::uint32_t>(f) - 1) : f;
}

std::uint64_t pixelSeed(std::uint64_t seed, int column, int row, int replicate) {
    return hashOf(seed, column, row, replicate);
}

/// Sums over the samples of a cell; residuals are taken against a mean known beforehand.
struct Moments {
    std::array<double, 3> sum{};
    std::array<double, 3> sumSquares{};
    int count = 0;

    void add(const std::array<double, 3>& v) {
        for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += v[c];
            sumSquares[c] += v[c] * v[c];
        }
        ++count;
    }
};

constexpr int kBranch = 4;  // n

/// A region while it is sampled.
class RegionRefiner {
  public:
    RegionRefiner(const Window& window, int regionX, int regionY, const HierarchicalOptions& options,
                  std::uint64_t seed, const Shade& shade)
        : window_(window),
          left_(regionX * kRegionSize),
          top_(regionY * kRegionSize),
          options_(options),
          seed_(seed),
          seeds_(SobolSeeds::from(hashOf(seed, regionX, regionY, 0x7265676eu))),
          shade_(shade),
          refined_(static_cast<std::size_t>(options.levels), 0) {}

    std::vector<int> run() {
        // Level 0: 16 points in the whole region; there is no level above to take a mean from.
        std::vector<Cell> cells{{0, 0, {}}};
        for (int level = 0; level < options_.levels && !cells.empty(); ++level) cells = refine(level, cells);
        return refined_;
    }

  private:
    struct Cell {
        std::uint32_t x;
        std::uint32_t y;
        std::vector<Rgb> known;  ///< the first n samples, taken as part of the cell above
    };

    /// Tops every cell up to 4n points; returns the children of those that are not yet precise enough.
    std::vector<Cell> refine(int level, const std::vector<Cell>& cells) {
        std::vector<Cell> next;
        for (const Cell& cell : cells) {
            if (!touchesWindow(level, cell)) continue;
            ++refined_[static_cast<std::size_t>(level)];
            // m(C): from the n points that the level above put here; at the top from nothing.
            std::array<double, 3> mean{};
            for (const Rgb& v : cell.known) {
                mean[0] += v.x;
                mean[1] += v.y;
                mean[2] += v.z;
            }
            if (!cell.known.empty())
                for (double& m : mean) m /= static_cast<double>(cell.known.size());
            Moments residuals;
            const auto take = [&](const Rgb& v) {
                residuals.add({v.x - mean[0], v.y - mean[1], v.z - mean[2]});
            };
            for (const Rgb& v : cell.known) take(v);
            std::array<std::vector<Rgb>, 4> children;
            if (level > 0) distributeKnown(level, cell, children);
            const std::uint32_t first = level == 0 ? 0 : kBranch;
            for (std::uint32_t rank = first; rank < kCellSamples; ++rank)
                sampleAt(level, cell, rank, take, children);
            if (preciseEnough(level, residuals, mean)) continue;
            for (std::uint32_t i = 0; i < 4; ++i)
                next.push_back({2 * cell.x + i % 2, 2 * cell.y + i / 2, std::move(children[i])});
        }
        return next;
    }

    /// Which quadrant of its cell a point is in.
    static std::size_t quadrant(int level, const SobolPoint& p) {
        return ((p.x >> (31 - level)) & 1u) + 2 * ((p.y >> (31 - level)) & 1u);
    }

    /// The cell's first n points again, by the quadrants they lie in. Those outside the window were not
    /// taken.
    void distributeKnown(int level, const Cell& cell, std::array<std::vector<Rgb>, 4>& children) const {
        std::size_t k = 0;
        for (std::uint32_t rank = 0; rank < kBranch; ++rank) {
            const SobolPoint p = pointOf(level, cell, rank);
            if (inWindow(p)) children[quadrant(level, p)].push_back(cell.known[k++]);
        }
        assert(k == cell.known.size());
    }

    template <class Take>
    void sampleAt(int level, const Cell& cell, std::uint32_t rank, Take& take,
                  std::array<std::vector<Rgb>, 4>& children) {
        const SobolPoint p = pointOf(level, cell, rank);
        if (!inWindow(p)) return;
        const int pixelX = static_cast<int>(p.x >> 30), pixelY = static_cast<int>(p.y >> 30);
        CameraSample s;
        s.column = left_ + pixelX;
        s.row = top_ + pixelY;
        s.x = rasterFloor(left_ + p.x * 0x1p-30);
        s.y = rasterFloor(top_ + p.y * 0x1p-30);
        s.seed = pixelSeed(seed_, s.column, s.row, 0);
        s.index = counts_[static_cast<std::size_t>(pixelY * kRegionSize + pixelX)]++;
        const Rgb v = shade_(s);
        take(v);
        children[quadrant(level, p)].push_back(v);
    }

    SobolPoint pointOf(int level, const Cell& cell, std::uint32_t rank) const {
        return scrambledSobolPoint(sobolIndexInCell(level, cell.x, cell.y, rank, seeds_), seeds_);
    }

    bool inWindow(const SobolPoint& p) const {
        return window_.contains(left_ + static_cast<int>(p.x >> 30), top_ + static_cast<int>(p.y >> 30));
    }

    /// Whether any part of a cell lies in the window.
    bool touchesWindow(int level, const Cell& cell) const {
        const double side = kRegionSize / static_cast<double>(1 << level);
        const double x = left_ + cell.x * side, y = top_ + cell.y * side;
        return x < window_.x + window_.width && x + side > window_.x && y < window_.y + window_.height &&
               y + side > window_.y;
    }

    bool preciseEnough(int level, const Moments& residuals, const std::array<double, 3>& mean) const {
        if (options_.tolerance <= 0 || residuals.count < kBranch) return false;
        const double perPixel = std::pow(4.0, level);
        double error = 0;
        for (std::size_t c = 0; c < 3; ++c) {
            const double r = residuals.sum[c] / residuals.count;
            const double variance = std::max(0.0, residuals.sumSquares[c] / residuals.count - r * r);
            const double m = mean[c] + r;
            error += variance / perPixel / (m * m + 0.01) / 3;
        }
        return error <= options_.tolerance * options_.tolerance;
    }

    Window window_;
    int left_;
    int top_;
    HierarchicalOptions options_;
    std::uint64_t seed_;
    SobolSeeds seeds_;
    const Shade& shade_;
    std::vector<int> refined_;
    std::array<std::uint32_t, kRegionSize * kRegionSize> counts_{};
};

}  // namespace

namespace {

/// The first `count` points of a pixel's randomisation `replicate`, or of its first two by turns.
void samplePixel(int column, int row, int count, std::optional<std::uint32_t> replicate, std::uint64_t seed,
                 const Shade& shade) {
    const std::uint32_t first = replicate.value_or(0);
    const int turns = replicate ? 1 : 2;
    CameraSample s;
    s.column = column;
    s.row = row;
    s.replicate = first;
    std::array<std::array<Vec2, 4>, 2> positions;
    for (int i = 0; i < count; ++i) {
        const int turn = i % turns;
        s.seed = pixelSeed(seed, column, row, static_cast<int>(first) + turn);
        s.index = static_cast<std::uint32_t>(i / turns);
        auto& own = positions[static_cast<std::size_t>(turn)];
        if (s.index % 4 == 0) own = PathSampler::ofFour(s.seed, s.index, dimension::kPixel);
        const Vec2 u = own[s.index % 4];
        s.x = rasterFloor(static_cast<double>(column) + u.x);
        s.y = rasterFloor(static_cast<double>(row) + u.y);
        shade(s);
    }
}

}  // namespace

CameraSample sampleInPixel(int column, int row, std::uint64_t seed, std::uint32_t index) {
    const Vec2 u = PathSampler(seed, index).pair(dimension::kPixel);
    return {column, row, static_cast<float>(column) + u.x, static_cast<float>(row) + u.y, seed, index};
}

void sampleUniformly(const Window& window, int spp, int replicates, std::uint64_t seed, const Shade& shade) {
    assert(replicates > 0 && spp % replicates == 0);
    if (replicates == 1)
        return sampleCounts(
            window, [&](int, int) { return spp; }, {}, seed, shade);
    for (int row = window.y; row < window.y + window.height; ++row)
        for (int column = window.x; column < window.x + window.width; ++column)
            for (int replicate = 0; replicate < replicates; ++replicate)
                samplePixel(column, row, spp / replicates, static_cast<std::uint32_t>(replicate), seed,
                            shade);
}

void sampleCounts(const Window& window, const std::function<int(int, int)>& countAt,
                  std::optional<std::uint32_t> replicate, std::uint64_t seed, const Shade& shade) {
    for (int row = window.y; row < window.y + window.height; ++row)
        for (int column = window.x; column < window.x + window.width; ++column)
            samplePixel(column, row, countAt(column, row), replicate, seed, shade);
}

std::vector<int> sampleHierarchically(const Window& window, int regionX, int regionY,
                                      const HierarchicalOptions& options, std::uint64_t seed,
                                      const Shade& shade) {
    assert(options.levels >= 1 && options.levels <= 8);
    return RegionRefiner(window, regionX, regionY, options, seed, shade).run();
}

}  // namespace vlx::render
