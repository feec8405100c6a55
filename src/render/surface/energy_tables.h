#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "render/surface/ggx.h"

namespace vlx::render {

/// Directional albedo of single-scattering GGX reflection, split so that it is linear in the reflectances at
/// normal (f0) and grazing incidence (f90): f0 (whole - grazing) + f90 grazing.
struct alignas(16) Albedo {
    float whole = 1;       ///< of a perfect reflector: 1 minus what masking and shadowing lose
    float conductor = 0;   ///< `grazing` of metals: the part weighted by Schlick's (1 - cos)^5
    float dielectric = 0;  ///< `grazing` of dielectrics: the part weighted by dielectricWeight
    float unused = 0;

    Albedo operator*(float s) const { return std::bit_cast<Albedo>(lanes() * s); }
    Albedo operator+(const Albedo& o) const { return std::bit_cast<Albedo>(lanes() + o.lanes()); }

  private:
    using Lanes [[gnu::vector_size(16)]] = float;
    Lanes lanes() const { return std::bit_cast<Lanes>(*this); }
};

/// Four of them.
struct AlbedoLanes {
    Lanes whole, conductor, dielectric;
};

template <class Real>
using AlbedoOf = PerReal<Real, Albedo, AlbedoLanes>;

/// How far the exact Fresnel reflectance at cosTheta has risen from normal (0) to grazing incidence (1).
/// Where glTF's sample code has Schlick's (1 - cos)^5: that is 15 % too low at 65 degrees for glass.
template <class Real>
Real dielectricWeight(Real cosTheta, Real eta, Real f0) {
    const Real risen = larger(Real{}, (dielectricFresnel(cosTheta, eta) - f0) / (1.f - f0));
    return f0 < 1.f ? risen : spread<Real>(1);
}

/// Reflectance of a boundary at normal incidence.
inline float normalReflectance(float ior) { return square((ior - 1) / (ior + 1)); }

struct TablePosition {
    std::size_t cell;
    float t;
};

/// Where a node coordinate in [0, 1] falls among `size` nodes.
inline TablePosition tablePosition(float coordinate, std::size_t size) {
    const float scaled = std::clamp(coordinate, 0.f, 1.f) * static_cast<float>(size - 1);
    const std::size_t cell = std::min(static_cast<std::size_t>(scaled), size - 2);
    return {cell, scaled - static_cast<float>(cell)};
}

inline std::array<TablePosition, kLanes> tablePositions(Lanes coordinate, std::size_t size) {
    const Lanes scaled = clamped(coordinate, Lanes{}, spread<Lanes>(1)) * static_cast<float>(size - 1);
    const auto last = static_cast<std::int32_t>(size - 2);
    LaneMask cell = __builtin_convertvector(scaled, LaneMask);
    cell = cell > last ? LaneMask{} + last : cell;
    const Lanes t = scaled - __builtin_convertvector(cell, Lanes);
    std::array<TablePosition, kLanes> out;
    for (std::size_t i = 0; i < kLanes; ++i) out[i] = {static_cast<std::size_t>(cell[i]), t[i]};
    return out;
}

/// Albedo over the cosine to the normal and the roughness, and its cosine-weighted mean, for one index of
/// refraction: what multiple-scattering compensation needs (Kulla, Conty, "Revisiting physically based
/// shading at Imageworks", 2017). Computed once by quasi-Monte Carlo over visible normals; energy is kept to
/// 1 %.
class AlbedoTable {
  public:
    explicit AlbedoTable(float ior);

    /// The table at one roughness, ready for look-ups by cosine.
    class Row {
      public:
        Albedo at(float cosTheta) const { return between(tablePosition(rootOf(cosTheta), kSize)); }
        const Albedo& mean() const { return mean_; }
        /// The mean over directions above a plane whose normal is tilted.
        Albedo meanAbove(float cosTilt) const;

      private:
        friend class AlbedoTable;
        friend struct AlbedoRowLanes;
        template <class Real>
        static Real rootOf(Real cosTheta) {
            return squareRoot(larger(Real{}, cosTheta));
        }
        Albedo between(const TablePosition& cosine) const;
        const AlbedoTable* table_ = nullptr;
        std::uint32_t index_ = 0;  ///< between this roughness and the next
        float t_ = 0;
        Albedo mean_;
    };

    float ior() const { return ior_; }
    /// `roughness` is perceptual: sqrt(alpha), in [0, 1].
    Row row(float roughness) const;
    /// Cosine-weighted mean of dielectricWeight.
    float meanWeight() const { return meanWeight_; }

  private:
    friend struct AlbedoRowLanes;
    static constexpr std::size_t kSize = 32;
    float ior_;
    float meanWeight_ = 0;
    /// Nodes are at roughness i / (kSize - 1), and at cosines (j / (kSize - 1))^2: dense at grazing angles.
    std::array<std::array<Albedo, kSize>, kSize> cells_;
    static constexpr std::size_t kTilts = 16;
    /// Means above planes at cosines k / (kTilts - 1) of the tilt; the last of each is the mean over all.
    std::array<std::array<Albedo, kTilts>, kSize> means_;
};

inline AlbedoTable::Row AlbedoTable::row(float roughness) const {
    const auto [i, t] = tablePosition(roughness, kSize);
    Row row;
    row.table_ = this;
    row.index_ = static_cast<std::uint32_t>(i);
    row.t_ = t;
    row.mean_ = means_[i][kTilts - 1] * (1 - t) + means_[i + 1][kTilts - 1] * t;
    return row;
}

inline Albedo AlbedoTable::Row::meanAbove(float cosTilt) const {
    const auto [k, t] = tablePosition(cosTilt, kTilts);
    const auto &low = table_->means_[index_], &high = table_->means_[index_ + 1];
    return (low[k] * (1 - t) + low[k + 1] * t) * (1 - t_) + (high[k] * (1 - t) + high[k + 1] * t) * t_;
}

inline Albedo AlbedoTable::Row::between(const TablePosition& cosine) const {
    const auto [j, t] = cosine;
    const auto &low = table_->cells_[index_], &high = table_->cells_[index_ + 1];
    return (low[j] * (1 - t) + low[j + 1] * t) * (1 - t_) + (high[j] * (1 - t) + high[j + 1] * t) * t_;
}

/// Rows of four surfaces.
struct AlbedoRowLanes {
    std::array<AlbedoTable::Row, kLanes> rows;

    AlbedoLanes at(Lanes cosTheta) const {
        const std::array<TablePosition, kLanes> at =
            tablePositions(AlbedoTable::Row::rootOf(cosTheta), AlbedoTable::kSize);
        return of([&](std::size_t i) { return rows[i].between(at[i]); });
    }
    AlbedoLanes mean() const {
        return of([&](std::size_t i) { return rows[i].mean(); });
    }
    AlbedoLanes meanAbove(Lanes cosTilt) const {
        return of([&](std::size_t i) { return rows[i].meanAbove(cosTilt[i]); });
    }

  private:
    template <class Function>
    static AlbedoLanes of(const Function& albedo) {
        const Albedo a = albedo(0), b = albedo(1), c = albedo(2), d = albedo(3);
        return {Lanes{a.whole, b.whole, c.whole, d.whole},
                Lanes{a.conductor, b.conductor, c.conductor, d.conductor},
                Lanes{a.dielectric, b.dielectric, c.dielectric, d.dielectric}};
    }
};

template <class Real>
using AlbedoRowOf = PerReal<Real, AlbedoTable::Row, AlbedoRowLanes>;

inline AlbedoTable::Row rowsOf(const AlbedoTable& table, float roughness) { return table.row(roughness); }
inline AlbedoRowLanes rowsOf(const AlbedoTable& table, Lanes roughness) {
    return {
        {table.row(roughness[0]), table.row(roughness[1]), table.row(roughness[2]), table.row(roughness[3])}};
}

/// A table for each lane.
template <class Table, class Real>
struct Tables {
    const Table* table = nullptr;
    const Table* operator[](std::size_t) const { return table; }
};
template <class Table>
struct Tables<Table, Lanes> {
    std::array<const Table*, kLanes> table{};
    const Table* operator[](std::size_t i) const { return table[i]; }
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
