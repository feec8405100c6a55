#pragma once

#include <Eigen/Core>

/// Combining estimates by cross-validation.
namespace vlx {

inline constexpr int kMostCandidates = 8;
using StackingMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMostCandidates, kMostCandidates>;
using StackingVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMostCandidates, 1>;

/// Second moments of m candidates about a base, summed over pixels and both halves, in units of noise:
/// e_j the difference of candidate j from the base (both from one half), y that of the other half's data.
struct StackingMoments {
    StackingMatrix products;       ///< m x m: sum e_i e_j
    StackingVector agreement;      ///< m: sum e_j y
    StackingVector standardError;  ///< m: of agreement
};

/// The share of its difference from another estimate that a noisy estimate keeps, (1 - variance / apart)+:
/// positive-part James-Stein (1961), with the squared difference `apart` and the estimate's variance summed
/// over the same channels. 0 where nothing sets them apart.
double shrinkage(double apart, double variance);

/// Weights w >= 0, sum w <= 1 (the base takes the rest), of least sum (y - sum_j w_j e_j)^2 + |w|^2: stacking
/// with the other half as what is predicted (Breiman, Stacked regressions, 1996). agreement is lowered first
/// by `significance[j]` standard errors. Coordinate descent, which for a convex problem of this size is exact
/// enough after 30 rounds.
StackingVector stackingWeights(const StackingMoments& moments, const StackingVector& significance);

}  // namespace vlx
