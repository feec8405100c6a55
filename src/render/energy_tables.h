#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "ggx.h"

namespace vlx::render {

/// Directional albedo of single-scattering GGX reflection with Schlick's Fresnel term, split so that it is
/// linear in the reflectances: albedo(mu; f0, f90) = f0 (whole - grazing) + f90 grazing.
struct Albedo {
    float whole = 1;    ///< of a perfectly reflecting surface: 1 minus what masking and shadowing lose
    float grazing = 0;  ///< the part weighted by (1 - cos)^5

    Albedo operator*(float s) const { return {whole * s, grazing * s}; }
    Albedo operator+(const Albedo& o) const { return {whole + o.whole, grazing + o.grazing}; }
};

/// Albedo over the cosine to the normal and the roughness, and its cosine-weighted mean: what
/// multiple-scattering compensation needs (Kulla, Conty, "Revisiting physically based shading at Imageworks",
/// 2017). Computed once by quasi-Monte Carlo over visible normals; relative error below 0.002.
class AlbedoTable {
  public:
    AlbedoTable();

    /// The table at one roughness, ready for look-ups by cosine.
    class Row {
      public:
        Albedo at(float cosTheta) const;
        const Albedo& mean() const { return mean_; }

      private:
        friend class AlbedoTable;
        const Albedo* low_ = nullptr;
        const Albedo* high_ = nullptr;
        float t_ = 0;
        Albedo mean_;
    };

    /// `roughness` is perceptual: sqrt(alpha), in [0, 1].
    Row row(float roughness) const;

  private:
    static constexpr std::size_t kSize = 32;
    /// Nodes are at roughness i / (kSize - 1), and at cosines (j / (kSize - 1))^2: dense at grazing angles.
    std::array<std::array<Albedo, kSize>, kSize> cells_;
    std::array<Albedo, kSize> means_;
};

/// Fraction of energy that single-scattering GGX reflection and refraction keep together at a dielectric
/// boundary of one index of refraction, seen from each side.
class GlassTable {
  public:
    explicit GlassTable(float ior);

    float ior() const { return ior_; }
    float kept(float cosTheta, float roughness, bool fromInside) const;

  private:
    static constexpr std::size_t kSize = 16;
    using Side = std::array<std::array<float, kSize>, kSize>;
    float ior_;
    std::array<Side, 2> sides_;
};

}  // namespace vlx::render
