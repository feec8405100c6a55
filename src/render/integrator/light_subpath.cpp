#include "render/integrator/bidirectional_vertex.h"
#include "variolux/base/hash.h"

namespace vlx::render {
namespace {

using LitVertex = PathVertex<kEveryFeature, SurfacePoint>;

/// Part of the light that goes on behind a single-sided surface whose front it has met.
constexpr float kBehind = 0.0625f;

/// Whether light goes on behind a surface that cannot be seen from behind: by a number of the ray's.
bool goesBehind(std::uint32_t seed, std::uint32_t ray) {
    return unitFloat(static_cast<std::uint32_t>(hashOf(seed, ray, 0x626568u))) < kBehind;
}

bool isDelta(const Light& light) {
    return light.type == LightType::Point || light.type == LightType::Spot ||
           light.type == LightType::Directional;
}

/// What becomes of light at a vertex: the factor of its throughput. `sums` go on with it.
Rgb scatteredLight(const Scene& scene, const LitVertex& vertex, const BsdfSample& next, const Vec3& direction,
                   MisSums& sums) {
    const Side seen = vertex.from(scene, direction);
    Rgb scattered;
    double reverse = 0;
    if (next.delta) {
        scattered = next.weight;
        if (!next.coat) scattered *= seen.bsdf.beneath() / vertex.side.bsdf.beneath();
        // Light is squeezed into a smaller solid angle where importance, carried as L / n^2, is not.
        if (next.through) {
            const float ior = vertex.point.fromBehind ? 1 / vertex.surface.ior : vertex.surface.ior;
            scattered *= std::abs(vertex.side.wo.z / next.wi.z) / (ior * ior);
        }
    } else {
        const BsdfValue f = seen.evaluate(vertex.back);
        scattered = f.value / next.pdf;
        reverse = f.pdf;
    }
    sums.scatter(next, vertex.cosine(direction), reverse);
    return scattered * (vertex.cosine(direction) / vertex.cosine(vertex.back));
}

/// At the first vertex, at a distance from the light.
MisSums sumsAtFirst(const PathContext& in, const LitVertex& vertex, const Emission& start, float distance) {
    double direct = 0;
    if (vertex.side.bsdf.hasSmoothLobe()) {
        LightSampler::Local local;
        in.lights.prepare(local, receiverAt(vertex.point));
        direct = in.lights.density(local, start.light, start.triangle, vertex.back, distance, start.cosLight);
    }
    const double emitted = start.density * vertex.cosine(vertex.back);
    MisSums sums;
    sums.vcm = sums.pathVcm = mis(direct / emitted);
    sums.vc = sums.pathVc = isDelta(in.scene.lights[start.light]) ? 0 : mis(1 / emitted);
    return sums;
}

}  // namespace

std::vector<BidirectionalTracer::LightVertex> BidirectionalTracer::lightSubpath(const PathSampler& sampler,
                                                                                float time) const {
    std::vector<LightVertex> path;
    if (emitter_.empty() || context_.options.maxBounces < 1) return path;
    const Emission start =
        emitter_.sample(sampler.pair(dimension::kEmission).x, sampler.pair(dimension::kEmissionOrigin),
                        sampler.pair(dimension::kEmissionDirection), time);
    if (isBlack(start.throughput)) return path;
    const Light& light = context_.scene.lights[start.light];
    const std::uint32_t seed = sampler.hashSeed(dimension::kLightOpacity);
    std::uint32_t rays = 0;
    Walk walk{context_, start.ray, start.throughput};
    MisSums sums;
    path.reserve(6);

    for (;;) {
        const std::optional<Hit> hit = context_.accelerator.intersectBothSides(walk.ray, seed + rays++);
        if (!hit || hit->light >= 0) break;
        const SurfacePoint point = walk.arrive<kEveryFeature>(*hit);
        if (!point.material->visibleFromBehind()) {
            // Seen from behind by light, from the front by the camera's rays, and the other way round.
            if (point.fromBehind) break;
            const bool behind = goesBehind(seed, rays);
            walk.throughput *= 1 / (behind ? kBehind : 1 - kBehind);
            if (behind) {
                walk.pass(point);
                continue;
            }
        }
        const LitVertex vertex(walk, point);
        const float cosBack = vertex.cosine(vertex.back);
        if (!(cosBack > 0)) break;
        if (walk.bounces == 0) {
            const auto distance = static_cast<float>(walk.way);
            walk.throughput *= light.type == LightType::Sphere ? 1.f : light.window(distance * distance);
            if (isBlack(walk.throughput)) break;
            sums = sumsAtFirst(context_, vertex, start, distance);
        } else {
            sums.arrive(walk.way * walk.way, cosBack);
        }
        const int events = walk.bounces + 1;
        path.push_back({vertex, sums, walk.throughput / cosBack, events});
        if (events >= context_.options.maxBounces) break;

        const std::uint32_t pair =
            dimension::kFirstLightBounce + dimension::kPerLightBounce * static_cast<std::uint32_t>(events);
        const Vec2 choice = sampler.pair(pair + dimension::kChoice);
        const BsdfSample next = vertex.side.bsdf.sample(sampler.pair(pair + dimension::kDirection), choice.x);
        if (next.delta ? isBlack(next.weight) : !(next.pdf > 0)) break;
        if (isDelta(light) && events == 1 && next.delta) break;  // what no path of PathTracer's finds
        if (next.folded) break;                                  // nor this
        const Vec3 direction = normalized(vertex.side.frame.toWorld(next.wi));
        const Rgb scattered = scatteredLight(context_.scene, vertex, next, direction, sums);
        const float survival =
            std::min(1.f, maxComponent(walk.throughput * scattered) / maxComponent(walk.throughput));
        walk.throughput *= scattered;
        if (!(maxComponent(walk.throughput) > 0)) break;
        if (!walk.goOn(vertex.point, vertex.media, next.through, direction, survival, choice.y)) break;
    }
    return path;
}

}  // namespace vlx::render
