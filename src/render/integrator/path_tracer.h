#pragma once

#include "render/integrator/integrator.h"
#include "render/light/light_sampler.h"
#include "render/plan/kernel_features.h"

namespace vlx::render {

template <Features F>
class BasicBsdf;

/// Unidirectional path tracing with next-event estimation, multiple importance sampling by the power
/// heuristic (Veach, "Robust Monte Carlo methods for light transport simulation", 1997) and Russian roulette
/// by throughput. Unbiased up to `maxBounces`.
///
/// There are several kernels, each compiled with some features only: the smallest that has what
/// `options.effects` asks for is used. All of them give the same bits.
class PathTracer final : public Integrator {
  public:
    PathTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
               const PathOptions& options);

    /// What comes in along any ray.
    PathSample along(const Ray& ray, const PathSampler& sampler) const {
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

    PathSample traceRay(const Ray& ray, Vec2, const PathSampler& sampler, std::vector<Splat>&,
                        Rgb*) const override {
        return along(ray, sampler);
    }
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
