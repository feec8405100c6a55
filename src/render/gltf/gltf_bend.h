#pragma once

#include <map>
#include <string>
#include <vector>

#include "render/gltf/gltf_file.h"
#include "render/gltf/gltf_nodes.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// How the vertices of a mesh are brought to where they are at one moment: morphed by weights, then moved by
/// the joints of a skin or, where there is none, by the node's transform.
struct Bend {
    std::vector<double> weights;    ///< of the morph targets; empty: not morphed
    std::vector<Transform> joints;  ///< from the mesh's rest to the world; empty: no skin
    Transform toWorld;
};

/// The weights that a mesh has by itself; empty where it has no morph targets.
std::vector<double> restWeights(const tinygltf::Mesh& mesh);

/// The nodes of a scene whose meshes bend: by a skin, by weights of their own, or by an animation of weights.
class Bends {
  public:
    /// Of nodes that are placed.
    Bends(const GltfFile& file, const NodeTree& nodes) : file_(file), nodes_(nodes) {}

    bool bends(std::size_t node) const;
    /// The animation that bends the node's mesh, or moves it, in words; empty: none.
    std::string causeOf(std::size_t node) const;
    /// `time`: 0 when the shutter opens, 1 when it closes, in the frame `frame` frames later. Throws Error on
    /// joints that are not in the scene, and inverse bind matrices that are too few or not finite.
    Bend at(std::size_t node, int frame, double time);

  private:
    const std::vector<Transform>& inverseBinds(std::size_t skin);

    const GltfFile& file_;
    const NodeTree& nodes_;
    std::map<std::size_t, std::vector<Transform>> inverseBinds_;
};

/// Vertices of a primitive at one moment.
struct VertexBlock {
    std::vector<Vec3> positions;
    std::vector<Vec3> normals;      ///< unit or zero; empty: none
    std::vector<Tangent> tangents;  ///< empty: none
    std::vector<char> mirrored;     ///< whether the vertex was moved by a reflection
};

/// The vertices of a primitive, and what they need to be bent.
class PrimitiveVertices {
  public:
    /// Reads them. `joints`: of the skin, 0: there is none. Throws Error on accessors of other sizes and
    /// types than the attribute's, joints out of range, and weights that are not finite or add up to nothing.
    PrimitiveVertices(const GltfFile& file, const tinygltf::Primitive& primitive, std::size_t joints,
                      const std::string& what);

    std::size_t count() const { return positions_.size(); }
    bool skinned() const { return !influences_.empty(); }
    /// What was mended of the weights, or nothing.
    std::string doubt() const;
    /// Throws Error where a vertex gets where it is not finite.
    VertexBlock at(const Bend& bend) const;

  private:
    struct Influence {
        std::uint32_t joint;
        float weight;
    };
    struct Target {
        double weight = 0;
        std::vector<float> positions, normals, tangents;  ///< differences, 3 a vertex; empty: none
    };
    std::vector<float> optional(const tinygltf::Primitive& primitive, const char* name, int components) const;
    void readInfluences(const tinygltf::Primitive& primitive, std::size_t joints);
    Transform placeOf(std::size_t vertex, const Bend& bend) const;

    const GltfFile& file_;
    std::string what_;
    std::vector<Vec3> positions_;
    std::vector<Vec3> normals_;
    std::vector<float> tangents_;  ///< 4 a vertex
    std::vector<Target> targets_;
    std::vector<Influence> influences_;  ///< influencesEach_ a vertex, the weights of each adding up to 1
    std::size_t influencesEach_ = 0;
    std::size_t scaled_ = 0;                             ///< vertices whose weights did not add up to 1
    std::pair<std::size_t, float> firstScaled_{0, 1.f};  ///< the first of them, and their sum
};

}  // namespace vlx::render
