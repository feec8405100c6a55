#pragma once

#include <vector>

#include "render/integrator/integrator.h"
#include "render/light/light_emitter.h"
#include "render/light/light_sampler.h"

namespace vlx::render {

/// Which strategies of a bidirectional tracer count, by their number of light vertices s and eye vertices t
/// (the camera included). All is the one to use; the others are for tests: each weighs 1, and all agree on
/// what they can sample. Lights that the camera sees itself count always.
enum class Strategies {
    All,          ///< combined by the power heuristic
    Chance,       ///< s = 0: the eye subpath meets the light
    DirectLight,  ///< s = 1
    Connection,   ///< t = 2, s >= 2: light that scattered twice and more
    Splatting     ///< t = 1
};

/// Bidirectional path tracing (Lafortune, Willems, 1993; Veach, Guibas, 1994): every camera sample has an eye
/// subpath, traced as PathTracer does, and a light subpath, and all their vertices are connected. Multiple
/// importance sampling by the power heuristic over all strategies but s = 1, t = 1 (lights seen by the camera
/// itself are found by chance only), with the recursive quantities of Georgiev, "Implementing vertex
/// connection and merging" (2012). What it estimates is what PathTracer estimates, on any scene:
/// - a light vertex scatters by the model as seen from the side that looks towards the camera, times the
///   factors of shading normals and refraction that light has and importance has not (Veach, 1997, 5.3);
/// - surfaces are seen through from behind as camera rays do: light that comes to the front of a single-sided
///   one may also go on behind it.
/// Caustics of lights without an extent are left out, as PathTracer cannot find them.
/// Solids inside one another may take absorption from the wrong one on the light's way. General kernel only;
/// effects that are left out must be the scene's or lobes of surfaces, not caustics.
class BidirectionalTracer final : public Integrator {
  public:
    /// `window`: the pixels whose camera samples are traced; splats fall inside it.
    BidirectionalTracer(const Scene& scene, const Accelerator& accelerator, const View& view,
                        const Window& window, const PathOptions& options,
                        Strategies strategies = Strategies::All);

  private:
    struct Vertex;
    /// Weighed radiance of a path, and as Splat::spread.
    struct Found {
        Rgb radiance;
        float spread = 0;
    };

    PathSample traceRay(const Ray& start, Vec2 lens, const PathSampler& sampler, std::vector<Splat>& splats,
                        Rgb* pathSquares) const override;
    std::vector<Vertex> lightSubpath(const PathSampler& sampler, float time) const;
    Found directLight(const Vertex& eye, const LightSampler::Local& local, float choice, Vec2 u, float time,
                      std::uint32_t seed) const;
    Found connection(const Vertex& eye, const Vertex& light, float time, std::uint32_t seed) const;
    void splat(const Vertex& light, Vec2 lens, float time, std::uint32_t seed,
               std::vector<Splat>& splats) const;
    /// Density (per solid angle; of finite delta lights per area) with which next-event estimation at a
    /// receiver would have chosen a light that is met in `direction`.
    double directDensity(const LightSampler::Local& local, std::size_t light, std::uint32_t triangle,
                         const Vec3& direction, float distance, float cosLight) const;
    float weight(Strategies own, double others) const;
    /// Density of a strategy over its weight and PathTracer's density, whose squares (over its own) add up to
    /// `byPath`.
    static float spreadOf(float weight, double byPath) {
        return weight > 0 && byPath > 0 ? static_cast<float>(1 / (weight * std::sqrt(byPath))) : 0;
    }

    const Scene& scene_;
    const Accelerator& accelerator_;
    Window window_;
    PathOptions options_;
    Strategies strategies_;
    LightSampler lights_;
    LightEmitter emitter_;
    bool absorbs_;
    bool hashesOpacity_;
};

}  // namespace vlx::render
