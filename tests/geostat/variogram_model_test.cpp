#include "variolux/geostat/variogram_model.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>
#include <random>

#include "simulated_field.h"

namespace {

using vlx::StructureType;
using vlx::VariogramModel;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const StructureType kTypes[] = {StructureType::Spherical, StructureType::Exponential, StructureType::Gaussian,
                                StructureType::Stable,    StructureType::Matern,      StructureType::Linear};

VariogramModel one(StructureType type, double sill, double range, double shape, double nugget = 0) {
    return {nugget, {{type, sill, range, shape}}};
}

// mpmath, 60 digits or more; small u shows whether 1 - rho was formed by subtraction.
TEST(VariogramModel, AgreesWithFiftyDigitValues) {
    struct {
        StructureType type;
        double shape, u, gamma;
    } const values[] = {
        {StructureType::Matern, 0.1, 1e-12, 0.0038929619735591035769},
        {StructureType::Matern, 0.3, 0.7, 0.66354652700249278799},
        {StructureType::Matern, 0.5, 1e-09, 9.9999999950000006245e-10},
        {StructureType::Matern, 1.0, 1e-06, 7.2157210368122914862e-12},
        {StructureType::Matern, 1.0, 2.0, 0.72026823636695514543},
        {StructureType::Matern, 1.3, 0.05, 0.0018307679486099482859},
        {StructureType::Matern, 1.5, 1e-07, 4.9999996666666787141e-15},
        {StructureType::Matern, 2.0, 5.0, 0.93363820359720675052},
        {StructureType::Matern, 2.5, 1e-05, 1.6666666666250004949e-11},
        {StructureType::Matern, 2.5, 3.0, 0.65149052142495239914},
        {StructureType::Matern, 7.5, 0.25, 0.0024004355472754246468},
        {StructureType::Matern, 30.0, 8.0, 0.42098734786194350954},
        {StructureType::Stable, 1e-08, 1e-300, 0.63211801760740591759},
        {StructureType::Stable, 1e-08, 0.5, 0.63212055627861170406},
        {StructureType::Stable, 0.05, 1e-20, 0.095162581964040415022},
        {StructureType::Stable, 0.7, 1e-12, 3.9810716976105113849e-9},
        {StructureType::Stable, 1.5, 1e-08, 9.9999999999950003138e-13},
        {StructureType::Stable, 1.9, 0.3, 0.096532407621021204095},
        {StructureType::Stable, 2.0, 1e-10, 1.0000000000000000729e-20},
        {StructureType::Spherical, 1, 1e-15, 1.5000000000000001166e-15},
        {StructureType::Exponential, 1, 1e-15, 9.9999999999999957771e-16},
        {StructureType::Gaussian, 1, 1e-9, 1.0000000000000001241e-18},
    };
    for (const auto& v : values)
        EXPECT_NEAR(vlx::unitSemivariance(v.type, v.shape, v.u), v.gamma, 4e-14 * v.gamma)
            << static_cast<int>(v.type) << " shape " << v.shape << " u " << v.u;
}

TEST(VariogramModel, CoincidesWhereFamiliesMeet) {
    for (const double u : {1e-10, 1e-3, 0.3, 1.0, 4.0, 30.0}) {
        const double e = vlx::unitSemivariance(StructureType::Exponential, 1, u);
        const double g = vlx::unitSemivariance(StructureType::Gaussian, 1, u);
        EXPECT_NEAR(vlx::unitSemivariance(StructureType::Stable, 1, u), e, 1e-15 * e);
        EXPECT_NEAR(vlx::unitSemivariance(StructureType::Stable, 2, u), g, 1e-15 * g);
        EXPECT_NEAR(vlx::unitSemivariance(StructureType::Matern, 0.5, u), e, 1e-15 * e);
        for (const double nu : {0.5, 1.5, 2.5}) {  // closed form beside the general one
            const double closed = vlx::unitSemivariance(StructureType::Matern, nu, u);
            const double general = vlx::unitSemivariance(StructureType::Matern, nu * (1 + 1e-15), u);
            EXPECT_NEAR(general, closed, 1e-13 * closed) << nu << " " << u;
        }
    }
}

TEST(VariogramModel, SemivarianceAndCovarianceAreConsistent) {
    for (const StructureType type : kTypes) {
        if (type == StructureType::Linear) continue;
        for (const double shape : {0.3, 0.5, 1.2, 1.5, 2.0})
            for (const double h : {0.0, 1e-6, 0.1, 1.0, 2.9, 3.0, 3.1, 10.0, 1e3, 1e300}) {
                const VariogramModel m = one(type, 2, 3, shape, 0.5);
                EXPECT_NEAR(vlx::covariance(m, h), m.sill() - vlx::semivariance(m, h), 4e-15);
                EXPECT_GE(vlx::covariance(m, h), 0);
            }
    }
    EXPECT_EQ(vlx::semivariance(one(StructureType::Stable, 2, 3, 1, 0.5), 0), 0);
    EXPECT_EQ(vlx::covariance(one(StructureType::Stable, 2, 3, 1, 0.5), 0), 2.5);
    EXPECT_DOUBLE_EQ(vlx::semivariance(one(StructureType::Linear, 2, 4, 1, 0.5), 6), 3.5);
}

TEST(VariogramModel, RisesMonotonically) {
    for (const StructureType type : kTypes)
        for (const double shape : {1e-8, 0.05, 0.7, 1.0, 1.7, 2.0}) {
            double last = 0;
            for (double h = 1e-12; h < 1e6; h *= 1.3) {
                const double gamma = vlx::semivariance(one(type, 1, 5, shape), h);
                ASSERT_GE(gamma, last * (1 - 1e-13)) << static_cast<int>(type) << " " << shape << " " << h;
                last = gamma;
            }
        }
}

TEST(VariogramModel, GradientEqualsFiniteDifferences) {
    for (const StructureType type : kTypes)
        for (const double shape : {0.3, 0.9, 1.5, 1.9})
            for (const double h : {0.01, 0.4, 1.1, 2.6, 9.0}) {
                const VariogramModel m{0.3,
                                       {{type, 1.7, 1.9, shape}, {StructureType::Exponential, 0.4, 5, 1}}};
                const Eigen::VectorXd g = vlx::semivarianceGradient(m, h);
                ASSERT_EQ(g.size(), 7);
                for (Eigen::Index p = 0; p < 7; ++p) {
                    const auto shifted = [&](double d) {
                        VariogramModel n = m;
                        if (p == 0) {
                            n.nugget += d;
                        } else {
                            auto& s = n.structures[static_cast<std::size_t>((p - 1) / 3)];
                            ((p - 1) % 3 == 0 ? s.sill : (p - 1) % 3 == 1 ? s.range : s.shape) += d;
                        }
                        return vlx::semivariance(n, h);
                    };
                    const double d = 1e-5;
                    EXPECT_NEAR(g[p], (shifted(d) - shifted(-d)) / (2 * d), 2e-9)
                        << static_cast<int>(type) << " shape " << shape << " h " << h << " parameter " << p;
                }
            }
    EXPECT_TRUE(vlx::semivarianceGradient(one(StructureType::Stable, 1, 1, 1, 1), 0).isZero(0));
}

TEST(VariogramModel, StaysFiniteAtExtremes) {
    for (const StructureType type : kTypes)
        for (const double shape : {1e-8, 0.5, 1.0, 2.0})
            for (const double sill : {1e-200, 1.0, 1e200})
                for (const double range : {1e-200, 1.0, 1e200})
                    for (const double h : {5e-324, 1e-200, 1.0, 1e100}) {
                        if (type == StructureType::Linear && h / range > 1e100) continue;  // truly infinite
                        const VariogramModel m = one(type, sill, range, shape);
                        const double gamma = vlx::semivariance(m, h);
                        ASSERT_TRUE(std::isfinite(gamma) && gamma >= 0);
                        if (type != StructureType::Linear) {
                            ASSERT_LE(gamma, sill);
                        }
                        ASSERT_FALSE(vlx::semivarianceGradient(m, h).hasNaN())
                            << static_cast<int>(type) << " " << shape << " " << range << " " << h;
                    }
    for (const StructureType type : kTypes) {
        const VariogramModel m = one(type, 2, 1, 0.7);
        EXPECT_EQ(vlx::semivariance(m, kInfinity), type == StructureType::Linear ? kInfinity : 2);
        EXPECT_TRUE(std::isnan(vlx::semivariance(m, std::nan(""))));
    }
}

TEST(VariogramModel, CovarianceMatricesArePositiveDefinite) {
    std::mt19937_64 random(3);
    std::uniform_real_distribution<double> uniform;
    for (const StructureType type : kTypes) {
        if (type == StructureType::Linear) continue;
        for (int repeat = 0; repeat < 10; ++repeat) {
            const Eigen::MatrixXd x = Eigen::MatrixXd::NullaryExpr(40, 2, [&] { return uniform(random); });
            const double shape = 0.05 + 1.95 * uniform(random), range = 0.05 + uniform(random);
            const Eigen::MatrixXd k = vlx::testing::covarianceMatrix(one(type, 1, range, shape), x);
            const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(k, Eigen::EigenvaluesOnly);
            EXPECT_GT(eigen.eigenvalues().minCoeff(), -1e-13 * eigen.eigenvalues().maxCoeff());
        }
    }
}

TEST(VariogramModel, ValidateNamesTheBrokenConstraint) {
    EXPECT_FALSE(one(StructureType::Stable, 0, 1, 2, 0).validate());
    const auto says = [](const VariogramModel& m, const std::string& words) {
        const auto message = m.validate();
        return message && message->find(words) != std::string::npos;
    };
    EXPECT_TRUE(says({-1, {}}, "nugget"));
    EXPECT_TRUE(says({std::nan(""), {}}, "nugget"));
    EXPECT_TRUE(says(one(StructureType::Exponential, -0.5, 1, 1), "sill of structure 1"));
    EXPECT_TRUE(says(one(StructureType::Exponential, 1, 0, 1), "range of structure 1"));
    EXPECT_TRUE(says(one(StructureType::Exponential, 1, kInfinity, 1), "range"));
    EXPECT_TRUE(says(one(StructureType::Stable, 1, 1, 2.1), "alpha"));
    EXPECT_TRUE(says(one(StructureType::Stable, 1, 1, 0), "alpha"));
    EXPECT_TRUE(says(one(StructureType::Matern, 1, 1, 0), "nu"));
    EXPECT_FALSE(one(StructureType::Spherical, 1, 1, 99).validate());
}

TEST(VariogramModel, SillAndBoundedness) {
    VariogramModel m = one(StructureType::Linear, 0, 1, 1, 0.5);
    EXPECT_TRUE(m.bounded());
    EXPECT_EQ(m.sill(), 0.5);
    m.structures[0].sill = 1;
    EXPECT_FALSE(m.bounded());
    EXPECT_EQ(m.sill(), kInfinity);
}

TEST(Anisotropy, StretchesAcrossItsAngle) {
    const vlx::Anisotropy anisotropy{0.7, 0.25};
    const Eigen::Matrix2d t = vlx::anisotropyTransform(anisotropy);
    const Eigen::Vector2d along(std::cos(0.7), std::sin(0.7)), across(-std::sin(0.7), std::cos(0.7));
    EXPECT_NEAR((t * along).norm(), 1, 1e-15);
    EXPECT_NEAR((t * across).norm(), 4, 1e-14);
    EXPECT_NEAR((t * along)[0], 1, 1e-15);
    EXPECT_NEAR(t.determinant(), 4, 1e-14);
}

}  // namespace
