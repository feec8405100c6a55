#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/data/sampled_frame.h"

/// Data of neighbouring frames, brought to a frame by motion and joined to its own: drift.h, 10.
namespace vlx {

/// A frame beside the one that is kriged.
struct Neighbour {
    const SampledFrame* frame;
    bool sameSeed =
        false;  ///< its samples in a pixel are those of the own frame: where nothing moves, no news
};

/// Refers to its frames, all of whose rows are filled and kept.
class Merge : public PixelSource {
  public:
    /// `before`: the frames 1, 2, ... before this one; `after` likewise. Of the same size and channels as it.
    Merge(const SampledFrame& own, std::vector<Neighbour> before, std::vector<Neighbour> after);

    void startAbove(int first) override;
    /// The datum of a pixel's half becomes the mean of its own and those of the K neighbours, weighted by
    /// w_k and numbers of samples; its count is the effective one,
    ///     z = sum w n z / sum w n,    n = (sum w n)^2 / sum w^2 n,    w = 1 for its own.
    /// A neighbour's is interpolated between the four pixels around the point's place there (weights of
    /// smoothstep: a linear one blurs more, the nearest pixel is off by more). w_k = exp(-20 d - f - m):
    ///  - d of the *other* half, so that weights are independent of what they weigh: of the mean over 7 x 7
    ///    pixels of (|dz|^2 - (v1 + v2)) / (v1 + v2), v error variances, each at most kWildVariances (a
    ///    change of light is in many pixels, a firefly in one), what is beyond its standard error sqrt(2 /
    ///    number); and the same of 21 x 21 pixels, which show smaller changes;
    ///  - f of the features, sum of (df^2 - (u1 + u2)) / (0.35^2 + 2 (u1 + u2)), u their error variances;
    ///  - m = |motion there and back|^2, in pixels: what was hidden goes elsewhere.
    /// Neither is less than 0. Scatter and features are merged by the same weights, those of both halves
    /// averaged.
    void fill(int first, int end, PixelRows& out) override;
    /// The frame's own, but for `luminance`, `light` and `noise`: these are of the merged data.
    const FrameCounts& counts() const override { return counts_; }
    std::uint64_t ringBytes() const override { return apart_.bytes(); }

    /// Of the rows filled: mean of n over the frame's own, of pixels that have samples.
    double gain() const { return own_ > 0 ? merged_ / own_ : 1; }

  private:
    struct Tap;
    const Neighbour& neighbour(std::size_t k) const {
        return k < before_.size() ? before_[k] : after_[k - before_.size()];
    }
    std::size_t neighbours() const { return before_.size() + after_.size(); }
    void compareRow(int y);
    void compareRow(int y, std::size_t k, const std::vector<float>& places);
    void addExcess(int y, std::size_t k, int plane, int known, int reach, float* out) const;
    std::vector<float> weightsOf(int y) const;
    void mergeRow(int y, PixelRows& out) const;
    void countRow(int y, const PixelRows& out);
    void addTaps(int x, int y, std::size_t k, const std::vector<float>& weights,
                 std::vector<Tap>& taps) const;

    const SampledFrame& frame_;
    const SampleLayout& layout_;
    DataPlanes planes_;
    FeaturePlanes features_;
    std::vector<Neighbour> before_, after_;
    int width_, height_;
    RowRing apart_;  // ApartPlanes of each neighbour
    FrameCounts counts_;
    int comparedRows_ = 0;
    double own_ = 0, merged_ = 0;
};

}  // namespace vlx
