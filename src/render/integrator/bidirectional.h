#pragma once

#include <vector>

#include "render/integrator/path_context.h"
#include "render/light/light_emitter.h"

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
    struct LightVertex;
    class EyeEstimate;

    PathSample traceRay(const Ray& start, Vec2 lens, const PathSampler& sampler, std::vector<Splat>& splats,
                        Rgb* pathSquares) const override;
    std::vector<LightVertex> lightSubpath(const PathSampler& sampler, float time) const;
    void splat(const LightVertex& light, Vec2 lens, float time, std::uint32_t seed,
               std::vector<Splat>& splats) const;
    float weight(Strategies own, double others) const;

    PathContext context_;
    Window window_;
    Strategies strategies_;
    LightEmitter emitter_;
};

}  // namespace vlx::render
