#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "edit/motion_check.h"
#include "variolux/base/progress.h"
#include "variolux/dump/format.h"
#include "variolux/dump/positions.h"

namespace vlx {

/// What `vlx-pack info` prints.
struct DumpInfo {
    std::string path;
    DumpHeader header;
    std::uint64_t fileBytes = 0;
    std::uint64_t rawBytes = 0;  ///< of all samples, uncompressed
    std::uint64_t samples = 0;
    std::uint32_t minSamples = 0;  ///< of any pixel
    std::uint32_t maxSamples = 0;
    double meanSamples = 0;
    std::uint64_t emptyPixels = 0;       ///< pixels without samples
    std::uint64_t nonFiniteSamples = 0;  ///< samples with a NaN or infinite R, G or B
    std::uint32_t replicates = 0;        ///< different values of sample.replicate; 0 without the channel
    PositionReport positions;            ///< without samples where the dump has no positions
    std::optional<std::array<MotionReport, 2>>
        motion;          ///< to the frame before and the next, where it is there
    std::string layers;  ///< layersFoundBy(): why these may be no samples of the camera
    std::vector<MissingPart> missing;
};

/// Reads the whole dump once, by bands. Throws as DumpReader.
DumpInfo inspectDump(const std::string& path, const Progress& progress = {});

/// For people, and for machines.
std::string toText(const DumpInfo& info);
std::string toJson(const DumpInfo& info);

}  // namespace vlx
