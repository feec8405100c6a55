#pragma once

#include "render/integrator/walk.h"

namespace vlx::render {

/// Light that an eye subpath has met by chance.
struct MetLight {
    Rgb radiance;             ///< towards where the ray comes from
    std::int32_t light = -1;  ///< of the scene; -1: nothing that is sampled as a light
    std::uint32_t triangle = 0;
    float distance = 0;
    float cosLight = 1;
    bool fromWithin = false;  ///< a sphere, which shines outwards
};

inline MetLight environmentMet(const PathContext& in, const Vec3& direction) {
    countEffect(Effect::Environment);
    return {in.scene.environment.radiance(direction), in.lights.environment()};
}

inline MetLight sphereMet(const PathContext& in, const Hit& hit, const Ray& ray, const Vec3& outwards) {
    countEffect(Effect::SphereLights);
    const Light& sphere = in.scene.lights[static_cast<std::size_t>(hit.light)];
    return {sphere.sphereRadiance(-ray.direction), hit.light, 0, hit.distance, 1,
            dot(outwards, ray.direction) >= 0};
}

inline MetLight surfaceMet(const PathContext& in, const Hit& hit, const SurfacePoint& point,
                           const Vec3& direction) {
    const float cosLight = std::abs(dot(point.geometricNormal, direction));
    // Moving emitters are no lights: they are met by chance only.
    return {emittedRadiance(in.scene, *point.shape, point.triangle, hit.u, hit.v, cosLight),
            point.shape->light, hit.triangle, hit.distance, cosLight};
}

/// A bounce's random numbers: by dimension::kDirection to kLightChoice.
using BouncePairs = std::array<Vec2, dimension::kPerBounce>;

/// A camera ray's path on its way, and what is seen so far, without its radiance.
struct EyePath {
    Walk walk;
    std::uint32_t seed = 0;  ///< of opacity; every ray of the path has one of its own
    PathSample seen;
    bool featuresPending = true;
    bool mirrored = true;  ///< nothing but mirrors and clear glass so far

    std::uint32_t raySeed() const { return seed + 2 * static_cast<std::uint32_t>(walk.bounces); }
};

/// Goes to the surface that the path has met and gathers what shines there; `shown` is what an unlit one
/// shows. Returns whether there is more to the surface.
template <class Estimator>
bool meetSurface(EyePath& path, const Hit& hit, const SurfacePoint& point, Estimator& estimator, bool& emits,
                 Rgb& shown) {
    const PathContext& in = path.walk.in;
    emits = point.material->emissive() && (path.mirrored || !point.material->unlit) &&
            (!point.fromBehind || point.material->visibleFromBehind());
    if (emits) {
        const MetLight met = surfaceMet(in, hit, point, path.walk.ray.direction);
        estimator.meet(path.walk, met);
        shown = point.material->unlit ? met.radiance : Rgb(1);  // what shines is white among the features
    }
    return path.featuresPending || path.walk.bounces < in.options.maxBounces;
}

/// Notes the features of the first surface that is not perfectly smooth.
inline void showFeatures(EyePath& path, const SurfacePoint& point, bool smoothLobe, bool emits,
                         const Rgb& albedo) {
    if (!path.featuresPending || !(smoothLobe || emits)) return;
    path.featuresPending = false;
    path.seen.normal = point.shadingNormal;
    path.seen.albedo = albedo;
}

/// How a path goes on from a surface, once its estimator knows; see Walk::goOn.
inline bool scattered(EyePath& path, const SurfacePoint& point, const Media& media, const BsdfSample& next,
                      const Vec3& direction, float u) {
    path.mirrored = path.mirrored && next.delta;
    path.walk.throughput *= next.weight;
    const float survival = std::min(1.f, maxComponent(path.walk.throughput));
    return path.walk.goOn(point, media, next.through, direction, survival, u);
}

/// What happens where the path has met a surface that calls for the features `F` at most. Returns whether it
/// goes on. `Estimator` gathers the radiance; it is told what the walk comes by:
/// - meet(const Walk&, const MetLight&): light, where the walk is;
/// - gather<F>(const Walk&, const PathVertex<F>&, const BouncePairs&, std::uint32_t seed): a vertex; `seed`
///   is of the opacity that a shadow ray meets;
/// - scatter(const PathVertex<F>&, const BsdfSample&, const Vec3& direction): how the walk goes on from it.
template <Features F, class Estimator>
bool scatterAt(EyePath& path, const Hit& hit, const PathSampler& sampler, Estimator& estimator) {
    Walk& walk = path.walk;
    const PathContext& in = walk.in;
    const SurfacePoint point = walk.arrive<F>(hit);
    bool emits = false;
    Rgb shown;
    if (!meetSurface(path, hit, point, estimator, emits, shown)) return false;

    const PathVertex<F> vertex(walk, point);
    const BasicBsdf<F>& bsdf = vertex.side.bsdf;
    showFeatures(path, point, bsdf.hasSmoothLobe(), emits, emits ? shown : bsdf.albedo());
    if (walk.bounces >= in.options.maxBounces) return false;
    if (walk.bounces > 0) countEffect(Effect::Indirect);

    // The bounce's four pairs at once: two of them one by one would take longer.
    const BouncePairs pairs = sampler.bounce(walk.bounces);
    estimator.template gather<F>(walk, vertex, pairs, path.raySeed() + 1);

    const Vec2 choice = pairs[dimension::kChoice];
    const BsdfSample next = bsdf.sample(pairs[dimension::kDirection], choice.x);
    if (isBlack(next.weight)) return false;
    const Vec3 direction = normalized(vertex.side.frame.toWorld(next.wi));
    estimator.scatter(vertex, next, direction);
    return scattered(path, point, vertex.media, next, direction, choice.y);
}

/// Follows the path's ray to the next surface; nothing where it ends before, at a light or in the distance.
template <class Estimator>
std::optional<Hit> meetNext(EyePath& path, Estimator& estimator) {
    Walk& walk = path.walk;
    const PathContext& in = walk.in;
    const Ray& ray = walk.ray;
    const std::optional<Hit> hit = in.accelerator.intersect(ray, path.raySeed());
    if (walk.bounces == 0) {
        if (in.options.motion != nullptr) path.seen.moved = in.options.motion->of(ray, hit);
        path.seen.hit = hit.has_value();
        path.seen.depth = hit ? hit->distance : 0;
    }
    if (!hit) {
        if (in.scene.environment) estimator.meet(walk, environmentMet(in, ray.direction));
        return {};
    }
    if (hit->light < 0) return hit;
    walk.travel(hit->distance);
    const Vec3 outwards = ray.origin + ray.direction * hit->distance -
                          in.scene.lights[static_cast<std::size_t>(hit->light)].position;
    estimator.meet(walk, sphereMet(in, *hit, ray, outwards));
    if (path.featuresPending) path.seen.normal = normalized(outwards);
    return {};
}

inline EyePath startOf(const PathContext& in, const Ray& ray, const PathSampler& sampler) {
    return {{in, ray}, in.hashesOpacity ? sampler.hashSeed(dimension::kOpacity) : 0, {}};
}

/// Follows a camera ray from surface to surface: at each, scatter(EyePath&, const Hit&) is scatterAt with the
/// features that the surface calls for. Returns what is seen, without its radiance.
template <class Estimator, class Scatter>
PathSample eyeSubpath(const PathContext& in, const Ray& start, const PathSampler& sampler,
                      Estimator& estimator, const Scatter& scatter) {
    EyePath path = startOf(in, start, sampler);
    while (const std::optional<Hit> hit = meetNext(path, estimator))
        if (!scatter(path, *hit)) break;
    return path.seen;
}

}  // namespace vlx::render
