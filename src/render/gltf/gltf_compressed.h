#pragma once

#include <string>

namespace vlx::render {

/// The JSON of a glTF file as tinygltf takes it where parts are compressed, by EXT_meshopt_compression and
/// KHR_draco_mesh_compression: bufferViews are of the compressed data, and what is said of a buffer whose
/// data has been left out is gone. Geometry that is there in plain, too, is said to be plain. Other files are
/// returned as they are.
std::string withCompressedViews(const std::string& json);

}  // namespace vlx::render
