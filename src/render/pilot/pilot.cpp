#include "render/pilot/pilot.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <memory>
#include <numeric>
#include <span>
#include <vector>

#include "render/integrator/path_tracer.h"
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

/// Of pixels of a grid over the picture.
std::vector<CameraSample> gridSamples(const RenderOptions& options) {
    std::vector<CameraSample> samples;
    for (int i = 0; i < kGridSide * kGridSide; ++i)
        for (std::uint32_t s = 0; s < kSamples; ++s) {
            CameraSample sample;
            sample.x =
                (static_cast<float>(i % kGridSide) + 0.5f) / kGridSide * static_cast<float>(options.width);
            sample.y =
                (static_cast<float>(i / kGridSide) + 0.5f) / kGridSide * static_cast<float>(options.height);
            sample.seed = hashOf(options.seed, i);
            sample.index = s;
            samples.push_back(sample);
        }
    return samples;
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
        const std::vector<CameraSample> samples = gridSamples(options);
        std::vector<PathSample> found(kStream);
        std::vector<Splat> splats;
        const double start = threadSeconds();
        for (std::size_t i = 0; i < samples.size(); i += kStream) {
            const std::size_t count = std::min(kStream, samples.size() - i);
            integrator->trace(std::span(samples).subspan(i, count), std::span(found).first(count), splats);
        }
        return threadSeconds() - start;
    }

    PathOptions path;
    std::unique_ptr<Scene> own;
    std::unique_ptr<Accelerator> ownAccelerator;
    std::unique_ptr<Integrator> integrator;
};

/// Mean over the channels of a sample's variance / (mean^2 + 0.01).
double relativeVariance(std::span<const PathSample> pixel) {
    const auto n = static_cast<double>(pixel.size());
    std::array<double, 3> sum{}, squares{};
    for (const PathSample& s : pixel) {
        const std::array<double, 3> rgb{s.radiance.x, s.radiance.y, s.radiance.z};
        for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += rgb[c];
            squares[c] += rgb[c] * rgb[c];
        }
    }
    double error = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        const double mean = sum[c] / n;
        error += std::max(0.0, squares[c] / n - mean * mean) * n / (n - 1) / (mean * mean + 0.01) / 3;
    }
    return error;
}

}  // namespace

EffectPilot pilotEffects(const Scene& scene, const Plan& plan, const RenderOptions& options) {
    EffectPilot found;
    const Accelerator accelerator(scene, options.path.effects);
    const PathTracer tracer(scene, accelerator,
                            View(scene.cameras[options.camera], options.width, options.height), options.path);
    const PathTracer::Hits hits = tracer.hits(gridSamples(options));
    const auto all = static_cast<double>(std::accumulate(hits.begin(), hits.end(), std::uint64_t{0}));
    for (std::size_t k = 0; k < hits.size() && all > 0; ++k)
        found.hits[k] = static_cast<double>(hits[k]) / all;
    if (scene.vertices.size() > 2'000'000) return found;
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
        found.shares[static_cast<std::size_t>(e.effect)] = with > 0 ? std::max(0.0, 1 - less / with) : 0;
    }
    return found;
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
    constexpr std::size_t kTogether = kStream / kPerPixel;
    static_assert(kPixels % kTogether == 0);
    do {
        std::vector<double> errors(kPixels);
        parallelFor(0, kPixels / kTogether, [&](std::int64_t stream) {
            std::vector<CameraSample> samples;
            for (std::size_t i = 0; i < kTogether; ++i) {
                const auto pixel =
                    static_cast<std::uint32_t>(static_cast<std::size_t>(stream) * kTogether + i);
                // Points of the plane's sequence, mixed, so that a round's pixels are all over the picture.
                const SobolPoint p = scrambledSobolPoint(static_cast<std::uint32_t>(rounds) * kPixels + pixel,
                                                         SobolSeeds::from(0x70696cu));
                const int column =
                    window.x + static_cast<int>(unitFloat(p.x) * static_cast<float>(window.width));
                const int row =
                    window.y + static_cast<int>(unitFloat(p.y) * static_cast<float>(window.height));
                const std::uint64_t seed = hashOf(options.seed, 0x70696cu, rounds, pixel);
                for (std::uint32_t s = 0; s < kPerPixel; ++s)
                    samples.push_back(sampleInPixel(column, row, seed, s));
            }
            std::vector<PathSample> found(samples.size());
            std::vector<Splat> splats;
            integrator->trace(samples, found, splats);
            for (std::size_t i = 0; i < kTogether; ++i)
                errors[static_cast<std::size_t>(stream) * kTogether + i] =
                    relativeVariance(std::span(found).subspan(i * kPerPixel, kPerPixel));
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
