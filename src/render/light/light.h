#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "render/math/sampling.h"
#include "render/math/vec.h"

namespace vlx::render {

enum class LightType : std::uint8_t { Point, Spot, Directional, Sphere, Mesh, Environment };

/// In what the intensities of a file's punctual lights are: W/sr and W/m2, or cd and lx; Auto: judged by the
/// file.
enum class LightUnits : std::uint8_t { Auto, Radiometric, Photometric };

/// A spot fades from the edge of its cone, t = 0, to where it is full, t = 1, by t^2 times this: 1, as
/// KHR_lights_punctual recommends, or, with `step` 1, what makes it the smooth step 3 t^2 - 2 t^3.
template <class Real>
Real coneEase(Real t, float step) {
    return 1.f + 2 * step * (1.f - t);
}

/// A light as next-event estimation sees it. Radiometric units.
struct Light {
    LightType type = LightType::Point;
    std::string name;
    /// Point, Spot, Sphere: W/sr. Directional: W/m2 across the beam. Mesh: mean radiance.
    Rgb intensity;
    Vec3 position;     ///< also the centre of a mesh light's bounds
    Vec3 direction;    ///< unit, in which light travels (Spot, Directional, a spot's sphere)
    float radius = 0;  ///< of a sphere; of a mesh light's bounds
    /// A spot's cone: t = clamp(cos x scale + offset, 0, 1); 0 and 1 for all around.
    float coneScale = 0;
    float coneOffset = 1;
    float coneStep = 0;        ///< of coneEase
    float coneCosine = 0;      ///< 1: times the cosine with the axis
    float range = 0;           ///< of Point and Spot; 0: without end
    std::int32_t course = -1;  ///< of a sphere: index into the scene's courses, or -1

    // Mesh lights:
    std::uint32_t shape = 0;
    float area = 0;
    Distribution triangles;  ///< chosen by power

    /// Factor of the cone towards a unit vector that leaves the light.
    float cone(const Vec3& away) const {
        const float cosine = dot(away, direction);
        const float t = std::clamp(cosine * coneScale + coneOffset, 0.f, 1.f);
        return square(t) * coneEase(t, coneStep) * (1 - coneCosine + coneCosine * cosine);
    }
    /// KHR_lights_punctual's window (Point, Spot): 1 - (distance / range)^4, 0 beyond the range.
    float window(float distanceSquared) const {
        return range > 0 ? std::max(0.f, 1 - square(distanceSquared / (range * range))) : 1.f;
    }
    /// Radiance of a sphere light's surface towards `away`: intensity spread over its disk.
    Rgb sphereRadiance(const Vec3& away) const { return intensity * (cone(away) / (kPi * radius * radius)); }
};

/// Radiance from far away: nothing, a constant, or a latitude-longitude image (rows from +y down; its middle
/// column is -z, +x lies to the right of it).
class Environment {
  public:
    Environment() = default;
    explicit Environment(const Rgb& constant);
    /// `pixels` row by row, finite and >= 0.
    Environment(int width, int height, std::vector<Rgb> pixels);

    explicit operator bool() const { return present_; }
    bool isConstant() const { return pixels_.empty(); }
    Rgb radiance(const Vec3& direction) const;
    /// Mean over the sphere.
    const Rgb& mean() const { return mean_; }

    struct Sample {
        Vec3 direction;
        float pdf = 0;
    };
    /// Images by luminance. A constant by the cosine about `normal`, or uniformly when light from behind
    /// counts too (`bothSides`).
    Sample sample(const Vec3& normal, bool bothSides, Vec2 u) const;
    float pdf(const Vec3& direction, const Vec3& normal, bool bothSides) const;

  private:
    bool present_ = false;
    Rgb constant_;
    Rgb mean_;
    int width_ = 0;
    int height_ = 0;
    std::vector<Rgb> pixels_;
    Distribution rows_;
    std::vector<Distribution> columns_;  ///< one a row
};

}  // namespace vlx::render
