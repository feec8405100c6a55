#pragma once

#include <array>
#include <concepts>

#include "render/math/sampling.h"
#include "render/math/vec.h"
#include "render/plan/effect_set.h"
#include "render/plan/kernel_features.h"
#include "render/surface/energy_tables.h"
#include "render/surface/sheen.h"

/// The surface model. Its parts are templates, defined in bsdf_energy.h and bsdf.h: include the latter.
namespace vlx::render {

template <class Real>
struct DielectricLayerOf;
using DielectricLayer = DielectricLayerOf<float>;

/// A material's parameters at one point, textures applied. Ranges: colours, metallic, roughness,
/// transmission, specular, clearcoat and clearcoatRoughness in [0, 1]; ior >= 1.
template <class Real>
struct SurfaceParametersOf {
    RgbOf<Real> baseColour{spread<Real>(1)};
    Real metallic{};
    Real roughness = spread<Real>(1);
    Mask<Real> retro{};  ///< diffuse light as in Disney's model
    Real transmission{};
    Real ior = spread<Real>(1.5f);
    float specular = 1;
    Rgb specularColour{1, 1, 1};
    Real clearcoat{};
    Real clearcoatRoughness{};
    RgbOf<Real> sheenColour{};
    Real sheenRoughness{};
    EffectSet leftOut;  ///< of diffuse, glossy, mirror, transmission, rough transmission
    const AlbedoTable* albedoTable = nullptr;  ///< of this ior; required
    Tables<SheenTable, Real> sheenTable;       ///< required where there is sheen
    Tables<GlassTable, Real> glassTable;       ///< of this ior; without it rough glass loses a little energy
    const DielectricLayerOf<Real>* layer = nullptr;  ///< of these; null: not known beforehand
};
using SurfaceParameters = SurfaceParametersOf<float>;

/// A surface's dielectric reflection, as far as neither directions nor the base colour matter.
template <class Real>
struct DielectricLayerOf {
    DielectricLayerOf() = default;
    explicit DielectricLayerOf(const SurfaceParameters& surface) requires std::same_as<Real, float>;

    /// Albedo, multiple scattering included.
    RgbOf<Real> albedo(const AlbedoOf<Real>& a) const {
        return f0 * (a.whole - a.dielectric) + RgbOf<Real>(f90 * a.dielectric) + multiple * (1.f - a.whole);
    }

    AlbedoRowOf<Real> row;
    Real exactF0{};  ///< of the index
    RgbOf<Real> f0;
    Real f90{};
    RgbOf<Real> multiple;  ///< Kulla and Conty's factor
    RgbOf<Real> mean;      ///< albedo
    RgbOf<Real> rest;      ///< 1 / (1 - mean)
};

/// f |cos wi| and the density (per solid angle) with which sample() chooses wi, both without delta lobes.
template <class Real>
struct BsdfValueOf {
    RgbOf<Real> value;
    Real pdf{};
};
using BsdfValue = BsdfValueOf<float>;

template <class Real>
struct BsdfSampleOf {
    Vec3Of<Real> wi;       ///< local
    RgbOf<Real> weight;    ///< f |cos wi| / pdf; 0: the path ends here
    Real pdf{};            ///< of all lobes together; meaningless for delta lobes
    Mask<Real> delta{};    ///< perfectly smooth reflection or refraction
    Mask<Real> coat{};     ///< a delta lobe's: the clear coat, not what lies beneath
    Mask<Real> through{};  ///< wi lies beyond the true surface
    /// A delta lobe's: folded back. Light that comes from wi does not go to wo.
    Mask<Real> folded{};
};
using BsdfSample = BsdfSampleOf<float>;

/// The one or the other, lane by lane.
template <class Real>
BsdfValueOf<Real> select(Mask<Real> first, const BsdfValueOf<Real>& a, const BsdfValueOf<Real>& b) {
    return {select(first, a.value, b.value), first ? a.pdf : b.pdf};
}
template <class Real>
BsdfSampleOf<Real> select(Mask<Real> first, const BsdfSampleOf<Real>& a, const BsdfSampleOf<Real>& b) {
    const auto either = [&](Mask<Real> p, Mask<Real> q) -> Mask<Real> { return first ? p : q; };
    return {select(first, a.wi, b.wi), select(first, a.weight, b.weight),
            first ? a.pdf : b.pdf,     either(a.delta, b.delta),
            either(a.coat, b.coat),    either(a.through, b.through),
            either(a.folded, b.folded)};
}

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
/// `F`: what the surface may have. Parts that F lacks are not compiled. `Real`: float, or Lanes for four
/// points of four surfaces.
template <Features F, class Real = float>
class BasicBsdf {
    static_assert(F.reflection || !(F.layers || F.glass), "layers and glass reflect");
    static_assert(std::same_as<Real, float> || !F.rare, "effects are left out of one surface at a time");

  public:
    using Vector = Vec3Of<Real>;
    using Colour = RgbOf<Real>;
    using Surface = SurfaceParametersOf<Real>;
    using Value = BsdfValueOf<Real>;
    using Sample = BsdfSampleOf<Real>;

    /// `fromInside`: wo is on the back of the surface (matters to glass only).
    /// `coatTable`: of index 1.5.
    /// `trueNormal`: the triangle's, local, on wo's side: trueNormal.z >= 0.
    BasicBsdf(const Surface& surface, const Vector& wo, Mask<Real> fromInside, const AlbedoTable& coatTable,
              const Vector& trueNormal = {Real{}, Real{}, Real{} + 1});

    Value evaluate(const Vector& wi) const;
    /// `direction` chooses within the lobe, `choice` the lobe.
    Sample sample(const Vec2Of<Real>& direction, Real choice) const;

    /// Estimate of the reflectance (transmission included) towards wo.
    const Colour& albedo() const { return albedo_; }
    /// Whether there is a lobe that is not a delta function, so that lights can be sampled.
    Mask<Real> hasSmoothLobe() const { return !onlyDelta_; }
    /// What coat and sheen let through of light towards wo: delta lobes beneath them are not reciprocal by
    /// it.
    Real beneath() const { return base_; }

  private:
    enum Lobe : std::size_t { kCoat, kReflection, kDiffuse, kGlass, kSheen, kLobes };

    struct Microfacet;

    template <bool kImage>
    Value lobes(const Vector& wi) const;
    Vector imageOf(const Vector& wi) const { return wi - up_ * (2.f * dot(wi, up_)); }

    Colour baseFresnel(Real cosH) const;
    Real coatFresnel(Real cosH) const;
    Value baseReflection(const Vector& wi) const;
    Value coatReflection(const Vector& wi) const;
    Value diffuse(const Vector& wi) const;
    Real retroFactor(const Vector& wi) const;
    Value glass(Mask<Real> there, const Vector& wi) const;
    Value sheen(Mask<Real> there, const Vector& wi) const;
    void leaveOut(const EffectSet& effects);
    void leaveAbove(Mask<Real> tilted);
    void setReflecting(const Surface& s, Mask<Real> fromInside, Real glass, Real sheenEnergy);
    struct GlassSplit {
        Colour reflected;
        Colour transmitted;
        Real reflectProbability;
    };
    GlassSplit splitAt(Real cosH) const;
    Sample mirror(const Colour& weight, bool coat) const;
    Sample finish(Vector wi, Mask<Real> through) const;
    Sample settled(Sample delta) const;

    static DielectricLayerOf<Real> layerOf(const Surface& s) {
        if constexpr (!F.reflection) return {};
        if constexpr (std::same_as<Real, float>)
            if (s.layer == nullptr) return DielectricLayer(s);
        return *s.layer;
    }

    Vector wo_;
    Vector up_;                      ///< the true normal
    DielectricLayerOf<Real> layer_;  ///< where F reflects
    Real alpha_;
    Real coatAlpha_;
    Real retroRoughness_;  ///< -1: the surface is not of that kind
    Real lambdaO_{};       ///< of the base's GGX at wo
    Real coatLambdaO_{};   ///< of the coat's
    Mask<Real> smooth_;    ///< the base reflects as a delta function
    Mask<Real> coatSmooth_;
    Mask<Real> glassSmooth_ = always<Real>();
    Mask<Real> onlyDelta_;

    Real coat_;     ///< clearcoat factor
    Colour sheen_;  ///< colour, scaled by what the coat lets through
    Real sheenRoughness_{};
    Real coatAlbedo_{};
    Real base_;    ///< what coat and sheen let through
    Real metal_;   ///< how much of each there is: metal,
    Real opaque_;  ///< opaque dielectric
    Colour metalF0_;
    Colour multiple_;     ///< factor of the multiple-scattering lobe, everything but (1 - whole(wi))
    Colour diffuse_;      ///< factor of the diffuse lobe, everything but (1 - Ed(wi))
    Real glassWeight_{};  ///< includes the multiple-scattering compensation
    Colour glassTint_;
    Real ior_;
    Real eta_;  ///< far side over near side
    Colour albedo_;
    std::array<Real, kLobes> probability_{};
};

/// Of any surface.
using Bsdf = BasicBsdf<kEveryFeature>;

}  // namespace vlx::render
