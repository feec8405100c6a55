#include "render/integrator/path_tracer.h"

#include <algorithm>

#include "render/integrator/path_kernel.h"
#include "render/plan/material_range.h"

namespace vlx::render {
namespace {

struct Kernel {
    Features features;
    bool (*scatterAt)(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
    void (*scatterAll)(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);
};

/// Smallest first.
constexpr std::array kKernels = [] {
    const auto of = []<Features F>() { return Kernel{F, &scatterAt<F, PathEstimate>, &scatterAll<F>}; };
    return std::array{of.operator()<kMatte>(),       of.operator()<kMatteTextured>(),
                      of.operator()<kReflecting>(),  of.operator()<kReflectingTextured>(),
                      of.operator()<kLayered>(),     of.operator()<kLayeredTextured>(),
                      of.operator()<kEveryFeature>()};
}();

static_assert(kKernels.size() == kKernelNames.size());

bool covers(const Features& kernel, const Features& wanted) {
    const auto implies = [](bool a, bool b) { return !a || b; };
    return implies(wanted.reflection, kernel.reflection) && implies(wanted.layers, kernel.layers) &&
           implies(wanted.glass, kernel.glass) && implies(wanted.textures, kernel.textures) &&
           implies(wanted.rare, kernel.rare);
}

/// What a surface of a shape calls for.
Features featuresOf(const Scene& scene, std::size_t index, const MaterialRange& range, bool moves) {
    const Shape& shape = scene.shapes[index];
    Features f;
    f.layers = range.clearcoat || range.sheen;
    f.glass = range.transmission || range.roughTransmission;
    f.reflection = f.layers || f.glass || range.glossy || range.mirror;
    f.textures = scene.materials[shape.material].textured || shape.firstColour >= 0;
    f.rare = moves && (shape.deformation >= 0 || index >= scene.worldShapes);
    return f;
}

}  // namespace

PathTracer::PathTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
                       const PathOptions& options)
    : Integrator(view, options.effects),
      context_(scene, accelerator, options, options.effects == EffectSet::all()) {
    const bool general = options.effects == EffectSet::all() || !options.leftOut.none();
    kernels_.assign(scene.shapes.size(), kKernels.size() - 1);
    if (general) return;
    const MaterialRanges ranges(scene);
    for (std::size_t i = 0; i < scene.shapes.size(); ++i) {
        const Features wanted = featuresOf(scene, i, ranges.of(scene.shapes[i].material),
                                           options.effects.has(Effect::ObjectMotion));
        const auto smallest = std::ranges::find_if(
            kKernels, [&](const Kernel& kernel) { return covers(kernel.features, wanted); });
        kernels_[i] = static_cast<std::uint8_t>(smallest - kKernels.begin());
    }
}

PathSample PathTracer::along(const Ray& ray, const PathSampler& sampler) const {
    PathEstimate estimate(context_);
    PathSample sample = eyeSubpath(context_, ray, sampler, estimate, [&](EyePath& path, const Hit& hit) {
        return kKernels[kernels_[hit.shape]].scatterAt(path, hit, sampler, estimate);
    });
    sample.radiance = estimate.radiance();
    return sample;
}

void PathTracer::trace(std::span<const CameraSample> samples, std::span<PathSample> found,
                       std::vector<Splat>&) const {
    Hits hits{};
    follow(samples, found, hits);
}

PathTracer::Hits PathTracer::hits(std::span<const CameraSample> samples) const {
    std::vector<PathSample> found(samples.size());
    Hits hits{};
    follow(samples, found, hits);
    return hits;
}

void PathTracer::follow(std::span<const CameraSample> samples, std::span<PathSample> found,
                        Hits& hits) const {
    const Scene& scene = context_.scene;
    std::vector<StreamedPath> paths;
    paths.reserve(samples.size());
    std::vector<StreamedPath*> alive;
    for (const CameraSample& sample : samples) {
        const Start start = startOf(sample);
        alive.push_back(&paths.emplace_back(context_, start.ray, start.sampler));
    }
    std::array<std::vector<StreamedPath*>, kKernels.size()> met;
    while (!alive.empty()) {
        for (StreamedPath* p : alive)
            if (const std::optional<Hit> hit = meetNext(p->path, p->estimate)) {
                p->hit = *hit;
                __builtin_prefetch(&scene.triangles[scene.shapes[hit->shape].firstTriangle + hit->triangle]);
                met[kernels_[hit->shape]].push_back(p);
            }
        alive.clear();
        for (std::size_t k = 0; k < kKernels.size(); ++k) {
            hits[k] += met[k].size();
            kKernels[k].scatterAll(met[k], alive);
            met[k].clear();
        }
    }
    for (std::size_t i = 0; i < paths.size(); ++i) {
        found[i] = paths[i].path.seen;
        found[i].radiance = paths[i].estimate.radiance();
    }
}

const Features& PathTracer::featuresAt(std::size_t shape) const { return kKernels[kernels_[shape]].features; }

}  // namespace vlx::render
