#include "reconstruct/data/frame.h"

#include <algorithm>

#include "reconstruct/data/prefilter.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

constexpr int kFilledRows = 32;        // pixels of data filled at a time
constexpr int kDraftFeatureReach = 3;  // of prefilterFeatures()

int featureReachOf(const Drift& options) {
    if (!options.steps.prefilter) return 0;
    return options.quality == Quality::Draft ? kDraftFeatureReach : kMostFeatureReach;
}

bool isHalved(const Drift& options, int width, int height) {
    return options.steps.halfResolution && std::min(width, height) >= kLeastHalved;
}

}  // namespace

Frame::Frame(const SampleLayout& layout, const PictureScale& picture, const Drift& options, int width,
             int height, Kept kept, PixelSource& source, StageClock& clock)
    : layout_(layout),
      picture_(picture),
      source_(source),
      clock_(clock),
      fine_(
          layout, options.steps.unseen, featureReachOf(options), width, height, kept,
          isHalved(options, width, height), picture, [this](int until) { fill(until); }, clock) {
    if (!isHalved(options, width, height)) return;
    coarse_ = std::make_unique<LevelData>(
        layout, options.steps.unseen, featureReachOf(options), (width + 1) / 2, (height + 1) / 2, Kept::Rows,
        false, picture, [this](int until) { fill(2 * until); }, clock);
    fine_.lookAt(*coarse_);
}

void Frame::startAbove(int fine, int coarse) {
    int filled = fine_.startAbove(fine);
    if (coarse_) filled = std::min(filled, 2 * coarse_->startAbove(coarse));
    filledRows_ = filled / 2 * 2;
    source_.startAbove(filledRows_);
}

void Frame::fillAll() {
    for (int y = 0; y < height(); y += kTile) fine_.fill(y + kTile);  // few at a time: rings hold no more
}

std::uint64_t Frame::ringBytes() const {
    return source_.ringBytes() + fine_.ringBytes() + (coarse_ ? coarse_->ringBytes() : 0);
}

/// Data of both levels up to (not including) `until`, cut to the picture.
void Frame::fill(int until) {
    until = std::min(until, height());
    while (filledRows_ < until) {
        const int first = filledRows_, end = std::min(height(), first + kFilledRows);
        fine_.pixels().claim(first, end);
        source_.fill(first, end, fine_.pixels());
        if (coarse_) {
            coarse_->pixels().claim(first / 2, (end + 1) / 2);
            parallelFor(first / 2, (end + 1) / 2, [&](std::int64_t y) {
                halveRow(fine_.pixels(), width(), height(), layout_.radiance, layout_.features,
                         static_cast<int>(y), coarse_->pixels());
            });
        }
        filledRows_ = end;
        clock_.addTo("statistics");
    }
}

}  // namespace vlx
