#pragma once

#include <span>
#include <string>
#include <vector>

#include "variolux/base/window.h"

namespace vlx {

/// The most replicates of splats that a dump holds: their channels have numbers of two digits.
inline constexpr int kMostSplatReplicates = 64;

/// Light that a bidirectional tracer's light subpaths brought to the picture: an image of radiance (R, G, B)
/// for each replicate, whose light subpaths are independent of the others'. The camera samples of a replicate
/// plus its splats are an estimate of the picture; the estimates of the replicates are independent and
/// identically distributed.
class SplatImages {
  public:
    SplatImages(const Window& data, int replicates)
        : data_(data),
          replicates_(replicates),
          values_(static_cast<std::size_t>(data.pixels()) * 3 * static_cast<std::size_t>(replicates)) {}

    const Window& data() const { return data_; }
    int replicates() const { return replicates_; }

    /// A replicate's value at raster pixel (x, y); channel 0: R, 1: G, 2: B.
    float& at(int x, int y, int replicate, int channel) {
        return values_[rowSize() * static_cast<std::size_t>(y - data_.y) +
                       plane(replicate, channel) * static_cast<std::size_t>(data_.width) +
                       static_cast<std::size_t>(x - data_.x)];
    }
    /// The planes of row y one after the other, in the file's order of channels (splatChannels).
    std::span<const float> row(int y) const {
        return {values_.data() + rowSize() * static_cast<std::size_t>(y - data_.y), rowSize()};
    }
    /// Number of a plane in a row.
    static std::size_t plane(int replicate, int channel) {
        return 3 * static_cast<std::size_t>(replicate) + 2 - static_cast<std::size_t>(channel);
    }

  private:
    std::size_t rowSize() const {
        return 3 * static_cast<std::size_t>(replicates_) * static_cast<std::size_t>(data_.width);
    }

    Window data_;
    int replicates_;
    std::vector<float> values_;
};

/// Names of the channels of the part `splats`, sorted: r00.B, r00.G, r00.R, r01.B, ...
std::vector<std::string> splatChannels(int replicates);

}  // namespace vlx
