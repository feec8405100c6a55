#pragma once

#include "render/integrator/path_context.h"
#include "render/surface/bsdf.h"
#include "render/surface/surface.h"

/// What every subpath, from the camera or from a light, does from one vertex to the next; compiled for what
/// a scene calls for.
namespace vlx::render {

/// Bounces before roulette may end a path.
inline constexpr int kSureBounces = 2;

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

/// A surface as seen from one direction; of Lanes, four of them.
template <Features F, class Real = float>
struct Side {
    using Vector = Vec3Of<Real>;

    Side(const AlbedoTable& coatTable, const Vector& shadingNormal, const Vector& geometricNormal,
         Mask<Real> fromBehind, const SurfaceParametersOf<Real>& surface, const Vector& viewer)
        : frame(shadingNormal),
          wo(frame.toLocal(viewer)),
          bsdf(surface, {wo.x, wo.y, larger(wo.z, spread<Real>(1e-4f))}, fromBehind, coatTable,
               frame.toLocal(geometricNormal)) {}
    Side(const Scene& scene, const SurfacePoint& seen, const SurfaceParameters& surface, const Vec3& viewer)
        : Side(scene.albedoTables[0], seen.shadingNormal, seen.geometricNormal, seen.fromBehind, surface,
               viewer) {}

    BsdfValueOf<Real> evaluate(const Vector& direction) const {
        return bsdf.evaluate(frame.toLocal(direction));
    }

    FrameOf<Real> frame;
    Vector wo;
    BasicBsdf<F, Real> bsdf;
};

/// What absorbs about a surface, where something does.
struct Media {
    const Material* here = nullptr;    ///< on the side that a subpath comes from,
    const Material* beyond = nullptr;  ///< and on the other

    /// Part that arrives at a point of light that starts at a distance in `direction`.
    Rgb arriving(const SurfacePoint& point, const Vec3& direction, float distance) const {
        const Material* through = dot(point.geometricNormal, direction) < 0 ? beyond : here;
        return through != nullptr ? transmitted(through->absorption, distance) : Rgb(1);
    }
};

struct Walk;

/// Where a subpath scatters. `Point`: SurfacePoint, or a reference to one that outlives the vertex.
template <Features F, class Point = const SurfacePoint&>
struct PathVertex {
    PathVertex(const Walk& walk, const SurfacePoint& met);

    Point point;  ///< as seen from the vertex before
    SurfaceParameters surface;
    Vec3 back;  ///< unit, to the vertex before
    Media media;
    Side<F> side;  ///< that is seen from the vertex before

    float cosine(const Vec3& direction) const { return std::abs(dot(point.geometricNormal, direction)); }
    /// As seen from elsewhere.
    Side<F> from(const Scene& scene, const Vec3& viewer) const {
        return {scene, seenFrom(point, viewer), surface, viewer};
    }
    Rgb arriving(const Vec3& direction, float distance) const {
        return media.arriving(point, direction, distance);
    }
};

/// A subpath on its way.
struct Walk {
    const PathContext& in;
    Ray ray;  ///< that it goes on by
    Rgb throughput{1, 1, 1};
    const Material* medium = nullptr;  ///< that the ray travels in, where it absorbs
    int bounces = 0;                   ///< scattering events so far
    double way = 0;                    ///< from the last of them, or the start, to the surface that was met

    bool absorbs(const Material& material) const { return in.absorbs && material.absorbs(); }

    /// Goes `distance` along the ray.
    void travel(float distance) {
        way += distance;
        if (medium != nullptr) throughput *= transmitted(medium->absorption, distance);
    }

    /// Goes to the surface that the ray has met.
    template <Features F>
    SurfacePoint arrive(const Hit& hit) {
        const SurfacePoint point = surfacePoint<F>(in.scene, hit, ray.direction, ray.time);
        // A ray that starts inside learns so when it meets the solid's surface from behind.
        if (medium == nullptr && point.fromBehind && absorbs(*point.material)) medium = point.material;
        travel(hit.distance);
        return point;
    }

    template <Features F>
    SurfaceParameters parameters(const SurfacePoint& point) const {
        return parametersAt<F>(in.scene, point, in.plain(*point.material));
    }

    /// Goes on behind the surface as if it were not there.
    void pass(const SurfacePoint& point) { ray = leave(point, ray.direction, ray.time); }

    /// About a surface that the ray has met.
    Media mediaAt(const SurfacePoint& point) const {
        return {medium, !point.fromBehind && absorbs(*point.material) ? point.material : nullptr};
    }

    /// Goes on from a point of a surface, which has scattered, `through` it or not; roulette lets the path
    /// live with probability `survival`, decided by `u`. Returns whether it lives.
    bool goOn(const SurfacePoint& point, const Media& media, bool through, const Vec3& direction,
              float survival, float u) {
        if (bounces >= kSureBounces) {
            if (u >= survival) return false;
            throughput *= 1 / survival;
        }
        if (through) medium = media.beyond;
        ray = leave(point, direction, ray.time);
        ++bounces;
        way = 0;
        return true;
    }
};

template <Features F, class Point>
PathVertex<F, Point>::PathVertex(const Walk& walk, const SurfacePoint& met)
    : point(met),
      surface(walk.parameters<F>(point)),
      back(-walk.ray.direction),
      media(walk.mediaAt(point)),
      side(walk.in.scene, point, surface, back) {}

}  // namespace vlx::render
