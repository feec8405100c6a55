#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "render/light/light.h"
#include "render/light/light_tree.h"
#include "render/math/sampling.h"
#include "render/math/vec.h"
#include "render/plan/effect_counters.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// Direct light towards a receiver: a direction, what arrives along it unoccluded, and how likely it was.
struct LightSample {
    Vec3 direction;
    float distance = 0;  ///< of the shadow ray
    Rgb radiance;        ///< for delta lights: irradiance across the beam
    float pdf = 0;       ///< per solid angle, choice of light included; for delta lights the latter only
    bool delta = false;
    std::uint32_t light = 0;     ///< of the scene
    std::uint32_t triangle = 0;  ///< of a mesh light's shape
};

/// Shadow rays end a little before the light.
inline constexpr float kReach = 1 - 1e-4f;

/// Chooses among the lights of a scene in proportion to their unoccluded irradiance at the receiver (an
/// estimate, with a floor for all that can reach it); beyond kLocalLights by descending a tree of them.
/// Refers to the scene, which must outlive it.
class LightSampler {
  public:
    static constexpr std::size_t kLocalLights = 32;

    /// `measures`: estimates are made even where there is no choice, for a single light.
    explicit LightSampler(const Scene& scene, bool measures = true);

    /// Estimates at one receiver, made once for its light sample and for what the path then meets by chance.
    struct Local {
        Receiver receiver;
        std::array<float, kLocalLights> weights{1};  ///< of a single light, taken without estimates
        float sum = 1;
        float possible = 1;  ///< how many are not 0
    };

    bool empty() const { return candidates_.empty(); }
    std::size_t size() const { return candidates_.size(); }

    void prepare(Local& local, const Receiver& receiver) const {
        local.receiver = receiver;
        if (estimates()) estimate<float>(std::array{&local}, receiver);
    }
    /// Four receivers at once: the same estimates.
    void prepare(const std::array<Local*, kLanes>& locals, const ReceiverOf<Lanes>& receivers) const {
        for (std::size_t i = 0; i < kLanes; ++i)
            locals[i]->receiver = {lane(receivers.position, i), lane(receivers.normal, i),
                                   receivers.bothSides[i] != 0};
        if (estimates()) estimate<Lanes>(locals, receivers);
    }
    LightSample sample(const Local& local, float choice, Vec2 u) const {
        // The commonest of the simple cases.
        if (alone_ && meshes_[0].light != nullptr) return sampleMesh(local.receiver, 0, u);
        return sampleAny(local, choice, u);
    }
    /// Density with which sample() at a receiver would have chosen a light that is met in `direction` from
    /// it: per solid angle; of points and spots per area; of directional lights the choice only. `triangle`:
    /// of a mesh light's shape, at `distance`, the light's cosine being `cosLight`.
    double density(const Local& local, std::uint32_t light, std::uint32_t triangle, const Vec3& direction,
                   float distance, float cosLight) const;
    /// The environment's number among the scene's lights, or -1 when it is none.
    std::int32_t environment() const { return environmentLight_; }

  private:
    /// A triangle of a mesh light.
    struct EmitterTriangle {
        Vec3 corner, edge1, edge2;
        Vec3 normal;
        float density = 0;  ///< probability / area
    };
    /// What is known of a mesh light beforehand; empty for other lights.
    struct MeshLight {
        const Light* light = nullptr;
        std::size_t firstTriangle = 0;  ///< in triangles_
        bool bothSides = false;
        bool plain = false;  ///< `emission` is its radiance at every point and in every direction
        Rgb emission;
    };
    struct Choice {
        std::size_t light = 0;
        float probability = 0;
    };
    bool estimates() const { return !alone_ && candidates_.size() <= kLocalLights; }
    template <class Real, std::size_t n>
    void estimate(const std::array<Local*, n>& locals, const ReceiverOf<Real>& receivers) const;
    void addTriangles(const Light& light);
    Choice choose(const Local& local, float u) const;
    /// Probability with which sample() would have chosen a light.
    float probability(const Local& local, std::size_t light) const;
    float meshPdf(const Local& local, std::uint32_t light, std::uint32_t triangle, float distance,
                  float cosLight) const;
    float spherePdf(const Local& local, std::uint32_t light) const;
    float environmentPdf(const Local& local, const Vec3& direction) const;

    LightSample sampleAny(const Local& local, float choice, Vec2 u) const;
    LightSample sampleMesh(const Receiver& receiver, std::size_t light, Vec2 u) const;
    LightSample sampleSphere(const Receiver& receiver, const Light& light, Vec2 u) const;

    const Scene* scene_;
    std::vector<LightCandidate> candidates_;
    std::vector<EmitterTriangle> triangles_;
    std::vector<MeshLight> meshes_;  ///< one for each light
    LightTree tree_;                 ///< when there are more than kLocalLights
    std::int32_t environmentLight_ = -1;
    bool measures_;
    bool alone_;  ///< a single light, taken without estimates
};

inline LightSample LightSampler::sampleMesh(const Receiver& receiver, std::size_t index, Vec2 u) const {
    countEffect(Effect::EmissiveMeshes);
    // u.x chooses the triangle, and its remainder the place on it.
    const MeshLight& mesh = meshes_[index];
    const Distribution::Sample chosen = mesh.light->triangles.sample(u.x);
    const Vec2 b = uniformTriangle({chosen.remapped, u.y});
    const EmitterTriangle& t = triangles_[mesh.firstTriangle + chosen.index];
    const Vec3 to = t.corner + t.edge1 * b.x + t.edge2 * b.y - receiver.position;
    const float d2 = lengthSquared(to);
    if (!(d2 > 0)) return {};
    LightSample s;
    s.distance = std::sqrt(d2);
    s.direction = to / s.distance;
    const float cosLight = -dot(t.normal, s.direction);
    if (cosLight == 0 || (cosLight < 0 && !mesh.bothSides)) return {};
    s.pdf = t.density * d2 / std::abs(cosLight);
    s.triangle = static_cast<std::uint32_t>(chosen.index);
    if (mesh.plain) {
        s.radiance = mesh.emission;
    } else {
        const Shape& shape = scene_->shapes[mesh.light->shape];
        const auto triangle = shape.firstTriangle + static_cast<std::uint32_t>(chosen.index);
        s.radiance = emittedRadiance(*scene_, shape, triangle, b.x, b.y, std::abs(cosLight)) *
                     opacityAt(*scene_, shape, triangle, b.x, b.y);
    }
    s.distance *= kReach;
    return s;
}

}  // namespace vlx::render
