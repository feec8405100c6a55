// The loops over data of a neighbourhood and over windows, against the same sums written plainly.

#include "reconstruct/drift/gram.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "base/simd.h"
#include "reconstruct/common/planes.h"
#include "reconstruct/common/window_sum.h"

namespace vlx {
namespace {

constexpr int kPlaneSide = 40, kPlaneCentre = 20 * kPlaneSide + 20;

std::vector<float> uniformValues(std::size_t n, unsigned seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> uniform(-1, 1);
    std::vector<float> values(n);
    for (float& v : values) v = uniform(random);
    return values;
}

/// Data of the surroundings of a pixel: about a third of them.
struct Selection {
    explicit Selection(int reach) : around{reach}, alike(static_cast<std::size_t>(around.size())) {
        const std::vector<float> values = uniformValues(alike.size(), 3);
        for (int dy = -reach; dy <= reach; ++dy)
            for (int dx = -reach; dx <= reach; ++dx) {
                const auto at = static_cast<std::size_t>(around.at(dx, dy));
                alike[at] = std::max(0.f, values[at] - 0.3f);
                if (alike[at] >= kLeast) places.push_back(kPlaneCentre + dy * kPlaneSide + dx);
            }
        const auto room = alike.size() + 8;
        list.resize(room);
        x.resize(room);
        y.resize(room);
        runs.resize(alike.size() / 8);
        found = selectData(around, alike.data(), kLeast, kPlaneCentre, kPlaneSide, runs.data(), list.data(),
                           x.data(), y.data());
    }
    static constexpr float kLeast = 0.01f;
    Surroundings around;
    std::vector<float> alike, list, x, y;
    std::vector<int> places;  // of the data, in order
    std::vector<DataRun> runs;
    DataCounts found;
};

TEST(Neighbourhood, DataAreThosePixelsThatAreAlike) {
    for (const int reach : {3, 4, 8, 15}) {
        const Selection of(reach);
        ASSERT_EQ(static_cast<std::size_t>(of.found.data), of.places.size());
        const std::vector<float> plane = uniformValues(kPlaneSide * kPlaneSide + 8, 5);
        std::vector<float> gathered(of.list.size());
        gather(plane.data(), of.runs.data(), of.found.runs, 0.25f, gathered.data());
        for (std::size_t k = 0; k < of.places.size(); ++k) {
            const int dx = of.places[k] % kPlaneSide - 20, dy = of.places[k] / kPlaneSide - 20;
            EXPECT_EQ(of.list[k], of.alike[static_cast<std::size_t>(of.around.at(dx, dy))]);
            EXPECT_FLOAT_EQ(of.x[k], static_cast<float>(dx) / static_cast<float>(reach));
            EXPECT_FLOAT_EQ(of.y[k], static_cast<float>(dy) / static_cast<float>(reach));
            EXPECT_EQ(gathered[k], plane[static_cast<std::size_t>(of.places[k])] - 0.25f);
        }
    }
}

TEST(Neighbourhood, WhatIsScatteredMeetsItsDataAndNoOtherPixel) {
    const Selection of(8);
    std::vector<float> plane(kPlaneSide * kPlaneSide + 8, 1.f), list = of.list;
    for (std::size_t k = of.places.size(); k < list.size(); ++k) list[k] = NAN;  // no datum's
    scatter(list.data(), of.runs.data(), of.found.runs, plane.data());
    std::vector<float> expected(plane.size(), 1.f);
    for (std::size_t k = 0; k < of.places.size(); ++k)
        expected[static_cast<std::size_t>(of.places[k])] += of.list[k];
    EXPECT_EQ(plane, expected);
}

TEST(Neighbourhood, GramMatrixIsThatOfTheWeightedProducts) {
    constexpr int kRows = 8, kData = 40;
    const std::vector<float> x = uniformValues(kRows * kData, 7);
    std::vector<float> w = uniformValues(kData, 8), weighted(x.size());
    for (float& v : w) v = std::abs(v);
    std::vector<double> gram(kRows * kRows);
    weightedGram(x.data(), w.data(), kRows, kData, kData, weighted.data(), gram.data());
    for (int a = 0; a < kRows; ++a)
        for (int b = 0; b <= a; ++b) {
            double sum = 0;
            for (int i = 0; i < kData; ++i)
                sum += static_cast<double>(w[static_cast<std::size_t>(i)]) *
                       static_cast<double>(x[static_cast<std::size_t>(a * kData + i)]) *
                       static_cast<double>(x[static_cast<std::size_t>(b * kData + i)]);
            EXPECT_NEAR(gram[static_cast<std::size_t>(b * kRows + a)], sum, 1e-5) << a << " " << b;
        }
}

TEST(Neighbourhood, WeightsCountSamplesWithinLimitsAndPixelsWithoutAreNoData) {
    std::vector<float> alike{1, 0.5f, 1, 1, 0, 0, 0, 0}, weights(8);
    const std::vector<float> counts{8, 8, 800, 0, 0, 0, 0, 0}, errors{1, 2, 3, 4, 0, 0, 0, 0};
    const DataWeights sums =
        weighData(counts.data(), errors.data(), 8, 1e-3f, 4, 8, alike.data(), weights.data());
    EXPECT_EQ(weights, (std::vector<float>{1, 0.5f, 4, 0, 0, 0, 0, 0}));
    EXPECT_EQ(alike, (std::vector<float>{1, 0.5f, 4, 1e-3f, 0, 0, 0, 0}));
    EXPECT_DOUBLE_EQ(sums.total, 5.5);
    EXPECT_DOUBLE_EQ(sums.noise, 1 + 1 + 4 * 4 * 3);
    EXPECT_TRUE(sums.gaps);
}

TEST(Neighbourhood, EstimatesAddWhatTheyDifferByFromTheReference) {
    const std::vector<float> rows{1, 1, 1, 1, 1, 1, 1, 1, 0, 1, 2, 3, 4, 5, 6, 7}, references(8, 2.f),
        weights(8, 0.5f), errors(8, 0.25f);
    const int numbers[] = {1};
    const float coefficients[] = {3};
    std::vector<float> sums(8), squares(8);
    predictChannel({rows.data(), 8, 1, numbers, coefficients}, 1, references.data(), weights.data(),
                   errors.data(), 8, sums.data(), squares.data());
    for (std::size_t i = 0; i < 8; ++i) {
        const float d = 1 + 3 * static_cast<float>(i) - 2;
        EXPECT_FLOAT_EQ(sums[i], 0.5f * d);
        EXPECT_FLOAT_EQ(squares[i], 0.5f * d * d + 0.125f);
    }
}

TEST(WindowSum, AlongARowIsTheSumUnderItsWeights) {
    for (const int n : {1, 7, 33, 200}) {
        const std::vector<float> in = uniformValues(static_cast<std::size_t>(n), 9);
        std::vector<float> out(in.size());
        sumAround(in, 16, true, out.data());
        for (int i = 0; i < n; ++i) {
            double sum = 0;
            for (int k = std::max(0, i - 16); k <= std::min(n - 1, i + 16); ++k)
                sum += std::pow(static_cast<double>(windowWeight(k - i, 16)), 2) *
                       static_cast<double>(in[static_cast<std::size_t>(k)]);
            EXPECT_NEAR(out[static_cast<std::size_t>(i)], sum, 1e-5) << n << " " << i;
        }
    }
}

/// By blocks: of values that do not change sign, as all that is summed over wide windows.
TEST(WindowSum, OfAWideWindowIsAsGoodAsPixelByPixel) {
    std::vector<float> in = uniformValues(900, 10), out(in.size());
    for (float& v : in) v = v * v;
    for (const bool squared : {false, true}) {
        sumAround(in, 256, squared, out.data());
        for (int i = 0; i < 900; i += 7) {
            double sum = 0;
            for (int k = std::max(0, i - 256); k <= std::min(899, i + 256); ++k)
                sum += std::pow(static_cast<double>(windowWeight(k - i, 256)), squared ? 2 : 1) *
                       static_cast<double>(in[static_cast<std::size_t>(k)]);
            EXPECT_NEAR(out[static_cast<std::size_t>(i)], sum, 0.01 * sum) << i;
        }
    }
}

/// At borders too, and with no feature at all.
TEST(WindowSum, OfAlikePixelsIsTheSumUnderTheirLikeness) {
    constexpr int kWidth = 21, kHeight = 9, kReach = 5;
    for (const int features : {0, 3}) {
        RowRing ring(kWidth, FeaturePlanes{features}.channels(), kHeight);
        const std::vector<float> values =
            uniformValues(static_cast<std::size_t>(kWidth * kHeight * (features + 4)), 11);
        const auto at = [&](int c, int x, int y) {
            return values[static_cast<std::size_t>((c * kHeight + y) * kWidth + x)];
        };
        for (int f = 0; f < features; ++f)
            for (int y = 0; y < kHeight; ++y)
                for (int x = 0; x < kWidth; ++x) {
                    ring.row(f, y)[x] = 0.2f * at(f, x, y);
                    ring.row(FeaturePlanes{features}.error(f), y)[x] = 0.01f;
                }
        const auto fill = [&](int row, int c, float* q) {
            for (int x = 0; x < kWidth; ++x) q[x] = at(features + c, x, row);
        };
        std::vector<float> sums(4 * kWidth);
        for (const int y : {0, 4, kHeight - 1}) {
            sumAlike(ring, features, kReach, 4, fill, y, kWidth, kHeight, sums.data());
            for (int x = 0; x < kWidth; ++x)
                for (int c = 0; c < 4; ++c) {
                    double sum = 0;
                    for (int row = std::max(0, y - kReach); row <= std::min(kHeight - 1, y + kReach); ++row)
                        for (int col = std::max(0, x - kReach); col <= std::min(kWidth - 1, x + kReach);
                             ++col) {
                            float d = 0;
                            for (int f = 0; f < features; ++f)
                                d += std::pow(ring.row(f, row)[col] - ring.row(f, y)[x], 2.f) /
                                     (0.01f + 2 * 0.01f);
                            sum += static_cast<double>(simd::nearExp(d) * at(features + c, col, row));
                        }
                    EXPECT_NEAR(sums[static_cast<std::size_t>(c * kWidth + x)], sum, 1e-4) << x << " " << y;
                }
        }
    }
}

}  // namespace
}  // namespace vlx
