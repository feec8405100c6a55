#pragma once

#include "reconstruct/data/frame.h"

/// From a dump's samples to a frame: drift.h, 1.
namespace vlx {

/// Samples are gathered to pixels, and these limited to data.
class SampledFrame : private PixelSource {
  public:
    /// Throws Error as chooseSampleLayout(), and where the dump has more features or radiance channels than
    /// kriging takes. The dump, the options and the clock must live as long.
    SampledFrame(const SampleSource& dump, const Drift& options, Kept kept, StageClock& clock);

    Frame& frame() { return frame_; }
    const Frame& frame() const { return frame_; }
    /// MotionPlanes, of the rows that are filled, where all are kept; no planes where it is not known.
    const RowRing& motion() const { return motion_; }

    /// Chooses how many rows are read at a time so that the process, which holds `held` bytes besides what is
    /// read, takes no more than `most`. Throws Error when it takes more with one.
    void readWithin(std::uint64_t most, std::uint64_t held);
    /// Counts rows from `first` up to `end` only.
    void own(int first, int end);
    bool isOwn(int y) const { return y >= firstRow_ && y < endRow_; }

  private:
    void startAbove(int first) override;
    void fill(int first, int end, PixelRows& out) override;
    const FrameCounts& counts() const override { return counts_; }
    std::uint64_t ringBytes() const override { return gathered_.bytes() + motion_.bytes(); }
    void gather(int until);

    const SampleSource& dump_;
    const Drift& options_;
    StageClock& clock_;
    SampleLayout layout_;
    GatheredPlanes planes_;
    int width_, height_, readRows_;
    PictureScale picture_;
    RowRing gathered_, motion_;
    Frame frame_;
    PixelData pixels_;
    FrameCounts counts_;
    int firstRow_ = 0, endRow_;  // own rows
    int gatheredRows_ = 0;
};

}  // namespace vlx
