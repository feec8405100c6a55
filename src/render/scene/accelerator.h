#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "render/math/vec.h"
#include "render/plan/effect_set.h"

namespace vlx::render {

struct Scene;

/// The nearest thing that a ray meets: a triangle of a shape, or a sphere light.
struct Hit {
    float distance = 0;
    float u = 0;  ///< barycentric coordinates of the second and third corner
    float v = 0;
    std::uint32_t shape = 0;
    std::uint32_t triangle = 0;  ///< of the shape
    std::int32_t instance = -1;  ///< -1: the shape is in world space
    std::int32_t light = -1;     ///< a sphere light's index, or -1: then the rest is meaningless
};

/// A ray as it was asked for.
struct RecordedRay {
    Ray ray;
    float distance = 0;  ///< of a shadow ray
    std::uint32_t seed = 0;
    bool shadow = false;
};

/// Hit tests through Embree: robust (watertight) traversal; instances move when the scene says so. Surfaces
/// that let rays through (alpha mask and blend, backs of single-sided surfaces) have filters; others pay
/// nothing for them. Blended surfaces are met with the probability of their opacity, decided by a hash of the
/// ray's seed and the triangle: the same for as long as the seed is the same.
class Accelerator {
  public:
    /// Refers to the scene's vertices and triangles, which must outlive it unchanged. Filters of opacity only
    /// when `effects` has alpha. Throws Error when Embree fails (out of memory).
    explicit Accelerator(const Scene& scene, const EffectSet& effects = EffectSet::all());
    ~Accelerator();
    Accelerator(const Accelerator&) = delete;
    Accelerator& operator=(const Accelerator&) = delete;

    std::optional<Hit> intersect(const Ray& ray, std::uint32_t seed) const {
        return intersect(ray, seed, false);
    }
    /// As intersect, but single-sided surfaces are met from behind too: a ray against the direction in which
    /// cameras look, which decides what is seen through.
    std::optional<Hit> intersectBothSides(const Ray& ray, std::uint32_t seed) const {
        return intersect(ray, seed, true);
    }
    /// Whether something lies on the ray before `distance`.
    bool occluded(const Ray& ray, float distance, std::uint32_t seed) const;

    /// How many rays the calling thread has tested so far, in all scenes.
    static std::uint64_t raysOnThisThread();

    /// For benchmarks: every ray from now on is appended to `rays` (null: no longer). One thread only.
    void record(std::vector<RecordedRay>* rays) { recorder_ = rays; }
    /// For benchmarks: the RTCScene.
    void* embreeScene() const;

  private:
    std::optional<Hit> intersect(const Ray& ray, std::uint32_t seed, bool bothSides) const;

    struct Impl;
    std::unique_ptr<Impl> impl_;
    std::vector<RecordedRay>* recorder_ = nullptr;
};

}  // namespace vlx::render
