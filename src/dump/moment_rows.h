#pragma once

#include <array>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "flat_images.h"
#include "variolux/dump/moments.h"

namespace vlx {

/// Means and variances of pixels, wherever they come from.
struct MomentSource {
    FlatImages* images = nullptr;
    std::array<FlatChannel, 3> mean;                  ///< R, G, B
    std::array<FlatChannel, 3> variance;              ///< or second moments
    std::optional<std::array<FlatChannel, 3>> first;  ///< first moments that go with second ones; else `mean`
    std::optional<FlatChannel> count;                 ///< samples of each pixel; else `samples`
    std::vector<std::pair<std::string, FlatChannel>> features;  ///< dump channel, from where
    VarianceMeaning meaning = VarianceMeaning::OfMean;
    bool xyz = false;
    double samples = 0;
};

struct MomentOutput {
    std::string path;
    std::string renderer;
    bool halves = true;
    std::uint64_t seed = 0;
    DumpCompression compression = DumpCompression::Zips;
};

/// Writes the dump that importMoments() describes, and adds notes and what is missing to the report.
void writeMoments(const MomentSource& source, const MomentOutput& output, ImportReport& report,
                  const Progress& progress);

}  // namespace vlx
