#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "variolux/base/progress.h"
#include "variolux/base/window.h"

namespace vlx {

struct MergeOptions {
    /// Parts need only fill a rectangle; else they must fill the whole picture (the display window).
    bool crop = false;
};

struct MergeReport {
    Window data;
    bool dump = false;  ///< else a flat image
};

/// Joins the parts of one picture, bands of rows or tiles, into one dump, or one flat image when the parts
/// are flat. What lies in a part comes out bit for bit, with the header of the first; variolux:renderSeconds
/// is the sum. The bytes do not depend on the order of the parts; but for the seconds, merging all parts of a
/// dump gives the dump's own bytes. Works by bands of rows. Throws Error when parts cannot be read; when they
/// are of different pictures: other display windows, channels, compression, or (dumps) renderer, scene, seed,
/// samples, pixel filter, effects or camera, naming both files and what differs; when they overlap; when some
/// are missing, naming the rows and columns; and as DumpWriter.
MergeReport mergeParts(const std::vector<std::string>& parts, const std::string& output,
                       const MergeOptions& options = {}, const Progress& progress = {});

}  // namespace vlx
