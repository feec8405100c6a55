#include "variolux/geostat/variogram_fit.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "oracle.h"
#include "simulated_field.h"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using vlx::EmpiricalVariogram;
using vlx::FitOptions;
using vlx::FitSearch;
using vlx::FitStatus;
using vlx::FitStructure;
using vlx::FitWeights;
using vlx::StructureType;
using vlx::VariogramFit;
using vlx::VariogramModel;
using vlx::testing::FieldSampler;
using vlx::testing::kRepeat;
using vlx::testing::pixelCentres;
using vlx::testing::Sample;

/// Classes at the given distances with the model's exact semivariances.
EmpiricalVariogram exactClasses(const VariogramModel& model, const std::vector<double>& distances,
                                double pairs = 100) {
    EmpiricalVariogram v;
    for (const double h : distances) v.bins.push_back({h, h, pairs, h, vlx::semivariance(model, h), 0, 0});
    return v;
}

std::vector<double> twelve() {
    std::vector<double> h;
    for (int i = 1; i <= 12; ++i) h.push_back(i);
    return h;
}

FitOptions freeStable() {
    FitOptions options;
    options.structures = {{StructureType::Stable, 0, 0, 0.1, 2}};
    return options;
}

TEST(VariogramFit, ReachesTheOraclesMinima) {
    const OracleCount count = runVariography(std::string(VLX_TESTDATA) + "/oracle");
    EXPECT_EQ(count.failed, 0);
    EXPECT_EQ(count.passed, 300 + 345 + 129);
}

TEST(VariogramFit, RecoversExactModels) {
    for (const StructureType type : {StructureType::Spherical, StructureType::Exponential,
                                     StructureType::Gaussian, StructureType::Stable, StructureType::Matern})
        for (const FitWeights weights :
             {FitWeights::Equal, FitWeights::Pairs, FitWeights::PairsPerSquaredDistance,
              FitWeights::PairsPerSquaredSemivariance}) {
            const bool shaped = type == StructureType::Stable || type == StructureType::Matern;
            const VariogramModel truth{0.3, {{type, 2, 4.3, shaped ? 1.3 : 1}}};
            FitOptions options;
            options.weights = weights;
            options.structures = {{type, 0, 0, shaped ? 0.2 : 1, shaped ? 2.0 : 1}};
            const VariogramFit fit = vlx::fitVariogram(exactClasses(truth, twelve()), options);
            ASSERT_EQ(fit.status, FitStatus::Ok) << fit.message();
            EXPECT_NEAR(fit.model.nugget, 0.3, 1e-4) << static_cast<int>(type);
            EXPECT_NEAR(fit.model.structures[0].sill, 2, 1e-4);
            EXPECT_NEAR(fit.model.structures[0].range, 4.3, 1e-3);
            if (shaped) {
                EXPECT_NEAR(fit.model.structures[0].shape, 1.3, 1e-3);
            }
            EXPECT_LT(fit.sse, 1e-8);
            EXPECT_FALSE(fit.rangeAtBound);
        }
}

TEST(VariogramFit, RecoversNestedStructures) {
    std::vector<double> h;
    for (int i = 1; i <= 40; ++i) h.push_back(i * 0.5);
    const VariogramModel truth{0.1,
                               {{StructureType::Spherical, 1, 3, 1}, {StructureType::Exponential, 2, 9, 1}}};
    FitOptions options;
    options.structures = {{StructureType::Spherical}, {StructureType::Exponential}};
    VariogramFit fit = vlx::fitVariogram(exactClasses(truth, h), options);
    for (const double x : h)
        EXPECT_NEAR(vlx::semivariance(fit.model, x), vlx::semivariance(truth, x), 2e-3) << fit.message();
    EXPECT_NEAR(fit.model.structures[0].range, 3, 0.1);
    EXPECT_NEAR(fit.model.structures[1].sill, 2, 0.1);
    // Linear beside a bounded one: the linear part has no range to search.
    const VariogramModel slope{0, {{StructureType::Spherical, 1, 3, 1}, {StructureType::Linear, 4, 20, 1}}};
    options.structures = {{StructureType::Spherical}, {StructureType::Linear}};
    fit = vlx::fitVariogram(exactClasses(slope, h), options);
    EXPECT_NEAR(fit.model.structures[1].sill, 4, 1e-4);
    EXPECT_EQ(fit.model.structures[1].range, 20);
    EXPECT_NEAR(fit.model.structures[0].range, 3, 1e-2);
}

TEST(VariogramFit, RespectsBounds) {
    const VariogramModel truth{0.5, {{StructureType::Stable, 1, 6, 1.5}}};
    FitOptions options;
    options.structures = {{StructureType::Stable, 1, 4, 0.3, 1.2}};
    VariogramFit fit = vlx::fitVariogram(exactClasses(truth, twelve()), options);
    EXPECT_LE(fit.model.structures[0].range, 4 * (1 + 1e-12));
    EXPECT_LE(fit.model.structures[0].shape, 1.2);
    EXPECT_TRUE(fit.rangeAtBound);
    options.nugget = false;
    EXPECT_EQ(vlx::fitVariogram(exactClasses(truth, twelve()), options).model.nugget, 0);
    // A falling variogram has no non-negative sill; a negative intercept no nugget.
    EmpiricalVariogram falling = exactClasses(truth, twelve());
    for (std::size_t i = 0; i < 12; ++i) falling.bins[i].semivariance = 12.0 - static_cast<double>(i);
    fit = vlx::fitVariogram(falling, freeStable());
    EXPECT_EQ(fit.model.structures[0].sill, 0);
    EXPECT_NEAR(fit.model.nugget, 6.5, 1e-12);
    EXPECT_LT(fit.sillTest.statistic, 0);
    for (auto& bin : falling.bins) bin.semivariance = bin.distance - 3;
    fit = vlx::fitVariogram(falling, freeStable());
    EXPECT_EQ(fit.model.nugget, 0);
    EXPECT_GT(fit.model.structures[0].sill, 0);
}

TEST(VariogramFit, DegenerateInputGivesAStatus) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(vlx::fitVariogram({}).status, FitStatus::TooFewClasses);
    EmpiricalVariogram v = exactClasses({0, {}}, {1, 2, 3});
    EXPECT_EQ(vlx::fitVariogram(v, freeStable()).status, FitStatus::Zero);  // constant data
    EXPECT_FALSE(vlx::fitVariogram(v).sillTest.significant);
    for (auto& bin : v.bins) bin.semivariance = -1;  // noise overstated
    VariogramFit fit = vlx::fitVariogram(v, freeStable());
    EXPECT_EQ(fit.status, FitStatus::Zero);
    EXPECT_EQ(fit.model.sill(), 0);
    v.bins[1].semivariance = nan;
    EXPECT_EQ(vlx::fitVariogram(v).status, FitStatus::NotFinite);
    v.bins[1].pairs = 0;  // an empty class is not looked at
    EXPECT_EQ(vlx::fitVariogram(v).status, FitStatus::Zero);
    for (auto& bin : v.bins) bin.pairs = 0;
    EXPECT_EQ(vlx::fitVariogram(v).status, FitStatus::TooFewClasses);
    EXPECT_NE(vlx::fitVariogram(v).message().find("found 0"), std::string::npos);
    v = exactClasses({0, {{StructureType::Linear, 1, 1, 1}}}, {0, 0, 5});
    EXPECT_EQ(vlx::fitVariogram(v).status, FitStatus::TooFewClasses);  // distance 0 says nothing
    for (const FitSearch search : {FitSearch::Global, FitSearch::Fast})
        for (const FitWeights weights : {FitWeights::Equal, FitWeights::PairsPerSquaredDistance,
                                         FitWeights::PairsPerSquaredSemivariance}) {
            v = exactClasses({0, {}}, {1, 1, 1});  // one distance, spread values
            v.bins[0].semivariance = 1e-300;
            v.bins[2].semivariance = 1e300;
            FitOptions options = freeStable();
            options.search = search;
            options.weights = weights;
            fit = vlx::fitVariogram(v, options);
            EXPECT_FALSE(fit.model.validate()) << fit.message();
        }
}

TEST(VariogramFit, ScalesWithUnits) {
    FieldSampler sampler({0.2, {{StructureType::Exponential, 1, 3, 1}}}, pixelCentres(10, 10), 21);
    const MatrixXd x = pixelCentres(10, 10);
    const VectorXd z = sampler.draw();
    vlx::EmpiricalVariogramOptions options;
    options.edges = vlx::uniformEdges(8.07, 10);  // edges off the lattice's distances
    const VariogramFit one = vlx::fitVariogram(vlx::empiricalVariogram(x, z, options));
    for (const double value : {1e-100, 1e-12, 1e12, 1e100})
        for (const double length : {1e-9, 1e9}) {
            options.edges = vlx::uniformEdges(8.07 * length, 10);
            const VariogramFit fit =
                vlx::fitVariogram(vlx::empiricalVariogram(length * x, value * z, options));
            EXPECT_NEAR(fit.model.nugget / value / value, one.model.nugget, 1e-6);
            EXPECT_NEAR(fit.model.structures[0].sill / value / value, one.model.structures[0].sill, 1e-6);
            EXPECT_NEAR(fit.model.structures[0].range / length, one.model.structures[0].range, 1e-6);
            EXPECT_NEAR(fit.sillTest.pValue, one.sillTest.pValue, 1e-9);
        }
}

TEST(VariogramFit, IteratedWeightsAreThoseOfTheFit) {
    FieldSampler sampler({0.2, {{StructureType::Exponential, 1, 3, 1}}}, pixelCentres(12, 12), 22);
    vlx::EmpiricalVariogramOptions options;
    options.edges = vlx::uniformEdges(8, 10);
    const auto v =
        vlx::empiricalVariogram(pixelCentres(12, 12), sampler.draw(), options, VectorXd::Constant(144, 0.05));
    FitOptions fitting;
    fitting.weights = FitWeights::PairsPerSquaredSemivariance;
    const VariogramFit fit = vlx::fitVariogram(v, fitting);
    ASSERT_EQ(fit.status, FitStatus::Ok);
    fitting.weights = FitWeights::PairsPerSquaredReference;
    fitting.reference = fit.model;
    const VariogramFit again = vlx::fitVariogram(v, fitting);
    for (double h = 0.5; h < 8; h += 0.5)
        EXPECT_NEAR(vlx::semivariance(fit.model, h), vlx::semivariance(again.model, h), 1e-5);
    double sse = 0;
    for (const auto& bin : v.bins) {
        const double r = (bin.semivariance - vlx::semivariance(fit.model, bin.distance)) /
                         (vlx::semivariance(fit.model, bin.distance) + bin.noise);
        if (bin.pairs > 0) sse += bin.pairs * r * r;
    }
    EXPECT_NEAR(fit.sse, sse, 1e-5 * sse);
}

// Errors of the classes are independent here, as the formula assumes: the reported standard errors must be
// the scatter of the estimates.
TEST(VariogramFitStatistics, StandardErrorsAreTheScatterOfEstimates) {
    const VariogramModel truth{0.5, {{StructureType::Exponential, 2, 3, 1}}};
    std::mt19937_64 random(23);
    std::normal_distribution<double> normal;
    FitOptions options;
    options.structures = {{StructureType::Exponential}};
    options.weights = FitWeights::Equal;
    Sample estimates[3], reported[3];
    for (int r = 0; r < 100 * kRepeat; ++r) {
        EmpiricalVariogram v = exactClasses(truth, twelve());
        for (auto& bin : v.bins) bin.semivariance += 0.02 * normal(random);
        const VariogramFit fit = vlx::fitVariogram(v, options);
        const double found[3] = {fit.model.nugget, fit.model.structures[0].sill,
                                 fit.model.structures[0].range};
        ASSERT_EQ(fit.standardErrors.size(), 4);
        EXPECT_TRUE(std::isnan(fit.standardErrors[3]));  // the exponential has no shape
        for (int p = 0; p < 3; ++p) {
            estimates[p].add(found[p]);
            reported[p].add(fit.standardErrors[p]);
        }
    }
    for (int p = 0; p < 3; ++p)
        EXPECT_NEAR(reported[p].mean() / std::sqrt(estimates[p].variance()), 1, 0.25) << p;
}

// With the range known, nugget and sill are linear in unbiased semivariances: unbiased but for the bounds at
// 0, which are far away here. 4.5 standard errors: one false alarm in 1e5.
TEST(VariogramFitStatistics, NuggetAndSillAreUnbiasedUnderKnownNoise) {
    const MatrixXd x = pixelCentres(16, 16);
    const VariogramModel truth{0.6, {{StructureType::Stable, 1, 2, 1.2}}};
    FieldSampler sampler(truth, x, 24);
    vlx::EmpiricalVariogramOptions options;
    options.edges = vlx::uniformEdges(8, 12);
    FitOptions fitting;
    fitting.structures = {{StructureType::Stable, 2, 2, 1.2, 1.2}};
    FitOptions free;
    free.structures = {{StructureType::Stable, 0.5, 8, 1.2, 1.2}};
    const VectorXd noise = sampler.noise(256).cwiseAbs2() * 0.5;
    Sample nugget, sill, logRange;
    for (int r = 0; r < 75 * kRepeat; ++r) {
        const VectorXd z = sampler.draw() + noise.cwiseSqrt().cwiseProduct(sampler.noise(256));
        const auto v = vlx::empiricalVariogram(x, z, options, noise);
        const VariogramFit fit = vlx::fitVariogram(v, fitting);
        nugget.add(fit.model.nugget);
        sill.add(fit.model.structures[0].sill);
        logRange.add(std::log(vlx::fitVariogram(v, free).model.structures[0].range));
    }
    EXPECT_LT(std::abs(nugget.mean() - 0.6), 4.5 * nugget.error() + 0.01);
    EXPECT_LT(std::abs(sill.mean() - 1), 4.5 * sill.error() + 0.01);
    EXPECT_NEAR(logRange.mean(), std::log(2.0), 0.15 + 4.5 * logRange.error());  // skewed: a factor of 1.16
}

// The share of false alarms on independent noise, at level 0.05, over kinds of noise. The bound of the test
// is asymptotic: the true level lies in [0, 0.07]. Rejected beyond 4 binomial standard errors from there.
TEST(SillTestStatistics, FalsePositivesKeepTheLevel) {
    for (const int side : {4, 8, 16})
        for (const int kind : {0, 1, 2, 3}) {
            const MatrixXd x = pixelCentres(side, side);
            const Eigen::Index n = x.rows();
            FieldSampler sampler({1, {}}, x, static_cast<std::uint64_t>(25 + kind));
            vlx::EmpiricalVariogramOptions options;
            options.edges = vlx::uniformEdges(0.75 * side, std::min(12, side));
            const int repeats = (side == 16 ? 200 : 400) * kRepeat;
            int alarms = 0;
            for (int r = 0; r < repeats; ++r) {
                VectorXd noise = VectorXd::Constant(n, 0.5);
                if (kind == 1) noise = (1.5 * sampler.noise(n)).array().exp();  // very unequal errors
                MatrixXd z(n, kind == 3 ? 3 : 1);
                for (Eigen::Index c = 0; c < z.cols(); ++c) {
                    VectorXd e = sampler.noise(n);
                    if (kind == 2) e = e.array().exp() / 2.1612;  // log-normal, as radiance
                    z.col(c) = noise.cwiseSqrt().cwiseProduct(e);
                }
                alarms += vlx::sillTest(
                              vlx::empiricalVariogram(x, z, options, static_cast<double>(z.cols()) * noise))
                              .significant;
            }
            const double rate = static_cast<double>(alarms) / repeats;
            const double error = std::sqrt(0.07 * 0.93 / repeats);
            EXPECT_LT(rate, 0.07 + 4 * error) << side << " kind " << kind;
            if (side == 16 && kind != 1) {  // many data: the level is also reached
                EXPECT_GT(rate, 0.035 - 4 * error) << side << " kind " << kind;
            }
        }
}

TEST(SillTestStatistics, FindsStructureUnderNoiseOfTheSameSize) {
    const MatrixXd x = pixelCentres(16, 16);
    FieldSampler sampler({0, {{StructureType::Exponential, 1, 4, 1}}}, x, 31);
    vlx::EmpiricalVariogramOptions options;
    options.edges = vlx::uniformEdges(12, 12);
    int found = 0;
    const int repeats = 25 * kRepeat;
    for (int r = 0; r < repeats; ++r) {
        const VectorXd z = sampler.draw() + sampler.noise(256);
        found += vlx::sillTest(vlx::empiricalVariogram(x, z, options, VectorXd::Ones(256)), 0.01).significant;
    }
    EXPECT_GT(found, 0.9 * repeats);
}

TEST(SillTest, ConstantOrSingleClassIsNotSignificant) {
    vlx::EmpiricalVariogramOptions options;
    options.edges = vlx::uniformEdges(4, 4);
    const MatrixXd x = pixelCentres(5, 5);
    EXPECT_FALSE(vlx::sillTest(vlx::empiricalVariogram(x, VectorXd::Constant(25, 0.1), options)).significant);
    EXPECT_EQ(vlx::sillTest({}).pValue, 1);
    // One firefly is noise, not structure.
    VectorXd z = VectorXd::Constant(25, 0.25);
    z[12] = 1e6;
    EXPECT_FALSE(vlx::sillTest(vlx::empiricalVariogram(x, z, options)).significant);
}

// The accuracy that FitSearch::Fast documents.
TEST(VariogramFitStatistics, FastSearchIsWithinOnePercentOfTheMinimum) {
    const MatrixXd x = pixelCentres(10, 10);
    std::mt19937_64 random(41);
    std::uniform_real_distribution<double> uniform;
    vlx::EmpiricalVariogramOptions options;
    options.edges = vlx::uniformEdges(9, 12);
    int cases = 0, good = 0;
    for (int r = 0; r < 40 * kRepeat; ++r) {
        const VariogramModel truth{
            uniform(random),
            {{StructureType::Stable, uniform(random), 1 + 5 * uniform(random), 0.5 + 1.5 * uniform(random)}}};
        FieldSampler sampler(truth, x, static_cast<std::uint64_t>(r));
        const auto v = vlx::empiricalVariogram(x, sampler.draw(), options);
        for (const bool freeShape : {false, true}) {
            FitOptions fitting = freeShape ? freeStable() : FitOptions{};
            const double global = vlx::fitVariogram(v, fitting).sse;
            fitting.search = FitSearch::Fast;
            const VariogramFit fast = vlx::fitVariogram(v, fitting);
            EXPECT_GE(fast.sse, global * (1 - 1e-6));
            EXPECT_LT(fast.evaluations, 330);
            ++cases;
            good += fast.sse <= 1.01 * global;
        }
    }
    EXPECT_GT(good, 0.98 * cases) << good << " of " << cases;
}

TEST(FitOptions, ValidateNamesTheBrokenConstraint) {
    EXPECT_FALSE(FitOptions{}.validate());
    FitOptions options;
    options.structures.clear();
    EXPECT_TRUE(options.validate());
    options.structures.assign(4, {});
    EXPECT_TRUE(options.validate());
    options.structures = {{StructureType::Stable, 0, 0, 0.5, 2.5}};
    EXPECT_NE(options.validate()->find("at most 2"), std::string::npos);
    options.structures = {{StructureType::Matern, 0, 0, 2, 1}};
    EXPECT_TRUE(options.validate());
    options.structures = {{StructureType::Spherical, 3, 2, 1, 1}};
    EXPECT_NE(options.validate()->find("minRange"), std::string::npos);
    options = {};
    options.level = 0;
    EXPECT_TRUE(options.validate());
}

}  // namespace
