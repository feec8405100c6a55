#include "pilot.h"

#include <ctime>
#include <limits>
#include <memory>

#include "camera.h"

namespace vlx::render {
namespace {

constexpr int kSide = 24;    ///< of the grid of pixels
constexpr int kSamples = 2;  ///< of each
constexpr int kRuns = 3;

double threadSeconds() {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

/// A scene without one effect, ready to be traced.
struct Variant {
    Variant(const Scene& whole, const Plan& plan, const RenderOptions& options, const Accelerator& shared,
            std::optional<Effect> without)
        : path(options.path) {
        const Scene* traced = &whole;
        const Accelerator* accelerator = &shared;
        if (without) {
            Plan rest = plan;
            rest.leftOut = {};
            rest.idleLights.clear();
            rest.leftOut.set(*without);
            rest.planned.set(*without, false);
            own = std::make_unique<Scene>(whole);
            applyPlan(*own, rest);
            path.effects = rest.planned;
            EffectSet lobes = options.path.leftOut;
            if (tracerLeavesOut(*without)) lobes.set(*without);
            path.leftOut = lobes;
            traced = own.get();
            if (needsOwn(*own, *without)) {
                ownAccelerator = std::make_unique<Accelerator>(*own, path.effects);
                accelerator = ownAccelerator.get();
            }
        }
        view = std::make_unique<View>(traced->cameras[options.camera], options.width, options.height);
        tracer = std::make_unique<PathTracer>(*traced, *accelerator, path);
    }

    /// Whether the shared accelerator does not fit: it knows lights by number.
    static bool needsOwn(const Scene& scene, Effect e) {
        using enum Effect;
        if (e == Alpha || e == ObjectMotion || e == SphereLights) return true;
        if (e != EmissiveMeshes && e != PunctualLights && e != Environment) return false;
        for (const Light& light : scene.lights)
            if (light.type == LightType::Sphere) return true;
        return false;
    }

    double run(const RenderOptions& options) const {
        const bool lens = path.effects.has(Effect::DepthOfField);
        const bool moves = path.effects.hasAny({Effect::CameraMotion, Effect::ObjectMotion});
        const double start = threadSeconds();
        for (int i = 0; i < kSide * kSide; ++i) {
            const float x =
                (static_cast<float>(i % kSide) + 0.5f) / kSide * static_cast<float>(options.width);
            const float y =
                (static_cast<float>(i / kSide) + 0.5f) / kSide * static_cast<float>(options.height);
            for (std::uint32_t s = 0; s < kSamples; ++s) {
                const PathSampler sampler(hashOf(options.seed, i), s);
                const Vec2 u = lens ? sampler.pair(dimension::kLens) : Vec2{};
                const float time = moves ? sampler.pair(dimension::kTime).x : 0;
                tracer->trace(view->ray(x, y, u, time), sampler);
            }
        }
        return threadSeconds() - start;
    }

    PathOptions path;
    std::unique_ptr<Scene> own;
    std::unique_ptr<Accelerator> ownAccelerator;
    std::unique_ptr<View> view;
    std::unique_ptr<PathTracer> tracer;
};

}  // namespace

std::array<std::optional<double>, kEffects> pilotShares(const Scene& scene, const Plan& plan,
                                                        const RenderOptions& options) {
    std::array<std::optional<double>, kEffects> shares;
    if (scene.vertices.size() > 2'000'000) return shares;
    const Accelerator accelerator(scene, options.path.effects);
    const Variant whole(scene, plan, options, accelerator, std::nullopt);
    whole.run(options);  // warm
    for (const PlannedEffect& e : plan.effects) {
        if (!e.called || !e.planned) continue;
        const Variant without(scene, plan, options, accelerator, e.effect);
        double with = std::numeric_limits<double>::infinity(), less = with;
        for (int i = 0; i < kRuns; ++i) {
            with = std::min(with, whole.run(options));
            less = std::min(less, without.run(options));
        }
        shares[static_cast<std::size_t>(e.effect)] = with > 0 ? std::max(0.0, 1 - less / with) : 0;
    }
    return shares;
}

}  // namespace vlx::render
