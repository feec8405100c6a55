#include <Eigen/Cholesky>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <vector>

#include "variolux/geostat/variogram_fit.h"

namespace vlx {

SillTest sillTest(const EmpiricalVariogram& variogram, double level) {
    assert(level > 0 && level < 1);
    std::vector<Eigen::Index> used;
    for (std::size_t b = 0; b < variogram.bins.size(); ++b) {
        const VariogramBin& bin = variogram.bins[b];
        if (bin.pairs > 0 && bin.distance > 0 && std::isfinite(bin.semivariance))
            used.push_back(static_cast<Eigen::Index>(b));
    }
    SillTest test;
    const Eigen::Index k = static_cast<Eigen::Index>(used.size());
    if (k < 2) return test;
    Eigen::VectorXd gamma(k), distance(k), pairs(k);
    for (Eigen::Index i = 0; i < k; ++i) {
        const VariogramBin& bin = variogram.bins[static_cast<std::size_t>(used[static_cast<std::size_t>(i)])];
        gamma[i] = bin.semivariance;
        distance[i] = bin.distance;
        pairs[i] = bin.pairs;
    }
    const double valueScale = gamma.cwiseAbs().maxCoeff();
    if (!(valueScale > 0)) return test;
    gamma /= valueScale;

    Eigen::VectorXd deviation(k);
    Eigen::MatrixXd correlation = Eigen::MatrixXd::Identity(k, k);
    const Eigen::Index all = static_cast<Eigen::Index>(variogram.bins.size());
    if (variogram.nullError.size() == all && variogram.nullCorrelation.rows() == all) {
        deviation = variogram.nullError(used) / valueScale;
        correlation = variogram.nullCorrelation(used, used);
    } else {
        const double mean = std::max(0.0, gamma.dot(pairs) / pairs.sum());
        deviation = mean * (2 * pairs.cwiseInverse()).cwiseSqrt();
    }
    if (!deviation.allFinite() || !correlation.allFinite() || !(deviation.minCoeff() > 0)) return test;
    correlation.diagonal().array() += 1e-9;  // classes that repeat each other
    const Eigen::LLT<Eigen::MatrixXd> factor(correlation);
    if (factor.info() != Eigen::Success) return test;
    const auto whiten = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
        return factor.matrixL().solve(x.cwiseQuotient(deviation));
    };

    const Eigen::VectorXd level0 = whiten(Eigen::VectorXd::Ones(k)).normalized();
    const Eigen::VectorXd observed = whiten(gamma);
    const double shortest = 0.5 * distance.minCoeff(), longest = distance.maxCoeff();
    constexpr int steps = 24;
    Eigen::VectorXd previous;
    double length = 0;
    bool any = false;
    for (int i = 0; i <= steps; ++i) {
        const double range = shortest * std::pow(longest / shortest, static_cast<double>(i) / steps);
        Eigen::VectorXd direction(k);
        for (Eigen::Index b = 0; b < k; ++b)
            direction[b] = unitSemivariance(StructureType::Exponential, 1, distance[b] / range);
        direction = whiten(direction);
        const double before = direction.norm();
        direction -= level0 * level0.dot(direction);
        const double norm = direction.norm();
        // All classes beyond the range: the structure cannot be told from a nugget.
        if (!(norm > 1e-6 * before)) continue;
        direction /= norm;
        const double z = direction.dot(observed);
        test.statistic = any ? std::max(test.statistic, z) : z;
        if (any) length += std::acos(std::clamp(direction.dot(previous), -1.0, 1.0));
        previous = direction;
        any = true;
    }
    if (!any || !std::isfinite(test.statistic)) return {};
    const double z = test.statistic;
    constexpr double pi = 3.14159265358979323846;
    test.pValue =
        std::min(1.0, 0.5 * std::erfc(z / std::sqrt(2.0)) + length / (2 * pi) * std::exp(-0.5 * z * z));
    test.significant = test.pValue <= level;
    return test;
}

}  // namespace vlx
