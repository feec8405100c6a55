#pragma once

#include <array>

#include "render/math/sampling.h"
#include "render/math/vec.h"
#include "render/plan/effect_counters.h"
#include "render/plan/kernel_features.h"
#include "render/surface/energy_tables.h"
#include "render/surface/sheen.h"

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
    Rgb sheenColour{0, 0, 0};
    float sheenRoughness = 0;
    EffectSet leftOut;  ///< of diffuse, glossy, mirror, transmission, rough transmission
    const AlbedoTable* albedoTable = nullptr;  ///< of this ior; required
    const SheenTable* sheenTable = nullptr;    ///< required where there is sheen
    const GlassTable* glassTable = nullptr;    ///< of this ior; without it rough glass loses a little energy
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
    BsdfValue diffuse(float cosI) const;
    BsdfValue glass(const Vec3& wi) const;
    BsdfValue sheen(const Vec3& wi) const;
    void leaveOut(const EffectSet& effects);
    void leaveAbove();
    void setReflecting(const SurfaceParameters& s, bool fromInside, float glass, float sheenEnergy);
    Rgb dielectricAlbedo(const Albedo& a) const;
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

    Vec3 wo_;
    Vec3 up_;  ///< the true normal
    float alpha_;
    float coatAlpha_;
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
    Rgb dielectricF0_;
    float dielectricF90_ = 0;
    Rgb dielectricMultiple_;  ///< Kulla and Conty's factor of the dielectric
    Rgb multiple_;            ///< factor of the multiple-scattering lobe, everything but (1 - whole(wi))
    Rgb diffuse_;             ///< factor of the diffuse lobe, everything but (1 - Ed(wi))
    float glassWeight_ = 0;   ///< includes the multiple-scattering compensation
    Rgb glassTint_;
    float ior_;
    float eta_;  ///< far side over near side
    float exactF0_;
    AlbedoTable::Row row_;
    Rgb albedo_;
    std::array<float, kLobes> probability_{};
};

/// Of any surface.
using Bsdf = BasicBsdf<kEveryFeature>;

inline constexpr float kCoatIor = 1.5f;
inline constexpr float kCoatF0 = 0.04f;

inline Rgb lerp(const Rgb& a, const Rgb& b, float t) { return a * (1 - t) + b * t; }

inline Rgb minimum(const Rgb& a, float b) { return {std::min(a.x, b), std::min(a.y, b), std::min(a.z, b)}; }

/// Kulla and Conty's colour of light that scattered more than once: with F the mean reflectance and E the
/// mean albedo, F^2 E / (1 - F (1 - E)) (as corrected in their course notes). 1 for F = 1.
inline Rgb multipleColour(const Rgb& meanReflectance, float meanWhole) {
    return meanReflectance * meanReflectance * meanWhole / (Rgb(1) - meanReflectance * (1 - meanWhole));
}

/// 1 / (1 - x), bounded: where x is 1 the lobe it scales is 0.
inline float inverseRest(float x) { return 1 / std::max(1 - x, 1e-4f); }
inline Rgb inverseRest(const Rgb& c) { return {inverseRest(c.x), inverseRest(c.y), inverseRest(c.z)}; }

template <Features F>
BasicBsdf<F>::BasicBsdf(const SurfaceParameters& s, const Vec3& wo, bool fromInside,
                        const AlbedoTable& coatTable, const Vec3& trueNormal)
    : wo_(wo),
      up_(trueNormal),
      alpha_(square(s.roughness)),
      coatAlpha_(square(s.clearcoatRoughness)),
      smooth_(alpha_ < kSmoothAlpha),
      coatSmooth_(coatAlpha_ < kSmoothAlpha),
      coat_(s.clearcoat),
      metal_(s.metallic),
      metalF0_(s.baseColour),
      glassTint_(s.baseColour),
      ior_(s.ior),
      eta_(fromInside ? 1 / s.ior : s.ior),
      exactF0_(normalReflectance(s.ior)),
      row_(s.albedoTable->row(s.roughness)) {
    const float cosO = wo.z;
    if (F.layers && coat_ > 0) {
        countEffect(Effect::Clearcoat);
        const Albedo a = coatTable.row(s.clearcoatRoughness).at(cosO);
        coatAlbedo_ = coat_ * (kCoatF0 * (a.whole - a.dielectric) + a.dielectric);
        if (!coatSmooth_) coatLambdaO_ = Ggx{coatAlpha_}.lambda(wo);
    }
    base_ = 1 - coatAlbedo_;
    float sheenEnergy = 0;
    if (F.layers && !isBlack(s.sheenColour)) {
        countEffect(Effect::Sheen);
        sheenRoughness_ = s.sheenRoughness;
        const float albedo = s.sheenTable->albedo(cosO, sheenRoughness_);
        sheen_ = s.sheenColour * (base_ / std::max(1.f, albedo));
        sheenEnergy = maxComponent(sheen_) * albedo;
        base_ -= sheenEnergy;
    }
    if constexpr (F.reflection)
        if (!smooth_) lambdaO_ = Ggx{alpha_}.lambda(wo);

    const float glass = F.glass ? (1 - metal_) * s.transmission : 0;
    opaque_ = 1 - metal_ - glass;
    if constexpr (!F.reflection) {
        // What follows for surfaces that do not reflect.
        diffuse_ = minimum(s.baseColour, 1.f) * (opaque_ * base_);
        albedo_ = Rgb(coatAlbedo_ + sheenEnergy) + diffuse_;
        probability_ = {coatAlbedo_, 0, maxComponent(diffuse_), 0, sheenEnergy};
    } else {
        setReflecting(s, fromInside, glass, sheenEnergy);
    }
    if constexpr (F.rare)
        if (!s.leftOut.none()) leaveOut(s.leftOut);
    constexpr float kUpright = 0.9999f;  // closer, and less than 1e-4 of a lobe is beneath
    if (up_.z < kUpright) leaveAbove();
    if constexpr (!F.reflection) {
        if (probability_[kDiffuse] > 0) probability_[kDiffuse] = 1;  // alone
    } else {
        float total = 0;
        for (const float p : probability_) total += p;
        for (float& p : probability_) p = total > 0 ? p / total : 0;
    }
    onlyDelta_ = (probability_[kCoat] == 0 || coatSmooth_) && (probability_[kReflection] == 0 || smooth_) &&
                 probability_[kDiffuse] == 0 && (probability_[kGlass] == 0 || glassSmooth_) &&
                 probability_[kSheen] == 0;
}

/// Everything but coat and sheen, and the probabilities of all lobes, not yet normalised.
template <Features F>
void BasicBsdf<F>::setReflecting(const SurfaceParameters& s, bool fromInside, float glass,
                                 float sheenEnergy) {
    const float cosO = wo_.z;
    dielectricF0_ = minimum(s.specularColour * exactF0_, 1.f) * s.specular;
    dielectricF90_ = s.specular;

    const Albedo atO = row_.at(cosO);
    const Albedo& mean = row_.mean();
    const Rgb dielectricMean = lerp(dielectricF0_, Rgb(dielectricF90_), s.albedoTable->meanWeight());
    const Rgb metalMean = lerp(metalF0_, Rgb(1), 1.f / 21.f);  // of Schlick's curve
    dielectricMultiple_ = multipleColour(dielectricMean, mean.whole);
    const Rgb again = (multipleColour(metalMean, mean.whole) * metal_ + dielectricMultiple_ * opaque_) *
                      ((1 - atO.whole) * base_);
    multiple_ = again * inverseRest(mean.whole);
    const Rgb entering = Rgb(1) - dielectricAlbedo(atO);
    const Rgb meanDielectric = dielectricAlbedo(mean);
    const Rgb rest = inverseRest(meanDielectric);
    const Rgb body = minimum(s.baseColour * rest, 1.f) * entering * (opaque_ * base_);
    diffuse_ = body * rest;

    // Smooth glass without a change of index neither bends nor spreads light.
    glassSmooth_ = smooth_ || std::abs(eta_ - 1) < 1e-3f;
    glassWeight_ = glass * base_;
    if (F.glass && glassWeight_ > 0 && !glassSmooth_ && s.glassTable != nullptr)
        glassWeight_ /= std::max(0.05f, s.glassTable->kept(cosO, s.roughness, fromInside));

    // Energy of each lobe towards wo: the probability of choosing it.
    const Rgb metalSingle = metalF0_ * (atO.whole - atO.conductor) + Rgb(atO.conductor);
    const Rgb dielectricSingle =
        dielectricF0_ * (atO.whole - atO.dielectric) + Rgb(dielectricF90_ * atO.dielectric);
    const Rgb single = (metalSingle * metal_ + dielectricSingle * opaque_) * base_;
    const Rgb spread = body + again;
    Rgb through;
    if (F.glass && glass > 0) {
        const GlassSplit split = splitAt(cosO);
        through = (split.reflected + split.transmitted) * (glass * base_);
    }
    albedo_ = Rgb(coatAlbedo_ + sheenEnergy) + single + spread + through;
    probability_ = {coatAlbedo_, maxComponent(single), maxComponent(spread), maxComponent(through),
                    sheenEnergy};
}

/// Diffuse lobes send all their light above the true surface.
template <Features F>
void BasicBsdf<F>::leaveAbove() {
    const float whole = 2 / (1 + up_.z);  // of a cosine lobe over what is above
    if constexpr (!F.reflection) {
        diffuse_ *= whole;
    } else {
        const Albedo& mean = row_.mean();
        const Albedo above = row_.meanAbove(up_.z);
        diffuse_ *= (Rgb(1) - dielectricAlbedo(mean)) * inverseRest(dielectricAlbedo(above)) * whole;
        multiple_ *= (1 - mean.whole) * inverseRest(above.whole) * whole;
    }
}

/// Albedo of the dielectric layer, multiple scattering included.
template <Features F>
Rgb BasicBsdf<F>::dielectricAlbedo(const Albedo& a) const {
    return dielectricF0_ * (a.whole - a.dielectric) + Rgb(dielectricF90_ * a.dielectric) +
           dielectricMultiple_ * (1 - a.whole);
}

template <Features F>
Rgb BasicBsdf<F>::baseFresnel(float cosH) const {
    Rgb f;
    if (metal_ > 0) f += lerp(metalF0_, Rgb(1), schlickWeight(cosH)) * metal_;
    if (opaque_ > 0)
        f += lerp(dielectricF0_, Rgb(dielectricF90_), dielectricWeight(cosH, ior_, exactF0_)) * opaque_;
    return f * base_;
}

template <Features F>
float BasicBsdf<F>::coatFresnel(float cosH) const {
    return coat_ * dielectricFresnel(cosH, kCoatIor);
}

template <Features F>
typename BasicBsdf<F>::GlassSplit BasicBsdf<F>::splitAt(float cosH) const {
    const float exact = dielectricFresnel(cosH, eta_);
    const Rgb r = lerp(dielectricF0_, Rgb(dielectricF90_), dielectricWeight(cosH, eta_, exactF0_));
    const Rgb t = exact < 1 ? (Rgb(1) - r) * glassTint_ : Rgb(0);
    const float toReflect = maxComponent(r), toTransmit = maxComponent(t);
    const float total = toReflect + toTransmit;
    return {r, t, total > 0 ? toReflect / total : 1};
}

/// GGX without its Fresnel factor, and the cosine of half the angle between wo and wi (wi.z > 0).
template <Features F>
struct BasicBsdf<F>::Microfacet {
    Microfacet(float alpha, float lambdaO, const Vec3& wo, const Vec3& wi) {
        const Ggx ggx{alpha};
        const Vec3 h = normalized(wo + wi);
        cosH = dot(wi, h);
        const float common = ggx.d(h) / (4 * wo.z);
        value = common / (1 + lambdaO + ggx.lambda(wi));
        pdf = common / (1 + lambdaO);
    }
    float cosH, value, pdf;
};

template <Features F>
BsdfValue BasicBsdf<F>::baseReflection(const Vec3& wi) const {
    countEffect(Effect::Glossy);
    const Microfacet m(alpha_, lambdaO_, wo_, wi);
    return {baseFresnel(m.cosH) * m.value, m.pdf};
}

template <Features F>
BsdfValue BasicBsdf<F>::coatReflection(const Vec3& wi) const {
    countEffect(Effect::Glossy);
    const Microfacet m(coatAlpha_, coatLambdaO_, wo_, wi);
    return {Rgb(coatFresnel(m.cosH) * m.value), m.pdf};
}

/// Diffuse and multiple-scattering lobes: cosine-sampled.
template <Features F>
BsdfValue BasicBsdf<F>::diffuse(float cosI) const {
    if (!isBlack(diffuse_)) countEffect(Effect::Diffuse);
    if constexpr (!F.reflection) {
        const float pdf = cosI * kInvPi;
        return {diffuse_ * pdf, pdf};
    }
    const Albedo atI = row_.at(cosI);
    const Rgb f = diffuse_ * (Rgb(1) - dielectricAlbedo(atI)) + multiple_ * (1 - atI.whole);
    const float pdf = cosI * kInvPi;
    return {f * pdf, pdf};
}

template <Features F>
BsdfValue BasicBsdf<F>::glass(const Vec3& wi) const {
    countEffect(wi.z > 0 ? Effect::Glossy : Effect::RoughTransmission);
    const Ggx ggx{alpha_};
    const float lambdaI = ggx.lambda(wi);
    const float g1 = 1 / (1 + lambdaO_), g2 = 1 / (1 + lambdaO_ + lambdaI);
    if (wi.z > 0) {
        const Vec3 h = normalized(wo_ + wi);
        const GlassSplit split = splitAt(dot(wo_, h));
        const float common = ggx.d(h) / (4 * wo_.z);
        return {split.reflected * (glassWeight_ * common * g2), split.reflectProbability * common * g1};
    }
    Vec3 h = normalized(wo_ + wi * eta_);
    if (h.z < 0) h = -h;
    const float cosO = dot(wo_, h), cosI = dot(wi, h);
    if (cosO <= 0 || cosI >= 0) return {};
    const GlassSplit split = splitAt(cosO);
    const float jacobian = eta_ * eta_ * -cosI / square(cosO + eta_ * cosI);  // |dh/dwi|
    const float common = ggx.d(h) * cosO / wo_.z * jacobian;
    return {split.transmitted * (glassWeight_ * common * g2), (1 - split.reflectProbability) * common * g1};
}

/// All smooth lobes at wi, which may be the image of the direction that is asked for.
template <Features F>
template <bool kImage>
BsdfValue BasicBsdf<F>::lobes(const Vec3& wi) const {
    BsdfValue sum;
    const auto add = [&](const BsdfValue& v, Lobe lobe) {
        sum.value += v.value;
        sum.pdf += v.pdf * probability_[lobe];
    };
    if (wi.z > 0) {
        if (probability_[kDiffuse] > 0) add(kImage ? BsdfValue{{}, wi.z * kInvPi} : diffuse(wi.z), kDiffuse);
        if (F.reflection && probability_[kReflection] > 0 && !smooth_) add(baseReflection(wi), kReflection);
        if (F.layers && probability_[kCoat] > 0 && !coatSmooth_) add(coatReflection(wi), kCoat);
        if (F.layers && probability_[kSheen] > 0) add(sheen(wi), kSheen);
    }
    if (F.glass && probability_[kGlass] > 0 && !glassSmooth_) add(glass(wi), kGlass);
    return sum;
}

template <Features F>
BsdfValue BasicBsdf<F>::evaluate(const Vec3& wi) const {
    const float side = dot(wi, up_);
    if (!(wi.z * side > 0)) return {};
    BsdfValue sum = lobes<false>(wi);
    const Vec3 image = imageOf(wi);
    if (image.z * side > 0) {
        const BsdfValue folded = lobes<true>(image);
        sum.value += folded.value;
        sum.pdf += folded.pdf;
    }
    return sum;
}

/// The sample of a direction that some smooth lobe chose: weighed by all of them.
template <Features F>
BsdfSample BasicBsdf<F>::finish(Vec3 wi, bool through) const {
    if ((dot(wi, up_) < 0) != through) wi = imageOf(wi);
    const BsdfValue v = evaluate(wi);
    if (!(v.pdf > 0)) return {};
    return {.wi = wi, .weight = v.value / v.pdf, .pdf = v.pdf, .through = through};
}

/// A delta lobe's sample on the side of the true surface where it belongs.
template <Features F>
BsdfSample BasicBsdf<F>::settled(BsdfSample s) const {
    s.delta = true;
    s.folded = (dot(s.wi, up_) < 0) != s.through;
    if (s.folded) s.wi = imageOf(s.wi);
    return s;
}

template <Features F>
BsdfSample BasicBsdf<F>::mirror(const Rgb& weight, bool coat) const {
    countEffect(Effect::Mirror);
    return settled({.wi = {-wo_.x, -wo_.y, wo_.z}, .weight = weight, .coat = coat});
}

template <Features F>
BsdfSample BasicBsdf<F>::sampleMicrofacet(float alpha, Vec2 u) const {
    const Vec3 wi = reflected(wo_, Ggx{alpha}.sampleVisible(wo_, u));
    return wi.z > 0 ? finish(wi, false) : BsdfSample{};
}

template <Features F>
BsdfSample BasicBsdf<F>::sampleGlass(Vec2 u, float choice) const {
    const Vec3 h = glassSmooth_ ? Vec3{0, 0, 1} : Ggx{alpha_}.sampleVisible(wo_, u);
    const GlassSplit split = splitAt(dot(wo_, h));
    const bool reflects = choice < split.reflectProbability;
    const Vec3 wi = reflects ? reflected(wo_, h) : refracted(wo_, h, eta_);
    if (reflects ? wi.z <= 0 : wi.z >= 0) return {};
    if (!glassSmooth_) return finish(wi, !reflects);
    countEffect(reflects ? Effect::Mirror : Effect::Transmission);
    const float scale = glassWeight_ / probability_[kGlass];
    const Rgb weight = reflects ? split.reflected * (scale / split.reflectProbability)
                                : split.transmitted * (scale / (1 - split.reflectProbability));
    return settled({.wi = wi, .weight = weight, .through = !reflects});
}

template <Features F>
BsdfSample BasicBsdf<F>::sample(Vec2 direction, float choice) const {
    if constexpr (!F.reflection)
        return probability_[kDiffuse] > 0 ? finish(cosineHemisphere(direction), false) : BsdfSample{};
    float rest = choice;
    if (rest < probability_[kDiffuse]) return finish(cosineHemisphere(direction), false);
    rest -= probability_[kDiffuse];
    if constexpr (F.reflection) {
        if (rest < probability_[kReflection])
            return smooth_ ? mirror(baseFresnel(wo_.z) / probability_[kReflection], false)
                           : sampleMicrofacet(alpha_, direction);
        rest -= probability_[kReflection];
    }
    if constexpr (F.layers) {
        if (rest < probability_[kSheen]) return finish(cosineHemisphere(direction), false);
        rest -= probability_[kSheen];
        if (rest < probability_[kCoat])
            return coatSmooth_ ? mirror(Rgb(coatFresnel(wo_.z) / probability_[kCoat]), true)
                               : sampleMicrofacet(coatAlpha_, direction);
        rest -= probability_[kCoat];
    }
    if constexpr (F.glass)
        if (probability_[kGlass] > 0)
            return sampleGlass(direction, std::min(rest / probability_[kGlass], 0x1.fffffep-1f));
    return {};
}

template <Features F>
BsdfValue BasicBsdf<F>::sheen(const Vec3& wi) const {
    const float pdf = wi.z * kInvPi;
    return {sheen_ * (charlieSheen(wo_, wi, sheenRoughness_) * wi.z), pdf};
}

/// Lobes of effects that are left out are neither chosen nor added.
template <Features F>
void BasicBsdf<F>::leaveOut(const EffectSet& effects) {
    const auto drop = [&](Effect effect, Lobe lobe) {
        if (effects.has(effect)) probability_[lobe] = 0;
    };
    // The lobe of diffuse light carries the reflection's multiple scattering too.
    if (effects.has(Effect::Diffuse)) diffuse_ = {};
    if (effects.has(Effect::Glossy)) multiple_ = {};
    if (isBlack(diffuse_) && isBlack(multiple_)) probability_[kDiffuse] = 0;
    drop(smooth_ ? Effect::Mirror : Effect::Glossy, kReflection);
    drop(coatSmooth_ ? Effect::Mirror : Effect::Glossy, kCoat);
    drop(glassSmooth_ ? Effect::Transmission : Effect::RoughTransmission, kGlass);
}

}  // namespace vlx::render
