#pragma once

#include <string>
#include <vector>

#include "import/stack/doubts.h"
#include "import/stack/plan.h"

/// Sentences of a stack's report.
namespace vlx {

/// How many images, of how many of the renderer's samples (samplesOfImages()).
void noteSamples(const std::vector<double>& ofImages, std::vector<std::string>& notes);

/// `unknown`: samples whose motion was made NaN.
void noteMotion(const ChannelMap& map, std::int64_t unknown, std::vector<std::string>& notes);

/// What the preset could not find, or takes in the renderer's own sense.
void notePreset(const StackPlan& plan, std::vector<std::string>& notes);

/// Whether `what` adds up to the light; `half`: its values are half floats. `advice` where it does not.
void noteSum(const std::string& what, const LightSum& sum, bool half, const std::string& advice,
             std::vector<std::string>& notes);

/// What vlx-krige is to be told of light groups and contributions.
void noteRadiance(const StackPlan& plan, std::vector<std::string>& notes);

}  // namespace vlx
