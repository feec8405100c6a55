#pragma once

#include <string>
#include <vector>

#include "render/gltf/gltf_file.h"
#include "render/math/transform.h"

namespace vlx::render {

/// EXT_mesh_gpu_instancing: where a node has the instances of its mesh, in its own space; the node's own
/// place alone where it has no such extension. `what`: the node, for messages. Throws Error on attributes of
/// different lengths or wrong types, values that are not finite, and more than 2^24 instances.
std::vector<Transform> instancesOf(const GltfFile& file, const tinygltf::Node& node, const std::string& what);

}  // namespace vlx::render
