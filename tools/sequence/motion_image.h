#pragma once

#include <string>

#include "variolux/base/image.h"

namespace vlx {

/// How far from a pixel its point was in the frame before: channels motion.x and motion.y of a flat image, or
/// of a dump the means over each pixel's samples whose motion is known; not finite where there is none.
/// Throws Error when the file cannot be read or has no such channels, or its data window is not `window`.
Image readMotion(const std::string& path, const Window& window);

}  // namespace vlx
