#pragma once

#include "render/light/light_sampler.h"
#include "render/math/sampling.h"
#include "render/plan/effect_set.h"
#include "render/plan/kernel_features.h"
#include "render/scene/accelerator.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// How direct light is found. Mis is the one to use; the others are for tests: all three agree.
enum class Strategy { Mis, LightsOnly, BsdfOnly };

struct PathOptions {
    int maxBounces = 12;  ///< scattering events at most: 0 shows only what emits, 1 direct light
    Strategy strategy = Strategy::Mis;
    /// What is to be simulated: all that the scene calls for must be in it. All: the general tracer.
    EffectSet effects = EffectSet::all();
    /// What the scene calls for and is not wanted: lobes of surfaces, and caustics. The rest is the scene's
    /// to leave out (plan.h).
    EffectSet leftOut;
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

template <Features F>
class BasicBsdf;

/// Unidirectional path tracing with next-event estimation, multiple importance sampling by the power
/// heuristic (Veach, "Robust Monte Carlo methods for light transport simulation", 1997) and Russian roulette
/// by throughput. Unbiased up to `maxBounces`. Refers to scene and accelerator, which must outlive it; safe
/// to use from many threads.
///
/// There are several kernels, each compiled with some features only: the smallest that has what
/// `options.effects` asks for is used. All of them give the same bits.
class PathTracer {
  public:
    PathTracer(const Scene& scene, const Accelerator& accelerator, const PathOptions& options);

    PathSample trace(const Ray& ray, const PathSampler& sampler) const {
        return (this->*kernel_)(ray, sampler);
    }

    /// Of the kernel in use.
    const Features& features() const { return features_; }

  private:
    using Kernel = PathSample (PathTracer::*)(Ray, const PathSampler&) const;
    /// What a shadow ray takes over from the path's.
    struct RayState {
        std::uint32_t seed = 0;
        float time = 0;
        const Material* medium = nullptr;  ///< on the viewer's side
        const Material* beyond = nullptr;  ///< on the other side of the surface
    };

    template <Features F>
    PathSample traceWith(Ray ray, const PathSampler& sampler) const;
    template <Features F>
    Rgb directLight(const SurfacePoint& point, const Frame& frame, const BasicBsdf<F>& bsdf,
                    const LightSampler::Local& local, float choice, Vec2 u, const RayState& state) const;

    const Scene& scene_;
    const Accelerator& accelerator_;
    PathOptions options_;
    LightSampler lights_;
    Features features_;
    Kernel kernel_;
    bool hashesOpacity_;
    bool choosesLights_;
    bool absorbs_;
    bool dropsCaustics_;
};

}  // namespace vlx::render
