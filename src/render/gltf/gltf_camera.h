#pragma once

#include "render/gltf/gltf_file.h"
#include "render/scene/camera.h"

namespace vlx::render {

/// The camera of a node. What it cannot be rendered with is in `unusable`.
Camera readCamera(const GltfFile& file, const tinygltf::Node& node, const Transform& toWorld,
                  const Motion& motion, const std::optional<Course>& course);

}  // namespace vlx::render
