#pragma once

#include <string>
#include <vector>

#include "import/import.h"

namespace vlx {

/// How channel names are understood. Layers' channels may end in upper or lower case letters.
enum class StackPreset {
    Auto,     ///< Cycles when a layer has a Combined pass; pbrt and Mitsuba by channels only they have; else
              ///< Plain
    Cycles,   ///< Blender's multilayer files: of the first layer L that has it, L.Combined -> R G B A,
              ///< L.Denoising Albedo -> albedo, L.Denoising Normal -> N, L.Denoising Depth (or L.Depth) -> Z,
              ///< L.Vector -> motion, motionNext (where something was hit)
    Mitsuba,  ///< Mitsuba 3's aov integrator: R G B A (of the film or the first nested integrator); the AOVs
              ///< named after what they are: albedo, normals or nn or sh_normal -> N; *.T -> Z
    Pbrt,     ///< pbrt-v4's gbuffer film: R G B, Albedo -> albedo, Ns -> N. It has no distance and no alpha
    Plain,    ///< R, G, B and the names of standardChannels() and kMotionChannels, as they are
};

struct StackOptions {
    StackPreset preset = StackPreset::Auto;
    ChannelMap map = {};  ///< entries override the preset's (`--map R=Combined.R`)
    /// Further channels or layers of radiance (radianceChannels), kept under their names.
    std::vector<std::string> radiance = {};
    bool groups = false;  ///< Cycles: keep the light groups, layers L.Combined_NAME, as radiance too
    /// Cycles: keep the contributions (stack/cycles_passes.h) as radiance, and write this flat file of all
    /// passes of the images as one (stack/pass_file.h). Empty: neither.
    std::string passes = {};
    /// A dump of the same view: its samples are kept before those of the images. Empty: none.
    std::string append = {};
    bool keepEmpty = false;     ///< pixels that were not rendered are samples of 0 (stack/rendered.h)
    std::string renderer = {};  ///< for the header; from the first image's metadata when empty
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
    std::string layer = {};   ///< where R, G, B (and A) are, and Cycles' features beside them: findColour()
};

/// Joins flat images of the same view, rendered with different seeds, into a dump of one sample an image a
/// pixel, in the order given. Every image gets its own sample.replicate, its number from 0: different seeds
/// are independent. Z becomes 0 where it says that nothing was hit (not finite, negative, or 1e9 and more).
/// There are no positions, unless the images have channels for them. Of kMotionChannels there are all or
/// none: those that the images do not have are NaN, not known. Works by bands of rows: the memory is that of
/// a few rows of all images. Throws Error when an image cannot be read, has other windows than the first, or
/// lacks a mapped channel (naming the file and the channels it has), when the dump to be added to has other
/// windows or channels, and as DumpWriter. What may be wrong with the images (stack/doubts.h) is a note that
/// begins with WARNING.
ImportReport stackImages(const std::vector<std::string>& images, const std::string& dump,
                         const StackOptions& options, const Progress& progress = {});

}  // namespace vlx
