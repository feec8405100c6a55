#pragma once

#include <cstdint>
#include <memory>

#include "reconstruct/data/level_data.h"
#include "variolux/reconstruct/drift.h"

/// What is known of a frame's pixels, at its resolution and at half of it: drift.h, 1 and 2.
namespace vlx {

/// What was found in the rows that are the reconstruction's own.
struct FrameCounts {
    std::int64_t samples = 0, dropped = 0, empty = 0;
    RadianceRange range;
    std::int64_t limited = 0;    ///< samples made darker as fireflies
    std::int64_t farPixels = 0;  ///< without samples within kHoleReach
    double luminance = 0, removed = 0;
    double light = 0, noise = 0;  ///< GatherCounts
};

/// Where a frame's data come from.
class PixelSource {
  public:
    virtual ~PixelSource() = default;
    /// Rows from `first` on are asked for.
    virtual void startAbove(int first) = 0;
    /// Fills the rows [first, end) of the fine level's pixels; the next call goes on there.
    virtual void fill(int first, int end, PixelRows& out) = 0;
    virtual const FrameCounts& counts() const = 0;
    virtual std::uint64_t ringBytes() const = 0;
};

/// Two levels, of which the coarse one's data are the fine one's, 2 x 2 pixels as one; filled as far as they
/// are asked for.
class Frame {
  public:
    /// All that it is given must live as long.
    Frame(const SampleLayout& layout, const PictureScale& picture, const Drift& options, int width,
          int height, Kept kept, PixelSource& source, StageClock& clock);
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

    const SampleLayout& layout() const { return layout_; }
    const PictureScale& picture() const { return picture_; }
    int width() const { return fine_.width(); }
    int height() const { return fine_.height(); }
    bool halved() const { return coarse_ != nullptr; }  ///< large enough for a coarse level
    LevelData& fine() { return fine_; }
    LevelData& coarse() { return *coarse_; }
    const LevelData& fine() const { return fine_; }
    const FrameCounts& counts() const { return source_.counts(); }

    /// Lets the levels start just far enough above their rows `fine` and `coarse` of variances for these to
    /// be what they are in the whole picture.
    void startAbove(int fine, int coarse);
    /// Fills all rows of the fine level.
    void fillAll();
    std::uint64_t ringBytes() const;

  private:
    void fill(int until);

    const SampleLayout& layout_;
    const PictureScale& picture_;
    PixelSource& source_;
    StageClock& clock_;
    LevelData fine_;
    std::unique_ptr<LevelData> coarse_;
    int filledRows_ = 0;
};

}  // namespace vlx
