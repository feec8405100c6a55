#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "reconstruct/data/level_data.h"
#include "variolux/reconstruct/drift.h"

/// What the samples of one dump say, pixel by pixel, at its resolution and at half of it: drift.h, 1 and 2.
namespace vlx {

/// What was found in the rows that are the reconstruction's own.
struct FrameCounts {
    std::int64_t samples = 0, dropped = 0, empty = 0;
    std::int64_t limited = 0;    ///< samples made darker as fireflies
    std::int64_t farPixels = 0;  ///< without samples within kHoleReach
    double luminance = 0, removed = 0;
    double light = 0, noise = 0;  ///< GatherCounts
};

/// Samples are gathered to pixels, these limited to data, at both resolutions, features prefiltered and
/// variances pooled; all as far as it is asked for.
class Frame {
  public:
    /// Throws Error as chooseSampleLayout(), and where the dump has more features or radiance channels than
    /// kriging takes. The dump and the options must live as long.
    Frame(const SampleSource& dump, const Drift& options, Kept kept, StageClock& clock);
    Frame(const Frame&) = delete;
    Frame& operator=(const Frame&) = delete;

    const SampleLayout& layout() const { return layout_; }
    const PictureScale& picture() const { return picture_; }
    int width() const { return width_; }
    int height() const { return height_; }
    bool halved() const { return coarse_ != nullptr; }  ///< large enough for a coarse level
    LevelData& fine() { return fine_; }
    LevelData& coarse() { return *coarse_; }
    const LevelData& fine() const { return fine_; }
    const LevelData& coarse() const { return *coarse_; }
    const FrameCounts& counts() const { return counts_; }

    /// Chooses how many rows are read at a time so that the process, which holds `held` bytes besides what is
    /// read, takes no more than `most`. Throws Error when it takes more with one.
    void readWithin(std::uint64_t most, std::uint64_t held);
    /// Counts rows from `first` up to `end` only.
    void own(int first, int end);
    /// Lets the levels start just far enough above their rows `fine` and `coarse` of variances for these to
    /// be what they are in the whole picture. Nothing where all rows are kept.
    void startAbove(int fine, int coarse);
    /// Fills all rows of both levels.
    void fillAll();
    std::uint64_t ringBytes() const;

  private:
    bool isOwn(int y) const { return y >= firstRow_ && y < endRow_; }
    void gather(int until);
    void fill(int until);

    const SampleSource& dump_;
    const Drift& options_;
    Kept kept_;
    StageClock& clock_;
    SampleLayout layout_;
    GatheredPlanes planes_;
    int width_, height_, readRows_;
    PictureScale picture_;
    RowRing gathered_;
    LevelData fine_;
    std::unique_ptr<LevelData> coarse_;
    PixelData pixels_;
    FrameCounts counts_;
    int firstRow_ = 0, endRow_;  // own rows
    int gatheredRows_ = 0, filledRows_ = 0;
};

}  // namespace vlx
