#pragma once

#include <array>
#include <optional>

#include "plan.h"
#include "render.h"

namespace vlx::render {

/// Part of the tracing time that each effect takes: 1 less the time without it over the time with it, from a
/// few thousand samples each, processor time. Measured, so it differs a little from run to run. Nothing for
/// effects that are not called for, and for all of them when the scene has more than two million vertices.
/// `scene`: the plan applied; `options`: of the picture.
std::array<std::optional<double>, kEffects> pilotShares(const Scene& scene, const Plan& plan,
                                                        const RenderOptions& options);

}  // namespace vlx::render
