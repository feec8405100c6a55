#pragma once

#include "render/integrator/path_tracer.h"
#include "render/surface/bsdf.h"
#include "render/surface/surface.h"

/// The path tracer's loop, compiled for what a scene calls for; see kernels_*.cpp for the instances.
namespace vlx::render {

/// Bounces before roulette may end a path.
inline constexpr int kSureBounces = 2;

inline float powerHeuristic(float own, float other) {
    // Divided first: squares of densities of near-delta lobes overflow.
    const float ratio = other / own;
    return 1 / (1 + ratio * ratio);
}

/// A ray that leaves a surface, its origin moved off the surface by more than rounding can err.
inline Ray leave(const SurfacePoint& point, const Vec3& direction, float time) {
    const float scale = 4e-6f * maxComponent(absolute(point.position)) + 1e-9f;
    const float side = dot(direction, point.geometricNormal) >= 0 ? scale : -scale;
    return {point.position + point.geometricNormal * side, direction, time};
}

/// Part of light that is left after a distance in a medium.
inline Rgb transmitted(const Rgb& absorption, float distance) {
    countEffect(Effect::Absorption);
    const auto kept = [&](float a) { return a > 0 ? std::exp(-a * distance) : 1.f; };
    return {kept(absorption.x), kept(absorption.y), kept(absorption.z)};
}

/// One light's contribution at a point, MIS-weighted.
template <Features F>
Rgb PathTracer::directLight(const SurfacePoint& point, const Frame& frame, const BasicBsdf<F>& bsdf,
                            const LightSampler::Local& local, float choice, Vec2 u,
                            const RayState& state) const {
    const LightSample light = lights_.sample(local, choice, u);
    if (!(light.pdf > 0) || isBlack(light.radiance)) return {};
    const Vec3 wi = frame.toLocal(light.direction);
    const BsdfValue f = bsdf.evaluate(wi);
    if (isBlack(f.value)) return {};
    if (accelerator_.occluded(leave(point, light.direction, state.time), light.distance, state.seed))
        return {};
    const bool alone = light.delta || options_.strategy == Strategy::LightsOnly;
    const float weight = alone ? 1 : powerHeuristic(light.pdf, f.pdf);
    Rgb radiance = light.radiance;
    if constexpr (F.rare) {
        const Material* medium =
            dot(point.geometricNormal, light.direction) < 0 ? state.beyond : state.medium;
        if (medium != nullptr) radiance *= transmitted(medium->absorption, light.distance);
    }
    return f.value * radiance * (weight / light.pdf);
}

template <Features F>
PathSample PathTracer::traceWith(Ray ray, const PathSampler& sampler) const {
    PathSample result;
    Rgb throughput{1, 1, 1};
    bool lightsSampled =
        false;          // at the previous vertex, so that what a ray meets by chance shares its weight
    float bsdfPdf = 0;  // of the ray
    LightSampler::Local local;  // estimates at the previous vertex
    bool featuresPending = true;
    const std::uint32_t seed = hashesOpacity_ ? sampler.hashSeed(dimension::kOpacity) : 0;
    const Material* medium = nullptr;  // that the ray travels in, where it absorbs
    bool scattered = false;            // by a surface that is not smooth
    bool caustic = false;              // then by smooth ones only

    // Weight of light that the BSDF's sampling found, the lights' sampling having `lightPdf` for it.
    const auto chanceWeight = [&](auto lightPdf) {
        if (F.rare && caustic) return 0.f;
        if (!lightsSampled || options_.strategy == Strategy::BsdfOnly) return 1.f;
        if (options_.strategy == Strategy::LightsOnly) return 0.f;
        return powerHeuristic(bsdfPdf, lightPdf());
    };

    for (int bounce = 0;; ++bounce) {
        // Stochastic opacity: a seed of its own for every ray of the path.
        const std::uint32_t raySeed = seed + 2 * static_cast<std::uint32_t>(bounce);
        const std::optional<Hit> hit = accelerator_.intersect(ray, raySeed);
        if (!hit) {
            if (scene_.environment) {
                countEffect(Effect::Environment);
                const float w = chanceWeight([&] { return lights_.environmentPdf(local, ray.direction); });
                result.radiance += throughput * scene_.environment.radiance(ray.direction) * w;
            }
            break;
        }
        if (bounce == 0) {
            result.hit = true;
            result.depth = hit->distance;
        }
        if (hit->light >= 0) {
            countEffect(Effect::SphereLights);
            const auto index = static_cast<std::uint32_t>(hit->light);
            const Light& light = scene_.lights[index];
            const float w = chanceWeight([&] { return lights_.spherePdf(local, index); });
            if constexpr (F.rare)
                if (medium != nullptr) throughput *= transmitted(medium->absorption, hit->distance);
            result.radiance += throughput * light.sphereRadiance(-ray.direction) * w;
            if (featuresPending)
                result.normal = normalized(ray.origin + ray.direction * hit->distance - light.position);
            break;
        }

        const SurfacePoint point = surfacePoint<F>(scene_, *hit, ray.direction, ray.time);
        const Material& material = *point.material;
        if constexpr (F.rare) {
            // A ray that starts inside learns so when it meets the solid's surface from behind.
            if (medium == nullptr && point.fromBehind && absorbs_ && material.absorbs()) medium = &material;
            if (medium != nullptr) throughput *= transmitted(medium->absorption, hit->distance);
        }
        const bool emits = material.emissive() && (!point.fromBehind || material.visibleFromBehind());
        if (emits) {
            const float cosLight = std::abs(dot(point.geometricNormal, ray.direction));
            const Rgb emitted =
                emittedRadiance(scene_, *point.shape, point.triangle, hit->u, hit->v, cosLight);
            const float w = chanceWeight([&] {
                // Moving emitters are no lights: they are met by chance only.
                return point.shape->light < 0
                           ? 0.f
                           : lights_.meshPdf(local, static_cast<std::uint32_t>(point.shape->light),
                                             hit->triangle, hit->distance, cosLight);
            });
            result.radiance += throughput * emitted * w;
        }
        if (!featuresPending && bounce >= options_.maxBounces) break;

        SurfaceParameters surface = parametersAt<F>(scene_, point);
        if constexpr (F.rare) surface.leftOut = options_.leftOut;
        const Frame frame(point.shadingNormal);
        const Vec3 wo = frame.toLocal(-ray.direction);
        const BasicBsdf<F> bsdf(surface, {wo.x, wo.y, std::max(wo.z, 1e-4f)}, point.fromBehind,
                                scene_.albedoTables[0], frame.toLocal(point.geometricNormal));
        if (featuresPending && (bsdf.hasSmoothLobe() || emits)) {
            featuresPending = false;
            result.normal = point.shadingNormal;
            if (!emits) result.albedo = bsdf.albedo();
        }
        if (bounce >= options_.maxBounces) break;
        if (bounce > 0) countEffect(Effect::Indirect);

        RayState state{raySeed + 1, ray.time, medium, nullptr};
        if constexpr (F.rare)
            if (absorbs_ && material.absorbs() && !point.fromBehind) state.beyond = &material;
        lightsSampled = bsdf.hasSmoothLobe() && !lights_.empty() && options_.strategy != Strategy::BsdfOnly;
        // The bounce's four pairs at once: two of them one by one would take longer.
        const auto pairs = sampler.bounce(bounce);
        if (lightsSampled) {
            lights_.prepare(local, {point.position, point.shadingNormal, F.glass && material.transmissive()});
            const float choice = choosesLights_ ? pairs[dimension::kLightChoice].x : 0;
            result.radiance += throughput * directLight<F>(point, frame, bsdf, local, choice,
                                                           pairs[dimension::kLight], state);
        }

        const Vec2 choice = pairs[dimension::kChoice];
        const BsdfSample next = bsdf.sample(pairs[dimension::kDirection], choice.x);
        if (isBlack(next.weight)) break;
        const Vec3 direction = normalized(frame.toWorld(next.wi));
        throughput *= next.weight;
        bsdfPdf = next.pdf;
        lightsSampled = lightsSampled && !next.delta;
        if constexpr (F.rare) {
            if (next.through) medium = state.beyond;
            scattered = scattered || !next.delta;
            caustic = dropsCaustics_ && scattered && next.delta;
        }
        if (bounce >= kSureBounces) {
            const float survival = std::min(1.f, maxComponent(throughput));
            if (choice.y >= survival) break;
            throughput *= 1 / survival;
        }
        ray = leave(point, direction, ray.time);
    }
    return result;
}

// Compiled in kernels_*.cpp.
extern template PathSample PathTracer::traceWith<kMatte>(Ray, const PathSampler&) const;
extern template PathSample PathTracer::traceWith<kMatteTextured>(Ray, const PathSampler&) const;
extern template PathSample PathTracer::traceWith<kReflecting>(Ray, const PathSampler&) const;
extern template PathSample PathTracer::traceWith<kReflectingTextured>(Ray, const PathSampler&) const;
extern template PathSample PathTracer::traceWith<kLayered>(Ray, const PathSampler&) const;
extern template PathSample PathTracer::traceWith<kLayeredTextured>(Ray, const PathSampler&) const;
extern template PathSample PathTracer::traceWith<kEveryFeature>(Ray, const PathSampler&) const;

}  // namespace vlx::render
