// The path tracer's rays a second against bare Embree's on the same rays, in the same run, on one thread.

#include <benchmark/benchmark.h>
#include <embree3/rtcore.h>

#include <chrono>
#include <limits>
#include <span>
#include <vector>

#include "render/film/region_sampling.h"
#include "render/integrator/integrator.h"
#include "render/plan/plan.h"
#include "render/scene/accelerator.h"
#include "render/scene/scene_loader.h"

namespace vlx::render {
namespace {

constexpr int kSize = 96;

double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// One sample in each pixel, in streams.
void trace(const Integrator& integrator) {
    std::vector<CameraSample> samples;
    std::vector<PathSample> found(kStream);
    std::vector<Splat> splats;
    const auto flush = [&] {
        integrator.trace(samples, std::span(found).first(samples.size()), splats);
        benchmark::DoNotOptimize(found.data());
        samples.clear();
    };
    sampleUniformly({0, 0, kSize, kSize}, 1, 1, 1, [&](const CameraSample& s) {
        samples.push_back(s);
        if (samples.size() == kStream) flush();
        return Rgb{};
    });
    flush();
}

void shoot(RTCScene scene, const std::vector<RecordedRay>& rays) {
    unsigned int found = 0;
    for (const RecordedRay& recorded : rays) {
        RTCIntersectContext context;
        rtcInitIntersectContext(&context);
        const Ray& ray = recorded.ray;
        RTCRayHit r;
        r.ray = {ray.origin.x,
                 ray.origin.y,
                 ray.origin.z,
                 0,
                 ray.direction.x,
                 ray.direction.y,
                 ray.direction.z,
                 0,
                 0,
                 0xffffffffu,
                 0,
                 0};
        r.ray.tfar = recorded.shadow ? recorded.distance : std::numeric_limits<float>::infinity();
        r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
        r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
        if (recorded.shadow) {
            rtcOccluded1(scene, &context, &r.ray);
            found += r.ray.tfar < 0;
        } else {
            rtcIntersect1(scene, &context, &r);
            found += r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
        }
    }
    benchmark::DoNotOptimize(found);
}

void TracerAgainstBareEmbree(benchmark::State& state) {
    Scene scene = loadScene(VLX_TESTDATA "/scenes/interior.glb");
    const Plan plan = planEffects(scene, {scene.activeCamera, kSize, kSize, 12, {}});
    applyPlan(scene, plan);
    PathOptions options;
    options.effects = plan.planned;
    Accelerator accelerator(scene, plan.planned);
    const View view(scene.cameras[scene.activeCamera], kSize, kSize);
    const auto integrator =
        makeIntegrator(IntegratorKind::Path, scene, accelerator, view, {0, 0, kSize, kSize}, options);
    std::vector<RecordedRay> rays;
    accelerator.record(&rays);
    trace(*integrator);
    accelerator.record(nullptr);

    double tracing = 0, shooting = 0;
    for ([[maybe_unused]] auto iteration : state) {
        auto start = std::chrono::steady_clock::now();
        trace(*integrator);
        const double t = secondsSince(start);
        start = std::chrono::steady_clock::now();
        shoot(static_cast<RTCScene>(accelerator.embreeScene()), rays);
        shooting += secondsSince(start);
        tracing += t;
        state.SetIterationTime(t);
    }
    const double total = static_cast<double>(rays.size()) * static_cast<double>(state.iterations());
    state.counters["rays_a_sample"] = static_cast<double>(rays.size()) / (kSize * kSize);
    state.counters["tracer_Mrays/s"] = total / tracing * 1e-6;
    state.counters["embree_Mrays/s"] = total / shooting * 1e-6;
    state.counters["ratio"] = shooting / tracing;
    state.counters["us_a_sample"] = tracing / static_cast<double>(state.iterations()) / (kSize * kSize) * 1e6;
}
BENCHMARK(TracerAgainstBareEmbree)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace vlx::render

BENCHMARK_MAIN();
