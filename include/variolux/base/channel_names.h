#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

/// How the channels of image files are called: LAYER.R. Where renderers keep their picture among them.
namespace vlx {

using ChannelTriple = std::array<std::string, 3>;

/// The layer of a channel, what stands before its last dot: ViewLayer.Combined of ViewLayer.Combined.R; ""
/// of R.
std::string layerOf(const std::string& channel);

/// What the layers beside a channel's own begin with: "ViewLayer." of ViewLayer.Combined.R, whose pass
/// Combined is one of the view layer's; "" of rgba.R and R.
std::string layerPrefix(const std::string& channel);

/// What a channel of a file of several parts is called: as it is in the first part; in others with the part's
/// name before it, unless it begins with that, or with its layerPrefix().
std::string partChannel(int part, const std::string& partName, const std::string& channel);

/// The three colours, or coordinates, of a layer among `names`: layer.R .G .B, or .r .g .b, .X .Y .Z,
/// .x .y .z; without a layer's name and its dot when `layer` is empty.
std::optional<ChannelTriple> layerTriple(const std::vector<std::string>& names, const std::string& layer);

/// "L." of the first layer L that has a pass Combined, as Blender names them; an empty name of a layer
/// counts. Composite, where Blender keeps its compositor's picture, only if there is no other. Nothing if
/// none has.
std::optional<std::string> cyclesLayer(const std::vector<std::string>& names);

/// Red, green and blue of an image whose channels are `names`; a luminance stands for all three. Nothing when
/// there are none.
///
/// With a `layer`: the pass Combined of the view layer of this name, or the layer of this name:
/// layerTriple(), .red .green .blue as Nuke writes them, or .Y. Without: Combined of cyclesLayer(); else R,
/// G, B, or r, g, b, or red, green, blue, or Y; else the layer RGBA, rgba, beauty or Ci.
std::optional<ChannelTriple> findColour(const std::vector<std::string>& names, const std::string& layer = {});

/// The alpha of the same layer as a red that findColour() found, if it has one.
std::optional<std::string> findAlpha(const std::vector<std::string>& names, const std::string& red);

/// The layer stddev that belongs to a red that findColour() found, as vlx-krige writes it: under the same
/// layerPrefix(), or in the same part; else one without prefix. Nothing when there is none.
std::optional<ChannelTriple> findError(const std::vector<std::string>& names, const std::string& red);

/// For messages: the layers of these channels, each once, and the channels that have none, "A, B, C".
std::string listedLayers(const std::vector<std::string>& names);

}  // namespace vlx
