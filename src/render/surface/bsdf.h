#pragma once

#include <algorithm>
#include <cmath>

#include "render/plan/effect_counters.h"
#include "render/surface/bsdf_energy.h"
#include "render/surface/bsdf_model.h"

/// Values and samples of the surface model that bsdf_model.h describes.
namespace vlx::render {

template <Features F, class Real>
RgbOf<Real> BasicBsdf<F, Real>::baseFresnel(Real cosH) const {
    Colour f;
    if (const Mask<Real> metal = metal_ > 0; any(metal))
        f += select(metal, lerp(metalF0_, white<Real>(), schlickWeight(cosH)) * metal_, Colour{});
    if (const Mask<Real> opaque = opaque_ > 0; any(opaque)) {
        const Real weight = dielectricWeight(cosH, ior_, layer_.exactF0);
        f += select(opaque, lerp(layer_.f0, Colour(layer_.f90), weight) * opaque_, Colour{});
    }
    return f * base_;
}

template <Features F, class Real>
float BasicBsdf<F, Real>::coatFresnel(float cosH) const {
    return coat_ * dielectricFresnel(cosH, kCoatIor);
}

template <Features F, class Real>
typename BasicBsdf<F, Real>::GlassSplit BasicBsdf<F, Real>::splitAt(float cosH) const {
    const float exact = dielectricFresnel(cosH, eta_);
    const Rgb r = lerp(layer_.f0, Rgb(layer_.f90), dielectricWeight(cosH, eta_, layer_.exactF0));
    const Rgb t = exact < 1 ? (Rgb(1) - r) * glassTint_ : Rgb(0);
    const float toReflect = maxComponent(r), toTransmit = maxComponent(t);
    const float total = toReflect + toTransmit;
    return {r, t, total > 0 ? toReflect / total : 1};
}

/// GGX without its Fresnel factor, and the cosine of half the angle between wo and wi (wi.z > 0).
template <Features F, class Real>
struct BasicBsdf<F, Real>::Microfacet {
    Microfacet(Real alpha, Real lambdaO, const Vector& wo, const Vector& wi) {
        const GgxOf<Real> ggx{alpha};
        const Vector h = normalized(wo + wi);
        cosH = dot(wi, h);
        const Real common = ggx.d(h) / (4.f * wo.z);
        value = common / (1.f + lambdaO + ggx.lambda(wi));
        pdf = common / (1.f + lambdaO);
    }
    Real cosH, value, pdf;
};

template <Features F, class Real>
BsdfValueOf<Real> BasicBsdf<F, Real>::baseReflection(const Vector& wi) const {
    countEffect(Effect::Glossy);
    const Microfacet m(alpha_, lambdaO_, wo_, wi);
    return {baseFresnel(m.cosH) * m.value, m.pdf};
}

template <Features F, class Real>
BsdfValue BasicBsdf<F, Real>::coatReflection(const Vec3& wi) const {
    countEffect(Effect::Glossy);
    const Microfacet m(coatAlpha_, coatLambdaO_, wo_, wi);
    return {Rgb(coatFresnel(m.cosH) * m.value), m.pdf};
}

template <Features F, class Real>
Real BasicBsdf<F, Real>::retroFactor(const Vector& wi) const {
    const Real more = retroRoughness_ * (1.f + dot(wo_, wi)) - 0.5f;
    return (1.f + more * schlickWeight(wo_.z)) * (1.f + more * schlickWeight(wi.z));
}

/// Diffuse and multiple-scattering lobes: cosine-sampled.
template <Features F, class Real>
BsdfValueOf<Real> BasicBsdf<F, Real>::diffuse(const Vector& wi) const {
    if (!all(isBlack(diffuse_))) countEffect(Effect::Diffuse);
    const Real pdf = wi.z * kInvPi;
    const Mask<Real> retro = retroRoughness_ >= 0;
    const Colour body = any(retro) ? select(retro, diffuse_ * retroFactor(wi), diffuse_) : diffuse_;
    if constexpr (!F.reflection) return {body * pdf, pdf};
    const auto atI = layer_.row.at(wi.z);
    const Colour entering = select(retro, white<Real>(), white<Real>() - layer_.albedo(atI));
    const Colour f = body * entering + multiple_ * (1.f - atI.whole);
    return {f * pdf, pdf};
}

template <Features F, class Real>
BsdfValue BasicBsdf<F, Real>::glass(const Vec3& wi) const {
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
template <Features F, class Real>
template <bool kImage>
BsdfValueOf<Real> BasicBsdf<F, Real>::lobes(const Vector& wi) const {
    Value sum;
    const auto add = [&](Mask<Real> there, const Value& v, Lobe lobe) {
        sum.value += select(there, v.value, Colour{});
        sum.pdf += there ? v.pdf * probability_[lobe] : Real{};
    };
    const Mask<Real> above = wi.z > 0;
    const auto has = [&](Lobe lobe) -> Mask<Real> { return above && probability_[lobe] > 0; };
    if (const Mask<Real> there = has(kDiffuse); any(there))
        add(there, kImage ? Value{{}, wi.z * kInvPi} : diffuse(wi), kDiffuse);
    if constexpr (F.reflection)
        if (const Mask<Real> there = has(kReflection) && !smooth_; any(there))
            add(there, baseReflection(wi), kReflection);
    if constexpr (F.layers) {
        if (has(kCoat) && !coatSmooth_) add(true, coatReflection(wi), kCoat);
        if (has(kSheen)) add(true, sheen(wi), kSheen);
    }
    if constexpr (F.glass)
        if (probability_[kGlass] > 0 && !glassSmooth_) add(true, glass(wi), kGlass);
    return sum;
}

template <Features F, class Real>
BsdfValueOf<Real> BasicBsdf<F, Real>::evaluate(const Vector& wi) const {
    const Real side = dot(wi, up_);
    const Mask<Real> seen = wi.z * side > 0;
    if (!any(seen)) return {};
    Value sum = lobes<false>(wi);
    const Vector image = imageOf(wi);
    if (const Mask<Real> folds = image.z * side > 0; any(folds)) {
        const Value folded = lobes<true>(image);
        sum.value += select(folds, folded.value, Colour{});
        sum.pdf += folds ? folded.pdf : Real{};
    }
    return {select(seen, sum.value, Colour{}), seen ? sum.pdf : Real{}};
}

/// The sample of a direction that some smooth lobe chose: weighed by all of them.
template <Features F, class Real>
BsdfSampleOf<Real> BasicBsdf<F, Real>::finish(Vector wi, Mask<Real> through) const {
    const Mask<Real> beneath = dot(wi, up_) < 0;
    if (const Mask<Real> folds = beneath != through; any(folds)) wi = select(folds, imageOf(wi), wi);
    const Value v = evaluate(wi);
    const Mask<Real> there = v.pdf > 0;
    if (!any(there)) return {};
    return {.wi = wi, .weight = select(there, v.value / v.pdf, Colour{}), .pdf = v.pdf, .through = through};
}

/// A delta lobe's sample on the side of the true surface where it belongs.
template <Features F, class Real>
BsdfSampleOf<Real> BasicBsdf<F, Real>::settled(Sample s) const {
    s.delta = Real{} == 0;
    const Mask<Real> beneath = dot(s.wi, up_) < 0;
    s.folded = beneath != s.through;
    s.wi = select(s.folded, imageOf(s.wi), s.wi);
    return s;
}

template <Features F, class Real>
BsdfSampleOf<Real> BasicBsdf<F, Real>::mirror(const Colour& weight, bool coat) const {
    countEffect(Effect::Mirror);
    return settled(
        {.wi = {-wo_.x, -wo_.y, wo_.z}, .weight = weight, .coat = coat ? Real{} == 0 : Mask<Real>{}});
}

template <Features F, class Real>
BsdfSample BasicBsdf<F, Real>::sampleMicrofacet(float alpha, Vec2 u) const {
    const Vec3 wi = reflected(wo_, Ggx{alpha}.sampleVisible(wo_, u));
    return wi.z > 0 ? finish(wi, false) : BsdfSample{};
}

template <Features F, class Real>
BsdfSample BasicBsdf<F, Real>::sampleGlass(Vec2 u, float choice) const {
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

template <Features F, class Real>
BsdfSample BasicBsdf<F, Real>::sample(Vec2 direction, float choice) const requires std::same_as<Real, float> {
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

template <Features F, class Real>
BsdfValue BasicBsdf<F, Real>::sheen(const Vec3& wi) const {
    const float pdf = wi.z * kInvPi;
    return {sheen_ * (charlieSheen(wo_, wi, sheenRoughness_) * wi.z), pdf};
}

/// Four at once: of diffuse light, and of the base's reflection where there is one.
template <Features F, class Real>
BsdfSampleOf<Real> BasicBsdf<F, Real>::sample(const Vec2Of<Lanes>& direction,
                                              Lanes choice) const requires std::same_as<Real, Lanes> {
    if constexpr (!F.reflection) {
        Sample s = finish(cosineHemisphere(direction), LaneMask{});
        s.weight = select(probability_[kDiffuse] > 0, s.weight, Colour{});
        return s;
    } else {
        const LaneMask diffuse = choice < probability_[kDiffuse];
        const LaneMask reflects = !diffuse && choice - probability_[kDiffuse] < probability_[kReflection];
        const LaneMask rough = reflects && !smooth_;
        Vector wi{Real{}, Real{}, Real{} - 1};  // beneath: where no lobe is
        if (any(diffuse)) wi = select(diffuse, cosineHemisphere(direction), wi);
        if (any(rough)) {
            const Vector w = reflected(wo_, GgxOf<Lanes>{alpha_}.sampleVisible(wo_, direction));
            wi = select(rough && w.z > 0, w, wi);
        }
        const LaneMask chosen = wi.z > 0;
        Sample s = finish(wi, LaneMask{});
        s.weight = select(chosen, s.weight, Colour{});
        if (const LaneMask smooth = reflects && smooth_; any(smooth)) {
            const Sample m = mirror(baseFresnel(wo_.z) / probability_[kReflection], false);
            s = {select(smooth, m.wi, s.wi),
                 select(smooth, m.weight, s.weight),
                 smooth ? m.pdf : s.pdf,
                 smooth,
                 m.coat & smooth,
                 m.through & smooth,
                 m.folded & smooth};
        }
        return s;
    }
}

}  // namespace vlx::render
