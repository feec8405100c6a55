#pragma once

#include <vector>

#include "reconstruct/common/pixel_statistics.h"

/// What stands in where a picture has no samples near.
namespace vlx {

/// Means of blocks of 8 x 8 pixels of the dump; blocks without samples have what those around have at the
/// finest scale that knows anything ("pull-push": Gortler et al., The Lumigraph, 1996, section 3.4), and how
/// far it is to the nearest block with samples. Memory: a 64th of the picture.
class GapField {
  public:
    /// Reads the dump once.
    GapField(const SampleSource& dump, const SampleLayout& layout, const GatheredPlanes& planes);

    /// Values at a place in pixels of the dump, linear between blocks: radiance, then features.
    /// Returns how far away, in pixels, the nearest samples are, give or take half a block.
    double at(double x, double y, std::vector<float>& values) const;

    static std::uint64_t bytes(const SampleSource& dump, const SampleLayout& layout);

  private:
    std::vector<float> blocks_;  // values and distance, block by block
    int columns_ = 0, rows_ = 0, values_ = 0;
};

}  // namespace vlx
