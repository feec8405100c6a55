#include "render/film/region_sampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "render/math/sampling.h"
#include "variolux/base/hash.h"

namespace vlx::render {
namespace {

struct Taken {
    std::vector<CameraSample> samples;
    std::vector<int> refined;

    /// Samples in each cell of `side` pixels.
    std::map<std::pair<int, int>, int> cells(double side) const {
        std::map<std::pair<int, int>, int> counts;
        for (const CameraSample& s : samples)
            ++counts[{static_cast<int>(std::floor(s.x / side)), static_cast<int>(std::floor(s.y / side))}];
        return counts;
    }
};

Taken take(const Window& window, int rx, int ry, const HierarchicalOptions& options, std::uint64_t seed,
           const std::function<Rgb(const CameraSample&)>& radiance) {
    Taken t;
    t.refined = sampleHierarchically(window, rx, ry, options, seed, [&](const CameraSample& s) {
        t.samples.push_back(s);
        return radiance(s);
    });
    return t;
}

Rgb constant(const CameraSample&) { return Rgb(1); }

/// White noise: nothing to stop for.
Rgb noise(const CameraSample& s) { return Rgb(static_cast<float>(hashOf(s.seed, s.index) % 1000)); }

const Window kRegion{4, 8, 4, 4};  // region (1, 2)

TEST(Hierarchical, TakenToTheEndIs256SamplesAPixelSixteenInEachSixteenthOfIt) {
    HierarchicalOptions options;
    options.tolerance = 0;
    for (std::uint64_t seed = 0; seed < 4; ++seed) {
        const Taken t = take(kRegion, 1, 2, options, seed, constant);
        EXPECT_EQ(t.refined, (std::vector<int>{1, 4, 16, 64, 256}));
        EXPECT_EQ(t.samples.size(), 256u * 16);
        const auto quarters = t.cells(0.25);
        EXPECT_EQ(quarters.size(), 256u);
        for (const auto& [cell, count] : quarters) EXPECT_EQ(count, 16);
    }
}

TEST(Hierarchical, EachLevelTopsItsCellsUpToSixteen) {
    for (int levels = 1; levels <= 5; ++levels) {
        HierarchicalOptions options;
        options.tolerance = 0;
        options.levels = levels;
        const Taken t = take(kRegion, 1, 2, options, 7, constant);
        const auto perPixel = static_cast<std::size_t>(std::pow(4, levels - 1));
        EXPECT_EQ(t.samples.size(), 16 * perPixel);
        const double side = 4 / std::pow(2, levels - 1);
        const auto cells = t.cells(side);
        EXPECT_EQ(cells.size(), static_cast<std::size_t>(std::pow(4, levels - 1)));
        for (const auto& [cell, count] : cells) EXPECT_EQ(count, kCellSamples) << levels;
        // n points in each quadrant of each cell.
        for (const auto& [cell, count] : t.cells(side / 2)) EXPECT_EQ(count, 4) << levels;
    }
}

TEST(Hierarchical, SamplesLieInTheirPixelsAndAreCountedThere) {
    HierarchicalOptions options;
    options.tolerance = 0;
    const Taken t = take(kRegion, 1, 2, options, 7, constant);
    std::map<std::pair<int, int>, std::uint32_t> next;
    for (const CameraSample& s : t.samples) {
        EXPECT_EQ(std::floor(s.x), s.column);
        EXPECT_EQ(std::floor(s.y), s.row);
        EXPECT_TRUE(kRegion.contains(s.column, s.row));
        EXPECT_EQ(s.index, (next[{s.column, s.row}]++));
    }
}

TEST(Hierarchical, StopsAtOnceWhereNothingVaries) {
    HierarchicalOptions options;
    options.tolerance = 0.02;
    const Taken t = take(kRegion, 1, 2, options, 3, constant);
    EXPECT_EQ(t.samples.size(), 16u);
    EXPECT_EQ(t.refined, (std::vector<int>{1, 0, 0, 0, 0}));
    for (const auto& [pixel, count] : t.cells(1)) EXPECT_EQ(count, 1);
}

TEST(Hierarchical, GoesOnToTheEndUnderStrongNoise) {
    HierarchicalOptions options;
    options.tolerance = 0.001;
    const Taken t = take(kRegion, 1, 2, options, 3, noise);
    EXPECT_EQ(t.samples.size(), 4096u);
}

/// Noise of variance v and mean m: s^2 / 4^level / (m^2 + 0.01) <= tolerance^2 decides the last level.
TEST(Hierarchical, StopsAtTheLevelThatTheCriterionNames) {
    const double mean = 10, deviation = 4;  // relative 0.4: 0.4, 0.2, 0.1, 0.05 at levels 0 to 3
    const auto signs = [&](const CameraSample& s) {
        return Rgb(static_cast<float>(mean + (hashOf(s.seed, s.index, 5) % 2 == 0 ? deviation : -deviation)));
    };
    for (const auto& [tolerance, level] : {std::pair{0.6, 0}, std::pair{0.28, 1}, std::pair{0.14, 2}}) {
        HierarchicalOptions options;
        options.tolerance = tolerance;
        int expected = 0;
        for (std::uint64_t seed = 0; seed < 20; ++seed) {
            const Taken t = take(kRegion, 1, 2, options, seed, signs);
            expected += t.samples.size() == static_cast<std::size_t>(16 * std::pow(4, level));
        }
        EXPECT_GE(expected, 18) << tolerance;  // the estimated variance may err now and then
    }
}

TEST(Hierarchical, RefinesOnlyWhereItVaries) {
    HierarchicalOptions options;
    options.tolerance = 0.05;
    const auto half = [](const CameraSample& s) { return s.x < 6 ? Rgb(1) : noise(s); };
    const Taken t = take(kRegion, 1, 2, options, 11, half);
    for (const auto& [pixel, count] : t.cells(1))
        if (pixel.first < 6) {
            EXPECT_EQ(count, 4);  // its cells of 2 pixels, refined once
        } else {
            EXPECT_GT(count, 100);
        }
}

TEST(Hierarchical, RegionsAtBordersKeepTheirSequence) {
    HierarchicalOptions options;
    options.tolerance = 0;
    const Taken whole = take(kRegion, 1, 2, options, 5, constant);
    std::set<std::tuple<float, float, std::uint32_t>> all;
    for (const CameraSample& s : whole.samples) all.insert({s.x, s.y, s.index});
    for (const Window& part : {Window{4, 8, 1, 4}, Window{5, 9, 3, 1}, Window{7, 11, 1, 1}}) {
        const Taken t = take(part, 1, 2, options, 5, constant);
        EXPECT_EQ(t.samples.size(), static_cast<std::size_t>(part.pixels()) * 256);
        for (const CameraSample& s : t.samples) {
            EXPECT_TRUE(part.contains(s.column, s.row));
            EXPECT_TRUE(all.contains({s.x, s.y, s.index}));
        }
    }
}

TEST(Hierarchical, PartlyOutsideStillStops) {
    HierarchicalOptions options;
    options.tolerance = 0.02;
    // One pixel of the region: 1 sample says nothing about variance, 4 do.
    const Taken t = take({7, 11, 1, 1}, 1, 2, options, 5, constant);
    EXPECT_EQ(t.samples.size(), 4u);
}

TEST(Uniform, EachPixelIsStratified) {
    // Each half, of samples of even or of odd number.
    const Window window{100, 200, 3, 2};
    std::map<std::tuple<int, int, std::uint64_t>, std::vector<CameraSample>> halves;
    sampleUniformly(window, 32, 1, 9, [&](const CameraSample& s) {
        halves[{s.column, s.row, s.seed}].push_back(s);
        return Rgb();
    });
    EXPECT_EQ(halves.size(), 12u);
    for (const auto& [half, samples] : halves) {
        ASSERT_EQ(samples.size(), 16u);
        std::set<std::pair<int, int>> strata;
        for (const CameraSample& s : samples) {
            EXPECT_EQ(std::floor(s.x), s.column);
            EXPECT_EQ(std::floor(s.y), s.row);
            strata.insert({static_cast<int>((s.x - static_cast<float>(s.column)) * 4),
                           static_cast<int>((s.y - static_cast<float>(s.row)) * 4)});
        }
        EXPECT_EQ(strata.size(), 16u);
    }
}

TEST(Uniform, FarFromTheOriginRoundingKeepsSamplesInTheirPixels) {
    const int far = (1 << 20) - 8;  // a float has 4 bits left for the position in the pixel
    const auto check = [](const CameraSample& s) {
        EXPECT_EQ(std::floor(s.x), s.column);
        EXPECT_EQ(std::floor(s.y), s.row);
        return Rgb();
    };
    sampleUniformly({far, far, 2, 2}, 64, 1, 9, check);
    HierarchicalOptions options;
    options.tolerance = 0;
    sampleHierarchically({far, far, 4, 4}, far / 4, far / 4, options, 9, check);
}

TEST(Uniform, MoreSamplesBeginWithTheFewer) {
    const auto collect = [](int spp) {
        std::vector<std::pair<float, float>> positions;
        sampleUniformly({3, 5, 1, 1}, spp, 1, 9, [&](const CameraSample& s) {
            positions.emplace_back(s.x, s.y);
            return Rgb();
        });
        return positions;
    };
    const auto few = collect(5), many = collect(50);
    EXPECT_TRUE(std::equal(few.begin(), few.end(), many.begin()));
}

TEST(Uniform, SamplesOfEvenAndOddNumberAreSeparateRandomisations) {
    std::vector<CameraSample> samples;
    sampleUniformly({0, 0, 1, 1}, 9, 1, 1, [&](const CameraSample& s) {
        samples.push_back(s);
        return Rgb();
    });
    ASSERT_EQ(samples.size(), 9u);
    EXPECT_NE(samples[0].seed, samples[1].seed);
    for (std::size_t i = 0; i < samples.size(); ++i) {
        EXPECT_EQ(samples[i].seed, samples[i % 2].seed);
        EXPECT_EQ(samples[i].index, i / 2);
        EXPECT_EQ(samples[i].replicate, 0u);
        const CameraSample alone = sampleInPixel(0, 0, samples[i].seed, samples[i].index);
        EXPECT_EQ(samples[i].x, alone.x);
        EXPECT_EQ(samples[i].y, alone.y);
    }
}

TEST(Uniform, HalvesOfThePixelAreNotCorrelated) {
    // The mean position of each half of 4 samples: within a half spread evenly, between them by chance. One
    // randomisation of all 4 would have a correlation near -1.
    double products = 0, squares = 0, n = 0;
    sampleUniformly({0, 0, 64, 64}, 4, 1, 3,
                    [&, i = 0, sum = std::array<double, 2>{}](const CameraSample& s) mutable {
                        sum[static_cast<std::size_t>(i % 2)] += static_cast<double>(s.x) - s.column - 0.5;
                        if (++i % 4 == 0) {
                            products += sum[0] * sum[1];
                            squares += (sum[0] * sum[0] + sum[1] * sum[1]) / 2;
                            ++n;
                            sum = {};
                        }
                        return Rgb();
                    });
    EXPECT_LT(std::abs(products / squares), 4 / std::sqrt(n));  // four standard errors
}

TEST(Uniform, ReplicatesAreSeparateRandomisations) {
    std::map<std::uint32_t, std::vector<std::pair<float, float>>> replicates;
    std::set<std::uint64_t> seeds;
    sampleUniformly({0, 0, 1, 1}, 32, 4, 1, [&](const CameraSample& s) {
        replicates[s.replicate].emplace_back(s.x, s.y);
        seeds.insert(s.seed);
        return Rgb();
    });
    EXPECT_EQ(replicates.size(), 4u);
    EXPECT_EQ(seeds.size(), 4u);
    for (const auto& [replicate, positions] : replicates) {
        EXPECT_EQ(positions.size(), 8u);
        if (replicate > 0) {
            EXPECT_NE(positions, replicates[0]);
        }
    }
}

TEST(PathSampler, FourAtOnceAreTheSameNumbers) {
    for (std::uint32_t i = 0; i < 200; ++i) {
        const std::uint64_t seed = hashOf(i);
        const PathSampler sampler(seed, i);
        const int number = static_cast<int>(i % 13);
        const auto bounce = sampler.bounce(number);
        for (std::uint32_t use = 0; use < dimension::kPerBounce; ++use)
            EXPECT_EQ(bounce[use], sampler.pair(dimension::atBounce(number, use)));
        const auto four = PathSampler::ofFour(seed, i, dimension::kLens);
        for (std::uint32_t k = 0; k < 4; ++k)
            EXPECT_EQ(four[k], PathSampler(seed, i + k).pair(dimension::kLens));
    }
}

}  // namespace
}  // namespace vlx::render
