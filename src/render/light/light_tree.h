#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "render/light/light.h"
#include "render/math/vec.h"

namespace vlx::render {

/// The point that is lit: its shading normal lets lights behind an opaque surface be left out. Of Lanes, four
/// points.
template <class Real>
struct ReceiverOf {
    Vec3Of<Real> position;
    Vec3Of<Real> normal;
    Mask<Real> bothSides{};  ///< light from behind counts (glass)
};
using Receiver = ReceiverOf<float>;

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
template <class Real>
Mask<Real> belowHorizon(const ReceiverOf<Real>& receiver, const Vec3Of<Real>& toCentre, float radius) {
    return !receiver.bothSides && dot(toCentre, receiver.normal) <= -radius * 1.001f;
}

/// Estimated irradiance, unoccluded: 0 only where the light cannot contribute.
template <class Real>
Real lightImportance(const ReceiverOf<Real>& receiver, const LightCandidate& light) {
    using Vector = Vec3Of<Real>;
    const Real one = spread<Real>(1);
    const auto cosineAt = [&](const Vector& direction) {
        return receiver.bothSides ? one : larger(Real{}, dot(receiver.normal, direction));
    };
    const Vector to = everywhere<Real>(light.position) - receiver.position;
    const Real d2 = lengthSquared(to);
    switch (light.type) {
        case LightType::Point:
        case LightType::Spot: {
            const Vector direction = to / squareRoot(d2);
            const Real along = dot(direction, everywhere<Real>(light.direction));
            const Real cone = clamped(light.coneOffset - along * light.coneScale, Real{}, one);
            const Real v =
                light.strength * cone * cone * coneEase(cone, light.coneStep) * cosineAt(direction) / d2;
            return d2 == 0 ? Real{} : v;
        }
        case LightType::Directional:
            return light.strength * cosineAt(everywhere<Real>(-light.direction));
        case LightType::Sphere: {
            const Real v = light.strength / larger(d2, spread<Real>(square(light.radius)));
            return belowHorizon(receiver, to, light.radius) ? Real{} : v;
        }
        case LightType::Mesh: {
            const Real nearest = larger(d2, spread<Real>(0.25f * square(light.radius)));
            const Real v = light.strength * smaller(light.area / nearest, spread<Real>(kPi));
            return belowHorizon(receiver, to, light.radius) ? Real{} : v;
        }
        case LightType::Environment:
            return spread<Real>(light.strength * kPi);
    }
    return Real{};
}

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
