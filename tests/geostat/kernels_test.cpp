#include "geostat/kernels.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <cmath>

#include "random_problem.h"

namespace vlx::kernels {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<InstructionSet> available() {
    std::vector<InstructionSet> sets = {InstructionSet::Base};
    if (instructionSet() >= InstructionSet::Avx2) sets.push_back(InstructionSet::Avx2);
    if (instructionSet() >= InstructionSet::Avx512) sets.push_back(InstructionSet::Avx512);
    return sets;
}

TEST(Kernels, CholeskyEqualsEigensAndItselfOnEveryInstructionSet) {
    testing::Random random(1);
    for (const Index n : {1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 33, 63, 64, 65, 100, 128}) {
        const Index extra = random.below(6), rows = n + extra, leading = leadingDimension(rows);
        MatrixXd a(n, n);
        for (Index i = 0; i < n; ++i)
            for (Index j = 0; j < n; ++j)
                a(i, j) = std::exp(-0.3 * std::abs(static_cast<double>(i - j))) + (i == j ? 0.01 : 0);
        MatrixXd padded = MatrixXd::Zero(leading, n);
        padded.topRows(n) = a;
        for (Index i = n; i < rows; ++i)
            for (Index j = 0; j < n; ++j) padded(i, j) = random.normal();
        const Eigen::LLT<MatrixXd> llt(a);
        const MatrixXd lower = llt.matrixL();
        const MatrixXd carried =
            lower.triangularView<Eigen::Lower>().solve(padded.middleRows(n, extra).transpose()).transpose();
        MatrixXd first;
        for (const InstructionSet set : available()) {
            MatrixXd f = padded;
            const double pivot = cholesky(f.data(), n, rows, leading, set);
            EXPECT_NEAR(pivot, lower.diagonal().cwiseAbs2().minCoeff(), 1e-12);
            const MatrixXd found = f.topRows(n).triangularView<Eigen::Lower>();
            EXPECT_LT((found - lower).cwiseAbs().maxCoeff(), 1e-12) << n;
            if (extra > 0) {
                EXPECT_LT((f.middleRows(n, extra) - carried).cwiseAbs().maxCoeff(), 1e-10) << n;
            }
            if (first.size() == 0) first = found;
            EXPECT_TRUE((found.array() == first.array()).all()) << n;
            // In float.
            Eigen::MatrixXf single = padded.cast<float>();
            cholesky(single.data(), n, rows, leading, set);
            const MatrixXd rounded = single.topRows(n).cast<double>().triangularView<Eigen::Lower>();
            EXPECT_LT((rounded - lower).cwiseAbs().maxCoeff(), 1e-4) << n;
        }
    }
}

TEST(Kernels, CholeskyReportsMatricesThatAreNotPositiveDefinite) {
    const Index leading = leadingDimension(2);
    MatrixXd a = MatrixXd::Zero(leading, 2);
    a.topRows(2) << 1, 2, 2, 1;
    EXPECT_LE(cholesky(a.data(), 2, 2, leading), 0);
    a.topRows(2) << 1, std::nan(""), std::nan(""), 1;
    EXPECT_FALSE(cholesky(a.data(), 2, 2, leading) > 0);
}

TEST(Kernels, ColumnsEqualTheModelOneValueAtATime) {
    testing::Random random(2);
    for (const StructureType type :
         {StructureType::Spherical, StructureType::Exponential, StructureType::Gaussian,
          StructureType::Stable, StructureType::Matern, StructureType::Linear})
        for (int k = 0; k < 200; ++k) {
            VariogramStructure s;
            s.type = type;
            s.sill = random.logUniform(0.01, 100);
            s.range = random.logUniform(1e-6, 1e8);
            s.shape = type == StructureType::Matern ? 0.5 + random.below(4) : random.uniform(0.05, 2);
            const VariogramModel model{0, {s}};
            const ModelColumns columns(model);
            constexpr Index n = 40;
            MatrixXd places(n, 2);
            for (Index i = 0; i < n; ++i) places.row(i) << random.logUniform(1e-9, 1e3), random.uniform();
            const VectorXd point = places.row(5).transpose();
            VectorXd gamma(n), c(n);
            columns.semivariances(places.data(), n, 2, point.data(), 0, n, gamma.data());
            if (type != StructureType::Linear)
                columns.covariances(places.data(), n, 2, point.data(), 0, n, c.data());
            EXPECT_EQ(gamma[5], 0);
            for (Index i = 0; i < n; ++i) {
                const double h = (places.row(i) - places.row(5)).norm();
                EXPECT_NEAR(gamma[i], semivariance(model, h), 2e-13 * semivariance(model, h));
                // exp(-x) magnifies errors of x = u^alpha by x; 1e-300 for what underflows.
                if (type != StructureType::Linear) {
                    EXPECT_NEAR(c[i], covariance(model, h), 1e-11 * covariance(model, h) + 1e-300);
                }
            }
        }
}

TEST(Kernels, BlocksAreSumsOfTheirPoints) {
    testing::Random random(2);
    const VariogramModel model{.nugget = 0,
                               .structures = {{StructureType::Stable, 0.7, 1.3, 2},
                                              {StructureType::Stable, 0.2, 0.4, 0.25},
                                              {StructureType::Spherical, 0.5, 2, 1},
                                              {StructureType::Matern, 0.5, 2, 1.5}}};
    for (std::size_t structures : {3, 4}) {
        VariogramModel some = model;
        some.structures.resize(structures);
        const ModelColumns columns(some);
        constexpr Index n = 200, k = 5;  // more than one chunk
        MatrixXd places(n, 4), points(k, 4);
        for (Index i = 0; i < n; ++i)
            for (Index axis = 0; axis < 4; ++axis) places(i, axis) = random.normal();
        for (Index a = 0; a < k; ++a) points.row(a) << random.normal(), random.normal(), 0.3, -0.2;
        const VectorXd weights = VectorXd::LinSpaced(k, 0.1, 0.3);
        for (const bool semivariance : {false, true}) {
            VectorXd expected = VectorXd::Zero(n), one(n), found(n);
            for (Index a = 0; a < k; ++a) {
                const VectorXd point = points.row(a).transpose();
                if (semivariance)
                    columns.semivariances(places.data(), n, 4, point.data(), 0, n, one.data());
                else
                    columns.covariances(places.data(), n, 4, point.data(), 0, n, one.data());
                expected += weights[a] * one;
            }
            columns.ofBlock(places.data(), n, points, weights.data(), n, semivariance, found.data());
            EXPECT_LT((found - expected).cwiseAbs().maxCoeff(), 1e-13);
        }
    }
}

TEST(Kernels, TrianglesAreSolvedAlikeOnEveryInstructionSet) {
    testing::Random random(3);
    for (const Index n : {1, 3, 4, 5, 31, 64, 101})
        for (const Index m : {1, 8, 16, 19}) {
            const Index leading = leadingDimension(n), step = (m + 15) / 16 * 16;
            MatrixXd l = MatrixXd::Zero(leading, n), x = MatrixXd::Zero(step, n);
            for (Index j = 0; j < n; ++j) {
                for (Index i = 0; i < n; ++i) l(i, j) = random.normal() / 4;  // upper half: not read
                l(j, j) = 1 + random.uniform();
                for (Index t = 0; t < m; ++t) x(t, j) = random.normal();
            }
            const auto lower = l.topRows(n).triangularView<Eigen::Lower>();
            for (const bool upper : {false, true}) {
                const MatrixXd b = x.topRows(m).transpose();
                MatrixXd expected = b;
                upper ? lower.transpose().solveInPlace(expected) : lower.solveInPlace(expected);
                MatrixXd first;
                for (const InstructionSet set : available()) {
                    MatrixXd y = x;
                    solveTriangle(l.data(), n, leading, upper, y.data(), m, step, set);
                    const MatrixXd found = y.topRows(m).transpose();
                    EXPECT_LT((found - expected).cwiseAbs().maxCoeff(),
                              1e-11 * expected.cwiseAbs().maxCoeff());
                    if (first.size() == 0) first = found;
                    EXPECT_TRUE((found.array() == first.array()).all()) << n << ' ' << m;
                }
            }
        }
}

}  // namespace
}  // namespace vlx::kernels
