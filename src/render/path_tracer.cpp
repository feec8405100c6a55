#include "path_tracer.h"

namespace vlx::render {
namespace {

/// Bounces before roulette may end a path.
constexpr int kSureBounces = 2;

float powerHeuristic(float own, float other) {
    // Divided first: squares of densities of near-delta lobes overflow.
    const float ratio = other / own;
    return 1 / (1 + ratio * ratio);
}

/// A ray that leaves a surface, its origin moved off the surface by more than rounding can err.
Ray leave(const SurfacePoint& point, const Vec3& direction) {
    const float scale = 4e-6f * maxComponent(absolute(point.position)) + 1e-9f;
    const float side = dot(direction, point.geometricNormal) >= 0 ? scale : -scale;
    return {point.position + point.geometricNormal * side, direction};
}

/// Whether a direction is on the same side of the true and of the shading surface: light that only one of
/// them lets through an opaque surface is a leak. Through glass it goes on, on the side where it truly is.
bool consistent(const SurfacePoint& point, const Vec3& direction, float localZ) {
    return point.material->transmissive() || dot(point.geometricNormal, direction) * localZ > 0;
}

}  // namespace

PathTracer::PathTracer(const Scene& scene, const Accelerator& accelerator, const PathOptions& options)
    : scene_(scene), accelerator_(accelerator), options_(options), lights_(scene) {}

/// One light's contribution at a point, MIS-weighted.
Rgb PathTracer::directLight(const SurfacePoint& point, const Frame& frame, const Bsdf& bsdf,
                            const Receiver& receiver, float choice, Vec2 u, std::uint32_t seed) const {
    const LightSample light = lights_.sample(receiver, choice, u);
    if (!(light.pdf > 0) || isBlack(light.radiance)) return {};
    const Vec3 wi = frame.toLocal(light.direction);
    if (!consistent(point, light.direction, wi.z)) return {};
    const BsdfValue f = bsdf.evaluate(wi);
    if (isBlack(f.value)) return {};
    if (accelerator_.occluded(leave(point, light.direction), light.distance, seed)) return {};
    const bool alone = light.delta || options_.strategy == Strategy::LightsOnly;
    const float weight = alone ? 1 : powerHeuristic(light.pdf, f.pdf);
    return f.value * light.radiance * (weight / light.pdf);
}

PathSample PathTracer::trace(Ray ray, const PathSampler& sampler) const {
    PathSample result;
    Rgb throughput{1, 1, 1};
    bool lightsSampled =
        false;          // at the previous vertex, so that what a ray meets by chance shares its weight
    float bsdfPdf = 0;  // of the ray
    Receiver receiver;  // the previous vertex
    bool featuresPending = true;
    const std::uint32_t seed = sampler.hashSeed(dimension::kOpacity);

    // Weight of light that the BSDF's sampling found, the lights' sampling having `lightPdf` for it.
    const auto chanceWeight = [&](auto lightPdf) {
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
                const float w = chanceWeight([&] { return lights_.environmentPdf(receiver, ray.direction); });
                result.radiance += throughput * scene_.environment.radiance(ray.direction) * w;
            }
            break;
        }
        if (bounce == 0) {
            result.hit = true;
            result.depth = hit->distance;
        }
        if (hit->light >= 0) {
            const auto index = static_cast<std::uint32_t>(hit->light);
            const Light& light = scene_.lights[index];
            const float w = chanceWeight([&] { return lights_.spherePdf(receiver, index); });
            result.radiance += throughput * light.sphereRadiance(-ray.direction) * w;
            if (featuresPending)
                result.normal = normalized(ray.origin + ray.direction * hit->distance - light.position);
            break;
        }

        const SurfacePoint point = surfaceAt(scene_, *hit, ray.direction);
        const Material& material = *point.material;
        const bool emits = material.emissive() && (!point.fromBehind || material.visibleFromBehind());
        if (emits) {
            const float cosLight = std::abs(dot(point.geometricNormal, ray.direction));
            const Rgb emitted =
                emittedRadiance(scene_, *point.shape, point.triangle, hit->u, hit->v, cosLight);
            const float w = chanceWeight([&] {
                return lights_.meshPdf(receiver, static_cast<std::uint32_t>(point.shape->light),
                                       hit->triangle, hit->distance, cosLight);
            });
            result.radiance += throughput * emitted * w;
        }

        const SurfaceParameters surface = surfaceParameters(scene_, point);
        const Frame frame(point.shadingNormal);
        const Vec3 wo = frame.toLocal(-ray.direction);
        const Bsdf bsdf(surface, {wo.x, wo.y, std::max(wo.z, 1e-4f)}, point.fromBehind,
                        scene_.albedoTables[0]);
        if (featuresPending && (bsdf.hasSmoothLobe() || emits)) {
            featuresPending = false;
            result.normal = point.shadingNormal;
            if (!emits) result.albedo = bsdf.albedo();
        }
        if (bounce >= options_.maxBounces) break;

        receiver = {point.position, point.shadingNormal, material.transmissive()};
        lightsSampled = bsdf.hasSmoothLobe() && !lights_.empty() && options_.strategy != Strategy::BsdfOnly;
        if (lightsSampled) {
            const Vec2 u = sampler.pair(dimension::atBounce(bounce, dimension::kLight));
            const float choice = sampler.pair(dimension::atBounce(bounce, dimension::kLightChoice)).x;
            result.radiance += throughput * directLight(point, frame, bsdf, receiver, choice, u, raySeed + 1);
        }

        const Vec2 choice = sampler.pair(dimension::atBounce(bounce, dimension::kChoice));
        const BsdfSample next =
            bsdf.sample(sampler.pair(dimension::atBounce(bounce, dimension::kDirection)), choice.x);
        if (isBlack(next.weight)) break;
        const Vec3 direction = normalized(frame.toWorld(next.wi));
        if (!consistent(point, direction, next.wi.z)) break;
        throughput *= next.weight;
        bsdfPdf = next.pdf;
        lightsSampled = lightsSampled && !next.delta;
        if (bounce >= kSureBounces) {
            const float survival = std::min(1.f, maxComponent(throughput));
            if (choice.y >= survival) break;
            throughput *= 1 / survival;
        }
        ray = leave(point, direction);
    }
    return result;
}

}  // namespace vlx::render
