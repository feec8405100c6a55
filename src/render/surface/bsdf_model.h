#pragma once

#include <array>

#include "render/math/sampling.h"
#include "render/math/vec.h"
#include "render/plan/effect_set.h"
#include "render/plan/kernel_features.h"
#include "render/surface/energy_tables.h"
#include "render/surface/sheen.h"

/// The surface model. Its parts are templates, defined in bsdf_energy.h and bsdf.h: include the latter.
namespace vlx::render {

struct DielectricLayer;

/// A material's parameters at one point, textures applied. Ranges: colours, metallic, roughness,
/// transmission, specular, clearcoat and clearcoatRoughness in [0, 1]; ior >= 1.
struct SurfaceParameters {
    Rgb baseColour{1, 1, 1};
    float metallic = 0;
    float roughness = 1;
    bool retro = false;  ///< diffuse light as in Disney's model
    float transmission = 0;
    float ior = 1.5f;
    float specular = 1;
    Rgb specularColour{1, 1, 1};
    float clearcoat = 0;
    float clearcoatRoughness = 0;
    Rgb sheenColour{0, 0, 0};
    float sheenRoughness = 0;
    EffectSet leftOut;  ///< of diffuse, glossy, mirror, transmission, rough transmission
    const AlbedoTable* albedoTable = nullptr;  ///< of this ior; required
    const SheenTable* sheenTable = nullptr;    ///< required where there is sheen
    const GlassTable* glassTable = nullptr;    ///< of this ior; without it rough glass loses a little energy
    const DielectricLayer* layer = nullptr;    ///< of these; null: not known beforehand
};

/// A surface's dielectric reflection, as far as neither directions nor the base colour matter.
struct DielectricLayer {
    DielectricLayer() = default;
    explicit DielectricLayer(const SurfaceParameters& surface);

    /// Albedo, multiple scattering included.
    Rgb albedo(const Albedo& a) const {
        return f0 * (a.whole - a.dielectric) + Rgb(f90 * a.dielectric) + multiple * (1 - a.whole);
    }

    AlbedoTable::Row row;
    float exactF0 = 0;  ///< of the index
    Rgb f0;
    float f90 = 0;
    Rgb multiple;  ///< Kulla and Conty's factor
    Rgb mean;      ///< albedo
    Rgb rest;      ///< 1 / (1 - mean)
};

/// f |cos wi| and the density (per solid angle) with which sample() chooses wi, both without delta lobes.
struct BsdfValue {
    Rgb value;
    float pdf = 0;
};

struct BsdfSample {
    Vec3 wi;               ///< local
    Rgb weight;            ///< f |cos wi| / pdf; 0: the path ends here
    float pdf = 0;         ///< of all lobes together; meaningless for delta lobes
    bool delta = false;    ///< perfectly smooth reflection or refraction
    bool coat = false;     ///< a delta lobe's: the clear coat, not what lies beneath
    bool through = false;  ///< wi lies beyond the true surface
    /// A delta lobe's: folded back. Light that comes from wi does not go to wo.
    bool folded = false;
};

/// Scattering at a point of a glTF surface, in the local frame whose z axis is the shading normal on the
/// viewer's side: wo.z > 0. `wo` points to the viewer, `wi` to the light.
///
///     f = coat + (1 - Ec(wo)) { sheen + (1 - Es(wo)) [ metallic and dielectric reflection + diffuse + glass
///     ] }
///
/// - reflection: GGX, height-correlated Smith; Fresnel from f0 to f90 along Schlick's curve for metals (f0 =
///   base colour) and along the exact one for dielectrics (f0 = ((ior-1)/(ior+1))^2 x specular x
///   specularColour, f90 = specular). Energy lost to multiple scattering is returned by Kulla and Conty's
///   lobe.
/// - diffuse: c / pi x (1-Ed(wo)) (1-Ed(wi)) / (1 - mean Ed), Ed being the dielectric reflection's albedo:
/// what
///   is not reflected enters. Reciprocal. c = min(1, base colour / (1 - mean Ed)), so that the base colour is
///   the diffuse reflectance that one sees beneath the reflection (as in Disney's and Cycles' models, which
///   take nothing off it), as far as energy allows: a white surface returns exactly what it gets.
///   With `retro` it is instead as Cycles has it up to Blender 3.6 (Burley, "Physically-based shading at
///   Disney", 2012): c / pi (1 + (r - 1/2) (1 - cos wo)^5) (1 + (r - 1/2) (1 - cos wi)^5), c the base colour,
///   r = roughness (1 + cosine between wo and wi). Nothing is taken off for the reflection, rough surfaces
///   shine at grazing angles: white ones return more than they get.
/// - glass (weight (1-metallic) transmission): reflection and refraction by the exact Fresnel term,
/// refraction
///   tinted by the base colour; rough glass is divided by its single-scattering albedo. The surface bounds a
///   solid: light refracts on entering and on leaving. What is carried is basic radiance L / n^2, n being the
///   index of the medium, which refraction leaves as it is; emission is given in it too.
/// - coat: GGX of index 1.5, Ec its albedo times the clearcoat factor. Scaling by the view direction only
///   keeps energy for every base, at the price of reciprocity: f(wo, wi) has wo towards the camera.
/// - sheen: Charlie's distribution (sheen.h), Es its albedo times the greatest channel of its colour; where
///   its albedo is above 1, at grazing angles, it is scaled to 1.
///
/// Where the shading normal is not the true one, lobes about it reach through the surface. What a reflection
/// would send beneath it, or refraction above it, leaves at the mirror image about the true surface, as if it
/// met that next: f(wo, wi) + f(wo, image of wi). Energy is kept, and nothing jumps as normals tilt: where
/// the shading normal turns from the viewer, a mirror reflects about the true normal. (Schuessler et al.,
/// "Microfacet-based normal mapping for robust Monte Carlo path tracing", 2017, have a second facet reflect
/// it likewise.) Diffuse light is too wide for that, it would shine twice where lights set; it is divided by
/// the part of its lobe that is above the surface.
///
/// `F`: what the surface may have. Parts that F lacks are not compiled.
template <Features F>
class BasicBsdf {
    static_assert(F.reflection || !(F.layers || F.glass), "layers and glass reflect");

  public:
    /// `fromInside`: wo is on the back of the surface (matters to glass only).
    /// `coatTable`: of index 1.5.
    /// `trueNormal`: the triangle's, local, on wo's side: trueNormal.z >= 0.
    BasicBsdf(const SurfaceParameters& surface, const Vec3& wo, bool fromInside, const AlbedoTable& coatTable,
              const Vec3& trueNormal = {0, 0, 1});

    BsdfValue evaluate(const Vec3& wi) const;
    /// `direction` chooses within the lobe, `choice` the lobe.
    BsdfSample sample(Vec2 direction, float choice) const;

    /// Estimate of the reflectance (transmission included) towards wo.
    const Rgb& albedo() const { return albedo_; }
    /// Whether there is a lobe that is not a delta function, so that lights can be sampled.
    bool hasSmoothLobe() const { return !onlyDelta_; }
    /// What coat and sheen let through of light towards wo: delta lobes beneath them are not reciprocal by
    /// it.
    float beneath() const { return base_; }

  private:
    enum Lobe : std::size_t { kCoat, kReflection, kDiffuse, kGlass, kSheen, kLobes };

    struct Microfacet;

    template <bool kImage>
    BsdfValue lobes(const Vec3& wi) const;
    Vec3 imageOf(const Vec3& wi) const { return wi - up_ * (2 * dot(wi, up_)); }

    Rgb baseFresnel(float cosH) const;
    float coatFresnel(float cosH) const;
    BsdfValue baseReflection(const Vec3& wi) const;
    BsdfValue coatReflection(const Vec3& wi) const;
    BsdfValue diffuse(const Vec3& wi) const;
    float retroFactor(const Vec3& wi) const;
    BsdfValue glass(const Vec3& wi) const;
    BsdfValue sheen(const Vec3& wi) const;
    void leaveOut(const EffectSet& effects);
    void leaveAbove();
    void setReflecting(const SurfaceParameters& s, bool fromInside, float glass, float sheenEnergy);
    struct GlassSplit {
        Rgb reflected;
        Rgb transmitted;
        float reflectProbability;
    };
    GlassSplit splitAt(float cosH) const;
    BsdfSample mirror(const Rgb& weight, bool coat) const;
    BsdfSample sampleMicrofacet(float alpha, Vec2 u) const;
    BsdfSample sampleGlass(Vec2 u, float choice) const;
    BsdfSample finish(Vec3 wi, bool through) const;
    BsdfSample settled(BsdfSample delta) const;

    static DielectricLayer layerOf(const SurfaceParameters& s) {
        if constexpr (!F.reflection) return {};
        return s.layer != nullptr ? *s.layer : DielectricLayer(s);
    }

    Vec3 wo_;
    Vec3 up_;                ///< the true normal
    DielectricLayer layer_;  ///< where F reflects
    float alpha_;
    float coatAlpha_;
    float retroRoughness_;   ///< -1: the surface is not of that kind
    float lambdaO_ = 0;      ///< of the base's GGX at wo
    float coatLambdaO_ = 0;  ///< of the coat's
    bool smooth_;            ///< the base reflects as a delta function
    bool coatSmooth_;
    bool glassSmooth_ = true;
    bool onlyDelta_;

    float coat_;  ///< clearcoat factor
    Rgb sheen_;   ///< colour, scaled by what the coat lets through
    float sheenRoughness_ = 0;
    float coatAlbedo_ = 0;
    float base_;    ///< what coat and sheen let through
    float metal_;   ///< how much of each there is: metal,
    float opaque_;  ///< opaque dielectric
    Rgb metalF0_;
    Rgb multiple_;           ///< factor of the multiple-scattering lobe, everything but (1 - whole(wi))
    Rgb diffuse_;            ///< factor of the diffuse lobe, everything but (1 - Ed(wi))
    float glassWeight_ = 0;  ///< includes the multiple-scattering compensation
    Rgb glassTint_;
    float ior_;
    float eta_;  ///< far side over near side
    Rgb albedo_;
    std::array<float, kLobes> probability_{};
};

/// Of any surface.
using Bsdf = BasicBsdf<kEveryFeature>;

}  // namespace vlx::render
