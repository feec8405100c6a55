#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/light/light.h"
#include "render/math/vec.h"

namespace vlx::render {

/// The point that is lit: its shading normal lets lights behind an opaque surface be left out.
struct Receiver {
    Vec3 position;
    Vec3 normal;
    bool bothSides = false;  ///< light from behind counts (glass)
};

/// What choosing among the lights takes, close together in memory.
struct LightCandidate {
    Vec3 position;
    float radius = 0;
    Vec3 direction;
    float strength = 0;  ///< greatest channel
    float area = 0;
    float coneScale = 0;
    float coneOffset = 1;
    float coneStep = 0;
    LightType type = LightType::Point;

    bool finite() const { return type != LightType::Directional && type != LightType::Environment; }
};

/// Part of the choice that is spread evenly over all lights that may reach the receiver: the estimate of the
/// rest may be far too low for some of them.
inline constexpr float kEvenPart = 0.1f;

/// Whether a ball about a centre lies below the receiver's horizon.
inline bool belowHorizon(const Receiver& receiver, const Vec3& toCentre, float radius) {
    return !receiver.bothSides && dot(toCentre, receiver.normal) <= -radius * 1.001f;
}

/// Estimated irradiance, unoccluded: 0 only where the light cannot contribute.
inline float lightImportance(const Receiver& receiver, const LightCandidate& light) {
    const float strength = light.strength;
    const auto cosineAt = [&](const Vec3& direction) {
        return receiver.bothSides ? 1.f : std::max(0.f, dot(receiver.normal, direction));
    };
    const Vec3 to = light.position - receiver.position;
    const float d2 = lengthSquared(to);
    switch (light.type) {
        case LightType::Point:
        case LightType::Spot: {
            if (d2 == 0) return 0;
            const Vec3 direction = to / std::sqrt(d2);
            const float cone =
                std::clamp(light.coneOffset - dot(direction, light.direction) * light.coneScale, 0.f, 1.f);
            return strength * cone * cone * coneEase(cone, light.coneStep) * cosineAt(direction) / d2;
        }
        case LightType::Directional:
            return strength * cosineAt(-light.direction);
        case LightType::Sphere:
            return belowHorizon(receiver, to, light.radius) ? 0
                                                            : strength / std::max(d2, square(light.radius));
        case LightType::Mesh:
            return belowHorizon(receiver, to, light.radius)
                       ? 0
                       : strength * std::min(light.area / std::max(d2, 0.25f * square(light.radius)), kPi);
        case LightType::Environment:
            return strength * kPi;
    }
    return 0;
}

/// Four lights side by side, for lightImportance of all of them at once. Spheres and environments are mesh
/// lights of other bounds.
struct LightQuad {
    using Floats [[gnu::vector_size(16)]] = float;
    using Mask [[gnu::vector_size(16)]] = std::int32_t;

    Floats x{}, y{}, z{};     ///< position
    Floats dx{}, dy{}, dz{};  ///< direction
    Floats strength{};        ///< 0: no light
    Floats coneScale{}, coneOffset{}, coneStep{};
    Floats area{}, nearest{}, most{};  ///< of min(area / max(distance^2, nearest), most)
    Floats depth{};                    ///< of the bounds below the horizon
    Mask isPoint{}, isDirectional{};

    void set(std::size_t lane, const LightCandidate& light);
    /// lightImportance of each, but for rounding.
    Floats importance(const Receiver& receiver) const;
};

/// A binary tree over many lights, each node with the bounds and the summed intensity of its lights:
/// descended by estimated irradiance, so that near lights and strong ones are chosen often and no list is
/// gone through (Conty, Kulla, "Importance sampling of many lights with adaptive tree splitting", 2018,
/// without cones and splitting). Lights from infinitely far away share the root's other side.
class LightTree {
  public:
    LightTree() = default;
    explicit LightTree(std::span<const LightCandidate> lights);

    struct Choice {
        std::size_t light = 0;
        float probability = 0;  ///< 0: no light was found that reaches the receiver
    };
    Choice choose(std::span<const LightCandidate> lights, const Receiver& receiver, float u) const;
    float probability(std::span<const LightCandidate> lights, const Receiver& receiver,
                      std::size_t light) const;

  private:
    struct Node {
        Vec3 low, high;
        float strength = 0;       ///< W/sr
        std::int32_t light = -1;  ///< of a leaf
        std::uint32_t left = 0;   ///< the right child follows it
        std::uint32_t parent = 0;
        std::uint32_t count = 0;
        bool infinite = false;  ///< holds lights from far away
    };
    void split(std::uint32_t node, std::span<const LightCandidate> lights, std::span<std::uint32_t> order);
    float importance(std::span<const LightCandidate> lights, const Receiver& receiver,
                     const Node& node) const;
    /// Probability of going left.
    float leftShare(std::span<const LightCandidate> lights, const Receiver& receiver, const Node& node) const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> leafOf_;  ///< of each light
};

}  // namespace vlx::render
