#pragma once

#include <cstdint>

/// The two-dimensional Sobol sequence, a (0,2)-sequence in base 2, and its randomisation by Owen scrambling.
///
/// *Elementary interval*: [a/2^i, (a+1)/2^i) x [b/2^j, (b+1)/2^j). In a (0,2)-sequence each run of 2^m
/// consecutive points that starts at a multiple of 2^m has exactly one point in every elementary interval of
/// area 2^-m, for every m. For squares (i = j) this is what hierarchical sampling needs: the first 4n points
/// put n into each quadrant, each quadrant topped up to 4n points of the sequence has n in each of its
/// quadrants, and so on.
///
/// Coordinates are 32-bit fixed point: value / 2^32, its bits are its binary digits, most significant first.
/// *Digit words* are the same bits the other way round (bit 0 is the first digit after the point): the order
/// in which scrambling is cheap.
namespace vlx {

struct SobolPoint {
    std::uint32_t x = 0;  ///< x / 2^32 in [0, 1)
    std::uint32_t y = 0;

    bool operator==(const SobolPoint&) const = default;
};

/// The 24 leading digits as a float in [0, 1). Elementary intervals to depth 24 stay exact.
constexpr float unitFloat(std::uint32_t fixedPoint) { return static_cast<float>(fixedPoint >> 8) * 0x1p-24f; }

constexpr std::uint32_t reverseBits(std::uint32_t v) {
    v = __builtin_bswap32(v);
    v = ((v >> 4) & 0x0f0f0f0fu) | ((v & 0x0f0f0f0fu) << 4);
    v = ((v >> 2) & 0x33333333u) | ((v & 0x33333333u) << 2);
    return ((v >> 1) & 0x55555555u) | ((v & 0x55555555u) << 1);
}

/// Digit word of the sequence's second coordinate. (The first coordinate's is the index itself: van der
/// Corput.) The generator matrix is Pascal's triangle modulo 2: digit j is the sum of the index's bits i with
/// C(i, j) odd, that is (Lucas) those whose i has all of j's bits. Sums over such supersets take
/// log2(32) steps; the transform is its own inverse.
constexpr std::uint32_t sobolSecondDigits(std::uint32_t index) {
    std::uint32_t d = index;
    d ^= (d >> 1) & 0x55555555u;
    d ^= (d >> 2) & 0x33333333u;
    d ^= (d >> 4) & 0x0f0f0f0fu;
    d ^= (d >> 8) & 0x00ff00ffu;
    d ^= (d >> 16) & 0x0000ffffu;
    return d;
}

/// Nested uniform (Owen) scrambling of a digit word: digit k is flipped or not by a hash of `seed` and the
/// digits before it. In a digit word these are the lower bits, and additions, odd multiplications and
/// x ^= x * even only carry upwards: any composition of them is a nested scrambling, so elementary intervals
/// map to elementary intervals exactly (Laine, Karras, "Stratified sampling for stochastic transparency",
/// 2011). How random the flips are depends on the constants: these are Vegdahl's ("Building a better LK
/// hash", 2021), which tests/base/sobol_test.cpp checks against a scrambling with an independent hash for
/// each digit.
constexpr std::uint32_t scrambleDigits(std::uint32_t digits, std::uint32_t seed) {
    std::uint32_t d = digits;
    d ^= d * 0x3d20adeau;
    d += seed;
    d *= (seed >> 16) | 1u;
    d ^= d * 0x05526c56u;
    d ^= d * 0x53a22864u;
    return d;
}

/// Point `index` of the sequence, not scrambled; the first points are (0,0), (1/2,1/2), (1/4,3/4), (3/4,1/4).
constexpr SobolPoint sobolPoint(std::uint32_t index) {
    return {reverseBits(index), reverseBits(sobolSecondDigits(index))};
}

/// Seeds of the two coordinates' scramblings; unequal and random seeds for independent ones.
struct SobolSeeds {
    std::uint32_t x = 0;
    std::uint32_t y = 0;

    /// Both from one 64-bit hash.
    static constexpr SobolSeeds from(std::uint64_t hash) {
        return {static_cast<std::uint32_t>(hash), static_cast<std::uint32_t>(hash >> 32)};
    }
};

/// Point `index` of the sequence, Owen-scrambled: each point is uniformly distributed over the seeds, and all
/// together are still a (0,2)-sequence.
constexpr SobolPoint scrambledSobolPoint(std::uint32_t index, SobolSeeds seeds) {
    return {reverseBits(scrambleDigits(index, seeds.x)),
            reverseBits(scrambleDigits(sobolSecondDigits(index), seeds.y))};
}

/// A nested uniform permutation of indices: each aligned run of 2^m indices maps onto an aligned run of 2^m
/// indices. Points taken in this order are still (0,2)-nets run by run, but are no longer correlated with
/// another pair of dimensions taken in its own order: how two-dimensional sequences are padded to many
/// dimensions (Kollig, Keller, "Efficient multidimensional sampling", 2002; Burley, "Practical hash-based
/// Owen scrambling", 2020). `reversedIndex` is reverseBits(index), computed once for all dimensions.
constexpr std::uint32_t shuffledIndex(std::uint32_t reversedIndex, std::uint32_t seed) {
    return reverseBits(scrambleDigits(reversedIndex, seed));
}

/// Deepest cells of sobolIndexInCell.
inline constexpr int kMaxCellDepth = 14;

/// The index of the point number `rank` (from 0) of the scrambled sequence inside the square cell
/// [cellX, cellX + 1) x [cellY, cellY + 1) / 2^depth, in the order of the sequence: it is
/// rank * 4^depth + (the one index below 4^depth that fits). Found by inverting the generator matrices and
/// the scrambling on the first `depth` digits, not by search.
/// Valid: 0 <= depth <= kMaxCellDepth, cell coordinates below 2^depth, rank below 2^(32 - 2 depth).
std::uint32_t sobolIndexInCell(int depth, std::uint32_t cellX, std::uint32_t cellY, std::uint32_t rank,
                               SobolSeeds seeds);

}  // namespace vlx
