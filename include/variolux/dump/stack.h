#pragma once

#include <map>
#include <string>
#include <vector>

#include "variolux/base/progress.h"
#include "variolux/dump/format.h"

namespace vlx {

/// Which channels of an image hold what: dump channel -> image channel, for example {"albedo.R",
/// "ViewLayer.Denoising Albedo.R"}. Values are taken as they are.
using ChannelMap = std::map<std::string, std::string>;

/// How channel names are understood.
enum class StackPreset {
    Auto,    ///< Cycles when a layer has a Combined pass, else Plain
    Cycles,  ///< Blender's multilayer files: of the first layer L that has it, L.Combined -> R G B A,
             ///< L.Denoising Albedo -> albedo, L.Denoising Normal -> N, L.Denoising Depth (or L.Depth) -> Z
    Plain,   ///< R, G, B and the names of standardChannels(), as they are
};

struct StackOptions {
    StackPreset preset = StackPreset::Auto;
    ChannelMap map;        ///< entries override the preset's (`--map R=Combined.R`)
    std::string renderer;  ///< for the header; from the first image's metadata when empty
    DumpCompression compression = DumpCompression::Zips;
};

struct StackReport {
    ChannelMap mapped;                 ///< what was taken from where
    std::vector<std::string> ignored;  ///< image channels left out
    std::vector<std::string> notes;    ///< decisions worth telling, one sentence each
};

/// Joins flat images of the same view, rendered with different seeds, into a dump of one sample an image a
/// pixel, in the order given. Every image gets its own sample.replicate, its number from 0: different seeds
/// are independent. Z becomes 0 where it says that nothing was hit (not finite, negative, or 1e9 and more).
/// There are no positions, unless the images have channels for them. Works by bands of rows: the memory is
/// that of a few rows of all images. Throws Error when an image cannot be read, has other windows than the
/// first, or lacks a mapped channel (naming the file and the channels it has), and as DumpWriter.
StackReport stackImages(const std::vector<std::string>& images, const std::string& dump,
                        const StackOptions& options, const Progress& progress = {});

}  // namespace vlx
