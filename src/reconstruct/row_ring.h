#pragma once

#include <cassert>
#include <cstddef>
#include <vector>

namespace vlx {

/// Rows of several planes of floats, of which only the last `capacity` are kept: row y overwrites row
/// y - capacity. Rows are counted from 0; contiguous along x.
class RowRing {
  public:
    RowRing() = default;
    RowRing(int width, int channels, int capacity)
        : width_(static_cast<std::size_t>(width)),
          channels_(channels),
          capacity_(capacity),
          values_(width_ * static_cast<std::size_t>(channels) * static_cast<std::size_t>(capacity)) {}

    int channels() const { return channels_; }
    std::size_t bytes() const { return values_.size() * sizeof(float); }

    float* row(int channel, int y) { return values_.data() + offset(channel, y); }
    const float* row(int channel, int y) const { return values_.data() + offset(channel, y); }

  private:
    std::size_t offset(int channel, int y) const {
        assert(y >= 0 && channel >= 0 && channel < channels_);
        return (static_cast<std::size_t>(y % capacity_) * static_cast<std::size_t>(channels_) +
                static_cast<std::size_t>(channel)) *
               width_;
    }

    std::size_t width_ = 0;
    int channels_ = 0;
    int capacity_ = 1;
    std::vector<float> values_;
};

}  // namespace vlx
