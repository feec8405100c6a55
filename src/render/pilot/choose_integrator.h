#pragma once

#include <string>
#include <string_view>

#include "render/film/render.h"

namespace vlx::render {

enum class IntegratorRequest { Auto, Path, Bidirectional };

constexpr std::string_view nameOf(IntegratorKind kind) {
    return kind == IntegratorKind::Path ? "path" : "bidirectional";
}

struct IntegratorChoice {
    IntegratorKind chosen = IntegratorKind::Path;
    std::string reason;
    bool tried = false;  ///< a pilot decided
};

/// Which integrator lowers the error faster. Path tracing, unless the plan (`options.plan`) has caustics, or
/// less than a quarter of the light comes to what the camera sees straight from the lights, and the picture
/// has so many `samples` that a pilot pays. Then both trace the picture small, 36 times, and what counts is
/// the variance of one sample a pixel, relative as in relMSE, times the number of rays. Path tracing's is at
/// least what the paths that bidirectional tracing found contribute to it (Integrator::trace):
/// caustics that it did not meet in the pilot do not show in its own. Deterministic: no clock is read. One
/// thread.
IntegratorChoice chooseIntegrator(const Scene& scene, const Accelerator& accelerator,
                                  const RenderOptions& options, double samples);

}  // namespace vlx::render
