#include "render/integrator/bidirectional.h"

#include "render/integrator/bidirectional_vertex.h"
#include "render/integrator/eye_subpath.h"

namespace vlx::render {
namespace {

using EyeVertex = PathVertex<kEveryFeature>;

/// Weighed radiance of a path, and as Splat::spread.
struct Found {
    Rgb radiance;
    float spread = 0;
};

/// Density of a strategy over its weight and PathTracer's density, whose squares (over its own) add up to
/// `byPath`.
float spreadOf(float weight, double byPath) {
    return weight > 0 && byPath > 0 ? static_cast<float>(1 / (weight * std::sqrt(byPath))) : 0;
}

}  // namespace

BidirectionalTracer::BidirectionalTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
                                         const Window& window, const PathOptions& options,
                                         Strategies strategies)
    : Integrator(view, options.effects),
      context_(scene, accelerator, options, true),
      window_(window),
      strategies_(strategies),
      emitter_(scene) {}

float BidirectionalTracer::weight(Strategies own, double others) const {
    if (strategies_ == Strategies::All) return static_cast<float>(1 / (1 + others));
    return strategies_ == own ? 1.f : 0.f;
}

/// Of an eye subpath: all strategies but splatting.
class BidirectionalTracer::EyeEstimate {
  public:
    /// `vcm`: of the camera ray. `raySeed`: of the opacity that the first connection meets.
    EyeEstimate(const BidirectionalTracer& tracer, const std::vector<LightVertex>& light, double vcm,
                std::uint32_t raySeed, Rgb* pathSquares)
        : tracer_(tracer),
          in_(tracer.context_),
          light_(light),
          raySeed_(raySeed),
          pathSquares_(pathSquares),
          sums_{vcm} {}

    const Rgb& radiance() const { return radiance_; }

    void meet(const Walk& walk, const MetLight& met) {
        if (walk.bounces == 0) {
            add(walk, {met.radiance, 1});
            return;
        }
        double direct = 0, emitted = 0;  // densities of next-event estimation and of light subpaths
        if (met.light >= 0 && !met.fromWithin) {
            const auto index = static_cast<std::uint32_t>(met.light);
            const Vec3& direction = walk.ray.direction;
            if (lightsSampled_)
                direct =
                    in_.lights.density(local_, index, met.triangle, direction, met.distance, met.cosLight);
            emitted = tracer_.emitter_.density(index, met.triangle, direction * -1.f);
        }
        const double byDirect = mis(direct) * sums_.vcm;
        const float w = tracer_.weight(Strategies::Chance, byDirect + mis(emitted) * sums_.vc);
        add(walk, {met.radiance * w, spreadOf(w, 1 + byDirect)});
    }

    template <Features F>
    void gather(const Walk& walk, const EyeVertex& eye, const BouncePairs& pairs, std::uint32_t seed) {
        const bool parallel = walk.bounces == 0 && tracer_.view().parallel();  // the camera ray's density
        sums_.arrive(parallel ? 1 : walk.way * walk.way, eye.cosine(eye.back));
        lightsSampled_ = eye.side.bsdf.hasSmoothLobe() && !in_.lights.empty();
        if (!lightsSampled_) return;
        in_.lights.prepare(local_, receiverAt(eye.point));
        const LightSample light =
            in_.lights.sample(local_, pairs[dimension::kLightChoice].x, pairs[dimension::kLight]);
        add(walk, directLight(eye, light, walk.ray.time, seed));
        const int events = walk.bounces + 1;
        for (const LightVertex& v : light_) {
            if (events + v.events > in_.options.maxBounces) break;
            if (v.at.side.bsdf.hasSmoothLobe())
                add(walk, connection(eye, events, v, walk.ray.time, raySeed_++));
        }
    }

    void scatter(const EyeVertex& eye, const BsdfSample& next, const Vec3& direction) {
        const double reverse = next.delta ? 0 : eye.from(in_.scene, direction).evaluate(eye.back).pdf;
        sums_.scatter(next, eye.cosine(direction), reverse);
        if (next.delta && next.folded) sums_.vc = 0;  // light subpaths do not fold
        lightsSampled_ = lightsSampled_ && !next.delta;
    }

  private:
    void add(const Walk& walk, const Found& found) {
        const Rgb v = walk.throughput * found.radiance;
        radiance_ += v;
        if (pathSquares_ != nullptr) *pathSquares_ += v * v * found.spread;
    }

    Found directLight(const EyeVertex& eye, const LightSample& light, float time, std::uint32_t seed) const;
    Found connection(const EyeVertex& eye, int events, const LightVertex& light, float time,
                     std::uint32_t seed) const;

    const BidirectionalTracer& tracer_;
    const PathContext& in_;
    const std::vector<LightVertex>& light_;
    std::uint32_t raySeed_;
    Rgb* pathSquares_;
    MisSums sums_;
    Rgb radiance_;
    bool lightsSampled_ = false;  // at the vertex before
    LightSampler::Local local_;   // estimates there
};

Found BidirectionalTracer::EyeEstimate::directLight(const EyeVertex& eye, const LightSample& light,
                                                    float time, std::uint32_t seed) const {
    if (!(light.pdf > 0) || isBlack(light.radiance)) return {};
    const BsdfValue f = eye.side.evaluate(light.direction);
    if (isBlack(f.value)) return {};
    if (in_.accelerator.occluded(leave(eye.point, light.direction, time), light.distance, seed)) return {};
    const double reverse = eye.from(in_.scene, light.direction).evaluate(eye.back).pdf;
    const double emitted = tracer_.emitter_.density(light.light, light.triangle, -light.direction);
    const double direct = light.delta && std::isfinite(light.distance)
                              ? light.pdf * square(light.distance / kReach)
                              : light.pdf;
    const double byChance = light.delta ? 0 : mis(f.pdf / static_cast<double>(light.pdf));
    const double byLight =
        mis(emitted * eye.cosine(light.direction) / direct) * (sums_.vcm + sums_.vc * mis(reverse));
    const float w = tracer_.weight(Strategies::DirectLight, byChance + byLight);
    return {f.value * light.radiance * eye.arriving(light.direction, light.distance) * (w / light.pdf),
            spreadOf(w, 1 + byChance)};
}

Found BidirectionalTracer::EyeEstimate::connection(const EyeVertex& eye, int events, const LightVertex& light,
                                                   float time, std::uint32_t seed) const {
    const Vec3 to = light.at.point.position - eye.point.position;
    const float d2 = lengthSquared(to);
    if (!(d2 > 0)) return {};
    const float distance = std::sqrt(d2);
    const Vec3 direction = to / distance;
    const BsdfValue f = eye.side.evaluate(direction);
    if (isBlack(f.value)) return {};
    const Side seen = light.at.from(in_.scene, -direction);
    const BsdfValue g = seen.evaluate(light.at.back);
    if (isBlack(g.value)) return {};
    if (in_.accelerator.occluded(leave(eye.point, direction, time), distance * kReach, seed)) return {};
    const double atEye = eye.cosine(direction) / static_cast<double>(d2);
    const double atLight = light.at.cosine(direction) / static_cast<double>(d2);
    const double reverse = eye.from(in_.scene, direction).evaluate(eye.back).pdf;
    const double back = light.at.side.evaluate(-direction).pdf;
    const MisSums& sums = light.sums;
    const double byEye = mis(f.pdf * atLight) * (sums.vcm + sums.vc * mis(g.pdf));
    const double byLight = mis(back * atEye) * (sums_.vcm + sums_.vc * mis(reverse));
    const float w = events == 1 || tracer_.strategies_ == Strategies::All
                        ? tracer_.weight(Strategies::Connection, byEye + byLight)
                        : 0;
    return {f.value * g.value * light.throughput * eye.arriving(direction, distance) *
                (w * static_cast<float>(atLight)),
            spreadOf(w, mis(f.pdf * atLight) * (sums.pathVcm + sums.pathVc * mis(g.pdf)))};
}

void BidirectionalTracer::splat(const LightVertex& light, Vec2 lens, float time, std::uint32_t seed,
                                std::vector<Splat>& splats) const {
    const View::Projection seen = view().project(light.at.point.position, lens, time);
    if (!(seen.density > 0) || !(std::abs(seen.x) < 1e9f) || !(std::abs(seen.y) < 1e9f)) return;
    if (!window_.contains(static_cast<int>(std::floor(seen.x)), static_cast<int>(std::floor(seen.y)))) return;
    const Vec3 to = seen.origin - light.at.point.position;
    const float d2 = lengthSquared(to);
    if (!(d2 > 0)) return;
    const float distance = std::sqrt(d2);
    const Vec3 direction = to / distance;
    const SurfacePoint point = seenFrom(light.at.point, direction);
    const Side<kEveryFeature> side(context_.scene, point, light.at.surface, direction);
    const BsdfValue f = side.evaluate(light.at.back);
    if (isBlack(f.value)) return;
    if (context_.accelerator.occluded({seen.origin, -direction, time}, distance * kReach, seed)) return;
    const double area =
        seen.density * light.at.cosine(direction) / (view().parallel() ? 1 : static_cast<double>(d2));
    const double perPixel = mis(area / static_cast<double>(window_.pixels()));
    const MisSums& sums = light.sums;
    const float w = weight(Strategies::Splatting, perPixel * (sums.vcm + sums.vc * mis(f.pdf)));
    Rgb radiance = light.throughput * f.value * (w * static_cast<float>(area));
    const Material& material = *point.material;
    if (point.fromBehind && context_.absorbs && material.absorbs())
        radiance *= transmitted(material.absorption, distance);
    if (!isBlack(radiance))
        splats.push_back(
            {seen.x, seen.y, radiance, spreadOf(w, perPixel * (sums.pathVcm + sums.pathVc * mis(f.pdf)))});
}

PathSample BidirectionalTracer::traceRay(const Ray& start, Vec2 lens, const PathSampler& sampler,
                                         std::vector<Splat>& splats, Rgb* pathSquares) const {
    const std::vector<LightVertex> light = lightSubpath(sampler, start.time);
    const std::uint32_t seed = context_.hashesOpacity ? sampler.hashSeed(dimension::kOpacity) : 0;
    std::uint32_t raySeed = seed + 0x40000000u;  // of splats and connections; each has its own opacity
    if (!light.empty()) {
        const Vec2 u = view().hasLens() ? sampler.pair(dimension::kLightLens) : Vec2{};
        for (const LightVertex& v : light)
            if (v.at.side.bsdf.hasSmoothLobe()) splat(v, u, start.time, raySeed++, splats);
    }
    const float density = view().project(start.origin + start.direction, lens, start.time).density;
    EyeEstimate estimate(*this, light, mis(static_cast<double>(window_.pixels()) / density), raySeed,
                         pathSquares);
    PathSample sample = eyeSubpath(context_, start, sampler, estimate, [&](EyePath& path, const Hit& hit) {
        return scatterAt<kEveryFeature>(path, hit, sampler, estimate);
    });
    sample.radiance = estimate.radiance();
    return sample;
}

}  // namespace vlx::render
