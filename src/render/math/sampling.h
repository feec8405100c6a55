#pragma once

#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "render/math/vec.h"
#include "variolux/base/hash.h"
#include "variolux/base/sobol.h"

namespace vlx::render {

/// Which pair of random numbers is for what. Pairs have names, not places in a row: a pair is computed only
/// for an effect that is simulated, and leaving one effect out changes no other effect's numbers.
namespace dimension {
inline constexpr std::uint32_t kPixel = 0;
inline constexpr std::uint32_t kLens = 1;
inline constexpr std::uint32_t kOpacity = 2;         ///< seeds the hash of stochastic opacity
inline constexpr std::uint32_t kTime = 0x80000000u;  ///< x: while the shutter is open
inline constexpr std::uint32_t kFirstBounce = 3;
inline constexpr std::uint32_t kPerBounce = 4;
// Added to the bounce's first pair:
inline constexpr std::uint32_t kDirection = 0;    ///< direction within the sampled lobe
inline constexpr std::uint32_t kChoice = 1;       ///< x: lobe, y: Russian roulette
inline constexpr std::uint32_t kLight = 2;        ///< point on the light
inline constexpr std::uint32_t kLightChoice = 3;  ///< x: which light

// Of light subpaths (bidirectional.h):
inline constexpr std::uint32_t kEmission = 0x40000000u;        ///< x: which light
inline constexpr std::uint32_t kEmissionOrigin = 0x40000001u;  ///< point on the light
inline constexpr std::uint32_t kEmissionDirection = 0x40000002u;
inline constexpr std::uint32_t kLightLens = 0x40000003u;  ///< point of the lens that the subpath is seen from
inline constexpr std::uint32_t kLightOpacity = 0x40000004u;  ///< seeds the hash of opacity
inline constexpr std::uint32_t kFirstLightBounce = 0x40000008u;
inline constexpr std::uint32_t kPerLightBounce = 2;  ///< kDirection, kChoice

constexpr std::uint32_t atBounce(int bounce, std::uint32_t use) {
    return kFirstBounce + static_cast<std::uint32_t>(bounce) * kPerBounce + use;
}
}  // namespace dimension

/// The random numbers of one camera sample: pairs of dimensions of Owen-scrambled, shuffled Sobol points.
/// Stateless: a pair depends on (seed, index, dimension) only.
class PathSampler {
  public:
    /// `seed`: of the pixel; `index`: of the sample in its pixel.
    PathSampler(std::uint64_t seed, std::uint32_t index) : seed_(seed), reversedIndex_(reverseBits(index)) {}

    Vec2 pair(std::uint32_t dimensionPair) const {
        const std::uint64_t hash = mixBits(seed_ + dimensionPair * 0x9e3779b97f4a7c15u);
        const std::uint32_t index = shuffledIndex(reversedIndex_, static_cast<std::uint32_t>(hash));
        const SobolPoint p = scrambledSobolPoint(index, SobolSeeds::from(mixBits(hash)));
        return {unitFloat(p.x), unitFloat(p.y)};
    }

    /// All pairs of a bounce, kDirection to kLightChoice, side by side: the same numbers as pair() gives.
    std::array<Vec2, dimension::kPerBounce> bounce(int number) const {
        Words order, x, y;
        for (std::uint32_t i = 0; i < dimension::kPerBounce; ++i) {
            const std::uint64_t hash = mixBits(seed_ + dimension::atBounce(number, i) * 0x9e3779b97f4a7c15u);
            const SobolSeeds seeds = SobolSeeds::from(mixBits(hash));
            order[i] = static_cast<std::uint32_t>(hash);
            x[i] = seeds.x;
            y[i] = seeds.y;
        }
        const Words reversed{reversedIndex_, reversedIndex_, reversedIndex_, reversedIndex_};
        const Words index = reversedBits(scrambled(reversed, order));
        return points(reversedBits(scrambled(index, x)), reversedBits(scrambled(secondDigits(index), y)));
    }

    /// The same pair of four samples in turn, from number `first` on.
    static std::array<Vec2, 4> ofFour(std::uint64_t seed, std::uint32_t first, std::uint32_t dimensionPair) {
        const std::uint64_t hash = mixBits(seed + dimensionPair * 0x9e3779b97f4a7c15u);
        const SobolSeeds seeds = SobolSeeds::from(mixBits(hash));
        const Words none{}, numbers = Words{0, 1, 2, 3} + first;
        const Words index =
            reversedBits(scrambled(reversedBits(numbers), none + static_cast<std::uint32_t>(hash)));
        return points(reversedBits(scrambled(index, none + seeds.x)),
                      reversedBits(scrambled(secondDigits(index), none + seeds.y)));
    }

    /// A seed that belongs to this sample alone, for hashed decisions along the path.
    std::uint32_t hashSeed(std::uint32_t dimensionPair) const {
        return static_cast<std::uint32_t>(hashOf(seed_, reversedIndex_, dimensionPair));
    }

  private:
    // sobol.h's functions on four words at once.
    using Words [[gnu::vector_size(16)]] = std::uint32_t;
    static_assert(dimension::kPerBounce == 4);

    static std::array<Vec2, 4> points(Words x, Words y) {
        x >>= 8;
        y >>= 8;
        std::array<Vec2, 4> pairs;
        for (std::uint32_t i = 0; i < 4; ++i)
            pairs[i] = {static_cast<float>(static_cast<std::int32_t>(x[i])) * 0x1p-24f,
                        static_cast<float>(static_cast<std::int32_t>(y[i])) * 0x1p-24f};
        return pairs;
    }
    static Words reversedBits(Words v) {
        v = ((v >> 16) & 0x0000ffffu) | (v << 16);
        v = ((v >> 8) & 0x00ff00ffu) | ((v & 0x00ff00ffu) << 8);
        v = ((v >> 4) & 0x0f0f0f0fu) | ((v & 0x0f0f0f0fu) << 4);
        v = ((v >> 2) & 0x33333333u) | ((v & 0x33333333u) << 2);
        return ((v >> 1) & 0x55555555u) | ((v & 0x55555555u) << 1);
    }
    static Words secondDigits(Words d) {
        d ^= (d >> 1) & 0x55555555u;
        d ^= (d >> 2) & 0x33333333u;
        d ^= (d >> 4) & 0x0f0f0f0fu;
        d ^= (d >> 8) & 0x00ff00ffu;
        d ^= (d >> 16) & 0x0000ffffu;
        return d;
    }
    static Words scrambled(Words d, Words seed) {
        d ^= d * 0x3d20adeau;
        d += seed;
        d *= (seed >> 16) | 1u;
        d ^= d * 0x05526c56u;
        d ^= d * 0x53a22864u;
        return d;
    }

    std::uint64_t seed_;
    std::uint32_t reversedIndex_;
};

/// Uniform square to uniform unit disk, concentric (Shirley, Chiu, 1997).
template <class Real>
Vec2Of<Real> toDisk(const Vec2Of<Real>& u) {
    const Real a = 2.f * u.x - 1.f, b = 2.f * u.y - 1.f;
    const Mask<Real> wide = magnitude(a) > magnitude(b);
    const Real r = wide ? a : b;
    // Sine and cosine of an angle of at most pi / 4, from the nearer axis: Taylor's series is exact in float.
    const Real x = (kPi / 4) * ((wide ? b : a) / r), x2 = x * x;
    const Real sine =
        x * (1.f + x2 * (-1.f / 6 + x2 * (1.f / 120 + x2 * (-1.f / 5040 + x2 * (1.f / 362880)))));
    const Real cosine = 1.f + x2 * (-0.5f + x2 * (1.f / 24 + x2 * (-1.f / 720 + x2 * (1.f / 40320))));
    const Mask<Real> centre = r == 0;
    const Real along = centre ? Real{} : r * cosine, across = centre ? Real{} : r * sine;
    return {wide ? along : across, wide ? across : along};
}

/// Cosine-weighted direction about +z; density cos / pi.
template <class Real>
Vec3Of<Real> cosineHemisphere(const Vec2Of<Real>& u) {
    const Vec2Of<Real> d = toDisk(u);
    return {d.x, d.y, squareRoot(larger(Real{}, 1.f - d.x * d.x - d.y * d.y))};
}

/// Uniform direction in the cone of directions with z >= cosMax; density 1 / (2 pi (1 - cosMax)).
/// `oneMinusCosMax` is passed as such: it keeps its precision for narrow cones.
inline Vec3 uniformCone(Vec2 u, float oneMinusCosMax) {
    const float oneMinusCos = u.x * oneMinusCosMax;
    const float sinTheta = std::sqrt(std::max(0.f, oneMinusCos * (2 - oneMinusCos)));
    const float phi = 2 * kPi * u.y;
    return {sinTheta * std::cos(phi), sinTheta * std::sin(phi), 1 - oneMinusCos};
}

/// Barycentric coordinates of a uniform point of a triangle (Heitz, "A low-distortion map between triangle
/// and square", 2019): b1, b2 of the second and third corner.
inline Vec2 uniformTriangle(Vec2 u) {
    float b1 = u.x, b2 = u.y;
    if (b2 > b1) {
        b1 *= 0.5f;
        b2 -= b1;
    } else {
        b2 *= 0.5f;
        b1 -= b2;
    }
    return {b1, b2};
}

/// A discrete distribution over n entries with given weights, sampled by its cumulative sums.
class Distribution {
  public:
    Distribution() = default;
    /// Weights >= 0, finite. When all are zero every entry is equally likely.
    explicit Distribution(std::span<const float> weights);

    struct Sample {
        std::size_t index = 0;
        float probability = 0;
        float remapped = 0;  ///< where u fell inside the entry's interval: a uniform number again
    };
    Sample sample(float u) const;
    float probability(std::size_t index) const { return cumulative_[index + 1] - cumulative_[index]; }
    std::size_t size() const { return cumulative_.empty() ? 0 : cumulative_.size() - 1; }

  private:
    std::vector<float> cumulative_;  ///< size() + 1 values from 0 to 1
};

inline Distribution::Sample Distribution::sample(float u) const {
    // The last entry whose lower bound is <= u: entries of probability 0 are never taken, because the next
    // one has the same lower bound.
    const auto above = std::upper_bound(cumulative_.begin(), cumulative_.end() - 1, u);
    const auto index = static_cast<std::size_t>(above - cumulative_.begin()) - 1;
    const float p = probability(index);
    return {index, p, std::min((u - cumulative_[index]) / p, 0x1.fffffep-1f)};
}

}  // namespace vlx::render
