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
Real BasicBsdf<F, Real>::coatFresnel(Real cosH) const {
    return coat_ * dielectricFresnel(cosH, spread<Real>(kCoatIor));
}

template <Features F, class Real>
typename BasicBsdf<F, Real>::GlassSplit BasicBsdf<F, Real>::splitAt(Real cosH) const {
    const Real exact = dielectricFresnel(cosH, eta_);
    const Colour r = lerp(layer_.f0, Colour(layer_.f90), dielectricWeight(cosH, eta_, layer_.exactF0));
    const Colour t = select(exact < 1, (white<Real>() - r) * glassTint_, Colour{});
    const Real toReflect = maxComponent(r), toTransmit = maxComponent(t);
    const Real total = toReflect + toTransmit;
    return {r, t, total > 0 ? toReflect / total : spread<Real>(1)};
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
BsdfValueOf<Real> BasicBsdf<F, Real>::coatReflection(const Vector& wi) const {
    countEffect(Effect::Glossy);
    const Microfacet m(coatAlpha_, coatLambdaO_, wo_, wi);
    return {Colour(coatFresnel(m.cosH) * m.value), m.pdf};
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
BsdfValueOf<Real> BasicBsdf<F, Real>::glass(Mask<Real> there, const Vector& wi) const {
    const GgxOf<Real> ggx{alpha_};
    const Real lambdaI = ggx.lambda(wi);
    const Real g1 = 1.f / (1.f + lambdaO_), g2 = 1.f / (1.f + lambdaO_ + lambdaI);
    Value v;
    const Mask<Real> above = wi.z > 0;
    if (const Mask<Real> reflects = there && above; any(reflects)) {
        countEffect(Effect::Glossy);
        const Vector h = normalized(wo_ + wi);
        const GlassSplit split = splitAt(dot(wo_, h));
        const Real common = ggx.d(h) / (4.f * wo_.z);
        v = select(
            reflects,
            Value{split.reflected * (glassWeight_ * common * g2), split.reflectProbability * common * g1}, v);
    }
    if (Mask<Real> transmits = there && !above; any(transmits)) {
        countEffect(Effect::RoughTransmission);
        Vector h = normalized(wo_ + wi * eta_);
        h = select(h.z < 0, -h, h);
        const Real cosO = dot(wo_, h), cosI = dot(wi, h);
        transmits = transmits && !(cosO <= 0 || cosI >= 0);
        const GlassSplit split = splitAt(cosO);
        const Real jacobian = eta_ * eta_ * -cosI / square(cosO + eta_ * cosI);  // |dh/dwi|
        const Real common = ggx.d(h) * cosO / wo_.z * jacobian;
        v = select(transmits,
                   Value{split.transmitted * (glassWeight_ * common * g2),
                         (1.f - split.reflectProbability) * common * g1},
                   v);
    }
    return v;
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
        if (const Mask<Real> there = has(kCoat) && !coatSmooth_; any(there))
            add(there, coatReflection(wi), kCoat);
        if (const Mask<Real> there = has(kSheen); any(there)) add(there, sheen(there, wi), kSheen);
    }
    if constexpr (F.glass)
        if (const Mask<Real> there = probability_[kGlass] > 0 && !glassSmooth_; any(there))
            add(there, glass(there, wi), kGlass);
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
    s.delta = always<Real>();
    const Mask<Real> beneath = dot(s.wi, up_) < 0;
    s.folded = beneath != s.through;
    s.wi = select(s.folded, imageOf(s.wi), s.wi);
    return s;
}

template <Features F, class Real>
BsdfSampleOf<Real> BasicBsdf<F, Real>::mirror(const Colour& weight, bool coat) const {
    countEffect(Effect::Mirror);
    return settled(
        {.wi = {-wo_.x, -wo_.y, wo_.z}, .weight = weight, .coat = coat ? always<Real>() : Mask<Real>{}});
}

template <Features F, class Real>
BsdfValueOf<Real> BasicBsdf<F, Real>::sheen(Mask<Real> there, const Vector& wi) const {
    const Real f = eachLane(there, [&](std::size_t i) {
        return charlieSheen(lane(wo_, i), lane(wi, i), laneOf(sheenRoughness_, i));
    });
    return {sheen_ * (f * wi.z), wi.z * kInvPi};
}

template <Features F, class Real>
BsdfSampleOf<Real> BasicBsdf<F, Real>::sample(const Vec2Of<Real>& direction, Real choice) const {
    // Lobes share [0, 1) in turn.
    Mask<Real> open = always<Real>();
    Real rest = choice;
    const auto chosen = [&](Lobe lobe) -> Mask<Real> {
        const Mask<Real> it = open && rest < probability_[lobe];
        open = open && !it;
        rest = rest - probability_[lobe];
        return it;
    };
    Mask<Real> cosine = chosen(kDiffuse), reflects{}, coats{};
    if constexpr (F.reflection) reflects = chosen(kReflection);
    if constexpr (F.layers) {
        const Mask<Real> sheens = chosen(kSheen);
        cosine = cosine || sheens;
        coats = chosen(kCoat);
    }

    // Lobes that are not delta functions are weighed together.
    Vector wi{Real{}, Real{}, Real{} - 1};
    Mask<Real> smooth{}, through{};
    Sample s;
    const auto take = [&](Mask<Real> there, const Vector& w) {
        wi = select(there, w, wi);
        smooth = smooth || there;
    };
    if (any(cosine)) take(cosine, cosineHemisphere(direction));
    const auto takeMicrofacet = [&](Mask<Real> there, Real alpha) {
        if (!any(there)) return;
        const Vector w = reflected(wo_, GgxOf<Real>{alpha}.sampleVisible(wo_, direction));
        take(there && w.z > 0, w);
    };
    if constexpr (F.reflection) takeMicrofacet(reflects && !smooth_, alpha_);
    if constexpr (F.layers) takeMicrofacet(coats && !coatSmooth_, coatAlpha_);
    if constexpr (F.glass) {
        if (const Mask<Real> glass = open && probability_[kGlass] > 0; any(glass)) {
            const Real part = smaller(rest / probability_[kGlass], spread<Real>(0x1.fffffep-1f));
            Vector h{Real{}, Real{}, Real{} + 1};
            if (any(glass && !glassSmooth_))
                h = select(glassSmooth_, h, GgxOf<Real>{alpha_}.sampleVisible(wo_, direction));
            const GlassSplit split = splitAt(dot(wo_, h));
            const Mask<Real> back = part < split.reflectProbability;
            const Vector w = select(back, reflected(wo_, h), refracted(wo_, h, eta_));
            const Mask<Real> leaves = glass && ((back && w.z > 0) || (!back && w.z < 0));
            through = leaves && !back;
            take(leaves && !glassSmooth_, w);
            if (const Mask<Real> delta = leaves && glassSmooth_; any(delta)) {
                if (any(delta && back)) countEffect(Effect::Mirror);
                if (any(delta && !back)) countEffect(Effect::Transmission);
                const Real scale = glassWeight_ / probability_[kGlass];
                const Colour weight = select(back, split.reflected * (scale / split.reflectProbability),
                                             split.transmitted * (scale / (1.f - split.reflectProbability)));
                s = select(delta, settled({.wi = w, .weight = weight, .through = through}), s);
            }
        }
    }
    if (any(smooth)) s = select(smooth, finish(wi, through), s);

    if constexpr (F.reflection)
        if (const Mask<Real> there = reflects && smooth_; any(there))
            s = select(there, mirror(baseFresnel(wo_.z) / probability_[kReflection], false), s);
    if constexpr (F.layers)
        if (const Mask<Real> there = coats && coatSmooth_; any(there))
            s = select(there, mirror(Colour(coatFresnel(wo_.z) / probability_[kCoat]), true), s);
    return s;
}

}  // namespace vlx::render
