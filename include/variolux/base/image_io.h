#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "variolux/base/image.h"

namespace vlx {

/// Reads a flat image of any format OpenImageIO knows (EXR, PNG, HDR, TIFF, PFM, ...) as float, no colour
/// conversion. EXR keeps its windows, channel names (layers as "layer.R") and channel order; several parts of
/// a multi-part EXR: the first flat one. Single-channel "Y" stays "Y".
/// Throws Error when the file is missing, unreadable, truncated, deep only, empty, or larger than 2^31
/// values.
Image readImage(const std::string& path);

/// Which channels of an image to read, of those that it has.
using ChannelChoice = std::function<std::vector<std::string>(const std::vector<std::string>&)>;

/// Reads the channels that `choose` takes, in its order, of all flat parts that have the data window of the
/// first flat one: channels of later parts are called as partChannel() says (base/channel_names.h). Memory is
/// that of the channels taken. Throws Error as readImage() does, and when there is no such channel.
Image readImage(const std::string& path, const ChannelChoice& choose);

struct ImageWriteOptions {
    bool half = false;                              ///< EXR only: 16-bit channels instead of 32-bit
    std::string compression = "zip";                ///< EXR only
    std::map<std::string, std::string> attributes;  ///< EXR and PNG text attributes
};

/// Writes an image row by row in the format of the path's extension. 8-bit formats get values clamped to [0,
/// 1] and quantised as they are: apply a transfer function first (see linearToSrgb). The file appears under
/// its name only after close(). All throw Error when the format is unknown or the disk refuses.
class ImageWriter {
  public:
    ImageWriter(const std::string& path, const Window& data, const Window& display,
                const std::vector<std::string>& channels, const ImageWriteOptions& options = {});
    ~ImageWriter();
    ImageWriter(const ImageWriter&) = delete;
    ImageWriter& operator=(const ImageWriter&) = delete;

    /// The next `count` rows from the top: interleaved channels, as Image::pixels has them.
    void write(const float* rows, int count);
    /// Gives the file its name. Throws Error when rows are missing, too.
    void close();

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

/// Writes a whole image as ImageWriter does.
void writeImage(const std::string& path, const Image& image, const ImageWriteOptions& options = {});

/// A text attribute of the first part of an image or a dump; empty when there is none, or no such file.
std::string readTextAttribute(const std::string& path, const std::string& name);

/// The sRGB transfer function: linear value in [0, 1] to display value in [0, 1]; clamps outside (NaN to 0).
float linearToSrgb(float linear);

}  // namespace vlx
