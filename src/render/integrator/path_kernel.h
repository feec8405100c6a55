#pragma once

#include "render/integrator/eye_subpath.h"

/// The path tracer's estimate, and what it does at a surface, compiled for what surfaces call for; see
/// kernels_*.cpp for the instances.
namespace vlx::render {

inline float powerHeuristic(float own, float other) {
    // Divided first: squares of densities of near-delta lobes overflow.
    const float ratio = other / own;
    return 1 / (1 + ratio * ratio);
}

/// Of a camera ray's radiance: one light's at each vertex, and what is met by chance, MIS-weighted.
class PathEstimate {
  public:
    explicit PathEstimate(const PathContext& in)
        : in_(in),
          choosesLights_(in.lights.size() > 1 || in.options.effects == EffectSet::all()),
          dropsCaustics_(in.options.leftOut.has(Effect::Caustics)) {}

    const Rgb& radiance() const { return radiance_; }

    void meet(const Walk& walk, const MetLight& met) {
        radiance_ += walk.throughput * met.radiance * chanceWeight(met, walk.ray.direction);
    }

    template <Features F>
    void gather(const Walk& walk, const PathVertex<F>& vertex, const BouncePairs& pairs, std::uint32_t seed) {
        lightsSampled_ = vertex.side.bsdf.hasSmoothLobe() && !in_.lights.empty() &&
                         in_.options.strategy != Strategy::BsdfOnly;
        if (!lightsSampled_) return;
        const SurfacePoint& point = vertex.point;
        in_.lights.prepare(local_, {point.position, point.shadingNormal, point.material->transmissive()});
        const float choice = choosesLights_ ? pairs[dimension::kLightChoice].x : 0;
        radiance_ += walk.throughput * direct(vertex, choice, pairs[dimension::kLight], walk.ray.time, seed);
    }

    template <Features F>
    void scatter(const PathVertex<F>&, const BsdfSample& next, const Vec3&) {
        bsdfPdf_ = next.pdf;
        lightsSampled_ = lightsSampled_ && !next.delta;
        scattered_ = scattered_ || !next.delta;
        caustic_ = dropsCaustics_ && scattered_ && next.delta;
    }

  private:
    /// Weight of light that the BSDF's sampling found.
    float chanceWeight(const MetLight& met, const Vec3& direction) const {
        if (caustic_) return 0;
        if (!lightsSampled_ || in_.options.strategy == Strategy::BsdfOnly) return 1;
        if (in_.options.strategy == Strategy::LightsOnly) return 0;
        if (met.light < 0) return 1;
        const double pdf = in_.lights.density(local_, static_cast<std::uint32_t>(met.light), met.triangle,
                                              direction, met.distance, met.cosLight);
        return powerHeuristic(bsdfPdf_, static_cast<float>(pdf));
    }

    /// One light's contribution at a vertex.
    template <Features F>
    Rgb direct(const PathVertex<F>& vertex, float choice, Vec2 u, float time, std::uint32_t seed) const {
        const LightSample light = in_.lights.sample(local_, choice, u);
        if (!(light.pdf > 0) || isBlack(light.radiance)) return {};
        const BsdfValue f = vertex.side.evaluate(light.direction);
        if (isBlack(f.value)) return {};
        if (in_.accelerator.occluded(leave(vertex.point, light.direction, time), light.distance, seed))
            return {};
        const bool alone = light.delta || in_.options.strategy == Strategy::LightsOnly;
        const float weight = alone ? 1 : powerHeuristic(light.pdf, f.pdf);
        return f.value * (light.radiance * vertex.arriving(light.direction, light.distance)) *
               (weight / light.pdf);
    }

    const PathContext& in_;
    bool choosesLights_;
    bool dropsCaustics_;
    Rgb radiance_;
    bool lightsSampled_ = false;  // at the vertex before: what a ray meets by chance shares its weight
    float bsdfPdf_ = 0;           // of the ray
    LightSampler::Local local_;   // estimates at the vertex before
    bool scattered_ = false;      // by a surface that is not smooth
    bool caustic_ = false;        // then by smooth ones only
};

using PathStep = bool(EyePath&, const Hit&, const PathSampler&, PathEstimate&);

// Compiled in kernels_*.cpp.
extern template bool scatterAt<kMatte>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
extern template bool scatterAt<kMatteTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
extern template bool scatterAt<kReflecting>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
extern template bool scatterAt<kReflectingTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
extern template bool scatterAt<kLayered>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
extern template bool scatterAt<kLayeredTextured>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);
extern template bool scatterAt<kEveryFeature>(EyePath&, const Hit&, const PathSampler&, PathEstimate&);

}  // namespace vlx::render
