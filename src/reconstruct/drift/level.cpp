#include "reconstruct/drift/level.h"

#include <algorithm>
#include <atomic>

#include "variolux/base/parallel.h"

namespace vlx {

namespace {

// Rows kept at each stage, likewise (level_data.cpp).
constexpr int kSumRows = 64;        // a tile's, and kMaxReach around: 62
constexpr int kEstimateRows = 100;  // and moments
constexpr int kCombinedRows = 88;

}  // namespace

std::vector<NeighbourhoodModel> modelsOf(Quality quality, bool coarse) {
    switch (quality) {
        case Quality::Draft:
            return {{8, 0.8f, 8, true}};
        case Quality::Standard:
            break;
        case Quality::High:
            return {{8, 0.8f, 2, true}, {15, 3.f, 6, false, coarse}, {4, 1.f, 2, false}};
    }
    if (coarse) return {{8, 0.8f, 5, true}, {15, 3.f, 8, false}, {4, 1.f, 4, false}};
    return {{8, 0.8f, 4, true}, {15, 3.f, 8, false, false}, {4, 1.f, 3, false}};
}

Level::Level(const SampleLayout& layout, const Drift& options, bool coarse, LevelData& data,
             DriftReport& report, StageClock& clock)
    : layout_(layout),
      steps_(options.steps),
      models_(modelsOf(options.quality, coarse)),
      data_(data),
      width_(data.width()),
      height_(data.height()),
      radiance_(layout.radiance),
      report_(report),
      clock_(clock),
      moments_(width_, MomentPlanes{static_cast<int>(models_.size())}.channels(), kept(kEstimateRows)),
      combined_(width_, CombinedPlanes{radiance_}.channels(), kept(kCombinedRows)),
      combination_(radiance_, width_, height_, data.data(), data.variances(), estimates_, moments_,
                   combined_) {
    for (std::size_t m = 0; m < models_.size(); ++m) {
        sums_.emplace_back(width_, EstimatePlanes{radiance_}.channels(), kept(kSumRows));
        estimates_.emplace_back(width_, ModelPlanes{radiance_}.channels(), kept(kEstimateRows));
    }
}

int Level::startAbove(int first) {
    combinedRows_ = std::max(0, first);
    finishedRows_ = std::max(0, first - kStackReach);
    krigedRows_ = std::max(0, finishedRows_ - kMaxReach) / kTile * kTile;
    zeroedRows_ = std::max(0, krigedRows_ - kMaxReach);
    return std::max(0, krigedRows_ - kTileMargin);
}

std::uint64_t Level::ringBytes() const {
    std::uint64_t bytes = moments_.bytes() + combined_.bytes();
    for (const auto* list : {&sums_, &estimates_})
        for (const RowRing& ring : *list) bytes += ring.bytes();
    return bytes;
}

// Each stage fills rows up to (not including) `until`, cut to the picture, after the stages that it needs.

/// Neighbourhoods centred in rows up to `until`.
void Level::krige(int until) {
    until = std::min(until, height_);
    while (krigedRows_ < until) {
        const int y = krigedRows_;
        data_.fill(y + kTile + kTileMargin);
        static std::atomic<std::int64_t> rowsKriged = 0;  // of all levels: no two inputs have one number
        TileInput input{&data_.data(),    &data_.features(), &data_.variances(), {radiance_},
                        layout_.features, layout_.group,     layout_.groups,     width_,
                        height_,          ++rowsKriged};
        // Rows that this tile row is the first to reach.
        for (RowRing& ring : sums_)
            for (int row = zeroedRows_; row < std::min(height_, y + kTile + kMaxReach); ++row)
                std::fill_n(ring.row(0, row), width_ * ring.channels(), 0.f);
        zeroedRows_ = std::min(height_, y + kTile + kMaxReach);
        const int tiles = (width_ + kTile - 1) / kTile;
        std::vector<NeighbourhoodCounts> counts(2 * static_cast<std::size_t>(tiles));
        for (int phase = 0; phase < 2; ++phase)  // tiles of one phase do not reach each other's pixels
            parallelFor(0, (tiles + 1 - phase) / 2 * 2, [&](std::int64_t i) {
                const int tile = static_cast<int>(i) / 2 * 2 + phase, half = static_cast<int>(i) % 2;
                counts[static_cast<std::size_t>(2 * tile + half)] =
                    krigeTile(input, models_, tile * kTile, y, half, sums_);
            });
        for (const NeighbourhoodCounts& of : counts) {
            report_.neighbourhoods += of.neighbourhoods;
            report_.ownNeighbourhoods += of.own;
            report_.failedNeighbourhoods += of.failed;
            report_.driftFunctions += of.effective;
            report_.driftFeatures += of.features;
        }
        krigedRows_ = std::min(height_, krigedRows_ + kTile);
        clock_.addTo("kriging");
        finish();
    }
}

/// Each model's estimates, and the moments of stacking, of rows that no neighbourhood reaches any more: sums
/// are kept no longer than they grow.
void Level::finish() {
    const int until = krigedRows_ == height_ ? height_ : krigedRows_ - kMaxReach;
    if (finishedRows_ >= until) return;
    moments_.claim(finishedRows_, until);
    for (RowRing& ring : estimates_) ring.claim(finishedRows_, until);
    parallelFor(finishedRows_, until, [&](std::int64_t y) {
        for (std::size_t m = 0; m < models_.size(); ++m) finishRow(m, static_cast<int>(y));
        fillGaps(static_cast<int>(y));
        combination_.momentsRow(static_cast<int>(y));
    });
    finishedRows_ = until;
    clock_.addTo("combining");
}

void Level::finishRow(std::size_t m, int y) {
    const EstimatePlanes planes{radiance_};
    const ModelPlanes out{radiance_};
    const DataPlanes data{radiance_};
    for (int x = 0; x < width_; ++x) {
        double variance[3] = {};
        double leverage = 0;
        const float gap = data_.data().row(data.gap(), y)[x];
        double perSample = 1e-300;  // of noise, over colours
        for (int c = 0; c < 3; ++c) perSample += static_cast<double>(data_.variances().row(c, y)[x]) / 3;
        for (int half = 0; half < 2; ++half) {
            const int first = half * planes.perHalf();
            // A half without data here takes the other's estimate.
            int from = first;
            if (sums_[m].row(first, y)[x] <= 0) from = planes.perHalf() - first;
            const double weight = sums_[m].row(from, y)[x];
            leverage += weight > 0 ? sums_[m].row(from + planes.leverage(), y)[x] / weight : 1;
            for (int c = 0; c < radiance_; ++c) {
                float& estimate = estimates_[m].row(out.half(half) + c, y)[x];
                if (weight <= 0) {  // no neighbourhood with data reaches it
                    estimate = data_.data().row(data.mean(half) + c, y)[x];
                    // Of a gap's pixel the semivariance at its distance is added in the end.
                    if (c < 3 && gap == 0)
                        variance[c] += 2 * static_cast<double>(data_.variances().row(c, y)[x]);
                    continue;
                }
                const double shift = sums_[m].row(from + planes.sum(c), y)[x] / weight;
                estimate = static_cast<float>(reference(data_.data(), data, c, x, y) + shift);
                if (c >= 3) continue;
                const double spread =
                    std::max(0.0, sums_[m].row(from + planes.square(c), y)[x] / weight - shift * shift);
                const double kriging = sums_[m].row(from + planes.variance(), y)[x] / weight;
                const double own = kriging * static_cast<double>(data_.variances().row(c, y)[x]) / perSample;
                variance[c] += spread + std::max(0.0, own - spread) / 2;
            }
        }
        for (int c = 0; c < 3; ++c)
            estimates_[m].row(out.variance() + c, y)[x] = static_cast<float>(variance[c] / 4);
        estimates_[m].row(out.leverage(), y)[x] = static_cast<float>(leverage / 2);
    }
}

/// Where a pixel lies in a gap, a model's neighbourhoods reach it with less and less to say: from half their
/// reach to the whole of it the widest model takes its place, and that one's what is read off the means of
/// blocks, so that no border shows where they end.
void Level::fillGaps(int y) {
    const ModelPlanes planes{radiance_};
    const DataPlanes data{radiance_};
    std::size_t widest = 0;
    for (std::size_t m = 1; m < models_.size(); ++m)
        if (models_[m].reach > models_[widest].reach) widest = m;
    const auto mix = [](float& value, float other, float share) { value += share * (other - value); };
    for (int x = 0; x < width_; ++x) {
        const float gap = data_.data().row(data.gap(), y)[x];
        if (gap == 0) continue;
        const auto share = [&](std::size_t m) {
            return std::clamp(2 * gap / static_cast<float>(models_[m].reach) - 1, 0.f, 1.f);
        };
        for (int k = 0; k < 2 * radiance_; ++k)
            mix(estimates_[widest].row(k, y)[x], data_.data().row(k, y)[x], share(widest));
        for (int c = 0; c < 3; ++c)
            mix(estimates_[widest].row(planes.variance() + c, y)[x], 0, share(widest));
        for (std::size_t m = 0; m < models_.size(); ++m)
            for (int k = 0; k < planes.channels() && m != widest; ++k)
                mix(estimates_[m].row(k, y)[x], estimates_[widest].row(k, y)[x], share(m));
    }
}

void Level::combine(int until) {
    until = std::min(until, height_);
    while (combinedRows_ < until) {  // few rows at a time: the rings hold no more
        const int end = std::min(until, combinedRows_ + kTile);
        krige(end + kStackReach + kMaxReach);
        combined_.claim(combinedRows_, end);
        parallelFor(combinedRows_, end,
                    [&](std::int64_t y) { combination_.combineRow(static_cast<int>(y), steps_.stacking); });
        combinedRows_ = end;
        clock_.addTo("combining");
    }
}

}  // namespace vlx
