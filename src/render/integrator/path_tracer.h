#pragma once

#include "render/integrator/path_context.h"
#include "render/plan/kernel_features.h"

namespace vlx::render {

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
        return kernel_(context_, ray, sampler);
    }

    /// Of the kernel in use.
    const Features& features() const { return features_; }

  private:
    using Kernel = PathSample (*)(const PathContext&, const Ray&, const PathSampler&);

    PathSample traceRay(const Ray& ray, Vec2, const PathSampler& sampler, std::vector<Splat>&,
                        Rgb*) const override {
        return along(ray, sampler);
    }

    PathContext context_;
    Features features_ = kEveryFeature;
    Kernel kernel_;
};

}  // namespace vlx::render
