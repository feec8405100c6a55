#include "reconstruct/common/inspection.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace vlx {
namespace {

struct Field {
    Eigen::MatrixXd positions{8, 2}, colours{8, 3};
    Eigen::VectorXd errors{8};
    Field() {
        std::mt19937 random(5);
        std::uniform_real_distribution<double> uniform(0, 4);
        for (Eigen::Index i = 0; i < 8; ++i) {
            positions.row(i) << uniform(random), uniform(random);
            colours.row(i) << std::sin(positions(i, 0)), uniform(random), std::cos(positions(i, 1));
            errors[i] = 0.05 + 0.1 * uniform(random);
        }
    }

    /// The kriging system of the data but for `without` (-1: of all).
    CovarianceProblem problem(Eigen::Index without) const {
        std::vector<Eigen::Index> rows;
        for (Eigen::Index i = 0; i < 8; ++i)
            if (i != without) rows.push_back(i);
        const auto n = static_cast<Eigen::Index>(rows.size());
        CovarianceProblem p;
        p.covariance.resize(n, n);
        p.drift = Eigen::MatrixXd::Ones(n, 1);
        p.values = colours(rows, Eigen::all);
        for (Eigen::Index a = 0; a < n; ++a)
            for (Eigen::Index b = 0; b < n; ++b)
                p.covariance(a, b) =
                    covarianceOf(rows[static_cast<std::size_t>(a)], rows[static_cast<std::size_t>(b)]) +
                    (a == b ? errors[rows[static_cast<std::size_t>(a)]] : 0);
        return p;
    }

    double covarianceOf(Eigen::Index a, Eigen::Index b) const {
        return std::exp(-(positions.row(a) - positions.row(b)).norm() / 1.5);
    }
};

TEST(CrossValidate, IsLeavingEachDatumOut) {
    const Field field;
    const CrossValidation found =
        crossValidate(CovarianceSystem(field.problem(-1)).leaveOneOut(), field.colours);
    double squares = 0, scores = 0;
    for (Eigen::Index i = 0; i < 8; ++i) {
        CovarianceTargets target;
        target.covariance.resize(7, 1);
        for (Eigen::Index k = 0, row = 0; k < 8; ++k)
            if (k != i) target.covariance(row++, 0) = field.covarianceOf(k, i);
        target.drift = Eigen::MatrixXd::Ones(1, 1);
        target.variance = Eigen::VectorXd::Constant(1, 1);
        const KrigingPrediction p = CovarianceSystem(field.problem(i)).predict(target);
        const double square = (p.estimate.row(0) - field.colours.row(i)).squaredNorm();
        squares += square;
        scores += square / (p.variance[0] + field.errors[i]);  // the datum's own error included
    }
    EXPECT_EQ(found.data, 8);
    EXPECT_NEAR(found.rmse, std::sqrt(squares / 8), 1e-9);
    EXPECT_NEAR(found.meanSquareScore, scores / 8, 1e-9);
}

TEST(CrossValidate, OfOneDatumThereIsNone) {
    CovarianceProblem p;
    p.covariance = p.drift = Eigen::MatrixXd::Ones(1, 1);
    p.values = Eigen::MatrixXd::Ones(1, 3);
    EXPECT_EQ(crossValidate(CovarianceSystem(p).leaveOneOut(), p.values).data, 0);
}

TEST(SetVariogram, KeepsAnEvenChoiceOfTheCloud) {
    Eigen::MatrixXd positions(100, 2), colours(100, 3);
    for (Eigen::Index i = 0; i < 100; ++i) {
        positions.row(i) << static_cast<double>(i % 10), static_cast<double>(i / 10);
        colours.row(i).setConstant(static_cast<double>(i % 10));
    }
    const Eigen::VectorXd errors = Eigen::VectorXd::Constant(100, 0.5);
    EmpiricalVariogramOptions options;
    options.edges = uniformEdges(20, 5);
    RegionInspection inspection;
    setVariogram(inspection, empiricalVariogram(positions, colours, options, errors), positions, colours,
                 errors);
    EXPECT_EQ(inspection.pairs, 100 * 99 / 2);
    EXPECT_LE(inspection.cloud.size(), kCloudPoints);
    EXPECT_GT(inspection.cloud.size(), kCloudPoints / 2);
    EXPECT_EQ(inspection.classes.size(), 5u);
    // The first pair: neighbours, 1 apart in each colour, less the noise.
    EXPECT_EQ(inspection.cloud[0][0], 1);
    EXPECT_EQ(inspection.cloud[0][1], 1.5 - 0.5);
}

}  // namespace
}  // namespace vlx
