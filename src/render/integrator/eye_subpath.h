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

/// Follows a camera ray from surface to surface. Returns what is seen, without its radiance: that is for
/// `Estimator`, which is told what the walk comes by:
/// - meet(const Walk<F>&, const MetLight&): light, where the walk is;
/// - gather(const Walk<F>&, const PathVertex<F>&, const BouncePairs&, std::uint32_t seed): a vertex; `seed`
///   is of the opacity that a shadow ray meets;
/// - scatter(const PathVertex<F>&, const BsdfSample&, const Vec3& direction): how the walk goes on from it.
template <Features F, class Estimator>
PathSample eyeSubpath(const PathContext& in, const Ray& start, const PathSampler& sampler,
                      Estimator& estimator) {
    PathSample result;
    Walk<F> walk{in, start};
    bool featuresPending = true;
    bool mirrored = true;  // nothing but mirrors and clear glass so far
    const std::uint32_t seed = in.hashesOpacity ? sampler.hashSeed(dimension::kOpacity) : 0;

    for (;;) {
        // Stochastic opacity: a seed of its own for every ray of the path.
        const std::uint32_t raySeed = seed + 2 * static_cast<std::uint32_t>(walk.bounces);
        const Ray& ray = walk.ray;
        const std::optional<Hit> hit = in.accelerator.intersect(ray, raySeed);
        if (walk.bounces == 0 && in.options.motion != nullptr) result.moved = in.options.motion->of(ray, hit);
        if (!hit) {
            if (in.scene.environment) estimator.meet(walk, environmentMet(in, ray.direction));
            break;
        }
        if (walk.bounces == 0) {
            result.hit = true;
            result.depth = hit->distance;
        }
        if (hit->light >= 0) {
            walk.travel(hit->distance);
            const Vec3 outwards = ray.origin + ray.direction * hit->distance -
                                  in.scene.lights[static_cast<std::size_t>(hit->light)].position;
            estimator.meet(walk, sphereMet(in, *hit, ray, outwards));
            if (featuresPending) result.normal = normalized(outwards);
            break;
        }

        const SurfacePoint point = walk.arrive(*hit);
        const bool emits = point.material->emissive() && (mirrored || !point.material->unlit) &&
                           (!point.fromBehind || point.material->visibleFromBehind());
        Rgb shown(1);  // what shines is white among the features
        if (emits) {
            const MetLight met = surfaceMet(in, *hit, point, ray.direction);
            estimator.meet(walk, met);
            if (point.material->unlit) shown = met.radiance;
        }
        if (!featuresPending && walk.bounces >= in.options.maxBounces) break;

        const PathVertex<F> vertex(walk, point);
        const BasicBsdf<F>& bsdf = vertex.side.bsdf;
        if (featuresPending && (bsdf.hasSmoothLobe() || emits)) {
            featuresPending = false;
            result.normal = point.shadingNormal;
            result.albedo = emits ? shown : bsdf.albedo();
        }
        if (walk.bounces >= in.options.maxBounces) break;
        if (walk.bounces > 0) countEffect(Effect::Indirect);

        // The bounce's four pairs at once: two of them one by one would take longer.
        const BouncePairs pairs = sampler.bounce(walk.bounces);
        estimator.gather(walk, vertex, pairs, raySeed + 1);

        const Vec2 choice = pairs[dimension::kChoice];
        const BsdfSample next = bsdf.sample(pairs[dimension::kDirection], choice.x);
        if (isBlack(next.weight)) break;
        const Vec3 direction = normalized(vertex.side.frame.toWorld(next.wi));
        estimator.scatter(vertex, next, direction);
        mirrored = mirrored && next.delta;
        walk.throughput *= next.weight;
        const float survival = std::min(1.f, maxComponent(walk.throughput));
        if (!walk.goOn(vertex, next, direction, survival, choice.y)) break;
    }
    return result;
}

}  // namespace vlx::render
