#include "render/integrator/bidirectional.h"

#include "render/integrator/bidirectional_vertex.h"

namespace vlx::render {

BidirectionalTracer::BidirectionalTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
                                         const Window& window, const PathOptions& options,
                                         Strategies strategies)
    : Integrator(view, options.effects),
      scene_(scene),
      accelerator_(accelerator),
      window_(window),
      options_(options),
      strategies_(strategies),
      lights_(scene),
      emitter_(scene),
      absorbs_(options.effects.has(Effect::Absorption)),
      hashesOpacity_(options.effects.has(Effect::Alpha)) {
    if (!options.effects.has(Effect::Indirect)) options_.maxBounces = std::min(1, options.maxBounces);
}

float BidirectionalTracer::weight(Strategies own, double others) const {
    if (strategies_ == Strategies::All) return static_cast<float>(1 / (1 + others));
    return strategies_ == own ? 1.f : 0.f;
}

double BidirectionalTracer::directDensity(const LightSampler::Local& local, std::size_t light,
                                          std::uint32_t triangle, const Vec3& direction, float distance,
                                          float cosLight) const {
    const auto index = static_cast<std::uint32_t>(light);
    switch (scene_.lights[light].type) {
        case LightType::Mesh:
            return lights_.meshPdf(local, index, triangle, distance, cosLight);
        case LightType::Sphere:
            return lights_.spherePdf(local, index);
        case LightType::Environment:
            return lights_.environmentPdf(local, direction);
        case LightType::Directional:
            return lights_.probability(local, light);
        case LightType::Point:
        case LightType::Spot:
            return lights_.probability(local, light) * static_cast<double>(distance) * distance;
    }
    return 0;
}

BidirectionalTracer::Found BidirectionalTracer::directLight(const Vertex& eye,
                                                            const LightSampler::Local& local, float choice,
                                                            Vec2 u, float time, std::uint32_t seed) const {
    const LightSample light = lights_.sample(local, choice, u);
    if (!(light.pdf > 0) || isBlack(light.radiance)) return {};
    const BsdfValue f = eye.side.evaluate(light.direction);
    if (isBlack(f.value)) return {};
    if (accelerator_.occluded(leave(eye.side.point, light.direction, time), light.distance, seed)) return {};
    const double reverse = eye.from(scene_, light.direction).evaluate(eye.back).pdf;
    const double emitted = emitter_.density(light.light, light.triangle, -light.direction);
    const double direct = light.delta && std::isfinite(light.distance)
                              ? light.pdf * square(light.distance / kReach)
                              : light.pdf;
    const double byChance = light.delta ? 0 : mis(f.pdf / static_cast<double>(light.pdf));
    const double byLight =
        mis(emitted * eye.cosine(light.direction) / direct) * (eye.vcm + eye.vc * mis(reverse));
    const float w = weight(Strategies::DirectLight, byChance + byLight);
    return {f.value * light.radiance * eye.arriving(light.direction, light.distance) * (w / light.pdf),
            spreadOf(w, 1 + byChance)};
}

BidirectionalTracer::Found BidirectionalTracer::connection(const Vertex& eye, const Vertex& light, float time,
                                                           std::uint32_t seed) const {
    const Vec3 to = light.position() - eye.position();
    const float d2 = lengthSquared(to);
    if (!(d2 > 0)) return {};
    const float distance = std::sqrt(d2);
    const Vec3 direction = to / distance;
    const BsdfValue f = eye.side.evaluate(direction);
    if (isBlack(f.value)) return {};
    const Side seen = light.from(scene_, -direction);
    const BsdfValue g = seen.evaluate(light.back);
    if (isBlack(g.value)) return {};
    if (accelerator_.occluded(leave(eye.side.point, direction, time), distance * kReach, seed)) return {};
    const double atEye = eye.cosine(direction) / static_cast<double>(d2);
    const double atLight = light.cosine(direction) / static_cast<double>(d2);
    const double reverse = eye.from(scene_, direction).evaluate(eye.back).pdf;
    const double back = light.side.evaluate(-direction).pdf;
    const double byEye = mis(f.pdf * atLight) * (light.vcm + light.vc * mis(g.pdf));
    const double byLight = mis(back * atEye) * (eye.vcm + eye.vc * mis(reverse));
    const float w = eye.events == 1 || strategies_ == Strategies::All
                        ? weight(Strategies::Connection, byEye + byLight)
                        : 0;
    return {f.value * g.value * light.throughput * eye.arriving(direction, distance) *
                (w * static_cast<float>(atLight)),
            spreadOf(w, mis(f.pdf * atLight) * (light.pathVcm + light.pathVc * mis(g.pdf)))};
}

void BidirectionalTracer::splat(const Vertex& light, Vec2 lens, float time, std::uint32_t seed,
                                std::vector<Splat>& splats) const {
    const View::Projection seen = view().project(light.position(), lens, time);
    if (!(seen.density > 0) || !(std::abs(seen.x) < 1e9f) || !(std::abs(seen.y) < 1e9f)) return;
    if (!window_.contains(static_cast<int>(std::floor(seen.x)), static_cast<int>(std::floor(seen.y)))) return;
    const Vec3 to = seen.origin - light.position();
    const float d2 = lengthSquared(to);
    if (!(d2 > 0)) return;
    const float distance = std::sqrt(d2);
    const Vec3 direction = to / distance;
    const Side side = light.from(scene_, direction);
    const BsdfValue f = side.evaluate(light.back);
    if (isBlack(f.value)) return;
    if (accelerator_.occluded({seen.origin, -direction, time}, distance * kReach, seed)) return;
    const double area = seen.density * light.cosine(direction) / static_cast<double>(d2);
    const double byEye =
        mis(area / static_cast<double>(window_.pixels())) * (light.vcm + light.vc * mis(f.pdf));
    const float w = weight(Strategies::Splatting, byEye);
    const double byPath =
        mis(area / static_cast<double>(window_.pixels())) * (light.pathVcm + light.pathVc * mis(f.pdf));
    Rgb radiance = light.throughput * f.value * (w * static_cast<float>(area));
    const Material& material = *side.point.material;
    if (side.point.fromBehind && absorbs_ && material.absorbs())
        radiance *= transmitted(material.absorption, distance);
    if (!isBlack(radiance)) splats.push_back({seen.x, seen.y, radiance, spreadOf(w, byPath)});
}

PathSample BidirectionalTracer::traceRay(const Ray& start, Vec2 lens, const PathSampler& sampler,
                                         std::vector<Splat>& splats, Rgb* pathSquares) const {
    const float time = start.time;
    const std::vector<Vertex> light = lightSubpath(sampler, time);
    const std::uint32_t seed = hashesOpacity_ ? sampler.hashSeed(dimension::kOpacity) : 0;
    std::uint32_t rays = 0x40000000u;  // of connections; each has its own opacity
    if (!light.empty()) {
        const Vec2 u = view().hasLens() ? sampler.pair(dimension::kLightLens) : Vec2{};
        for (const Vertex& v : light)
            if (v.side.bsdf.hasSmoothLobe()) splat(v, u, time, seed + rays++, splats);
    }

    PathSample result;
    Ray ray = start;
    Rgb throughput{1, 1, 1};
    const float density = view().project(ray.origin + ray.direction, lens, time).density;
    double vcm = mis(static_cast<double>(window_.pixels()) / density), vc = 0;
    bool lightsSampled = false;  // at the vertex before
    LightSampler::Local local;   // estimates there
    bool featuresPending = true;
    const Material* medium = nullptr;

    const auto add = [&](const Found& found) {
        const Rgb v = throughput * found.radiance;
        result.radiance += v;
        if (pathSquares != nullptr) *pathSquares += v * v * found.spread;
    };

    for (int bounce = 0;; ++bounce) {
        // Of light that is met by chance, its density for next-event estimation and for light subpaths known.
        const auto byChance = [&](const Rgb& radiance, double direct, double emitted) -> Found {
            if (bounce == 0) return {radiance, 1};
            const double byDirect = mis(direct) * vcm;
            const float w = weight(Strategies::Chance, byDirect + mis(emitted) * vc);
            return {radiance * w, spreadOf(w, 1 + byDirect)};
        };
        const auto foundOf = [&](const Rgb& radiance, std::size_t index, std::uint32_t triangle,
                                 float distance, float cosLight) {
            const double direct =
                lightsSampled ? directDensity(local, index, triangle, ray.direction, distance, cosLight) : 0;
            return byChance(radiance, direct, emitter_.density(index, triangle, ray.direction * -1.f));
        };
        const std::uint32_t raySeed = seed + 2 * static_cast<std::uint32_t>(bounce);
        const std::optional<Hit> hit = accelerator_.intersect(ray, raySeed);
        if (!hit) {
            if (scene_.environment) {
                countEffect(Effect::Environment);
                const std::optional<std::size_t> index = lights_.environment();
                const Rgb radiance = scene_.environment.radiance(ray.direction);
                add(index ? foundOf(radiance, *index, 0, 0, 1) : Found{radiance, 1});
            }
            break;
        }
        if (bounce == 0) {
            result.hit = true;
            result.depth = hit->distance;
        }
        if (hit->light >= 0) {
            countEffect(Effect::SphereLights);
            const auto index = static_cast<std::size_t>(hit->light);
            const Light& sphere = scene_.lights[index];
            const Vec3 outwards = ray.origin + ray.direction * hit->distance - sphere.position;
            // From within, no other strategy finds it.
            if (medium != nullptr) throughput *= transmitted(medium->absorption, hit->distance);
            const Rgb radiance = sphere.sphereRadiance(-ray.direction);
            add(dot(outwards, ray.direction) < 0 ? foundOf(radiance, index, 0, hit->distance, 1)
                                                 : byChance(radiance, 0, 0));
            if (featuresPending) result.normal = normalized(outwards);
            break;
        }

        const SurfacePoint point = surfacePoint<kEveryFeature>(scene_, *hit, ray.direction, time);
        const Material& material = *point.material;
        if (medium == nullptr && point.fromBehind && absorbs_ && material.absorbs()) medium = &material;
        if (medium != nullptr) throughput *= transmitted(medium->absorption, hit->distance);
        const bool emits = material.emissive() && (!point.fromBehind || material.visibleFromBehind());
        if (emits) {
            const float cosLight = std::abs(dot(point.geometricNormal, ray.direction));
            const Rgb emitted =
                emittedRadiance(scene_, *point.shape, point.triangle, hit->u, hit->v, cosLight);
            add(point.shape->light >= 0 ? foundOf(emitted, static_cast<std::size_t>(point.shape->light),
                                                  hit->triangle, hit->distance, cosLight)
                                        : byChance(emitted, 0, 0));
        }
        if (!featuresPending && bounce >= options_.maxBounces) break;

        SurfaceParameters surface = parametersAt<kEveryFeature>(scene_, point);
        surface.leftOut = options_.leftOut;
        Vertex eye{Side(scene_, point, surface, -ray.direction), surface, -ray.direction, throughput};
        const Bsdf& bsdf = eye.side.bsdf;
        if (featuresPending && (bsdf.hasSmoothLobe() || emits)) {
            featuresPending = false;
            result.normal = point.shadingNormal;
            if (!emits) result.albedo = bsdf.albedo();
        }
        if (bounce >= options_.maxBounces) break;
        if (bounce > 0) countEffect(Effect::Indirect);
        eye.events = bounce + 1;
        eye.medium = medium;
        if (absorbs_ && material.absorbs() && !point.fromBehind) eye.beyond = &material;
        eye.vcm = vcm;
        eye.vc = vc;
        eye.arriveAt(static_cast<double>(hit->distance) * hit->distance);

        const auto pairs = sampler.bounce(bounce);
        lightsSampled = bsdf.hasSmoothLobe() && !lights_.empty();
        if (lightsSampled) {
            lights_.prepare(local, receiverAt(point));
            add(directLight(eye, local, pairs[dimension::kLightChoice].x, pairs[dimension::kLight], time,
                            raySeed + 1));
            for (const Vertex& v : light) {
                if (eye.events + v.events > options_.maxBounces) break;
                if (v.side.bsdf.hasSmoothLobe()) add(connection(eye, v, time, seed + rays++));
            }
        }

        const Vec2 choice = pairs[dimension::kChoice];
        const BsdfSample next = bsdf.sample(pairs[dimension::kDirection], choice.x);
        if (isBlack(next.weight)) break;
        const Vec3 direction = normalized(eye.side.frame.toWorld(next.wi));
        if (next.delta) {
            vcm = 0;
            vc = next.folded ? 0 : eye.vc * mis(eye.cosine(direction));  // light subpaths do not fold
        } else {
            const double reverse = eye.from(scene_, direction).evaluate(eye.back).pdf;
            vc = mis(eye.cosine(direction) / static_cast<double>(next.pdf)) *
                 (eye.vc * mis(reverse) + eye.vcm);
            vcm = mis(1 / static_cast<double>(next.pdf));
        }
        throughput *= next.weight;
        lightsSampled = lightsSampled && !next.delta;
        if (next.through) medium = eye.beyond;
        if (bounce >= kSureBounces) {
            const float survival = std::min(1.f, maxComponent(throughput));
            if (choice.y >= survival) break;
            throughput *= 1 / survival;
        }
        ray = leave(point, direction, time);
    }
    return result;
}

}  // namespace vlx::render
