#pragma once

#include <span>
#include <vector>

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
        : in_(&in),
          choosesLights_(in.lights.size() > 1 || in.options.effects == EffectSet::all()),
          dropsCaustics_(in.options.leftOut.has(Effect::Caustics)) {}

    const Rgb& radiance() const { return radiance_; }

    void meet(const Walk& walk, const MetLight& met) {
        radiance_ += walk.throughput * met.radiance * chanceWeight(met, walk.ray.direction);
    }

    template <Features F>
    void gather(const Walk& walk, const PathVertex<F>& vertex, const BouncePairs& pairs, std::uint32_t seed) {
        if (!asksForLight(vertex.side.bsdf.hasSmoothLobe())) return;
        in_->lights.prepare(local_, receiverAt(vertex.point));
        const LightSample light = chooseLight(pairs);
        if (reaches(light))
            add(walk, vertex.point, vertex.media, light, vertex.side.evaluate(light.direction), seed);
    }

    template <Features F>
    void scatter(const PathVertex<F>&, const BsdfSample& next, const Vec3&) {
        scatter(next);
    }

    /// Whether a light is chosen at a surface.
    bool asksForLight(bool smoothLobe) {
        return lightsSampled_ =
                   smoothLobe && !in_->lights.empty() && in_->options.strategy != Strategy::BsdfOnly;
    }
    static Receiver receiverAt(const SurfacePoint& point) {
        return {point.position, point.shadingNormal, point.material->transmissive()};
    }
    LightSampler::Local& local() { return local_; }
    /// By what local() was prepared for.
    LightSample chooseLight(const BouncePairs& pairs) const {
        return in_->lights.sample(local_, choosesLights_ ? pairs[dimension::kLightChoice].x : 0,
                                  pairs[dimension::kLight]);
    }

    static bool reaches(const LightSample& light) { return light.pdf > 0 && !isBlack(light.radiance); }

    /// What comes of a light that reaches(), if nothing is in its way; `f`: in its direction.
    void add(const Walk& walk, const SurfacePoint& point, const Media& media, const LightSample& light,
             const BsdfValue& f, std::uint32_t seed) {
        if (isBlack(f.value)) return;
        if (in_->accelerator.occluded(leave(point, light.direction, walk.ray.time), light.distance, seed))
            return;
        const bool alone = light.delta || in_->options.strategy == Strategy::LightsOnly;
        const float weight = alone ? 1 : powerHeuristic(light.pdf, f.pdf);
        const Rgb arriving = light.radiance * media.arriving(point, light.direction, light.distance);
        radiance_ += walk.throughput * (f.value * arriving * (weight / light.pdf));
    }

    void scatter(const BsdfSample& next) {
        bsdfPdf_ = next.pdf;
        lightsSampled_ = lightsSampled_ && !next.delta;
        scattered_ = scattered_ || !next.delta;
        caustic_ = dropsCaustics_ && scattered_ && next.delta;
    }

  private:
    /// Weight of light that the BSDF's sampling found.
    float chanceWeight(const MetLight& met, const Vec3& direction) const {
        if (caustic_) return 0;
        if (!lightsSampled_ || in_->options.strategy == Strategy::BsdfOnly) return 1;
        if (in_->options.strategy == Strategy::LightsOnly) return 0;
        if (met.light < 0) return 1;
        const double pdf = in_->lights.density(local_, static_cast<std::uint32_t>(met.light), met.triangle,
                                               direction, met.distance, met.cosLight);
        return powerHeuristic(bsdfPdf_, static_cast<float>(pdf));
    }

    const PathContext* in_;
    bool choosesLights_;
    bool dropsCaustics_;
    Rgb radiance_;
    bool lightsSampled_ = false;  // at the vertex before: what a ray meets by chance shares its weight
    float bsdfPdf_ = 0;           // of the ray
    LightSampler::Local local_;   // estimates at the vertex before
    bool scattered_ = false;      // by a surface that is not smooth
    bool caustic_ = false;        // then by smooth ones only
};

/// A camera ray's path in a stream of them.
struct StreamedPath {
    StreamedPath(const PathContext& in, const Ray& ray, const PathSampler& numbers)
        : sampler(numbers), path(startOf(in, ray, sampler)), estimate(in) {}

    PathSampler sampler;
    EyePath path;
    PathEstimate estimate;
    Hit hit;  ///< where it is
};

/// What scatterAt does, for paths that have all met surfaces which call for `F` at most. Those that go on are
/// appended to `alive`, in their order.
template <Features F>
void scatterAll(std::span<StreamedPath* const> met, std::vector<StreamedPath*>& alive);

// Compiled in kernels_*.cpp.
#define VLX_KERNEL(F)                                                                           \
    extern template bool scatterAt<F>(EyePath&, const Hit&, const PathSampler&, PathEstimate&); \
    extern template void scatterAll<F>(std::span<StreamedPath* const>, std::vector<StreamedPath*>&);
VLX_KERNEL(kMatte)
VLX_KERNEL(kMatteTextured)
VLX_KERNEL(kReflecting)
VLX_KERNEL(kReflectingTextured)
VLX_KERNEL(kLayered)
VLX_KERNEL(kLayeredTextured)
VLX_KERNEL(kEveryFeature)
#undef VLX_KERNEL

}  // namespace vlx::render
