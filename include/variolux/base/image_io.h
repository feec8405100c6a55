#pragma once

#include <map>
#include <string>

#include "variolux/base/image.h"

namespace vlx {

/// Reads a flat image of any format OpenImageIO knows (EXR, PNG, HDR, TIFF, PFM, ...) as float, no colour
/// conversion. EXR keeps its windows, channel names (layers as "layer.R") and channel order; several parts of
/// a multi-part EXR: the first flat one. Single-channel "Y" stays "Y".
/// Throws Error when the file is missing, unreadable, truncated, deep only, empty, or larger than 2^31
/// values.
Image readImage(const std::string& path);

struct ImageWriteOptions {
    bool half = false;                              ///< EXR only: 16-bit channels instead of 32-bit
    std::string compression = "zip";                ///< EXR only
    std::map<std::string, std::string> attributes;  ///< EXR and PNG text attributes
};

/// Writes `image` in the format of the path's extension. 8-bit formats get values clamped to [0, 1] and
/// quantised as they are: apply a transfer function first (see linearToSrgb). The file appears under its name
/// only when complete. Throws Error when the format is unknown or the disk refuses.
void writeImage(const std::string& path, const Image& image, const ImageWriteOptions& options = {});

/// The sRGB transfer function: linear value in [0, 1] to display value in [0, 1]; clamps outside (NaN to 0).
float linearToSrgb(float linear);

}  // namespace vlx
