#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "import/stack.h"
#include "variolux/base/channel_names.h"

namespace vlx {

using Names = std::vector<std::string>;

/// The three channels of the first of these layers that the image has: layer.R .G .B, or .r .g .b, or the
/// same with X Y Z. The layer "" is R, G, B themselves.
std::optional<std::array<std::string, 3>> findTriple(const Names& names, const Names& layers);

/// Luminance in place of three colours: three times the channel Y, or layer.Y, of the first of these layers
/// that has it.
std::optional<std::array<std::string, 3>> findLuminance(const Names& names, const Names& layers);

/// The channel of the first of these layers that holds one number a pixel: the name itself or one of the
/// endings that renderers give a depth.
std::optional<std::string> findNumber(const Names& names, const Names& layers);

/// Enters three channels of `to` ("albedo" -> albedo.R ..., "N" -> N.X ..., "" -> R ...) unless some are
/// there.
void enter(ChannelMap& map, const std::string& to, const std::optional<std::array<std::string, 3>>& from);

/// The colours of the layer that --layer names: findColour(). Throws Error, listing the layers there are.
ChannelTriple namedLayer(const std::string& path, const Names& names, const std::string& layer);

struct ChosenMap {
    ChannelMap map;
    StackPreset preset = StackPreset::Plain;  ///< what Auto stood for
};

/// What a stack takes from an image of these channels. Throws Error when there is nothing to take as R, G, B.
ChosenMap chooseStackMap(const std::string& path, const Names& names, const StackOptions& options);

/// The dump's channels for a map: those of standardChannels() in their order, then others as FLOAT;
/// sample.replicate only with `replicates`.
std::vector<DumpChannel> dumpChannels(const ChannelMap& map, bool replicates);

/// Z of a sample that hit nothing is 0; renderers write 1e10, infinity or -1. Returns whether z was such.
bool cleanDepth(float& z);

}  // namespace vlx
