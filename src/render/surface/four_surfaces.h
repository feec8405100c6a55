#pragma once

#include "render/surface/bsdf.h"

/// BSDFs of four surfaces side by side: from parameters and to samples of each.
namespace vlx::render {

inline BsdfValue lane(const BsdfValueOf<Lanes>& v, std::size_t i) { return {lane(v.value, i), v.pdf[i]}; }
inline BsdfSample lane(const BsdfSampleOf<Lanes>& s, std::size_t i) {
    return {.wi = lane(s.wi, i),
            .weight = lane(s.weight, i),
            .pdf = s.pdf[i],
            .delta = s.delta[i] != 0,
            .coat = s.coat[i] != 0,
            .through = s.through[i] != 0,
            .folded = s.folded[i] != 0};
}

/// Of four surfaces: of what `F` has.
template <Features F>
class FourSurfaces {
  public:
    template <class Function>
    explicit FourSurfaces(const Function& of) {
        std::array<SurfaceParameters, kLanes> s;
        std::array<const DielectricLayer*, kLanes> layer;
        std::array<DielectricLayer, kLanes> own;
        for (std::size_t i = 0; i < kLanes; ++i) {
            s[i] = of(i);
            layer[i] = s[i].layer != nullptr ? s[i].layer : &(own[i] = DielectricLayer(s[i]));
            layer_.row.rows[i] = layer[i]->row;
        }
        all_.baseColour = vectorsOf([&](std::size_t i) { return s[i].baseColour; });
        all_.metallic = lanesOf([&](std::size_t i) { return s[i].metallic; });
        all_.roughness = lanesOf([&](std::size_t i) { return s[i].roughness; });
        all_.retro = maskOf([&](std::size_t i) { return s[i].retro; });
        all_.ior = lanesOf([&](std::size_t i) { return s[i].ior; });
        layer_.exactF0 = lanesOf([&](std::size_t i) { return layer[i]->exactF0; });
        layer_.f0 = vectorsOf([&](std::size_t i) { return layer[i]->f0; });
        layer_.f90 = lanesOf([&](std::size_t i) { return layer[i]->f90; });
        layer_.multiple = vectorsOf([&](std::size_t i) { return layer[i]->multiple; });
        layer_.mean = vectorsOf([&](std::size_t i) { return layer[i]->mean; });
        layer_.rest = vectorsOf([&](std::size_t i) { return layer[i]->rest; });
        all_.layer = &layer_;
        if constexpr (F.layers) {
            all_.clearcoat = lanesOf([&](std::size_t i) { return s[i].clearcoat; });
            all_.clearcoatRoughness = lanesOf([&](std::size_t i) { return s[i].clearcoatRoughness; });
            all_.sheenColour = vectorsOf([&](std::size_t i) { return s[i].sheenColour; });
            all_.sheenRoughness = lanesOf([&](std::size_t i) { return s[i].sheenRoughness; });
            for (std::size_t i = 0; i < kLanes; ++i) all_.sheenTable.table[i] = s[i].sheenTable[0];
        }
        if constexpr (F.glass) {
            all_.transmission = lanesOf([&](std::size_t i) { return s[i].transmission; });
            for (std::size_t i = 0; i < kLanes; ++i) all_.glassTable.table[i] = s[i].glassTable[0];
        }
    }
    FourSurfaces(const FourSurfaces&) = delete;
    FourSurfaces& operator=(const FourSurfaces&) = delete;

    const SurfaceParametersOf<Lanes>& operator*() const { return all_; }

  private:
    SurfaceParametersOf<Lanes> all_;
    DielectricLayerOf<Lanes> layer_;
};

}  // namespace vlx::render
