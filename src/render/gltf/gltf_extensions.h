#pragma once

#include <string>

namespace vlx::render {

/// What to do about an extension that is not supported, for messages: "; ..." or nothing.
std::string remedyFor(const std::string& extension);

/// What a picture lacks where an extension is ignored, for messages: ": ..." or nothing.
std::string missingWithout(const std::string& extension);

/// Whether the tracer reads it.
bool isSupported(const std::string& extension);

}  // namespace vlx::render
