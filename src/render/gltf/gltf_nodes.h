#pragma once

#include <optional>
#include <string>
#include <vector>

#include "render/gltf/gltf_animation.h"
#include "render/gltf/gltf_file.h"
#include "render/scene/motion.h"

namespace vlx::render {

struct PlacedNode {
    std::size_t node = 0;
    Transform toWorld;             ///< in the middle of the exposure
    Motion motion;                 ///< while the shutter is open; empty where it does not move
    std::optional<Course> course;  ///< where it is elsewhere in the neighbouring frames
};

/// The nodes of a glTF file's scene: where they are, and when.
class NodeTree {
  public:
    /// Reads the animations: throws and warns as they do.
    NodeTree(const GltfFile& file, const Shutter& shutter, std::vector<std::string>& warnings);

    /// The scene that is shown; null: the file has none. Throws Error when there is no such one.
    const tinygltf::Scene* scene() const;
    /// All nodes of the scene, in the order of the file's trees. Throws Error on references out of range,
    /// nodes with two parents and transforms that are none.
    std::vector<PlacedNode> placed();

    // Of the nodes that placed() has placed.
    bool isPlaced(std::size_t node) const { return parents_[node] >= -1; }
    /// What animates a node or one above it, or nothing.
    std::string movesBy(std::size_t node) const;
    Transform placeAt(std::size_t node, double seconds) const;

    const Animations& animations() const { return animations_; }
    const Shutter& shutter() const { return shutter_; }

  private:
    Transform atRest(std::size_t node) const;
    std::string faultOfParents(std::size_t node, std::int64_t parent) const;
    Motion motionOf(std::size_t node, double later) const;
    std::optional<Course> courseOf(std::size_t node, const Motion& own) const;

    const GltfFile& file_;
    Shutter shutter_;
    Animations animations_;
    std::vector<std::int64_t> parents_;  ///< of each node; -1: a root; -2: not in the scene
    std::vector<std::int64_t> movers_;   ///< the nearest that is animated, itself or above; -1: none
};

}  // namespace vlx::render
