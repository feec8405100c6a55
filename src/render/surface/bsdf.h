#pragma once

#include <algorithm>
#include <cmath>

#include "render/plan/effect_counters.h"
#include "render/surface/bsdf_energy.h"
#include "render/surface/bsdf_model.h"

/// Values and samples of the surface model that bsdf_model.h describes.
namespace vlx::render {

template <Features F>
Rgb BasicBsdf<F>::baseFresnel(float cosH) const {
    Rgb f;
    if (metal_ > 0) f += lerp(metalF0_, Rgb(1), schlickWeight(cosH)) * metal_;
    if (opaque_ > 0)
        f += lerp(layer_.f0, Rgb(layer_.f90), dielectricWeight(cosH, ior_, layer_.exactF0)) * opaque_;
    return f * base_;
}

template <Features F>
float BasicBsdf<F>::coatFresnel(float cosH) const {
    return coat_ * dielectricFresnel(cosH, kCoatIor);
}

template <Features F>
typename BasicBsdf<F>::GlassSplit BasicBsdf<F>::splitAt(float cosH) const {
    const float exact = dielectricFresnel(cosH, eta_);
    const Rgb r = lerp(layer_.f0, Rgb(layer_.f90), dielectricWeight(cosH, eta_, layer_.exactF0));
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

template <Features F>
float BasicBsdf<F>::retroFactor(const Vec3& wi) const {
    const float more = retroRoughness_ * (1 + dot(wo_, wi)) - 0.5f;
    return (1 + more * schlickWeight(wo_.z)) * (1 + more * schlickWeight(wi.z));
}

/// Diffuse and multiple-scattering lobes: cosine-sampled.
template <Features F>
BsdfValue BasicBsdf<F>::diffuse(const Vec3& wi) const {
    if (!isBlack(diffuse_)) countEffect(Effect::Diffuse);
    const float pdf = wi.z * kInvPi;
    const bool retro = retroRoughness_ >= 0;
    const Rgb body = retro ? diffuse_ * retroFactor(wi) : diffuse_;
    if constexpr (!F.reflection) return {body * pdf, pdf};
    const Albedo atI = layer_.row.at(wi.z);
    const Rgb entering = retro ? Rgb(1) : Rgb(1) - layer_.albedo(atI);
    const Rgb f = body * entering + multiple_ * (1 - atI.whole);
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
        if (probability_[kDiffuse] > 0) add(kImage ? BsdfValue{{}, wi.z * kInvPi} : diffuse(wi), kDiffuse);
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

}  // namespace vlx::render
