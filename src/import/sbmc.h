#pragma once

#include <string>
#include <vector>

#include "import/import.h"

namespace vlx {

struct SbmcOptions {
    std::string renderer = "pbrt-v2 (SBMC)";
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

/// Reads sample files of SBMC (Gharbi et al., "Sample-based Monte Carlo Denoising using a Kernel-Splatting
/// Network", 2019), versions 20181212 and 20190401 (read alike, as SBMC does), one square tile each: R G B =
/// diffuse + specular, A = hasHit, Z at the first hit, albedo and N at the first diffuse hit, positions dx,
/// dy within their pixel. Light paths (probabilities, directions, bounces) are left out. Tiles may come in
/// any order and must fill a rectangle; the picture around it is the display window. Memory is that of a row
/// of tiles. Throws Error when a file is no such tile or damaged, or tiles are of different pictures, overlap
/// or leave gaps.
ImportReport importSbmc(const std::vector<std::string>& tiles, const std::string& dump,
                        const SbmcOptions& options, const Progress& progress = {});

}  // namespace vlx
