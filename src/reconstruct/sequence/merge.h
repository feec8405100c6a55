#pragma once

#include <vector>

#include "reconstruct/data/sampled_frame.h"

/// Data of neighbouring frames, brought to a frame by motion and joined to its own.
namespace vlx {

/// Refers to its frames, all of whose rows are filled.
class Merge : public PixelSource {
  public:
    /// `before`: the frames 1, 2, ... before this one; `after` likewise. Of the same size and channels as it.
    Merge(const SampledFrame& own, std::vector<const SampledFrame*> before,
          std::vector<const SampledFrame*> after);

    void startAbove(int first) override;
    void fill(int first, int end, PixelRows& out) override;
    const FrameCounts& counts() const override { return counts_; }
    std::uint64_t ringBytes() const override { return apart_.bytes(); }

  private:
    std::size_t neighbours() const { return before_.size() + after_.size(); }
    const SampledFrame& neighbour(std::size_t k) const {
        return *(k < before_.size() ? before_[k] : after_[k - before_.size()]);
    }
    void compareRow(int y);
    void compareRow(int y, const SampledFrame& there, const float* places, std::size_t k);
    std::vector<float> weightsOf(int y) const;
    void mergeRow(int y, PixelRows& out) const;

    const SampledFrame& own_;
    const SampleLayout& layout_;
    DataPlanes planes_;
    FeaturePlanes featurePlanes_;
    std::vector<const SampledFrame*> before_, after_;
    int width_, height_;
    RowRing apart_;  // ApartPlanes of each neighbour
    FrameCounts counts_;
    int comparedRows_ = 0;
};

}  // namespace vlx
