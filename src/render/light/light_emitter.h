#pragma once

#include <cstdint>
#include <vector>

#include "render/math/sampling.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// The start of a light subpath.
struct Emission {
    Ray ray;         ///< leaves the light
    Rgb throughput;  ///< emitted radiance / density; of delta lights intensity, or irradiance, / density
    double density = 0;
    float cosLight = 1;  ///< of the direction with the light's normal; 1 where it has none
    std::uint32_t light = 0;
    std::uint32_t triangle = 0;  ///< of a mesh light's shape
};

/// Chooses rays that leave a scene's lights: a light by its power, then
/// - mesh lights: a point by power, a direction by its cosine;
/// - points, spots, spheres: a direction, evenly over the cone, and a point of the sphere's disk across it;
/// - environment: a direction by Environment::sample, a point of the disk that the scene's bounding sphere is
///   across it; directional lights: such a point.
/// The density is per solid angle and projected area (of the disk across the ray): what does not exist of a
/// delta light is left out. Refers to the scene, which must outlive it.
class LightEmitter {
  public:
    explicit LightEmitter(const Scene& scene);

    bool empty() const { return lights_.size() == 0 || power_ == 0; }
    /// `choice`: which light; density 0 when there is none, or it is dark there.
    Emission sample(float choice, Vec2 origin, Vec2 direction, float time) const;
    /// The density of a ray that travels along `direction` from a point of the light (of the triangle).
    double density(std::size_t light, std::uint32_t triangle, const Vec3& direction) const;

  private:
    double coneDensity(const Light& light) const;
    float leastCosine(const Light& light) const;
    Emission fromMesh(std::size_t light, float side, Vec2 origin, Vec2 direction) const;
    Emission fromCone(std::size_t light, Vec2 origin, Vec2 direction) const;
    Emission fromAfar(std::size_t light, Vec2 origin, Vec2 direction) const;

    const Scene* scene_;
    Distribution lights_;
    double power_ = 0;
    std::vector<std::vector<float>> areas_;  ///< of a mesh light's triangles
    Vec3 centre_;                            ///< of the scene's bounding sphere
    float radius_ = 0;
};

}  // namespace vlx::render
