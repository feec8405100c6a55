#pragma once

#include <Eigen/Core>
#include <vector>

/// Kriging with a drift of random coefficients, by its normal equations.
///
///     z_i = m + sum_j b_j phi_j(x_i) + e_i,   Var[e_i] = s^2 / w_i,   b_j ~ N(0, 1 / a_g(j)),   m unknown
///
/// is ordinary kriging with the covariance C(x, y) = sum_j phi_j(x) phi_j(y) / a_g(j): a model of finite rank
/// (Omre 1987, Bayesian kriging; Cressie and Johannesson 2008, fixed rank kriging). Its cost is n p^2 instead
/// of n^3, whatever n. The prior variances, one a group of functions, are estimated from the data: a group
/// that explains nothing gets variance 0 and drops out, one that explains much is hardly shrunk.
namespace vlx {

/// Most functions of one model. Systems live on the stack.
inline constexpr int kMaxRandomDrift = 40;

using DriftMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRandomDrift, kMaxRandomDrift>;
using DriftVector = Eigen::Matrix<double, Eigen::Dynamic, 1, Eigen::ColMajor, kMaxRandomDrift, 1>;

/// The data, summed: all that the model needs to know of them. p functions, c value columns.
struct DriftMoments {
    /// p x p: sum_i w_i (phi_i - mean)(phi_i - mean)' / s^2. Functions known with error: with their error
    /// variances, sum_i w_i Var / s^2, on the diagonal (their noise must not become the estimate's).
    DriftMatrix normal;
    /// p x c: sum_i w_i (phi_i - mean)(z_i - mean)' / s^2.
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRandomDrift, kMaxRandomDrift>
        right;
    /// Value columns (the first ones) that the prior variances are estimated from; 1 to c.
    int fitted = 1;
    /// Precision that the iteration starts from and, times 1e-6, its lower bound; > 0. One over the variance
    /// of the values is a good start.
    double start = 1;
};

struct RandomDrift {
    /// p x c: E[b | z].
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, kMaxRandomDrift, kMaxRandomDrift>
        coefficients;
    DriftVector variance;           ///< p: Var[b_j | z]
    std::vector<double> precision;  ///< a_g of each group
    double effective = 0;           ///< effective number of functions, sum_j (1 - a_j Var[b_j | z])
    bool ok = true;                 ///< false: the equations are not finite; coefficients are then 0
};

/// Estimates the prior variances by maximum likelihood of type II and solves. MacKay's fixed point (1992,
/// Bayesian interpolation), `iterations` times: gamma_g = sum (1 - a_g Var[b_j | z]), a_g = gamma_g / mean
/// over value columns of sum b_j^2. `group[j]` in [0, groups) is the group of function j. Never throws.
RandomDrift fitRandomDrift(const DriftMoments& moments, const std::vector<int>& group, int groups,
                           int iterations);

}  // namespace vlx
