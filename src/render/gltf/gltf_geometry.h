#pragma once

#include <functional>
#include <string>
#include <vector>

#include "render/gltf/gltf_bend.h"
#include "render/gltf/gltf_file.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// Turns primitives of glTF meshes into shapes of the scene.
class GeometryReader {
  public:
    GeometryReader(const GltfFile& file, Scene& scene) : file_(file), scene_(scene) {}

    /// From now on primitives have the materials that they have in this variant (KHR_materials_variants).
    void setVariant(int variant) { variant_ = variant; }
    /// The number of a primitive's material among the scene's.
    std::uint32_t materialOf(const tinygltf::Primitive& primitive, const std::string& what) const;

    /// Appends the triangles of a mesh, transformed, one shape a primitive (none for points and lines, or
    /// where every triangle is degenerate). Zero-area triangles are dropped and counted.
    std::vector<Shape> read(std::size_t mesh, const Transform& toWorld);

    /// The same of a mesh that bends, by `at` of a frame and time as Bends::at: followed while the shutter is
    /// open in up to 16 steps, as many as keep the vertices half way between steps within 1e-3 of the
    /// greatest way of any; and to the neighbouring frames where `sequence`.
    using BendAt = std::function<Bend(int frame, double time)>;
    std::vector<Shape> readBent(std::size_t mesh, const BendAt& at, bool sequence, const std::string& cause);

  private:
    struct Use;
    void readPrimitive(std::size_t mesh, std::size_t primitive, const Use& use, std::vector<Shape>& out);
    std::vector<VertexBlock> blocksOf(const PrimitiveVertices& vertices, const Use& use,
                                      Deformation& deformation) const;
    void readFurtherUvs(const tinygltf::Primitive& primitive, Shape& shape, const std::string& what);
    std::vector<std::uint32_t> triangleIndices(const tinygltf::Primitive& primitive, std::uint32_t vertices,
                                               const std::string& what) const;

    const GltfFile& file_;
    Scene& scene_;
    int variant_ = -1;
};

}  // namespace vlx::render
