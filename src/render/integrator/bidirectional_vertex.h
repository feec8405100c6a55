#pragma once

#include "render/integrator/bidirectional.h"
#include "render/integrator/path_kernel.h"

// How MIS is done. A path is a product of densities, one for each strategy; what is wanted is their sum over
// that of the strategy at hand. Two numbers for each subpath, vcm and vc, hold the sums over the strategies
// that end nearer to its start, as in Georgiev's report (d_VCM and d_VC); mis() is the heuristic's power. All
// densities are per solid angle, turned into areas by true (not shading) cosines. Roulette, the choice of a
// delta lobe, opacity and going on behind a surface are left out of them: any function of the whole path will
// do, as long as every strategy uses the same.

/// Vertices of the bidirectional tracer's subpaths, and the quantities of MIS that they carry.
namespace vlx::render {

inline double mis(double density) { return density * density; }

/// A surface as seen from one direction.
struct Side {
    Side(const Scene& scene, const SurfacePoint& seen, const SurfaceParameters& surface, const Vec3& viewer)
        : point(seen),
          frame(seen.shadingNormal),
          wo(frame.toLocal(viewer)),
          bsdf(surface, {wo.x, wo.y, std::max(wo.z, 1e-4f)}, seen.fromBehind, scene.albedoTables[0],
               frame.toLocal(seen.geometricNormal)) {}

    BsdfValue evaluate(const Vec3& direction) const { return bsdf.evaluate(frame.toLocal(direction)); }

    SurfacePoint point;
    Frame frame;
    Vec3 wo;
    Bsdf bsdf;
};

/// The receiver of direct light: the same whatever direction it is seen from on one side.
inline Receiver receiverAt(const SurfacePoint& point) {
    return {point.position, point.geometricNormal, point.material->transmissive()};
}

struct BidirectionalTracer::Vertex {
    Side side;  ///< as seen from the vertex before
    SurfaceParameters surface;
    Vec3 back;       ///< unit, to the vertex before
    Rgb throughput;  ///< of light subpaths: divided by the cosine with `back`
    double vcm = 0;
    double vc = 0;
    // The same over the strategies s = 0 and s = 1 only, PathTracer's; of light subpaths.
    double pathVcm = 0;
    double pathVc = 0;
    int events = 1;                    ///< scattering events of its subpath, with this one
    const Material* medium = nullptr;  ///< that absorbs on the side of `back`,
    const Material* beyond = nullptr;  ///< and on the other

    const Vec3& position() const { return side.point.position; }
    float cosine(const Vec3& direction) const { return std::abs(dot(side.point.geometricNormal, direction)); }
    /// As seen from elsewhere.
    Side from(const Scene& scene, const Vec3& viewer) const {
        return {scene, seenFrom(side.point, viewer), surface, viewer};
    }
    /// Light that arrives from `direction` at a distance, of what starts there.
    Rgb arriving(const Vec3& direction, float distance) const {
        const Material* through = dot(side.point.geometricNormal, direction) < 0 ? beyond : medium;
        return through != nullptr ? transmitted(through->absorption, distance) : Rgb(1);
    }
    /// Turns densities per solid angle at the vertex before into densities per area here.
    void arriveAt(double distanceSquared) {
        const double cosHere = mis(std::max(cosine(back), 1e-9f));
        vcm *= mis(distanceSquared) / cosHere;
        vc /= cosHere;
        pathVc /= cosHere;
    }
};

}  // namespace vlx::render
