#pragma once

#include <algorithm>
#include <cmath>

#include "render/plan/effect_counters.h"
#include "render/surface/bsdf_model.h"

/// How much energy each lobe of a surface gets towards the viewer: what a BSDF is set up with.
namespace vlx::render {

inline constexpr float kCoatIor = 1.5f;
inline constexpr float kCoatF0 = 0.04f;

template <class Real>
RgbOf<Real> lerp(const RgbOf<Real>& a, const RgbOf<Real>& b, Real t) {
    return a * (1.f - t) + b * t;
}

template <class Real>
RgbOf<Real> minimum(const RgbOf<Real>& a, float b) {
    return {smaller(a.x, spread<Real>(b)), smaller(a.y, spread<Real>(b)), smaller(a.z, spread<Real>(b))};
}

template <class Real>
RgbOf<Real> white() {
    return RgbOf<Real>(spread<Real>(1));
}

/// Kulla and Conty's colour of light that scattered more than once: with F the mean reflectance and E the
/// mean albedo, F^2 E / (1 - F (1 - E)) (as corrected in their course notes). 1 for F = 1.
template <class Real>
RgbOf<Real> multipleColour(const RgbOf<Real>& meanReflectance, Real meanWhole) {
    return meanReflectance * meanReflectance * meanWhole /
           (white<Real>() - meanReflectance * (1.f - meanWhole));
}

/// 1 / (1 - x), bounded: where x is 1 the lobe it scales is 0.
template <class Real>
Real inverseRest(Real x) {
    return 1.f / larger(1.f - x, spread<Real>(1e-4f));
}
template <class Real>
RgbOf<Real> inverseRest(const RgbOf<Real>& c) {
    return {inverseRest(c.x), inverseRest(c.y), inverseRest(c.z)};
}

template <class Real>
DielectricLayerOf<Real>::DielectricLayerOf(const SurfaceParameters& s) requires std::same_as<Real, float>
    : row(s.albedoTable->row(s.roughness)),
      exactF0(normalReflectance(s.ior)),
      f0(minimum(s.specularColour* exactF0, 1.f) * s.specular),
      f90(s.specular),
      multiple(multipleColour(lerp(f0, Rgb(f90), s.albedoTable->meanWeight()), row.mean().whole)),
      mean(albedo(row.mean())),
      rest(inverseRest(mean)) {}

template <Features F, class Real>
BasicBsdf<F, Real>::BasicBsdf(const Surface& s, const Vector& wo, Mask<Real> fromInside,
                              [[maybe_unused]] const AlbedoTable& coatTable, const Vector& trueNormal)
    : wo_(wo),
      up_(trueNormal),
      layer_(layerOf(s)),
      alpha_(square(s.roughness)),
      coatAlpha_(square(s.clearcoatRoughness)),
      retroRoughness_(s.retro ? s.roughness : spread<Real>(-1)),
      smooth_(alpha_ < kSmoothAlpha),
      coatSmooth_(coatAlpha_ < kSmoothAlpha),
      coat_(s.clearcoat),
      metal_(s.metallic),
      metalF0_(s.baseColour),
      glassTint_(s.baseColour),
      ior_(s.ior),
      eta_(fromInside ? 1.f / s.ior : s.ior) {
    Real sheenEnergy{};
    base_ = spread<Real>(1);
    if constexpr (F.layers) {
        const Real cosO = wo.z;
        if (const Mask<Real> coated = coat_ > 0; any(coated)) {
            countEffect(Effect::Clearcoat);
            const auto a = rowsOf(coatTable, s.clearcoatRoughness).at(cosO);
            const Real albedo = coat_ * (kCoatF0 * (a.whole - a.dielectric) + a.dielectric);
            coatAlbedo_ = coated ? albedo : Real{};
            if (!all(coatSmooth_)) coatLambdaO_ = GgxOf<Real>{coatAlpha_}.lambda(wo);
        }
        base_ = 1.f - coatAlbedo_;
        if (const Mask<Real> has = !isBlack(s.sheenColour); any(has)) {
            countEffect(Effect::Sheen);
            sheenRoughness_ = s.sheenRoughness;
            const Real albedo = eachLane(has, [&](std::size_t i) {
                return s.sheenTable[i]->albedo(laneOf(cosO, i), laneOf(sheenRoughness_, i));
            });
            sheen_ = select(has, s.sheenColour * (base_ / larger(spread<Real>(1), albedo)), Colour{});
            sheenEnergy = maxComponent(sheen_) * albedo;
            base_ = base_ - sheenEnergy;
        }
    }
    if constexpr (F.reflection)
        if (!all(smooth_)) lambdaO_ = GgxOf<Real>{alpha_}.lambda(wo);

    const Real glass = F.glass ? (1.f - metal_) * s.transmission : Real{};
    opaque_ = 1.f - metal_ - glass;
    if constexpr (!F.reflection) {
        // What follows for surfaces that do not reflect.
        diffuse_ = minimum(s.baseColour, 1.f) * (opaque_ * base_);
        albedo_ = Colour(coatAlbedo_ + sheenEnergy) + diffuse_;
        probability_ = {coatAlbedo_, Real{}, maxComponent(diffuse_), Real{}, sheenEnergy};
    } else {
        setReflecting(s, fromInside, glass, sheenEnergy);
    }
    if constexpr (F.rare)
        if (!s.leftOut.none()) leaveOut(s.leftOut);
    constexpr float kUpright = 0.9999f;  // closer, and less than 1e-4 of a lobe is beneath
    if (const Mask<Real> tilted = up_.z < kUpright; any(tilted)) leaveAbove(tilted);
    if constexpr (!F.reflection) {
        Real& alone = probability_[kDiffuse];
        alone = alone > 0 ? spread<Real>(1) : alone;
    } else {
        Real total{};
        for (const Real p : probability_) total += p;
        for (Real& p : probability_) p = total > 0 ? p / total : Real{};
    }
    const auto none = [&](Lobe lobe) -> Mask<Real> { return probability_[lobe] == 0; };
    onlyDelta_ =
        none(kDiffuse) && none(kSheen) && (none(kReflection) || smooth_) && (none(kCoat) || coatSmooth_);
    if constexpr (F.glass) onlyDelta_ = onlyDelta_ && (none(kGlass) || glassSmooth_);
}

/// Everything but coat and sheen, and the probabilities of all lobes, not yet normalised.
template <Features F, class Real>
void BasicBsdf<F, Real>::setReflecting(const Surface& s, [[maybe_unused]] Mask<Real> fromInside, Real glass,
                                       Real sheenEnergy) {
    const Real cosO = wo_.z;
    const Mask<Real> metal = metal_ > 0;
    const auto atO = layer_.row.at(cosO);
    const Real meanWhole = layer_.row.mean().whole;
    Colour colour = layer_.multiple * opaque_;
    if (any(metal)) {
        const Colour metalMean =
            lerp(metalF0_, white<Real>(), spread<Real>(1.f / 21.f));  // of Schlick's curve
        colour = select(metal, multipleColour(metalMean, meanWhole) * metal_ + colour, colour);
    }
    const Colour again = colour * ((1.f - atO.whole) * base_);
    multiple_ = again * inverseRest(meanWhole);
    const Colour entering = white<Real>() - layer_.albedo(atO);
    const Colour body =
        select(s.retro, minimum(s.baseColour, 1.f), minimum(s.baseColour * layer_.rest, 1.f) * entering) *
        (opaque_ * base_);
    diffuse_ = select(s.retro, body, body * layer_.rest);

    // Energy of each lobe towards wo: the probability of choosing it.
    const Colour dielectricSingle =
        layer_.f0 * (atO.whole - atO.dielectric) + Colour(layer_.f90 * atO.dielectric);
    Colour single = dielectricSingle * opaque_;
    if (any(metal))
        single =
            select(metal, (metalF0_ * (atO.whole - atO.conductor) + Colour(atO.conductor)) * metal_ + single,
                   single);
    single *= base_;
    const Colour spreadLight = body + again;
    Colour through;
    if constexpr (F.glass) {
        // Smooth glass without a change of index neither bends nor spreads light.
        glassSmooth_ = smooth_ || magnitude(eta_ - 1.f) < 1e-3f;
        glassWeight_ = glass * base_;
        if (const Mask<Real> spreads = glassWeight_ > 0 && !glassSmooth_; any(spreads)) {
            const Real kept = eachLane(spreads, [&](std::size_t i) {
                const GlassTable* table = s.glassTable[i];
                if (table == nullptr) return 1.f;
                const bool inside = laneOf(fromInside ? spread<Real>(1) : Real{}, i) > 0;
                return std::max(0.05f, table->kept(laneOf(cosO, i), laneOf(s.roughness, i), inside));
            });
            glassWeight_ = spreads ? glassWeight_ / kept : glassWeight_;
        }
        if (const Mask<Real> transmits = glass > 0; any(transmits)) {
            const GlassSplit split = splitAt(cosO);
            through = select(transmits, (split.reflected + split.transmitted) * (glass * base_), Colour{});
        }
    }
    albedo_ = Colour(coatAlbedo_ + sheenEnergy) + single + spreadLight + through;
    probability_ = {coatAlbedo_, maxComponent(single), maxComponent(spreadLight), maxComponent(through),
                    sheenEnergy};
}

/// Diffuse lobes send all their light above the true surface.
template <Features F, class Real>
void BasicBsdf<F, Real>::leaveAbove(Mask<Real> tilted) {
    const Real whole = 2.f / (1.f + up_.z);  // of a cosine lobe over what is above
    if constexpr (!F.reflection) {
        diffuse_ = select(tilted, diffuse_ * whole, diffuse_);
    } else {
        const auto above = layer_.row.meanAbove(up_.z);
        const Colour entering =
            select(retroRoughness_ < 0, (white<Real>() - layer_.mean) * inverseRest(layer_.albedo(above)),
                   white<Real>());
        diffuse_ = select(tilted, diffuse_ * (entering * whole), diffuse_);
        const Real more = (1.f - layer_.row.mean().whole) * inverseRest(above.whole) * whole;
        multiple_ = select(tilted, multiple_ * more, multiple_);
    }
}

/// Lobes of effects that are left out are neither chosen nor added.
template <Features F, class Real>
void BasicBsdf<F, Real>::leaveOut(const EffectSet& effects) {
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
