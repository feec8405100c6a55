#include "reconstruct/data/level_data.h"

#include <algorithm>

#include "reconstruct/data/prefilter.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

// Rows kept at each stage: what later stages look back at, and as far ahead as it is filled for them. With
// tiles of 32 rows, centres that reach 15, patches that reach 3 and windows that reach 11, each is what was
// seen over heights, widths, bands and scales of tall pictures, and some to spare; builds with assertions
// notice where it is more.
struct PixelRowCounts {
    int data, squares, raw;
};
constexpr PixelRowCounts kPixelRows{248, 184, 112};
constexpr PixelRowCounts kLeadingRows{392, 256, 280};  // of a level whose source another one drives ahead
constexpr int kResidualRows = 64;                      // a tile's, and kReturnReach around
constexpr int kFeatureRows = 200;                      // finishing looks back at them
constexpr int kVarianceRows = 164;                     // and at these

const PixelRowCounts& rowsOf(bool driven) { return driven ? kLeadingRows : kPixelRows; }

int keptOf(Kept kept, int rows, int height) { return kept == Kept::Whole ? height : std::min(rows, height); }

}  // namespace

LevelData::LevelData(const SampleLayout& layout, bool unseen, int featureReach, int width, int height,
                     Kept kept, bool driven, const PictureScale& picture, Source source, StageClock& clock)
    : layout_(layout),
      unseen_(unseen),
      featureReach_(featureReach),
      width_(width),
      height_(height),
      radiance_(layout.radiance),
      picture_(picture),
      source_(std::move(source)),
      clock_(clock),
      pixels_{RowRing(width, DataPlanes{radiance_}.channels(), keptOf(kept, rowsOf(driven).data, height)),
              RowRing(width, SquaresPlanes::kChannels, keptOf(kept, rowsOf(driven).squares, height)),
              RowRing(width, FeaturePlanes{layout.features}.rawChannels(),
                      keptOf(kept, rowsOf(driven).raw, height))},
      features_(width, FeaturePlanes{layout.features}.channels(), keptOf(kept, kFeatureRows, height)),
      residuals_(width, ResidualPlanes{layout.groups}.channels(), std::min(kResidualRows, height)),
      variances_(width, VariancePlanes::kChannels, keptOf(kept, kVarianceRows, height)) {}

int LevelData::startAbove(int first) {
    varianceRows_ = std::max(0, first);
    featureRows_ = std::max(0, varianceRows_ - kVarianceReach);
    prefilteredRows_ = std::max(0, featureRows_ - kReturnReach) / kTile * kTile;
    return std::max(0, prefilteredRows_ - kTileMargin);
}

std::uint64_t LevelData::ringBytes() const {
    std::uint64_t bytes = 0;
    for (const RowRing* ring :
         {&pixels_.data, &pixels_.squares, &pixels_.raw, &features_, &residuals_, &variances_})
        bytes += ring->bytes();
    return bytes;
}

// Each stage fills rows up to (not including) `until`, cut to the picture, after the stages that it needs.

void LevelData::prefilter(int until) {
    until = std::min(until, height_);
    while (featureRows_ < until) {
        const int ahead = std::min(height_, featureRows_ + 1 + kReturnReach);
        while (prefilteredRows_ < ahead) {
            const int y = prefilteredRows_;
            source_(y + kTile + kTileMargin);
            for (RowRing* ring : {&features_, &residuals_}) ring->claim(y, std::min(height_, y + kTile));
            parallelFor(0, (width_ + kTile - 1) / kTile, [&](std::int64_t tile) {
                prefilterFeatures(pixels_.raw, pixels_.data, {radiance_}, layout_, featureReach_,
                                  static_cast<int>(tile) * kTile, y, width_, height_, features_, residuals_);
            });
            prefilteredRows_ = std::min(height_, y + kTile);
        }
        const int end = prefilteredRows_ == height_ ? height_ : prefilteredRows_ - kReturnReach;
        parallelFor(featureRows_, end, [&](std::int64_t y) {
            returnResiduals(pixels_.raw, residuals_, layout_, static_cast<int>(y), width_, height_,
                            features_);
        });
        featureRows_ = end;
        clock_.addTo("features");
    }
}

void LevelData::fill(int until) {
    until = std::min(until, height_);
    if (varianceRows_ >= until) return;
    if (wider_) wider_->fill(until / 2 + 1);
    prefilter(until + kVarianceReach);
    source_(until + kVarianceReach);
    variances_.claim(varianceRows_, until);
    parallelFor(varianceRows_, until, [&](std::int64_t y) {
        smoothVariances(pixels_.squares, pixels_.data, {radiance_}, features_, layout_.features, picture_,
                        unseen_, wider_ ? &wider_->variances_ : nullptr, static_cast<int>(y), width_, height_,
                        variances_);
    });
    varianceRows_ = until;
    clock_.addTo("variances");
}

}  // namespace vlx
