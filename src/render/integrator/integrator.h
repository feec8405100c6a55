#pragma once

#include <memory>
#include <span>
#include <vector>

#include "render/math/sampling.h"
#include "render/plan/effect_set.h"
#include "render/scene/accelerator.h"
#include "render/scene/camera.h"
#include "render/scene/frame_motion.h"
#include "render/scene/scene.h"
#include "variolux/base/window.h"

namespace vlx::render {

/// How direct light is found. Mis is the one to use; the others are for tests: all three agree.
enum class Strategy { Mis, LightsOnly, BsdfOnly };

struct PathOptions {
    int maxBounces = 12;  ///< scattering events at most: 0 shows only what emits, 1 direct light
    Strategy strategy = Strategy::Mis;  ///< of path tracing
    /// What is to be simulated: all that the scene calls for must be in it. All: the general tracer.
    EffectSet effects = EffectSet::all();
    /// What the scene calls for and is not wanted: lobes of surfaces, and caustics. The rest is the scene's
    /// to leave out (plan.h).
    EffectSet leftOut;
    const FrameMotion* motion = nullptr;  ///< tells PathSample::moved; null: it is not wanted
};

/// What one camera sample yields.
struct PathSample {
    Rgb radiance;      ///< never clamped
    float depth = 0;   ///< along the camera ray to the first hit; 0 on a miss
    bool hit = false;  ///< the camera ray met something
    Rgb albedo{1, 1,
               1};  ///< reflectance at the first hit that is not perfectly smooth; 1 for emitters, misses
    Vec3 normal;    ///< shading normal there, towards the viewer; 0 on a miss
    Moved moved;    ///< of what the camera ray met first, or of the direction
};

/// Light that a light subpath brings to a place of the picture.
struct Splat {
    float x = 0;  ///< raster position, inside the window
    float y = 0;
    Rgb radiance;      ///< to be divided by the number of light subpaths for each pixel of the window
    float spread = 0;  ///< radiance^2 x spread: part of the second moment of path tracing (pathSquares)
    std::uint32_t sample = 0;  ///< whose subpath it is: its place among those traced together
};

/// Samples that are traced together: at some 600 bytes each they fit into a core's cache.
inline constexpr std::size_t kStream = 512;

/// Estimates a picture, camera sample by camera sample: the random numbers, the point of the lens and the
/// time are the sample's. Refers to scene and accelerator, which must outlive it; safe to use from many
/// threads.
class Integrator {
  public:
    virtual ~Integrator() = default;
    Integrator(const Integrator&) = delete;
    Integrator& operator=(const Integrator&) = delete;

    /// What comes in along the sample's ray; bidirectional tracing appends to `splats` what its light subpath
    /// brings to other places. To `pathSquares`, if it is given, bidirectional tracing adds what together
    /// with radiance^2 x spread of the splats estimates the second moment of a sample of path tracing's,
    /// without products of different paths: f^2 / p over all paths f found, p being the density with which
    /// path tracing would have.
    PathSample trace(const CameraSample& sample, std::vector<Splat>& splats,
                     Rgb* pathSquares = nullptr) const;

    /// The same for many samples, best kStream, which takes less time: to `found`, of as many.
    virtual void trace(std::span<const CameraSample> samples, std::span<PathSample> found,
                       std::vector<Splat>& splats) const;

  protected:
    Integrator(const View& view, const EffectSet& effects);

    const View& view() const { return view_; }

    /// A sample's ray, and the point of the lens that it starts at.
    struct Start {
        PathSampler sampler;
        Vec2 lens;
        Ray ray;
    };
    Start startOf(const CameraSample& sample) const;

  private:
    /// `ray` starts at `lens`, a point of [0, 1)^2.
    virtual PathSample traceRay(const Ray& ray, Vec2 lens, const PathSampler& sampler,
                                std::vector<Splat>& splats, Rgb* pathSquares) const = 0;

    View view_;
    bool lens_;
    bool moves_;
};

enum class IntegratorKind { Path, Bidirectional };

/// `window`: the pixels whose camera samples are traced; splats fall inside it.
std::unique_ptr<Integrator> makeIntegrator(IntegratorKind kind, const Scene& scene,
                                           const Accelerator& accelerator, const View& view,
                                           const Window& window, const PathOptions& options);

}  // namespace vlx::render
