#pragma once

#include <array>
#include <optional>

#include "render/film/render.h"
#include "render/plan/kernel_features.h"
#include "render/plan/plan.h"

namespace vlx::render {

struct EffectPilot {
    /// Part of the tracing time that each effect takes: 1 less the time without it over the time with it,
    /// processor time. Measured, so it differs a little from run to run. Nothing for effects that are not
    /// called for, and for all of them when the scene has more than two million vertices.
    std::array<std::optional<double>, kEffects> shares;
    /// Part of the surfaces met by paths that each of the path tracer's kernels works on, as in kKernelNames.
    /// 0 for all where nothing is met.
    std::array<double, kKernelNames.size()> hits{};
};

/// Of a few thousand samples. `scene`: the plan applied; `options`: of the picture.
EffectPilot pilotEffects(const Scene& scene, const Plan& plan, const RenderOptions& options);

/// What a few samples, spread over the picture, say of all.
struct PilotMeasure {
    double seconds = 0;           ///< of the pilot itself, wall time
    double secondsPerSample = 0;  ///< wall time, on all threads; writing not included
    double relativeVariance = 0;  ///< mean over pixels and channels of a sample's variance / (mean^2 + 0.01)
};

/// Traces pixels of a grid over the picture, 16 samples each, until that has taken `atLeast` seconds. With
/// bidirectional tracing the variance is not that of the picture, which has splats too.
PilotMeasure pilotMeasure(const Scene& scene, const Accelerator& accelerator, const RenderOptions& options,
                          double atLeast);

}  // namespace vlx::render
