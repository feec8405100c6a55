#pragma once

#include "render/integrator/path_context.h"
#include "render/plan/kernel_features.h"

namespace vlx::render {

/// Unidirectional path tracing with next-event estimation, multiple importance sampling by the power
/// heuristic (Veach, "Robust Monte Carlo methods for light transport simulation", 1997) and Russian roulette
/// by throughput. Unbiased up to `maxBounces`.
///
/// There are several kernels, each compiled with some features only: at each surface the smallest works that
/// has what the surface's material calls for; the one with everything where all `options.effects` are asked
/// for. All of them give the same bits.
class PathTracer final : public Integrator {
  public:
    PathTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
               const PathOptions& options);

    using Integrator::trace;
    /// Paths go on together, and at each surface those that call for the same kernel.
    void trace(std::span<const CameraSample> samples, std::span<PathSample> found,
               std::vector<Splat>& splats) const override;

    /// How many of the surfaces that the samples' paths meet each kernel works on, as in kKernelNames.
    using Hits = std::array<std::uint64_t, kKernelNames.size()>;
    Hits hits(std::span<const CameraSample> samples) const;

    /// What comes in along any ray.
    PathSample along(const Ray& ray, const PathSampler& sampler) const;

    /// Of the kernel that works on a shape's surface.
    const Features& featuresAt(std::size_t shape) const;

  private:
    PathSample traceRay(const Ray& ray, Vec2, const PathSampler& sampler, std::vector<Splat>&,
                        Rgb*) const override {
        return along(ray, sampler);
    }

    void follow(std::span<const CameraSample> samples, std::span<PathSample> found, Hits& hits) const;

    PathContext context_;
    std::vector<std::uint8_t> kernels_;  ///< of each shape
};

}  // namespace vlx::render
