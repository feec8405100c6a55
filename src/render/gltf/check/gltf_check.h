#pragma once

#include <string>
#include <vector>

namespace vlx::render {

/// What tinygltf's model does not say.
struct GltfFacts {
    std::vector<std::string> warnings;  ///< values out of range, which readers take as the nearest in it
    std::vector<bool> zeroAspects;      ///< of each camera: its aspectRatio is 0, not just missing
};

/// Checks the JSON of a glTF file for what readers take in silence: first the version and, by name,
/// extensions that it requires and that are not supported; then types and ranges of values, references by
/// number, which must be to what is there, and the files that it is made of (gltf_files.h). `file` names it
/// in errors. Throws Error, which says where in the file, what was expected and found.
GltfFacts checkGltf(const std::string& file, const std::string& text);

}  // namespace vlx::render
