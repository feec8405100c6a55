#pragma once

#include <algorithm>
#include <cmath>

#include "render/plan/effect_counters.h"
#include "render/surface/bsdf_model.h"

/// How much energy each lobe of a surface gets towards the viewer: what a BSDF is set up with.
namespace vlx::render {

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

inline DielectricLayer::DielectricLayer(const SurfaceParameters& s)
    : row(s.albedoTable->row(s.roughness)),
      exactF0(normalReflectance(s.ior)),
      f0(minimum(s.specularColour * exactF0, 1.f) * s.specular),
      f90(s.specular),
      multiple(multipleColour(lerp(f0, Rgb(f90), s.albedoTable->meanWeight()), row.mean().whole)),
      mean(albedo(row.mean())),
      rest(inverseRest(mean)) {}

template <Features F>
BasicBsdf<F>::BasicBsdf(const SurfaceParameters& s, const Vec3& wo, bool fromInside,
                        const AlbedoTable& coatTable, const Vec3& trueNormal)
    : wo_(wo),
      up_(trueNormal),
      layer_(layerOf(s)),
      alpha_(square(s.roughness)),
      coatAlpha_(square(s.clearcoatRoughness)),
      retroRoughness_(s.retro ? s.roughness : -1),
      smooth_(alpha_ < kSmoothAlpha),
      coatSmooth_(coatAlpha_ < kSmoothAlpha),
      coat_(s.clearcoat),
      metal_(s.metallic),
      metalF0_(s.baseColour),
      glassTint_(s.baseColour),
      ior_(s.ior),
      eta_(fromInside ? 1 / s.ior : s.ior) {
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
    const Albedo atO = layer_.row.at(cosO);
    const float meanWhole = layer_.row.mean().whole;
    Rgb colour = layer_.multiple * opaque_;
    if (metal_ > 0) {
        const Rgb metalMean = lerp(metalF0_, Rgb(1), 1.f / 21.f);  // of Schlick's curve
        colour = multipleColour(metalMean, meanWhole) * metal_ + colour;
    }
    const Rgb again = colour * ((1 - atO.whole) * base_);
    multiple_ = again * inverseRest(meanWhole);
    const Rgb entering = Rgb(1) - layer_.albedo(atO);
    const Rgb body =
        (s.retro ? minimum(s.baseColour, 1.f) : minimum(s.baseColour * layer_.rest, 1.f) * entering) *
        (opaque_ * base_);
    diffuse_ = s.retro ? body : body * layer_.rest;

    // Smooth glass without a change of index neither bends nor spreads light.
    glassSmooth_ = smooth_ || std::abs(eta_ - 1) < 1e-3f;
    glassWeight_ = glass * base_;
    if (F.glass && glassWeight_ > 0 && !glassSmooth_ && s.glassTable != nullptr)
        glassWeight_ /= std::max(0.05f, s.glassTable->kept(cosO, s.roughness, fromInside));

    // Energy of each lobe towards wo: the probability of choosing it.
    const Rgb dielectricSingle = layer_.f0 * (atO.whole - atO.dielectric) + Rgb(layer_.f90 * atO.dielectric);
    Rgb single = dielectricSingle * opaque_;
    if (metal_ > 0) single = (metalF0_ * (atO.whole - atO.conductor) + Rgb(atO.conductor)) * metal_ + single;
    single *= base_;
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
        const Albedo above = layer_.row.meanAbove(up_.z);
        const Rgb entering =
            retroRoughness_ < 0 ? (Rgb(1) - layer_.mean) * inverseRest(layer_.albedo(above)) : Rgb(1);
        diffuse_ *= entering * whole;
        multiple_ *= (1 - layer_.row.mean().whole) * inverseRest(above.whole) * whole;
    }
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
