#include "bsdf.h"

#include "sampling.h"

namespace vlx::render {
namespace {

constexpr float kCoatIor = 1.5f;
constexpr float kCoatF0 = 0.04f;

Rgb lerp(const Rgb& a, const Rgb& b, float t) { return a * (1 - t) + b * t; }

Rgb minimum(const Rgb& a, float b) { return {std::min(a.x, b), std::min(a.y, b), std::min(a.z, b)}; }

/// Kulla and Conty's colour of light that scattered more than once: with F the mean reflectance and E the
/// mean albedo, F^2 E / (1 - F (1 - E)) (as corrected in their course notes). 1 for F = 1.
Rgb multipleColour(const Rgb& meanReflectance, float meanWhole) {
    return meanReflectance * meanReflectance * meanWhole / (Rgb(1) - meanReflectance * (1 - meanWhole));
}

/// 1 / (1 - x), bounded: where x is 1 the lobe it scales is 0.
float inverseRest(float x) { return 1 / std::max(1 - x, 1e-4f); }

}  // namespace

Bsdf::Bsdf(const SurfaceParameters& s, const Vec3& wo, bool fromInside, const AlbedoTable& coatTable)
    : wo_(wo),
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
    if (coat_ > 0) {
        const Albedo a = coatTable.row(s.clearcoatRoughness).at(cosO);
        coatAlbedo_ = coat_ * (kCoatF0 * (a.whole - a.dielectric) + a.dielectric);
        if (!coatSmooth_) coatLambdaO_ = Ggx{coatAlpha_}.lambda(wo);
    }
    base_ = 1 - coatAlbedo_;
    if (!smooth_) lambdaO_ = Ggx{alpha_}.lambda(wo);

    const float glass = (1 - metal_) * s.transmission;
    opaque_ = 1 - metal_ - glass;
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
    const Rgb rest{inverseRest(meanDielectric.x), inverseRest(meanDielectric.y),
                   inverseRest(meanDielectric.z)};
    const Rgb body = minimum(s.baseColour * rest, 1.f) * entering * (opaque_ * base_);
    diffuse_ = body * rest;

    // Smooth glass without a change of index neither bends nor spreads light.
    glassSmooth_ = smooth_ || std::abs(eta_ - 1) < 1e-3f;
    glassWeight_ = glass * base_;
    if (glassWeight_ > 0 && !glassSmooth_ && s.glassTable != nullptr)
        glassWeight_ /= std::max(0.05f, s.glassTable->kept(cosO, s.roughness, fromInside));

    // Energy of each lobe towards wo: the probability of choosing it.
    const Rgb metalSingle = metalF0_ * (atO.whole - atO.conductor) + Rgb(atO.conductor);
    const Rgb dielectricSingle =
        dielectricF0_ * (atO.whole - atO.dielectric) + Rgb(dielectricF90_ * atO.dielectric);
    const Rgb single = (metalSingle * metal_ + dielectricSingle * opaque_) * base_;
    const Rgb spread = body + again;
    Rgb through;
    if (glass > 0) {
        const GlassSplit split = splitAt(cosO);
        through = (split.reflected + split.transmitted) * (glass * base_);
    }
    albedo_ = Rgb(coatAlbedo_) + single + spread + through;
    probability_ = {coatAlbedo_, maxComponent(single), maxComponent(spread), maxComponent(through)};
    const float total = probability_[0] + probability_[1] + probability_[2] + probability_[3];
    for (float& p : probability_) p = total > 0 ? p / total : 0;
    onlyDelta_ = (probability_[kCoat] == 0 || coatSmooth_) && (probability_[kReflection] == 0 || smooth_) &&
                 probability_[kDiffuse] == 0 && (probability_[kGlass] == 0 || glassSmooth_);
}

/// Albedo of the dielectric layer, multiple scattering included.
Rgb Bsdf::dielectricAlbedo(const Albedo& a) const {
    return dielectricF0_ * (a.whole - a.dielectric) + Rgb(dielectricF90_ * a.dielectric) +
           dielectricMultiple_ * (1 - a.whole);
}

Rgb Bsdf::baseFresnel(float cosH) const {
    Rgb f;
    if (metal_ > 0) f += lerp(metalF0_, Rgb(1), schlickWeight(cosH)) * metal_;
    if (opaque_ > 0)
        f += lerp(dielectricF0_, Rgb(dielectricF90_), dielectricWeight(cosH, ior_, exactF0_)) * opaque_;
    return f * base_;
}

float Bsdf::coatFresnel(float cosH) const { return coat_ * dielectricFresnel(cosH, kCoatIor); }

Bsdf::GlassSplit Bsdf::splitAt(float cosH) const {
    const float exact = dielectricFresnel(cosH, eta_);
    const Rgb r = lerp(dielectricF0_, Rgb(dielectricF90_), dielectricWeight(cosH, eta_, exactF0_));
    const Rgb t = exact < 1 ? (Rgb(1) - r) * glassTint_ : Rgb(0);
    const float toReflect = maxComponent(r), toTransmit = maxComponent(t);
    const float total = toReflect + toTransmit;
    return {r, t, total > 0 ? toReflect / total : 1};
}

/// GGX without its Fresnel factor, and the cosine of half the angle between wo and wi (wi.z > 0).
struct Bsdf::Microfacet {
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

BsdfValue Bsdf::baseReflection(const Vec3& wi) const {
    const Microfacet m(alpha_, lambdaO_, wo_, wi);
    return {baseFresnel(m.cosH) * m.value, m.pdf};
}

BsdfValue Bsdf::coatReflection(const Vec3& wi) const {
    const Microfacet m(coatAlpha_, coatLambdaO_, wo_, wi);
    return {Rgb(coatFresnel(m.cosH) * m.value), m.pdf};
}

/// Diffuse and multiple-scattering lobes: cosine-sampled.
BsdfValue Bsdf::diffuse(float cosI) const {
    const Albedo atI = row_.at(cosI);
    const Rgb f = diffuse_ * (Rgb(1) - dielectricAlbedo(atI)) + multiple_ * (1 - atI.whole);
    const float pdf = cosI * kInvPi;
    return {f * pdf, pdf};
}

BsdfValue Bsdf::glass(const Vec3& wi) const {
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

BsdfValue Bsdf::evaluate(const Vec3& wi) const {
    BsdfValue sum;
    const auto add = [&](const BsdfValue& v, Lobe lobe) {
        sum.value += v.value;
        sum.pdf += v.pdf * probability_[lobe];
    };
    if (wi.z > 0) {
        if (probability_[kDiffuse] > 0) add(diffuse(wi.z), kDiffuse);
        if (probability_[kReflection] > 0 && !smooth_) add(baseReflection(wi), kReflection);
        if (probability_[kCoat] > 0 && !coatSmooth_) add(coatReflection(wi), kCoat);
    }
    if (probability_[kGlass] > 0 && !glassSmooth_ && wi.z != 0) add(glass(wi), kGlass);
    return sum;
}

/// The sample of a direction that some smooth lobe chose: weighed by all of them.
BsdfSample Bsdf::finish(const Vec3& wi) const {
    const BsdfValue v = evaluate(wi);
    if (!(v.pdf > 0)) return {};
    return {wi, v.value / v.pdf, v.pdf, false};
}

BsdfSample Bsdf::mirror(const Rgb& weight) const { return {{-wo_.x, -wo_.y, wo_.z}, weight, 0, true}; }

BsdfSample Bsdf::sampleMicrofacet(float alpha, Vec2 u) const {
    const Vec3 wi = reflected(wo_, Ggx{alpha}.sampleVisible(wo_, u));
    return wi.z > 0 ? finish(wi) : BsdfSample{};
}

BsdfSample Bsdf::sampleGlass(Vec2 u, float choice) const {
    const Vec3 h = glassSmooth_ ? Vec3{0, 0, 1} : Ggx{alpha_}.sampleVisible(wo_, u);
    const GlassSplit split = splitAt(dot(wo_, h));
    const bool reflects = choice < split.reflectProbability;
    const Vec3 wi = reflects ? reflected(wo_, h) : refracted(wo_, h, eta_);
    if (reflects ? wi.z <= 0 : wi.z >= 0) return {};
    if (!glassSmooth_) return finish(wi);
    const float scale = glassWeight_ / probability_[kGlass];
    if (reflects) return {wi, split.reflected * (scale / split.reflectProbability), 0, true};
    return {wi, split.transmitted * (scale / (1 - split.reflectProbability)), 0, true};
}

BsdfSample Bsdf::sample(Vec2 direction, float choice) const {
    float rest = choice;
    if (rest < probability_[kDiffuse]) return finish(cosineHemisphere(direction));
    rest -= probability_[kDiffuse];
    if (rest < probability_[kReflection])
        return smooth_ ? mirror(baseFresnel(wo_.z) / probability_[kReflection])
                       : sampleMicrofacet(alpha_, direction);
    rest -= probability_[kReflection];
    if (rest < probability_[kCoat])
        return coatSmooth_ ? mirror(Rgb(coatFresnel(wo_.z) / probability_[kCoat]))
                           : sampleMicrofacet(coatAlpha_, direction);
    rest -= probability_[kCoat];
    if (probability_[kGlass] > 0)
        return sampleGlass(direction, std::min(rest / probability_[kGlass], 0x1.fffffep-1f));
    return {};
}

}  // namespace vlx::render
