#include "variolux/base/sobol.h"

#include <array>
#include <cassert>
#include <utility>

namespace vlx {
namespace {

/// Columns of a square matrix over GF(2), one bit a row.
using BitMatrix = std::array<std::uint32_t, kMaxCellDepth>;

constexpr std::uint32_t lowBits(int count) { return (1u << count) - 1u; }

/// Inverse of the map from index bits depth .. 2 depth - 1 to the first `depth` digits of the second
/// coordinate. It exists because the sequence is a (0,2)-sequence; Gauss-Jordan elimination by columns.
constexpr BitMatrix invertedBlock(int depth) {
    BitMatrix columns{};
    BitMatrix inverse{};
    for (int k = 0; k < depth; ++k) {
        columns[static_cast<std::size_t>(k)] = sobolSecondDigits(1u << (depth + k)) & lowBits(depth);
        inverse[static_cast<std::size_t>(k)] = 1u << k;
    }
    for (int row = 0; row < depth; ++row) {
        const auto r = static_cast<std::size_t>(row);
        std::size_t pivot = r;
        while (!((columns[pivot] >> row) & 1u)) ++pivot;
        std::swap(columns[pivot], columns[r]);
        std::swap(inverse[pivot], inverse[r]);
        for (std::size_t k = 0; k < static_cast<std::size_t>(depth); ++k) {
            if (k == r || !((columns[k] >> row) & 1u)) continue;
            columns[k] ^= columns[r];
            inverse[k] ^= inverse[r];
        }
    }
    return inverse;
}

constexpr auto kInverses = [] {
    std::array<BitMatrix, kMaxCellDepth + 1> all{};
    for (int depth = 0; depth <= kMaxCellDepth; ++depth)
        all[static_cast<std::size_t>(depth)] = invertedBlock(depth);
    return all;
}();

/// The `depth` digits that scrambling turns into `scrambled`. Digit k of the result depends on digits 0..k
/// only and flips with digit k, so they are found one after the other.
std::uint32_t unscrambledDigits(std::uint32_t scrambled, int depth, std::uint32_t seed) {
    std::uint32_t digits = 0;
    for (int k = 0; k < depth; ++k) digits |= (scrambleDigits(digits, seed) ^ scrambled) & (1u << k);
    return digits;
}

/// The `depth` bits of a cell coordinate as a digit word.
std::uint32_t cellDigits(std::uint32_t cell, int depth) {
    return depth == 0 ? 0 : reverseBits(cell << (32 - depth));
}

}  // namespace

std::uint32_t sobolIndexInCell(int depth, std::uint32_t cellX, std::uint32_t cellY, std::uint32_t rank,
                               SobolSeeds seeds) {
    assert(depth >= 0 && depth <= kMaxCellDepth);
    assert(cellX <= lowBits(depth) && cellY <= lowBits(depth));
    // The first coordinate's digits are the index's low bits.
    std::uint32_t index = rank << (2 * depth);
    index |= unscrambledDigits(cellDigits(cellX, depth), depth, seeds.x);
    // The bits between are whatever gives the second coordinate its digits.
    const std::uint32_t wanted = unscrambledDigits(cellDigits(cellY, depth), depth, seeds.y);
    const std::uint32_t missing = (sobolSecondDigits(index) ^ wanted) & lowBits(depth);
    const BitMatrix& inverse = kInverses[static_cast<std::size_t>(depth)];
    std::uint32_t bits = 0;
    for (int row = 0; row < depth; ++row)
        if ((missing >> row) & 1u) bits ^= inverse[static_cast<std::size_t>(row)];
    return index | bits << depth;
}

}  // namespace vlx
