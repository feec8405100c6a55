#pragma once

#include <ImfCompression.h>
#include <ImfLineOrder.h>

#include <map>
#include <string>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/dump/format.h"

namespace vlx {

/// A part of a renderer's flat file, as OpenEXR writes it.
struct LayerPart {
    std::string name;
    Window data, display;
    std::vector<DumpChannel> channels;
    Imf::Compression compression = Imf::ZIP_COMPRESSION;
    Imf::LineOrder order = Imf::INCREASING_Y;
    bool tiled = false;   ///< 8 x 16 pixels
    bool mipmap = false;  ///< tiles of several resolutions, of which only the first is written
};

/// Values are layerValue(), or `constant` where a channel has an entry. Each part has a text attribute and
/// one of a type that OpenEXR does not know.
void writeLayers(const std::string& path, const std::vector<LayerPart>& parts,
                 const std::map<std::string, float>& constants = {});
float layerValue(const std::string& channel, int x, int y);

/// Two parts of 13 x 150 pixels at (3, -2) in a picture of 40 x 200, and one of other pixels: `beauty` with
/// HALF R G B A, FLOAT Z, UINT id and a light group, rows from below; `variance` with FLOAT R G B, in tiles;
/// `mask` with HALF x.
std::vector<LayerPart> rendererParts();

/// All that a file holds, to compare.
struct ReadPart {
    std::map<std::string, std::string> attributes;  ///< type and bytes; without `channels`
    std::map<std::string, std::string> channels;    ///< type and bytes
};
std::vector<ReadPart> readLayers(const std::string& path);

/// Bytes of a channel as ReadPart has them.
std::string layerBytes(ChannelType type, const std::vector<float>& values);

}  // namespace vlx
