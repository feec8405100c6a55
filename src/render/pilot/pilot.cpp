#include "render/pilot/pilot.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <vector>

#include "render/integrator/integrator.h"
#include "render/scene/camera.h"
#include "variolux/base/hash.h"
#include "variolux/base/parallel.h"

namespace vlx::render {
namespace {

constexpr int kGridSide = 24;  ///< of the grid of pixels
constexpr int kSamples = 2;    ///< of each
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
        integrator = makeIntegrator(IntegratorKind::Path, *traced, *accelerator,
                                    View(traced->cameras[options.camera], options.width, options.height),
                                    {0, 0, options.width, options.height}, path);
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
        std::vector<Splat> splats;
        const double start = threadSeconds();
        for (int i = 0; i < kGridSide * kGridSide; ++i) {
            const float x =
                (static_cast<float>(i % kGridSide) + 0.5f) / kGridSide * static_cast<float>(options.width);
            const float y =
                (static_cast<float>(i / kGridSide) + 0.5f) / kGridSide * static_cast<float>(options.height);
            for (std::uint32_t s = 0; s < kSamples; ++s) {
                CameraSample sample;
                sample.x = x;
                sample.y = y;
                sample.seed = hashOf(options.seed, i);
                sample.index = s;
                integrator->trace(sample, splats);
            }
        }
        return threadSeconds() - start;
    }

    PathOptions path;
    std::unique_ptr<Scene> own;
    std::unique_ptr<Accelerator> ownAccelerator;
    std::unique_ptr<Integrator> integrator;
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

PilotMeasure pilotMeasure(const Scene& scene, const Accelerator& accelerator, const RenderOptions& options,
                          double atLeast) {
    using Clock = std::chrono::steady_clock;
    constexpr int kPixels = 1024, kPerPixel = 16, kMostRounds = 64;
    const View view(scene.cameras[options.camera], options.width, options.height);
    const Window window = options.crop.value_or(Window{0, 0, options.width, options.height});
    const std::unique_ptr<Integrator> integrator =
        makeIntegrator(options.integrator, scene, accelerator, view, window, options.path);
    PilotMeasure measure;
    double variance = 0;
    int rounds = 0;
    const auto start = Clock::now();
    do {
        std::vector<double> errors(kPixels);
        parallelFor(0, kPixels, [&](std::int64_t i) {
            // Points of the plane's sequence, mixed, so that a round's pixels are all over the picture.
            const SobolPoint p = scrambledSobolPoint(static_cast<std::uint32_t>(rounds * kPixels + i),
                                                     SobolSeeds::from(0x70696cu));
            const int column = window.x + static_cast<int>(unitFloat(p.x) * static_cast<float>(window.width));
            const int row = window.y + static_cast<int>(unitFloat(p.y) * static_cast<float>(window.height));
            std::array<double, 3> sum{}, squares{};
            std::vector<Splat> splats;
            for (std::uint32_t s = 0; s < kPerPixel; ++s) {
                const std::uint64_t seed = hashOf(options.seed, 0x70696cu, rounds, i);
                const Rgb v = integrator->trace(sampleInPixel(column, row, seed, s), splats).radiance;
                const std::array<double, 3> rgb{v.x, v.y, v.z};
                for (std::size_t c = 0; c < 3; ++c) {
                    sum[c] += rgb[c];
                    squares[c] += rgb[c] * rgb[c];
                }
            }
            for (std::size_t c = 0; c < 3; ++c) {
                const double mean = sum[c] / kPerPixel;
                const double v =
                    std::max(0.0, squares[c] / kPerPixel - mean * mean) * kPerPixel / (kPerPixel - 1);
                errors[static_cast<std::size_t>(i)] += v / (mean * mean + 0.01) / 3;
            }
        });
        for (const double e : errors) variance += e / kPixels;
        ++rounds;
        measure.seconds = std::chrono::duration<double>(Clock::now() - start).count();
    } while (measure.seconds < atLeast && rounds < kMostRounds);
    measure.secondsPerSample = measure.seconds / (static_cast<double>(rounds) * kPixels * kPerPixel);
    measure.relativeVariance = variance / rounds;
    return measure;
}

}  // namespace vlx::render
