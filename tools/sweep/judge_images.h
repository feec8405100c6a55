#pragma once

#include <string>

#include "sweep/sweep_plan.h"

namespace vlx {

/// Fills in values and reliability of a record, as SweepRecord says, from the image that `command` made of a
/// dump, or from those of all frames (both patterns). Temporary files are STEM.*. Throws Error when an image
/// cannot be read or is of another window.
void judgeImages(const SweepPlan& plan, const std::string& command, const std::string& dump,
                 const std::string& image, const std::string& stem, SweepRecord& record);

}  // namespace vlx
