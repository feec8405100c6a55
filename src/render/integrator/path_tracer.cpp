#include "render/integrator/path_tracer.h"

#include "render/integrator/path_kernel.h"

namespace vlx::render {
namespace {

/// What effects take of a kernel.
Features featuresFor(const EffectSet& effects, const EffectSet& leftOut, const Scene& scene) {
    using enum Effect;
    Features f;
    f.layers = effects.hasAny({Clearcoat, Sheen});
    f.glass = effects.hasAny({Transmission, RoughTransmission});
    f.reflection = f.layers || f.glass || effects.hasAny({Glossy, Mirror});
    f.textures = effects.hasAny({Textures, NormalMaps}) || !scene.colours.empty();
    f.rare = effects.hasAny({Absorption, ObjectMotion}) || !leftOut.none();
    return f;
}

bool covers(const Features& kernel, const Features& wanted) {
    const auto implies = [](bool a, bool b) { return !a || b; };
    return implies(wanted.reflection, kernel.reflection) && implies(wanted.layers, kernel.layers) &&
           implies(wanted.glass, kernel.glass) && implies(wanted.textures, kernel.textures) &&
           implies(wanted.rare, kernel.rare);
}

}  // namespace

PathTracer::PathTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
                       const PathOptions& options)
    : Integrator(view, options.effects),
      context_(scene, accelerator, options, options.effects == EffectSet::all()),
      kernel_(&tracePath<kEveryFeature>) {
    const Features wanted = featuresFor(options.effects, options.leftOut, scene);
    // Smallest first. One with everything but the rare parts serves what none of the smaller ones does.
    const auto offer = [&]<Features F>() {
        if (features_ != kEveryFeature || !covers(F, wanted)) return;
        features_ = F;
        kernel_ = &tracePath<F>;
    };
    offer.operator()<kMatte>();
    offer.operator()<kMatteTextured>();
    offer.operator()<kReflecting>();
    offer.operator()<kReflectingTextured>();
    offer.operator()<kLayered>();
    offer.operator()<kLayeredTextured>();
}

}  // namespace vlx::render
