#pragma once

#include "edit/merge.h"

namespace vlx {

/// mergeParts() for flat images.
MergeReport mergeFlat(const std::vector<std::string>& paths, const std::string& output,
                      const MergeOptions& options, const Progress& progress);

/// kInputsAttribute of a flat image; empty when there is none.
std::string flatInputs(const std::string& path);

}  // namespace vlx
