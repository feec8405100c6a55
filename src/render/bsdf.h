#pragma once

#include <array>

#include "energy_tables.h"
#include "vec.h"

namespace vlx::render {

/// A material's parameters at one point, textures applied. Ranges: colours, metallic, roughness,
/// transmission, specular, clearcoat and clearcoatRoughness in [0, 1]; ior >= 1.
struct SurfaceParameters {
    Rgb baseColour{1, 1, 1};
    float metallic = 0;
    float roughness = 1;
    float transmission = 0;
    float ior = 1.5f;
    float specular = 1;
    Rgb specularColour{1, 1, 1};
    float clearcoat = 0;
    float clearcoatRoughness = 0;
    const AlbedoTable* albedoTable = nullptr;  ///< of this ior; required
    const GlassTable* glassTable = nullptr;    ///< of this ior; without it rough glass loses a little energy
};

/// f |cos wi| and the density (per solid angle) with which sample() chooses wi, both without delta lobes.
struct BsdfValue {
    Rgb value;
    float pdf = 0;
};

struct BsdfSample {
    Vec3 wi;             ///< local
    Rgb weight;          ///< f |cos wi| / pdf; 0: the path ends here
    float pdf = 0;       ///< of all lobes together; meaningless for delta lobes
    bool delta = false;  ///< perfectly smooth reflection or refraction
};

/// Scattering at a point of a glTF surface, in the local frame whose z axis is the shading normal on the
/// viewer's side: wo.z > 0. `wo` points to the viewer, `wi` to the light.
///
///     f = coat + (1 - Ec(wo)) [ metallic and dielectric reflection + diffuse + glass ]
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
/// - glass (weight (1-metallic) transmission): reflection and refraction by the exact Fresnel term,
/// refraction
///   tinted by the base colour; rough glass is divided by its single-scattering albedo. The surface bounds a
///   solid: light refracts on entering and on leaving. What is carried is basic radiance L / n^2, n being the
///   index of the medium, which refraction leaves as it is; emission is given in it too.
/// - coat: GGX of index 1.5, Ec its albedo times the clearcoat factor. Scaling by the view direction only
///   keeps energy for every base, at the price of reciprocity: f(wo, wi) has wo towards the camera.
class Bsdf {
  public:
    /// `fromInside`: wo is on the back of the surface (matters to glass only).
    /// `coatTable`: of index 1.5.
    Bsdf(const SurfaceParameters& surface, const Vec3& wo, bool fromInside, const AlbedoTable& coatTable);

    BsdfValue evaluate(const Vec3& wi) const;
    /// `direction` chooses within the lobe, `choice` the lobe.
    BsdfSample sample(Vec2 direction, float choice) const;

    /// Estimate of the reflectance (transmission included) towards wo.
    const Rgb& albedo() const { return albedo_; }
    /// Whether there is a lobe that is not a delta function, so that lights can be sampled.
    bool hasSmoothLobe() const { return !onlyDelta_; }
    /// The coat's part of what leaves towards wo: emission from below is scaled by 1 - coatAlbedo().
    float coatAlbedo() const { return coatAlbedo_; }

  private:
    enum Lobe : std::size_t { kCoat, kReflection, kDiffuse, kGlass, kLobes };

    struct Microfacet;

    Rgb baseFresnel(float cosH) const;
    float coatFresnel(float cosH) const;
    BsdfValue baseReflection(const Vec3& wi) const;
    BsdfValue coatReflection(const Vec3& wi) const;
    BsdfValue diffuse(float cosI) const;
    BsdfValue glass(const Vec3& wi) const;
    Rgb dielectricAlbedo(const Albedo& a) const;
    struct GlassSplit {
        Rgb reflected;
        Rgb transmitted;
        float reflectProbability;
    };
    GlassSplit splitAt(float cosH) const;
    BsdfSample mirror(const Rgb& weight) const;
    BsdfSample sampleMicrofacet(float alpha, Vec2 u) const;
    BsdfSample sampleGlass(Vec2 u, float choice) const;
    BsdfSample finish(const Vec3& wi) const;

    Vec3 wo_;
    float alpha_;
    float coatAlpha_;
    float lambdaO_ = 0;      ///< of the base's GGX at wo
    float coatLambdaO_ = 0;  ///< of the coat's
    bool smooth_;            ///< the base reflects as a delta function
    bool coatSmooth_;
    bool glassSmooth_;
    bool onlyDelta_;

    float coat_;  ///< clearcoat factor
    float coatAlbedo_ = 0;
    float base_;    ///< 1 - coatAlbedo_
    float metal_;   ///< how much of each there is: metal,
    float opaque_;  ///< opaque dielectric
    Rgb metalF0_;
    Rgb dielectricF0_;
    float dielectricF90_;
    Rgb dielectricMultiple_;  ///< Kulla and Conty's factor of the dielectric
    Rgb multiple_;            ///< factor of the multiple-scattering lobe, everything but (1 - whole(wi))
    Rgb diffuse_;             ///< factor of the diffuse lobe, everything but (1 - Ed(wi))
    float glassWeight_;       ///< includes the multiple-scattering compensation
    Rgb glassTint_;
    float ior_;
    float eta_;  ///< far side over near side
    float exactF0_;
    AlbedoTable::Row row_;
    Rgb albedo_;
    std::array<float, kLobes> probability_{};
};

}  // namespace vlx::render
