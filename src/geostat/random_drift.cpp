#include "variolux/geostat/random_drift.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace vlx {

namespace {

constexpr double kLeastPrecision = 1e-6;  // of the start: a prior this wide does not shrink
constexpr double kMostPrecision = 1e12;   // of the start: a group this tight is out

/// Inverse of the lower triangle of a factor. Plain loops: these matrices are too small for blocks to pay.
DriftMatrix inverseOf(const DriftMatrix& factor) {
    const Eigen::Index p = factor.rows();
    DriftMatrix inverse = DriftMatrix::Zero(p, p);
    for (Eigen::Index j = 0; j < p; ++j) {
        inverse(j, j) = 1 / factor(j, j);
        for (Eigen::Index i = j + 1; i < p; ++i) {
            double sum = 0;
            for (Eigen::Index k = j; k < i; ++k) sum += factor(i, k) * inverse(k, j);
            inverse(i, j) = -sum / factor(i, i);
        }
    }
    return inverse;
}

}  // namespace

RandomDrift fitRandomDrift(const DriftMoments& moments, const std::vector<int>& group, int groups,
                           int iterations) {
    const Eigen::Index p = moments.normal.rows();
    RandomDrift drift;
    drift.precision.assign(static_cast<std::size_t>(groups), moments.start);
    drift.coefficients.setZero(p, moments.right.cols());
    drift.variance.setZero(p);
    const double least = kLeastPrecision * moments.start, most = kMostPrecision * moments.start;
    for (int iteration = 0;; ++iteration) {
        DriftMatrix matrix = moments.normal;
        for (Eigen::Index j = 0; j < p; ++j)
            matrix(j, j) += drift.precision[static_cast<std::size_t>(group[static_cast<std::size_t>(j)])];
        const Eigen::LLT<DriftMatrix> factor(matrix);
        if (factor.info() != Eigen::Success) {
            drift.ok = false;
            return drift;
        }
        const DriftMatrix inverse = inverseOf(factor.matrixLLT());
        drift.coefficients = inverse.transpose().lazyProduct(inverse.lazyProduct(moments.right).eval());
        drift.variance = inverse.colwise().squaredNorm().transpose();

        std::vector<double> explained(static_cast<std::size_t>(groups)), squares = explained;
        for (Eigen::Index j = 0; j < p; ++j) {
            const auto g = static_cast<std::size_t>(group[static_cast<std::size_t>(j)]);
            explained[g] += std::max(0.0, 1 - drift.precision[g] * drift.variance[j]);
            squares[g] += drift.coefficients.row(j).head(moments.fitted).squaredNorm() / moments.fitted;
        }
        drift.effective = 0;
        for (const double gamma : explained) drift.effective += gamma;
        if (iteration == iterations) break;
        for (std::size_t g = 0; g < explained.size(); ++g)
            drift.precision[g] = std::clamp(explained[g] / std::max(squares[g], 1e-300), least, most);
    }
    if (!drift.coefficients.allFinite() || !drift.variance.allFinite()) {
        drift.ok = false;
        drift.coefficients.setZero();
        drift.variance.setZero();
    }
    return drift;
}

}  // namespace vlx
