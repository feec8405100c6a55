#pragma once

#include "render/integrator/bidirectional.h"
#include "render/integrator/walk.h"

// How MIS is done. A path is a product of densities, one for each strategy; what is wanted is their sum over
// that of the strategy at hand. Two numbers for each subpath, vcm and vc, hold the sums over the strategies
// that end nearer to its start, as in Georgiev's report (d_VCM and d_VC); mis() is the heuristic's power. All
// densities are per solid angle, turned into areas by true (not shading) cosines. Roulette, the choice of a
// delta lobe, opacity and going on behind a surface are left out of them: any function of the whole path will
// do, as long as every strategy uses the same.

/// Vertices of the bidirectional tracer's subpaths, and the quantities of MIS that they carry.
namespace vlx::render {

inline double mis(double density) { return density * density; }

/// What MIS has to know of a subpath.
struct MisSums {
    double vcm = 0;
    double vc = 0;
    // The same over the strategies s = 0 and s = 1 only, PathTracer's; of light subpaths.
    double pathVcm = 0;
    double pathVc = 0;

    /// Turns densities per solid angle at the vertex before into densities per area at this one, `cosine`
    /// being that of the direction back.
    void arrive(double distanceSquared, float cosine) {
        const double cosHere = mis(std::max(cosine, 1e-9f));
        vcm *= mis(distanceSquared) / cosHere;
        vc /= cosHere;
        pathVc /= cosHere;
    }

    /// Goes on in a direction at `cosine`, chosen as `next` says; `reverse`: the density of the direction
    /// back, coming from there.
    void scatter(const BsdfSample& next, float cosine, double reverse) {
        if (next.delta) {
            vcm = 0;
            vc *= mis(cosine);
            pathVc *= mis(cosine);
        } else {
            const double turned = mis(cosine / static_cast<double>(next.pdf));
            vc = turned * (vc * mis(reverse) + vcm);
            pathVc = turned * (pathVc * mis(reverse) + pathVcm);
            vcm = mis(1 / static_cast<double>(next.pdf));
        }
        pathVcm = 0;
    }
};

/// The receiver of direct light: the same whatever direction it is seen from on one side.
inline Receiver receiverAt(const SurfacePoint& point) {
    return {point.position, point.geometricNormal, point.material->transmissive()};
}

struct BidirectionalTracer::LightVertex {
    PathVertex<kEveryFeature, SurfacePoint> at;
    MisSums sums;
    Rgb throughput;  ///< divided by the cosine with `at.back`
    int events = 1;  ///< scattering events of its subpath, with this one
};

}  // namespace vlx::render
