#pragma once

#include <map>
#include <string>

#include "sweep/sweep_plan.h"

namespace vlx {

/// The error of a method's image that has no error map, without a reference, as `vlx-krige --assess` tells it
/// (METHOD.md, 7.12): predicted_relmse with its 95 % interval, assessed_low and assessed_high,
/// predicted_rmse, and assessed_by_halves, 1 or 0. `command` (with {input} and {output}) is run twice more,
/// on the samples of even and of odd number of the dump; where it fails on these, or leaves their images
/// unreadable, they are done without. Temporary files are STEM.*, and are removed. Throws Error when the
/// assessment fails.
std::map<std::string, double> assessedErrors(const SweepPlan& plan, const std::string& command,
                                             const std::string& dump, const std::string& image,
                                             const std::string& stem);

}  // namespace vlx
