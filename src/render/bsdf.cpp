#include "bsdf.h"

#include "sampling.h"

namespace vlx::render {
namespace {

constexpr float kCoatF0 = 0.04f;

Rgb lerp(const Rgb& a, const Rgb& b, float t) { return a * (1 - t) + b * t; }

Rgb fresnel(const Rgb& f0, const Rgb& f90, float weight) { return lerp(f0, f90, weight); }

Rgb singleAlbedo(const Rgb& f0, const Rgb& f90, const Albedo& a) {
    return f0 * (a.whole - a.grazing) + f90 * a.grazing;
}

/// Kulla and Conty's colour of light that scattered more than once: with F the mean reflectance and E the
/// mean albedo, F^2 E / (1 - F (1 - E)) (as corrected in their course notes). 1 for F = 1.
Rgb multipleColour(const Rgb& f0, const Rgb& f90, float meanWhole) {
    const Rgb mean = lerp(f0, f90, 1.f / 21.f);  // mean of Schlick's weight over the cosine hemisphere
    return mean * mean * meanWhole / (Rgb(1) - mean * (1 - meanWhole));
}

/// 1 / (1 - x), bounded: where x is 1 the lobe it scales is 0.
float inverseRest(float x) { return 1 / std::max(1 - x, 1e-4f); }

bool sameSide(const Vec3& a, const Vec3& b) { return a.z * b.z > 0; }

}  // namespace

Bsdf::Bsdf(const SurfaceParameters& s, const Vec3& wo, bool fromInside, const AlbedoTable& table)
    : wo_(wo),
      alpha_(square(s.roughness)),
      coatAlpha_(square(s.clearcoatRoughness)),
      smooth_(alpha_ < kSmoothAlpha),
      coatSmooth_(coatAlpha_ < kSmoothAlpha),
      coat_(s.clearcoat),
      coatAlbedo_(0),
      glassTint_(s.baseColour),
      eta_(fromInside ? 1 / s.ior : s.ior),
      exactF0_(square((s.ior - 1) / (s.ior + 1))),
      row_(table.row(s.roughness)) {
    const float cosO = wo.z;
    if (coat_ > 0) {
        const Albedo a = table.row(s.clearcoatRoughness).at(cosO);
        coatAlbedo_ = coat_ * (kCoatF0 * (a.whole - a.grazing) + a.grazing);
        if (!coatSmooth_) coatLambdaO_ = Ggx{coatAlpha_}.lambda(wo);
    }
    base_ = 1 - coatAlbedo_;
    if (!smooth_) lambdaO_ = Ggx{alpha_}.lambda(wo);

    const float metal = s.metallic;
    const float dielectric = 1 - metal;
    const float glass = dielectric * s.transmission;
    const float opaque = dielectric - glass;
    const Rgb limited = s.specularColour * exactF0_;
    dielectricF0_ = Rgb{std::min(limited.x, 1.f), std::min(limited.y, 1.f), std::min(limited.z, 1.f)} * s.specular;
    dielectricF90_ = s.specular;
    f0_ = s.baseColour * metal + dielectricF0_ * opaque;
    f90_ = Rgb(metal + dielectricF90_ * opaque);

    const Albedo atO = row_.at(cosO);
    const Albedo& mean = row_.mean();
    dielectricMultiple_ = multipleColour(dielectricF0_, Rgb(dielectricF90_), mean.whole);
    const Rgb single = singleAlbedo(f0_, f90_, atO);
    const Rgb colour = multipleColour(s.baseColour, Rgb(1), mean.whole) * metal + dielectricMultiple_ * opaque;
    multiple_ = colour * ((1 - atO.whole) * inverseRest(mean.whole) * base_);

    const Rgb entering = Rgb(1) - dielectricAlbedo(atO);
    const Rgb meanDielectric = dielectricAlbedo(mean);
    const Rgb rest{inverseRest(meanDielectric.x), inverseRest(meanDielectric.y), inverseRest(meanDielectric.z)};
    const Rgb full = s.baseColour * rest;
    const Rgb body = Rgb{std::min(full.x, 1.f), std::min(full.y, 1.f), std::min(full.z, 1.f)} * entering *
                     (opaque * base_);
    diffuse_ = body * rest;

    // Smooth glass without a change of index neither bends nor spreads light.
    glassSmooth_ = smooth_ || std::abs(eta_ - 1) < 1e-3f;
    glassWeight_ = glass * base_;
    if (glassWeight_ > 0 && !glassSmooth_ && s.glassTable != nullptr)
        glassWeight_ /= std::max(0.05f, s.glassTable->kept(cosO, s.roughness, fromInside));

    // Energy of each lobe towards wo: the probability of choosing it.
    const Rgb reflected = single * base_;
    const Rgb spread = body + colour * ((1 - atO.whole) * base_);
    const GlassSplit split = splitAt(cosO);
    const Rgb through = (split.reflected + split.transmitted) * (glass * base_);
    albedo_ = Rgb(coatAlbedo_) + reflected + spread + through;
    probability_ = {coatAlbedo_, maxComponent(reflected), maxComponent(spread), maxComponent(through)};
    const float total = probability_[0] + probability_[1] + probability_[2] + probability_[3];
    for (float& p : probability_) p = total > 0 ? p / total : 0;
    onlyDelta_ = (probability_[kCoat] == 0 || coatSmooth_) && (probability_[kReflection] == 0 || smooth_) &&
                 probability_[kDiffuse] == 0 && (probability_[kGlass] == 0 || glassSmooth_);
}

/// Albedo of the dielectric layer, multiple scattering included.
Rgb Bsdf::dielectricAlbedo(const Albedo& a) const {
    return singleAlbedo(dielectricF0_, Rgb(dielectricF90_), a) + dielectricMultiple_ * (1 - a.whole);
}

Bsdf::GlassSplit Bsdf::splitAt(float cosH) const {
    const float exact = dielectricFresnel(cosH, eta_);
    // The exact curve from 0 at normal incidence to 1 at grazing replaces Schlick's weight.
    const float weight = exactF0_ < 1 ? std::max(0.f, (exact - exactF0_) / (1 - exactF0_)) : 1.f;
    const Rgb r = fresnel(dielectricF0_, Rgb(dielectricF90_), weight);
    const Rgb t = exact < 1 ? (Rgb(1) - r) * glassTint_ : Rgb(0);
    const float toReflect = maxComponent(r), toTransmit = maxComponent(t);
    const float total = toReflect + toTransmit;
    return {r, t, total > 0 ? toReflect / total : 1};
}

/// wi.z > 0.
BsdfValue Bsdf::reflection(const Ggx& ggx, float lambdaO, const Vec3& wi, const Rgb& f0, const Rgb& f90) const {
    const Vec3 h = normalized(wo_ + wi);
    const float common = ggx.d(h) / (4 * wo_.z);
    const float g2 = 1 / (1 + lambdaO + ggx.lambda(wi));
    return {fresnel(f0, f90, schlickWeight(dot(wi, h))) * (common * g2), common / (1 + lambdaO)};
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
    const auto add = [&](const BsdfValue& v, float scale, float probability) {
        sum.value += v.value * scale;
        sum.pdf += v.pdf * probability;
    };
    if (sameSide(wo_, wi)) {
        if (probability_[kDiffuse] > 0) add(diffuse(wi.z), 1, probability_[kDiffuse]);
        if (probability_[kReflection] > 0 && !smooth_)
            add(reflection(Ggx{alpha_}, lambdaO_, wi, f0_, f90_), base_, probability_[kReflection]);
        if (probability_[kCoat] > 0 && !coatSmooth_)
            add(reflection(Ggx{coatAlpha_}, coatLambdaO_, wi, Rgb(kCoatF0), Rgb(1)), coat_, probability_[kCoat]);
    }
    if (probability_[kGlass] > 0 && !glassSmooth_ && wi.z != 0) add(glass(wi), 1, probability_[kGlass]);
    return sum;
}

/// The sample of a direction that some smooth lobe chose: weighed by all of them.
BsdfSample Bsdf::finish(const Vec3& wi) const {
    const BsdfValue v = evaluate(wi);
    if (!(v.pdf > 0)) return {};
    return {wi, v.value / v.pdf, v.pdf, false};
}

BsdfSample Bsdf::sampleReflection(float alpha, const Rgb& f0, const Rgb& f90, Vec2 u, Lobe lobe) const {
    if (alpha < kSmoothAlpha) {
        const float scale = (lobe == kCoat ? coat_ : base_) / probability_[lobe];
        return {{-wo_.x, -wo_.y, wo_.z}, fresnel(f0, f90, schlickWeight(wo_.z)) * scale, 0, true};
    }
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
    if (rest < probability_[kReflection]) return sampleReflection(alpha_, f0_, f90_, direction, kReflection);
    rest -= probability_[kReflection];
    if (rest < probability_[kCoat])
        return sampleReflection(coatAlpha_, Rgb(kCoatF0), Rgb(1), direction, kCoat);
    rest -= probability_[kCoat];
    if (probability_[kGlass] > 0) return sampleGlass(direction, std::min(rest / probability_[kGlass], 0x1.fffffep-1f));
    return {};
}

}  // namespace vlx::render
