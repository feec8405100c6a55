#pragma once

#include "render/integrator/integrator.h"
#include "render/light/light_sampler.h"
#include "render/surface/bsdf.h"
#include "render/surface/surface.h"

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
        layers_.reserve(traced.materials.size());
        for (const Material& material : traced.materials) {
            SurfaceParameters& plain = plain_.emplace_back(plainParameters(traced, material));
            plain.leftOut = wanted.leftOut;
            if (hasOneLayer(material)) plain.layer = &layers_.emplace_back(plain);
        }
    }
    PathContext(const PathContext&) = delete;
    PathContext& operator=(const PathContext&) = delete;

    /// What is known of a material's surfaces before they are met.
    const SurfaceParameters& plain(const Material& material) const {
        return plain_[static_cast<std::size_t>(&material - scene.materials.data())];
    }

    const Scene& scene;
    const Accelerator& accelerator;
    PathOptions options;  ///< at most one bounce where indirect light is not simulated
    LightSampler lights;
    bool absorbs;
    bool hashesOpacity;

  private:
    std::vector<SurfaceParameters> plain_;
    std::vector<DielectricLayer> layers_;
};

}  // namespace vlx::render
