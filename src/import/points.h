#pragma once

#include <cstdint>
#include <string>

#include "variolux/dump/format.h"

namespace vlx {

struct PointOptions {
    std::uint32_t points = 64;
    /// Owen scrambling of the points; without it they are the Sobol sequence itself.
    bool scramble = false;
    std::uint64_t seed = 0;
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

/// Samples an image at the first points of the two-dimensional Sobol sequence over its data window, and
/// writes the pixels' R, G, B found there, with the points' positions, as a dump: most pixels are left
/// without a sample. Kriged as one region (`vlx-krige --whole-image`) it shows how few points resemble an
/// image: the paper's figure
/// 1. Throws Error when the image cannot be read, lacks R, G or B, or the dump cannot be written; when no or
/// more than 2^20 points are asked for.
void sampleAtPoints(const std::string& image, const std::string& dump, const PointOptions& options);

}  // namespace vlx
