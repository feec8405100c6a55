#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "render/gltf/gltf_file.h"
#include "render/math/transform.h"

namespace vlx::render {

/// Translation, rotation (quaternion x, y, z, w) and scale of a node.
struct Pose {
    std::array<double, 3> translation{0, 0, 0};
    std::array<double, 4> rotation{0, 0, 0, 1};
    std::array<double, 3> scale{1, 1, 1};
};

/// First scaled, then rotated (the quaternion need not be of unit length, but not 0), then moved.
Transform placeOf(const Pose& pose);

/// How many morph targets the mesh of a node has; 0 without a mesh.
std::size_t morphTargets(const tinygltf::Model& model, std::size_t node);

/// The animations of a glTF file, all played at once: where nodes are at a time, and how far the targets of
/// their meshes are morphed. Before the first and after the last key all stays as that key has it.
class Animations {
  public:
    /// Reads all channels. Channels without keys, of weights that nothing has, and second ones for the same
    /// property are left out, with a warning. Throws Error on references out of range, times that are not
    /// finite or do not ascend, and values that are too few or not finite.
    Animations(const GltfFile& file, std::vector<std::string>& warnings);

    /// The animation and node in words: empty when no animation moves the node.
    std::string causeOf(std::size_t node) const;
    /// The node's own transform at `seconds`, the rest pose where no channel says otherwise.
    Transform local(std::size_t node, double seconds) const;

    /// The animation of a node's morph weights in words: empty when there is none.
    std::string morphCauseOf(std::size_t node) const;
    /// The weights of its mesh's targets, where an animation gives them.
    std::optional<std::vector<double>> weights(std::size_t node, double seconds) const;

    /// When the last of them is over, seconds; at least 0.
    double lastKey() const { return lastKey_; }

  private:
    enum class Property { Translation, Rotation, Scale, Weights };
    enum class Interpolation { Linear, Step, Cubic };
    struct Channel {
        Property property;
        Interpolation interpolation;
        std::vector<double> times;
        std::vector<double> values;  ///< `width` a key; cubic: in-tangent, value and out-tangent
        std::size_t width = 3;
        std::vector<double> at(double seconds) const;
    };
    struct Animated {
        Pose rest;
        std::string cause;
        std::vector<Channel> channels;
    };
    struct Morphed {
        std::string cause;
        Channel channel;
    };
    void readChannel(std::size_t animation, std::size_t channel);
    std::size_t widthOf(Property property, std::size_t node) const;

    const GltfFile& file_;
    std::vector<std::string>& warnings_;
    std::map<std::size_t, Animated> nodes_;
    std::map<std::size_t, Morphed> morphed_;
    double lastKey_ = 0;
};

}  // namespace vlx::render
