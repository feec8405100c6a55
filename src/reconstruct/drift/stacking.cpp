#include "reconstruct/drift/stacking.h"

#include <algorithm>

namespace vlx {

double shrinkage(double apart, double variance) {
    return apart > variance && apart > 0 ? 1 - variance / apart : 0;
}

Eigen::VectorXd stackingWeights(const StackingMoments& moments, const Eigen::VectorXd& significance) {
    constexpr int kRounds = 30;
    constexpr double kRidge = 1;  // in units of noise: differences below one standard error decide nothing
    const Eigen::Index m = moments.agreement.size();
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(m);
    const Eigen::VectorXd agreement = moments.agreement - significance.cwiseProduct(moments.standardError);
    for (int round = 0; round < kRounds; ++round)
        for (Eigen::Index j = 0; j < m; ++j) {
            const double others = moments.products.row(j).dot(weights) - moments.products(j, j) * weights[j];
            const double best = (agreement[j] - others) / (moments.products(j, j) + kRidge);
            weights[j] = std::clamp(best, 0.0, std::max(0.0, 1 - (weights.sum() - weights[j])));
        }
    return weights;
}

}  // namespace vlx
