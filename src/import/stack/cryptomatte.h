#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "exr/flat_images.h"

namespace vlx {

/// A cryptomatte of several images as one: of each pixel ranks of (id, coverage). An image's layers NAME00,
/// NAME01, ... hold two ranks each, R, G and B, A (Friedman and Jones, "Fully automatic ID mattes with
/// support for motion blur and transparency", 2015). The coverage of an id is the mean over the images; the
/// ranks are ordered by it, equal ones as they come. Ids are bit patterns and copied as such.
class Cryptomatte {
  public:
    /// Of the layers that begin with `name`; from now on their channels are read.
    Cryptomatte(FlatImages& images, const std::string& name);

    /// Names of the channels, two a rank: id, coverage.
    const std::vector<std::string>& channels() const { return names_; }
    /// Writes a pixel of the rows read last: values of channels(). Returns the coverage of ids beyond the
    /// ranks, which is left out.
    float merge(const FlatImages& images, std::size_t pixel, float* out) const;

  private:
    std::vector<std::string> names_;
    std::vector<std::vector<FlatChannel>> taken_;  // of each image: names_
};

}  // namespace vlx
