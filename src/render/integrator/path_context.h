#pragma once

#include "render/integrator/integrator.h"
#include "render/light/light_sampler.h"

namespace vlx::render {

/// What all paths of an integrator share.
struct PathContext {
    /// `measures`: as LightSampler's.
    PathContext(const Scene& traced, const Accelerator& shot, const PathOptions& wanted, bool measures)
        : scene(traced),
          accelerator(shot),
          options(wanted),
          lights(traced, measures),
          absorbs(wanted.effects.has(Effect::Absorption)),
          hashesOpacity(wanted.effects.has(Effect::Alpha)) {
        if (!wanted.effects.has(Effect::Indirect)) options.maxBounces = std::min(1, wanted.maxBounces);
    }

    const Scene& scene;
    const Accelerator& accelerator;
    PathOptions options;  ///< at most one bounce where indirect light is not simulated
    LightSampler lights;
    bool absorbs;
    bool hashesOpacity;
};

}  // namespace vlx::render
