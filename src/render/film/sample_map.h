#pragma once

#include <cstdint>
#include <string>

#include "variolux/base/image.h"
#include "variolux/base/window.h"

namespace vlx::render {

/// Where samples are wanted: for each pixel a density relative to the others.
class SampleMap {
  public:
    /// Reads the channel `sampling.density` of a flat image (or `Y`, or the only one). Throws Error when
    /// there is none, when a value is negative or not finite, when the image is of another picture (its
    /// display window) or does not cover `window` of it, and when there is no density there.
    SampleMap(const std::string& path, const Window& picture, const Window& window);

    /// Samples of a pixel when the mean over the window is to be `mean`: the density's share, rounded up or
    /// down at random, by `seed`, so that the expectation is exact.
    int samplesAt(int x, int y, int mean, std::uint64_t seed) const;
    /// The most that any pixel gets.
    std::int64_t most(int mean) const;

  private:
    Image image_;
    int channel_;
    double total_ = 0;  ///< over the window
    double greatest_ = 0;
    std::int64_t pixels_;
};

}  // namespace vlx::render
