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
    /// For the header's kInputsAttribute (base/fingerprint.h) where wholeInputs() says nothing, and for
    /// crops.
    std::string inputs = {};
};

/// What the parts of a whole picture say together of what they were made of (kInputsAttribute): where they
/// are all the bands of one run, what the run of the whole picture would say; else nothing. Throws Error when
/// parts cannot be read and when bands are of runs with different inputs or parameters, naming both files.
std::string wholeInputs(const std::vector<std::string>& parts);

struct MergeReport {
    Window data;
    bool dump = false;  ///< else a flat image
};

/// Joins the parts of one picture, bands of rows or tiles, into one dump, or one flat image when the parts
/// are flat. What lies in a part comes out bit for bit, with the header of the first; variolux:renderSeconds
/// is the sum, kInputsAttribute what wholeInputs() or `options` say. The bytes do not depend on the order of
/// the parts; but for the seconds, merging all parts of a dump gives the dump's own bytes. Works by bands of
/// rows. Throws Error when parts cannot be read; when they are of different pictures: other display windows,
/// channels, compression, or (dumps) renderer, scene, seed, samples, pixel filter, effects or camera, naming
/// both files and what differs; when they overlap; when some are missing, naming the rows and columns; and as
/// wholeInputs() and DumpWriter.
MergeReport mergeParts(const std::vector<std::string>& parts, const std::string& output,
                       const MergeOptions& options = {}, const Progress& progress = {});

}  // namespace vlx
