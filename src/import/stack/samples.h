#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "import/stack/plan.h"
#include "variolux/dump/band.h"

namespace vlx {

/// A stack's samples: of each pixel one an image, in the images' order.
class StackedSamples {
  public:
    /// From now on the plan's channels are read. Replicates are numbered from `firstReplicate`.
    StackedSamples(FlatImages& images, const StackPlan& plan, std::uint32_t firstReplicate);

    /// Of the rows [row, row + rows), counted from the first one, which were read last.
    SampleBand band(int row, int rows);

    std::int64_t misses() const { return misses_; }          ///< depths that became 0
    std::int64_t motionless() const { return motionless_; }  ///< samples whose motion became unknown

  private:
    FlatImages& images_;
    const StackPlan& plan_;
    std::uint32_t firstReplicate_;
    std::vector<std::vector<Mixture>> channels_;  // of each dump channel: of each image, if of any
    std::int64_t misses_ = 0, motionless_ = 0;
};

/// The band without the pixels that were not rendered.
SampleBand withoutEmpty(SampleBand band, const std::vector<char>& rendered, std::size_t images);

}  // namespace vlx
