#include "reconstruct/drift/stacking.h"

#include <algorithm>

namespace vlx {

double shrinkage(double apart, double variance) {
    return apart > variance && apart > 0 ? 1 - variance / apart : 0;
}

StackingVector stackingWeights(const StackingMoments& moments, const StackingVector& significance) {
    constexpr int kRounds = 30;
    constexpr double kLeastMove = 1e-4;  // no pixel shows less
    constexpr double kRidge = 1;  // in units of noise: differences below one standard error decide nothing
    const Eigen::Index m = moments.agreement.size();
    StackingVector weights = StackingVector::Zero(m);
    const StackingVector agreement = moments.agreement - significance.cwiseProduct(moments.standardError);
    bool moved = true;
    for (int round = 0; round < kRounds && moved; ++round) {
        moved = false;
        for (Eigen::Index j = 0; j < m; ++j) {
            const double others = moments.products.row(j).dot(weights) - moments.products(j, j) * weights[j];
            const double best = (agreement[j] - others) / (moments.products(j, j) + kRidge);
            const double weight = std::clamp(best, 0.0, std::max(0.0, 1 - (weights.sum() - weights[j])));
            moved = moved || std::abs(weight - weights[j]) > kLeastMove;
            weights[j] = weight;
        }
    }
    return weights;
}

}  // namespace vlx
