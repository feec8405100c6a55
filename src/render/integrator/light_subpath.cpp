#include "render/integrator/bidirectional_vertex.h"
#include "variolux/base/hash.h"

namespace vlx::render {
namespace {

/// Part of the light that goes on behind a single-sided surface whose front it has met.
constexpr float kBehind = 0.0625f;

}  // namespace

std::vector<BidirectionalTracer::Vertex> BidirectionalTracer::lightSubpath(const PathSampler& sampler,
                                                                           float time) const {
    std::vector<Vertex> path;
    if (emitter_.empty() || options_.maxBounces < 1) return path;
    const Emission start =
        emitter_.sample(sampler.pair(dimension::kEmission).x, sampler.pair(dimension::kEmissionOrigin),
                        sampler.pair(dimension::kEmissionDirection), time);
    if (isBlack(start.throughput)) return path;
    const Light& light = scene_.lights[start.light];
    const bool delta = light.type == LightType::Point || light.type == LightType::Spot ||
                       light.type == LightType::Directional;
    const std::uint32_t seed = sampler.hashSeed(dimension::kLightOpacity);
    std::uint32_t rays = 0;
    Ray ray = start.ray;
    Rgb throughput = start.throughput;
    double vcm = 0, vc = 0, pathVc = 0, way = 0;
    const Material* medium = nullptr;
    path.reserve(6);

    for (int events = 1;;) {
        const std::optional<Hit> hit = accelerator_.intersectBothSides(ray, seed + rays++);
        if (!hit || hit->light >= 0) break;
        const SurfacePoint point = surfacePoint<kEveryFeature>(scene_, *hit, ray.direction, time);
        const Material& material = *point.material;
        way += hit->distance;
        if (medium == nullptr && point.fromBehind && absorbs_ && material.absorbs()) medium = &material;
        if (medium != nullptr) throughput *= transmitted(medium->absorption, hit->distance);
        if (!material.visibleFromBehind()) {
            // Seen from behind by light, from the front by the camera's rays, and the other way round.
            if (point.fromBehind) break;
            const bool behind =
                unitFloat(static_cast<std::uint32_t>(hashOf(seed, rays, 0x626568u))) < kBehind;
            throughput *= 1 / (behind ? kBehind : 1 - kBehind);
            if (behind) {
                ray = leave(point, ray.direction, time);
                continue;
            }
        }
        SurfaceParameters surface = parametersAt<kEveryFeature>(scene_, point);
        surface.leftOut = options_.leftOut;
        Vertex vertex{Side(scene_, point, surface, -ray.direction), surface, -ray.direction, throughput};
        vertex.events = events;
        vertex.medium = medium;
        if (absorbs_ && material.absorbs() && !point.fromBehind) vertex.beyond = &material;
        const float cosBack = vertex.cosine(vertex.back);
        if (!(cosBack > 0)) break;
        if (events == 1) {
            const auto distance = static_cast<float>(way);
            throughput *= light.type == LightType::Sphere ? 1.f : light.window(distance * distance);
            if (isBlack(throughput)) break;
            LightSampler::Local local;
            double direct = 0;
            if (vertex.side.bsdf.hasSmoothLobe()) {
                lights_.prepare(local, receiverAt(point));
                direct =
                    directDensity(local, start.light, start.triangle, vertex.back, distance, start.cosLight);
            }
            vertex.vcm = mis(direct / (start.density * cosBack));
            vertex.vc = delta ? 0 : mis(1 / (start.density * cosBack));
            vertex.pathVcm = vertex.vcm;
            vertex.pathVc = vertex.vc;
        } else {
            vertex.vcm = vcm;
            vertex.vc = vc;
            vertex.pathVc = pathVc;
            vertex.arriveAt(way * way);
        }
        vertex.throughput = throughput / cosBack;
        path.push_back(vertex);
        if (events >= options_.maxBounces) break;

        const Vec2 choice = sampler.pair(dimension::kFirstLightBounce +
                                         dimension::kPerLightBounce * static_cast<std::uint32_t>(events) +
                                         dimension::kChoice);
        const Vec2 u = sampler.pair(dimension::kFirstLightBounce +
                                    dimension::kPerLightBounce * static_cast<std::uint32_t>(events) +
                                    dimension::kDirection);
        const BsdfSample next = vertex.side.bsdf.sample(u, choice.x);
        if (next.delta ? isBlack(next.weight) : !(next.pdf > 0)) break;
        if (delta && events == 1 && next.delta) break;  // what no path of PathTracer's finds
        if (next.folded) break;                         // nor this
        const Vec3 direction = normalized(vertex.side.frame.toWorld(next.wi));
        const Side seen = vertex.from(scene_, direction);
        Rgb scattered;
        if (next.delta) {
            scattered = next.weight;
            if (!next.coat) scattered *= seen.bsdf.beneath() / vertex.side.bsdf.beneath();
            // Light is squeezed into a smaller solid angle where importance, carried as L / n^2, is not.
            if (next.through) {
                const float ior = point.fromBehind ? 1 / surface.ior : surface.ior;
                scattered *= std::abs(vertex.side.wo.z / next.wi.z) / (ior * ior);
            }
            vcm = 0;
            vc = vertex.vc * mis(vertex.cosine(direction));
            pathVc = vertex.pathVc * mis(vertex.cosine(direction));
        } else {
            const BsdfValue f = seen.evaluate(vertex.back);
            scattered = f.value / next.pdf;
            const double turned = mis(vertex.cosine(direction) / static_cast<double>(next.pdf));
            vc = turned * (vertex.vc * mis(f.pdf) + vertex.vcm);
            pathVc = turned * (vertex.pathVc * mis(f.pdf) + vertex.pathVcm);
            vcm = mis(1 / static_cast<double>(next.pdf));
        }
        scattered *= vertex.cosine(direction) / cosBack;
        const float survival = std::min(1.f, maxComponent(throughput * scattered) / maxComponent(throughput));
        throughput *= scattered;
        if (!(maxComponent(throughput) > 0)) break;
        if (events > kSureBounces) {
            if (choice.y >= survival) break;
            throughput *= 1 / survival;
        }
        if (next.through) medium = vertex.beyond;
        ray = leave(point, direction, time);
        way = 0;
        ++events;
    }
    return path;
}

}  // namespace vlx::render
