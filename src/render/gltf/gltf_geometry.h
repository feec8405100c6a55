#pragma once

#include <map>
#include <vector>

#include "render/gltf/gltf_file.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// Turns primitives of glTF meshes into shapes of the scene.
class GeometryReader {
  public:
    GeometryReader(const GltfFile& file, Scene& scene) : file_(file), scene_(scene) {}

    /// Appends the triangles of a mesh, transformed, one shape a primitive (none for points and lines, or
    /// where every triangle is degenerate). Zero-area triangles are dropped and counted.
    std::vector<Shape> read(std::size_t mesh, const Transform& toWorld);

  private:
    void readPrimitive(std::size_t mesh, std::size_t primitive, const Transform& toWorld,
                       std::vector<Shape>& out);
    std::vector<std::uint32_t> triangleIndices(const tinygltf::Primitive& primitive, std::uint32_t vertices,
                                               const std::string& what) const;

    const GltfFile& file_;
    Scene& scene_;
};

}  // namespace vlx::render
