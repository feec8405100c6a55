#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "variolux/base/channel_names.h"
#include "variolux/base/image.h"

namespace vlx {

/// What is compared of an image.
struct ColourImage {
    ChannelTriple channels;            ///< of the file, that are its red, green and blue
    Image colour;                      ///< those as R, G, B
    std::optional<Image> stddev;       ///< R, G, B of the layer stddev that belongs to them (findError())
    bool layerFound = false;           ///< there is a layer of the name asked for
    std::vector<std::string> present;  ///< the names of all channels
};

/// Reads the colours of an image of any format, of all its flat parts (readImage()): of a `layer` where the
/// file has it, else what findColour() finds, else the one channel of a one-channel image. stddev only when
/// asked for. Memory is that of what is returned. Throws Error as readImage(), and when there is no colour,
/// listing the layers there are.
ColourImage readColour(const std::string& path, const std::string& layer = {}, bool withStddev = false);

/// A layer that one at least of several images must have.
class LayerSearch {
  public:
    /// An empty name asks for nothing.
    explicit LayerSearch(std::string layer) : layer_(std::move(layer)) {}
    /// An image that was read with this layer.
    void add(const ColourImage& image);
    /// Throws Error, listing the layers there are, when no image has it.
    void check() const;

  private:
    std::string layer_;
    bool found_ = false;
    std::vector<std::string> present_;
};

}  // namespace vlx
