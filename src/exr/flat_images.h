#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "variolux/base/window.h"

namespace vlx {

class ImageInput;

/// A flat image with pixels, whose header was checked before OpenImageIO believes it. Throws Error.
std::unique_ptr<ImageInput> openFlat(const std::string& path);

bool contains(const std::vector<std::string>& names, const std::string& name);

/// A channel, its values multiplied by a factor.
struct ScaledChannel {
    std::string name;
    float factor = 1;
};

/// Of "FACTOR*NAME", for example -1*flow.y: up to the first '*' stands a finite number other than 0. Nothing
/// for any other text.
std::optional<ScaledChannel> parseScaled(const std::string& text);

/// What `source` stands for in an image of the channels `names`: the channel of this very name, else
/// parseScaled(), else a channel that is not there.
ScaledChannel channelFor(const std::vector<std::string>& names, const std::string& source);

/// A channel of one of a set of images.
struct FlatChannel {
    std::size_t image = 0;
    std::size_t index = 0;  ///< among the channels taken from that image
    float factor = 1;       ///< of its values
};

/// Channels of flat images of equal windows, read by bands of rows: what importers take samples from. Files
/// stay open between bands as long as systems allow so many. Memory is a band of the channels taken.
class FlatImages {
  public:
    /// Opens all images. Throws Error when one cannot be read, is deep, or has other windows than the first.
    explicit FlatImages(std::vector<std::string> paths);
    ~FlatImages();

    std::size_t size() const;
    const std::string& path(std::size_t image) const;
    /// Of all flat parts with the first one's data window (partChannel).
    const std::vector<std::string>& channels(std::size_t image) const;
    /// Type of a channel of an image: "half", "float", ...; "" where it has none of this name.
    std::string type(std::size_t image, const std::string& channel) const;
    Window data() const;
    Window display() const;
    /// Text attribute of an image, empty when it has none of this name.
    std::string text(std::size_t image, const std::string& attribute) const;
    /// Number attribute of an image.
    std::optional<double> number(std::size_t image, const std::string& attribute) const;

    /// From now on, read() reads this channel too (channelFor). Throws Error when the image has no such
    /// channel.
    FlatChannel take(std::size_t image, const std::string& source);

    /// Rows a band may have so that `values` floats a pixel stay within a fixed memory.
    int bandRows(std::size_t values) const;

    /// Reads the rows [y, y + rows) of all channels taken; images are read in parallel. Throws Error.
    void read(int y, int rows);

    /// Of pixel `pixel`, counted row by row, of the rows read last.
    float value(FlatChannel channel, std::size_t pixel) const;

    /// Hash of all values read of an image so far: equal for images that are identical.
    std::uint64_t hash(std::size_t image) const;

  private:
    class Source;
    std::vector<std::unique_ptr<Source>> sources_;
};

}  // namespace vlx
