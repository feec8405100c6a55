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

struct StackOptions {
    /// Explicit mapping (`--map R=Combined.R`). Entries override the preset's.
    ChannelMap map;
    /// "auto" (look at the channel names), "cycles" (Blender multilayer EXR: L.Combined, L.Denoising Albedo,
    /// L.Denoising Normal, L.Denoising Depth or L.Depth, for the first layer L that has Combined), "plain"
    /// (R, G, B and dump channel names as they are).
    std::string preset = "auto";
    std::string renderer;  ///< for the header; from the image's metadata when empty
    DumpCompression compression = DumpCompression::Zips;
};

struct StackReport {
    ChannelMap mapped;                 ///< what was taken from where
    std::vector<std::string> ignored;  ///< image channels left out
    std::vector<std::string>
        notes;  ///< decisions worth telling (no positions: ..., infinite depth on misses: ...)
};

/// Joins images of the same view, rendered with different seeds, into a dump of one sample an image a pixel,
/// in the order given. Streams: memory does not grow with the number of images times their size. Every image
/// gets its own sample.replicate (different seeds are independent). Throws Error when images differ in
/// windows or lack a mapped channel, naming the file and the channels it has.
StackReport stackImages(const std::vector<std::string>& images, const std::string& dump,
                        const StackOptions& options, const Progress& progress = {});

}  // namespace vlx
