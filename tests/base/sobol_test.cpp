#include "variolux/base/sobol.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "variolux/base/hash.h"

namespace vlx {
namespace {

using Sequence = std::function<SobolPoint(std::uint32_t)>;

SobolSeeds seedsOf(int k) { return SobolSeeds::from(hashOf(k, 99)); }

/// The sequence as it is, and scrambled by several seeds.
std::vector<Sequence> sequences() {
    std::vector<Sequence> all{sobolPoint};
    for (int k = 0; k < 8; ++k)
        all.push_back([k](std::uint32_t i) { return scrambledSobolPoint(i, seedsOf(k)); });
    return all;
}

std::uint32_t leadingDigits(std::uint32_t value, int digits) {
    return digits == 0 ? 0 : value >> (32 - digits);
}

TEST(Sobol, FirstPoints) {
    const std::uint32_t half = 1u << 31, quarter = 1u << 30;
    EXPECT_EQ(sobolPoint(0), (SobolPoint{0, 0}));
    EXPECT_EQ(sobolPoint(1), (SobolPoint{half, half}));
    EXPECT_EQ(sobolPoint(2), (SobolPoint{quarter, half + quarter}));
    EXPECT_EQ(sobolPoint(3), (SobolPoint{half + quarter, quarter}));
}

TEST(Sobol, EveryRunOf2ToTheMHasOnePointInEveryElementaryIntervalOfThatArea) {
    for (const Sequence& point : sequences()) {
        for (int m = 0; m <= 10; ++m) {
            const std::uint32_t run = 1u << m;
            for (std::uint32_t start : {0u, run, 5 * run, 64 * run}) {
                for (int i = 0; i <= m; ++i) {
                    std::vector<int> hits(run, 0);
                    for (std::uint32_t k = start; k < start + run; ++k) {
                        const SobolPoint p = point(k);
                        ++hits[leadingDigits(p.x, i) << (m - i) | leadingDigits(p.y, m - i)];
                    }
                    for (const int h : hits) ASSERT_EQ(h, 1) << "m = " << m << ", i = " << i;
                }
            }
        }
    }
}

/// METHOD.md, section 2, n = 4: the first 4n points of any cell have n in each of its quadrants. One branch
/// of the tree, down to the last depth.
TEST(Sobol, FirstSixteenPointsOfACellHaveFourInEachQuadrantAtEveryDepth) {
    for (int k = 0; k < 20; ++k) {
        const SobolSeeds seeds = seedsOf(k);
        std::uint32_t x = 0, y = 0;
        for (int depth = 0; depth <= kMaxCellDepth; ++depth) {
            int inQuadrant[4] = {0, 0, 0, 0};
            for (std::uint32_t rank = 0; rank < 16; ++rank) {
                const SobolPoint p = scrambledSobolPoint(sobolIndexInCell(depth, x, y, rank, seeds), seeds);
                ASSERT_EQ(leadingDigits(p.x, depth), x);
                ASSERT_EQ(leadingDigits(p.y, depth), y);
                ++inQuadrant[((p.x >> (31 - depth)) & 1) + 2 * ((p.y >> (31 - depth)) & 1)];
            }
            for (const int n : inQuadrant) ASSERT_EQ(n, 4) << "depth " << depth;
            const std::uint64_t next = hashOf(k, depth);
            x = 2 * x + (next & 1);
            y = 2 * y + ((next >> 1) & 1);
        }
    }
}

TEST(Sobol, IndexInCellFindsWhatASearchFinds) {
    for (int k = 0; k < 4; ++k) {
        const SobolSeeds seeds = seedsOf(k);
        for (int depth = 0; depth <= 4; ++depth) {
            const std::uint32_t side = 1u << depth;
            std::vector<std::uint32_t> found(side * side, 0);
            for (std::uint32_t index = 0; index < 16 * side * side; ++index) {
                const SobolPoint p = scrambledSobolPoint(index, seeds);
                const std::uint32_t x = leadingDigits(p.x, depth), y = leadingDigits(p.y, depth);
                const std::uint32_t rank = found[y * side + x]++;
                ASSERT_EQ(sobolIndexInCell(depth, x, y, rank, seeds), index) << "depth " << depth;
            }
        }
    }
}

TEST(OwenScrambling, KeepsPrefixesApartAndTogether) {
    // Numbers that agree in their first k digits still do, and differ in the next one if they did.
    for (int k = 0; k < 31; ++k) {
        for (int t = 0; t < 100; ++t) {
            const auto seed = static_cast<std::uint32_t>(hashOf(t, 1));
            const auto a = static_cast<std::uint32_t>(hashOf(t, k));
            const auto high = static_cast<std::uint32_t>(hashOf(t, k, 2));
            const std::uint32_t below = (1u << k) - 1;
            const std::uint32_t b = (a & below) | ((~a) & (1u << k)) | (high & ~below & ~(1u << k));
            const std::uint32_t difference = scrambleDigits(a, seed) ^ scrambleDigits(b, seed);
            ASSERT_EQ(difference & below, 0u);
            ASSERT_NE(difference & (1u << k), 0u);
        }
    }
}

TEST(OwenScrambling, EarlierDigitsFlipLaterOnesHalfOfTheTime) {
#ifdef VARIOLUX_SANITIZED
    const int trials = 1 << 12;
#else
    const int trials = 1 << 14;
#endif
    for (int in = 0; in < 31; ++in) {
        int flips[32] = {};
        for (int t = 0; t < trials; ++t) {
            const std::uint64_t h = hashOf(t, in, 7);
            const auto digits = static_cast<std::uint32_t>(h), seed = static_cast<std::uint32_t>(h >> 32);
            const std::uint32_t changed =
                scrambleDigits(digits, seed) ^ scrambleDigits(digits ^ (1u << in), seed);
            for (int out = in + 1; out < 32; ++out) flips[out] += (changed >> out) & 1;
        }
        // 496 binomial counts: 5 standard deviations leave 0.03 % for a false alarm.
        for (int out = in + 1; out < 32; ++out)
            ASSERT_NEAR(flips[out], trials / 2, 5 * 0.5 * std::sqrt(trials)) << in << " to " << out;
    }
}

/// A scrambling with an independent hash for every digit: slow, and beyond doubt.
std::uint32_t trulyScrambled(std::uint32_t digits, std::uint32_t seed) {
    std::uint32_t out = digits;
    for (int k = 0; k < 32; ++k) {
        const std::uint32_t before = digits & ((1u << k) - 1);
        out ^= static_cast<std::uint32_t>(hashOf(seed, k, before) & 1) << k;
    }
    return out;
}

/// Variance over seeds of the mean of a function over the first n scrambled points.
template <class Scramble>
double varianceOfMean(std::uint32_t n, int trials, Scramble scramble) {
    double sum = 0, squares = 0;
    for (int t = 0; t < trials; ++t) {
        const SobolSeeds seeds = seedsOf(t);
        double mean = 0;
        for (std::uint32_t i = 0; i < n; ++i) {
            const double x = reverseBits(scramble(i, seeds.x)) * 0x1p-32;
            const double y = reverseBits(scramble(sobolSecondDigits(i), seeds.y)) * 0x1p-32;
            mean += std::exp(-5 * (x - 0.3) * (x - 0.3) - 5 * (y - 0.6) * (y - 0.6)) + (x + y < 0.9) * 0.1;
        }
        mean /= n;
        sum += mean;
        squares += mean * mean;
    }
    return squares / trials - (sum / trials) * (sum / trials);
}

TEST(OwenScrambling, IntegratesAsWellAsAnIndependentHashForEveryDigit) {
#ifdef VARIOLUX_SANITIZED
    const int trials = 300;
    const double margin = 0.5;
#else
    const int trials = 4000;
    const double margin = 0.15;  // over 4 standard deviations of the ratio (sqrt(2 * 2 / 4000) = 0.03)
#endif
    for (const std::uint32_t n : {16u, 64u}) {
        const double own = varianceOfMean(n, trials, scrambleDigits);
        const double reference = varianceOfMean(n, trials, trulyScrambled);
        EXPECT_NEAR(own / reference, 1, margin) << n << " points";
    }
}

TEST(ShuffledIndex, PermutesEveryAlignedRun) {
    for (int m = 0; m <= 10; ++m) {
        const std::uint32_t run = 1u << m;
        for (std::uint32_t start : {0u, 3 * run}) {
            std::vector<int> hits(run, 0);
            std::uint32_t block = 0;
            for (std::uint32_t i = start; i < start + run; ++i) {
                const std::uint32_t s = shuffledIndex(reverseBits(i), 1234567u);
                if (i == start) block = s >> m;
                ASSERT_EQ(s >> m, block);
                ++hits[s & (run - 1)];
            }
            for (const int h : hits) ASSERT_EQ(h, 1);
        }
    }
}

TEST(UnitFloat, StaysBelowOneAndKeepsLeadingDigits) {
    EXPECT_EQ(unitFloat(0), 0.f);
    EXPECT_LT(unitFloat(0xffffffffu), 1.f);
    EXPECT_EQ(unitFloat(1u << 31), 0.5f);
}

}  // namespace
}  // namespace vlx
