#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/sequence/likeness.h"

/// Data of neighbouring frames, brought to a frame by motion and joined to its own: drift.h, 10.
namespace vlx {

/// Refers to its frames, all of whose rows are filled and kept.
class Merge : public PixelSource {
  public:
    /// As Likeness.
    Merge(const SampledFrame& own, std::vector<Neighbour> before, std::vector<Neighbour> after);

    void startAbove(int first) override { likeness_.startAbove(first); }
    /// The datum of a pixel's half becomes the mean of its own and those of the K neighbours, weighted by
    /// w_k (Likeness) and numbers of samples; doubt counts as a larger error variance, v / (n w), as in
    /// neighbourhoods:
    ///     z = sum w n z / sum w n,    n = sum w n,    w = 1 for its own.
    /// A neighbour's is interpolated between the four pixels around the point's place there. Scatter and
    /// features are merged by the same weights, those of both halves averaged.
    void fill(int first, int end, PixelRows& out) override;
    /// The frame's own, but for `luminance`, `light` and `noise`: these are of the merged data.
    const FrameCounts& counts() const override { return counts_; }
    std::uint64_t ringBytes() const override { return likeness_.ringBytes(); }

    /// Of the rows filled: mean of n over the frame's own, of pixels that have samples.
    double gain() const { return own_ > 0 ? merged_ / own_ : 1; }

  private:
    struct Tap;
    void mergeRow(int y, PixelRows& out) const;
    void countRow(int y, const PixelRows& out);
    void addTaps(int x, int y, std::size_t k, const std::vector<float>& weights,
                 std::vector<Tap>& taps) const;

    const SampledFrame& frame_;
    const SampleLayout& layout_;
    DataPlanes planes_;
    FeaturePlanes features_;
    int width_;
    Likeness likeness_;
    FrameCounts counts_;
    double own_ = 0, merged_ = 0;
};

}  // namespace vlx
