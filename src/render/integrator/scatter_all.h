#pragma once

#include "render/integrator/path_kernel.h"
#include "render/surface/four_surfaces.h"

/// scatterAt for many paths: four at once where the surface model can (bsdf_model.h).
namespace vlx::render {

/// Up to four paths; where there are fewer, the last is computed several times and counts once.
template <Features F>
void scatterFour(std::span<StreamedPath* const> met, std::vector<StreamedPath*>& alive) {
    const PathContext& in = met[0]->path.walk.in;
    const std::size_t count = met.size();
    const auto pathAt = [&](std::size_t i) -> StreamedPath& { return *met[std::min(i, count - 1)]; };
    struct Met {
        SurfacePoint point;
        Rgb shown;
        bool emits = false;
        bool lives = false;
        bool asksForLight = false;
        BouncePairs pairs{};
        LightSample light;
    };
    std::array<Met, kLanes> at;
    const auto pointAt = [&](std::size_t i) -> const SurfacePoint& {
        return at[std::min(i, count - 1)].point;
    };
    bool any = false;
    for (std::size_t i = 0; i < count; ++i) {
        StreamedPath& p = *met[i];
        at[i].point = p.path.walk.arrive<F>(p.hit);
        at[i].lives = meetSurface(p.path, p.hit, at[i].point, p.estimate, at[i].emits, at[i].shown);
        any = any || at[i].lives;
    }
    if (!any) return;

    const FourSurfaces<F> surfaces(
        [&](std::size_t i) { return pathAt(i).path.walk.template parameters<F>(pointAt(i)); });
    const Side<F, Lanes> side(in.scene.albedoTables[0],
                              vectorsOf([&](std::size_t i) { return pointAt(i).shadingNormal; }),
                              vectorsOf([&](std::size_t i) { return pointAt(i).geometricNormal; }),
                              maskOf([&](std::size_t i) { return pointAt(i).fromBehind; }), *surfaces,
                              vectorsOf([&](std::size_t i) { return -pathAt(i).path.walk.ray.direction; }));
    const LaneMask smoothLobe = side.bsdf.hasSmoothLobe();
    bool lights = false;
    any = false;
    for (std::size_t i = 0; i < count; ++i) {
        if (!at[i].lives) continue;
        EyePath& path = met[i]->path;
        showFeatures(path, at[i].point, smoothLobe[i] != 0, at[i].emits,
                     at[i].emits ? at[i].shown : lane(side.bsdf.albedo(), i));
        at[i].lives = path.walk.bounces < in.options.maxBounces;
        if (!at[i].lives) continue;
        if (path.walk.bounces > 0) countEffect(Effect::Indirect);
        any = true;
        at[i].pairs = met[i]->sampler.bounce(path.walk.bounces);
        at[i].asksForLight = met[i]->estimate.asksForLight(smoothLobe[i] != 0);
        lights = lights || at[i].asksForLight;
    }
    if (!any) return;

    BsdfValueOf<Lanes> f;
    if (lights) {
        const auto receiver = [&](std::size_t i) { return PathEstimate::receiverAt(pointAt(i)); };
        in.lights.prepare({&pathAt(0).estimate.local(), &pathAt(1).estimate.local(),
                           &pathAt(2).estimate.local(), &pathAt(3).estimate.local()},
                          {vectorsOf([&](std::size_t i) { return receiver(i).position; }),
                           vectorsOf([&](std::size_t i) { return receiver(i).normal; }),
                           maskOf([&](std::size_t i) { return receiver(i).bothSides; })});
        for (std::size_t i = 0; i < count; ++i)
            if (at[i].asksForLight) at[i].light = met[i]->estimate.chooseLight(at[i].pairs);
        f = side.evaluate(vectorsOf([&](std::size_t i) { return at[i].light.direction; }));
    }
    const auto pair = [&](std::uint32_t which) {
        return Vec2Of<Lanes>{lanesOf([&](std::size_t i) { return at[i].pairs[which].x; }),
                             lanesOf([&](std::size_t i) { return at[i].pairs[which].y; })};
    };
    const Vec2Of<Lanes> choice = pair(dimension::kChoice);
    const BsdfSampleOf<Lanes> next = side.bsdf.sample(pair(dimension::kDirection), choice.x);
    const Vec3Of<Lanes> direction = normalized(side.frame.toWorld(next.wi));
    for (std::size_t i = 0; i < count; ++i) {
        if (!at[i].lives) continue;
        StreamedPath& p = *met[i];
        const Media media = p.path.walk.mediaAt(at[i].point);
        if (PathEstimate::reaches(at[i].light))
            p.estimate.add(p.path.walk, at[i].point, media, at[i].light, lane(f, i), p.path.raySeed() + 1);
        const BsdfSample own = lane(next, i);
        if (isBlack(own.weight)) continue;
        p.estimate.scatter(own);
        if (scattered(p.path, at[i].point, media, own, lane(direction, i), choice.y[i])) alive.push_back(&p);
    }
}

/// The corners of a triangle are all over the memory: asked for while others are computed.
inline void prefetchCorners(const Scene& scene, const Hit& hit) {
    for (const std::uint32_t corner : scene.triangles[scene.shapes[hit.shape].firstTriangle + hit.triangle])
        __builtin_prefetch(&scene.vertices[corner]);
}

template <Features F>
void scatterAll(std::span<StreamedPath* const> met, std::vector<StreamedPath*>& alive) {
    if constexpr (F.rare) {
        for (StreamedPath* p : met)
            if (scatterAt<F>(p->path, p->hit, p->sampler, p->estimate)) alive.push_back(p);
    } else {
        for (std::size_t i = 0; i < met.size(); i += kLanes) {
            for (std::size_t k = i + kLanes; k < std::min(i + 2 * kLanes, met.size()); ++k)
                prefetchCorners(met[k]->path.walk.in.scene, met[k]->hit);
            scatterFour<F>(met.subspan(i, std::min(kLanes, met.size() - i)), alive);
        }
    }
}

}  // namespace vlx::render
