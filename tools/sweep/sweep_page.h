#pragma once

#include <string>
#include <vector>

#include "sweep/sweep_summary.h"
#include "variolux/base/window.h"

namespace vlx {

struct SweepPageOptions {
    std::vector<Window> crops;  ///< raster coordinates
    std::vector<SweepTarget> targets;
};

/// The report: one HTML file without any reference to another, readable offline. Images of the first
/// repetition and the reference are in it as pageImage() makes them. Sources: tools/sweep/report. Throws
/// Error when a kept image or a region's JSON cannot be read, or a crop lies outside the images.
std::string toHtml(const Sweep& sweep, const SweepSummary& summary, const SweepPageOptions& options = {});

}  // namespace vlx
