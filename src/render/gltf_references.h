#pragma once

#include <string>
#include <vector>

namespace vlx::render {

/// The glTF file `path` and the files that it names: buffers and images, where it looks for them. Only the
/// file itself if it is no glTF file.
std::vector<std::string> gltfFiles(const std::string& path);

}  // namespace vlx::render
