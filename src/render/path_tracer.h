#pragma once

#include "accelerator.h"
#include "light.h"
#include "sampling.h"
#include "scene.h"

namespace vlx::render {

/// How direct light is found. Mis is the one to use; the others are for tests: all three agree.
enum class Strategy { Mis, LightsOnly, BsdfOnly };

struct PathOptions {
    int maxBounces = 12;  ///< scattering events at most: 0 shows only what emits, 1 direct light
    Strategy strategy = Strategy::Mis;
};

/// What one camera sample yields.
struct PathSample {
    Rgb radiance;      ///< never clamped
    float depth = 0;   ///< along the camera ray to the first hit; 0 on a miss
    bool hit = false;  ///< the camera ray met something
    Rgb albedo{1, 1,
               1};  ///< reflectance at the first hit that is not perfectly smooth; 1 for emitters, misses
    Vec3 normal;    ///< shading normal there, towards the viewer; 0 on a miss
};

/// Unidirectional path tracing with next-event estimation, multiple importance sampling by the power
/// heuristic (Veach, "Robust Monte Carlo methods for light transport simulation", 1997) and Russian roulette
/// by throughput. Unbiased up to `maxBounces`. Refers to scene and accelerator, which must outlive it; safe
/// to use from many threads.
class PathTracer {
  public:
    PathTracer(const Scene& scene, const Accelerator& accelerator, const PathOptions& options);

    PathSample trace(Ray ray, const PathSampler& sampler) const;

  private:
    Rgb directLight(const SurfacePoint& point, const Frame& frame, const Bsdf& bsdf, const Receiver& receiver,
                    float choice, Vec2 u, std::uint32_t seed) const;

    const Scene& scene_;
    const Accelerator& accelerator_;
    PathOptions options_;
    LightSampler lights_;
};

}  // namespace vlx::render
