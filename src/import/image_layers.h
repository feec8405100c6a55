#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "import/import.h"
#include "variolux/base/image.h"

namespace vlx {

/// What copyWithLayers() did.
struct LayerCopy {
    ChannelMap replaced;             ///< channel of the file -> channel of the image
    std::vector<std::string> added;  ///< channels that the file did not have
    std::int64_t overflows = 0;      ///< values beyond HALF's range, 65504: stored as +-65504
    std::string recompressed;  ///< compression of the file, where another one had to be taken; else empty
};

/// Copies a flat OpenEXR file, of one part or several, with some channels replaced by an image's.
///
/// Everything else is passed through bit for bit: parts without a replaced channel as they are (their packed
/// bytes are copied); of the others all other channels' values, the types of channels (replaced ones too),
/// compression, windows, line order, tiles, and all attributes, also those of types that OpenEXR does not
/// know. Where a part's compression loses bits anew each time (B44, B44A, DWAA, DWAB) that part becomes ZIP.
///
/// `replace`: dump channel (as the image calls it: R, G, B, A, a light group's) -> channel of the file, as
/// FlatImages call them: in parts after the first with the part's name before it. Channels of the image
/// without an entry (stddev.R) belong beside the layer that R is put into: under its layerPrefix(), where
/// Blender's compositor looks for them (ViewLayer.stddev.R beside ViewLayer.Combined.R; ViewLayer.ao.V for
/// ao), unless their names begin so already. They replace channels of that name, else of their own, else they
/// are added to the part that has R's, as FLOAT. `attributes`: texts that the first part's header gets.
/// Memory is some rows of all channels. The file appears under its name when it is complete. Throws Error
/// when `from` is not such a file, when its data window is not the image's, a channel is missing, has not a
/// value for each pixel, or has several resolutions, and when writing fails.
LayerCopy copyWithLayers(const std::string& from, const std::string& to, const Image& image,
                         const ChannelMap& replace,
                         const std::map<std::string, std::string>& attributes = {});

/// Where a renderer's file has R, G, B (and A), by StackPreset::Auto, `layer` (StackOptions) and `map`, whose
/// other entries are kept. Throws Error when it cannot be read or has nothing to take as R, G, B.
ChannelMap findRadiance(const std::string& image, const ChannelMap& map, const std::string& layer = {});

}  // namespace vlx
