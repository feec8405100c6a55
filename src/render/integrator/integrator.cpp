#include "render/integrator/integrator.h"

#include "render/integrator/bidirectional.h"
#include "render/integrator/path_tracer.h"

namespace vlx::render {

Integrator::Integrator(const View& view, const EffectSet& effects)
    : view_(view),
      lens_(effects.has(Effect::DepthOfField)),
      moves_(effects.hasAny({Effect::CameraMotion, Effect::ObjectMotion})) {}

Integrator::Start Integrator::startOf(const CameraSample& sample) const {
    const PathSampler sampler(sample.seed, sample.index);
    const Vec2 lens = lens_ ? sampler.pair(dimension::kLens) : Vec2{};
    const float time = moves_ ? sampler.pair(dimension::kTime).x : 0;
    return {sampler, lens, view_.ray(sample.x, sample.y, lens, time)};
}

PathSample Integrator::trace(const CameraSample& sample, std::vector<Splat>& splats, Rgb* pathSquares) const {
    const Start start = startOf(sample);
    return traceRay(start.ray, start.lens, start.sampler, splats, pathSquares);
}

void Integrator::trace(std::span<const CameraSample> samples, std::span<PathSample> found,
                       std::vector<Splat>& splats) const {
    for (std::size_t i = 0; i < samples.size(); ++i) {
        const std::size_t before = splats.size();
        found[i] = trace(samples[i], splats);
        for (std::size_t s = before; s < splats.size(); ++s) splats[s].sample = static_cast<std::uint32_t>(i);
    }
}

std::unique_ptr<Integrator> makeIntegrator(IntegratorKind kind, const Scene& scene,
                                           const Accelerator& accelerator, const View& view,
                                           const Window& window, const PathOptions& options) {
    if (kind == IntegratorKind::Bidirectional)
        return std::make_unique<BidirectionalTracer>(scene, accelerator, view, window, options);
    return std::make_unique<PathTracer>(scene, accelerator, view, options);
}

}  // namespace vlx::render
