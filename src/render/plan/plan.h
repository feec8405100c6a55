#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "render/plan/effect_set.h"
#include "render/scene/scene.h"

namespace vlx::render {

/// The picture that is planned for.
struct PlanOptions {
    std::size_t camera = 0;
    int width = 512;
    int height = 512;
    int maxBounces = 12;
    EffectRequest request;
};

struct PlannedEffect {
    Effect effect = Effect::Diffuse;
    bool called = false;   ///< by the scene
    bool planned = false;  ///< will be simulated
    std::string reason;    ///< names what calls for it, or says why nothing does
};

/// Features of first hits that the dump is to hold: those that differ from hit to hit.
struct RecordedFeatures {
    bool albedo = true;
    bool normalAndDepth = true;
    std::string reason;  ///< why something is not recorded; else empty
};

/// Whether the dump is to hold motion vectors: of a picture in a sequence, where the camera or something that
/// it may see is elsewhere in a neighbouring frame.
struct RecordedMotion {
    bool recorded = false;
    std::string reason;
};

/// What a picture of a scene is to simulate. Derived from the scene alone, before anything is traced, and
/// conservative: what is not called for cannot be met by any path. What no path can meet calls for nothing:
/// materials that nothing in reach has, surfaces out of the camera's sight where nothing in sight scatters,
/// lights that reach nothing, animations outside the exposure.
struct Plan {
    std::array<PlannedEffect, kEffects> effects;
    bool general = false;  ///< everything is simulated, called for or not
    EffectSet called;
    EffectSet planned;
    EffectSet leftOut;  ///< called for, but not wanted: the image is biased
    RecordedFeatures features;
    RecordedMotion motion;
    std::vector<std::size_t> idleLights;  ///< lights that reach nothing
    std::vector<std::string> warnings;

    const PlannedEffect& of(Effect e) const { return effects[static_cast<std::size_t>(e)]; }
    /// Whether any light is called for and planned.
    bool lit() const;
    /// Names of what the picture holds, for the dump's header: what is called for and planned.
    std::vector<std::string> simulated() const;
};

Plan planEffects(const Scene& scene, const PlanOptions& options);

/// Whether an effect is the tracer's to leave out (PathOptions::leftOut), not the scene's.
bool tracerLeavesOut(Effect effect);

/// Takes out of the scene what the plan leaves out and is the scene's: lights, lenses, motion, textures and
/// layers; also idle lights, unless the plan is general. To be called before an accelerator is built.
void applyPlan(Scene& scene, const Plan& plan);

}  // namespace vlx::render
