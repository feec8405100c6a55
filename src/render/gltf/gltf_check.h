#pragma once

#include <string>
#include <vector>

namespace vlx::render {

/// Checks the JSON of a glTF file for what readers take in silence: first, by name, extensions that it
/// requires and that are not supported; then types of values, and references by number, which must be to what
/// is there. `file` names it in errors. Throws Error, which says where in the file, what was expected and
/// found.
///
/// Returns which cameras have an aspectRatio of 0: tinygltf takes that for none.
std::vector<bool> checkGltf(const std::string& file, const std::string& text);

}  // namespace vlx::render
