#pragma once

#include <functional>
#include <string>
#include <vector>

#include "variolux/base/progress.h"
#include "variolux/base/window.h"

/// The parts that a job of a farm is cut into: frames of a sequence, bands of a picture.
namespace vlx {

/// "1-100x2", "1-3,7,10-20x5": frame numbers >= 0, in this order, each once. Throws CLI::ValidationError.
std::vector<int> parseFrames(const std::string& text);

/// "2/5": the second of five bands. Throws CLI::ValidationError.
Band parseBand(const std::string& text);

/// The name with each run of '#' in its last part replaced by the frame's number, of at least as many digits.
std::string frameName(const std::string& name, int frame);

/// Throws CLI::ValidationError unless `name`, given by `option`, has a place for the frame's number.
void requireFramePlace(const std::string& option, const std::string& name);

/// Progress of the part `index` of `count` equal ones of a whole.
Progress progressOfPart(const Progress& whole, std::size_t index, std::size_t count);

/// Calls run(frame, progress) for each frame. One that fails is said on standard error, and the others go on;
/// in the end an Error says which failed.
void forEachFrame(const std::vector<int>& frames, const Progress& progress,
                  const std::function<void(int, const Progress&)>& run);

}  // namespace vlx
