#pragma once

#include <string>
#include <vector>

#include "variolux/dump/import.h"

namespace vlx {

struct SbmcOptions {
    std::string renderer = "pbrt-v2 (SBMC)";
    DumpCompression compression = DumpCompression::Zips;
};

/// Reads sample files of SBMC (Gharbi et al., "Sample-based Monte Carlo Denoising using a Kernel-Splatting
/// Network", 2019), versions 20181212 and 20190401, one square tile each, into one dump of the whole picture:
/// R G B = diffuse + specular, A = hasHit, Z and N at the first hit, albedo at the first diffuse hit,
/// positions dx, dy within their pixel. Light paths (probabilities, directions, bounces) are left out. Tiles
/// may come in any order; pixels of missing tiles have no samples. Memory is that of a row of tiles. Throws
/// Error when a file is no such tile or damaged, or tiles are of different pictures or overlap.
ImportReport importSbmc(const std::vector<std::string>& tiles, const std::string& dump,
                        const SbmcOptions& options, const Progress& progress = {});

}  // namespace vlx
