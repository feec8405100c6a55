#pragma once

#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <vector>

/// Empirical (sample) variograms: how the squared difference of two values grows with the distance between
/// them (Cressie, Statistics for Spatial Data, 1993, ch. 2.4; Chiles and Delfiner, Geostatistics, ch. 2).
///
/// Conventions of the whole file. Data are n positions (n x d, one row a datum) and n values (n x c, one
/// column a channel). The distance is the Euclidean one in all d columns: scale columns beforehand for a
/// composite distance (image plane, features, colour) or an anisotropy (anisotropyTransform). The squared
/// difference of vector values is the squared norm, so a semivariance is the sum over channels. Each
/// unordered pair counts once. A datum with a non-finite position or value, or an error variance or weight
/// that is negative or not finite, is left out and counted in `skipped`.
namespace vlx {

/// With d_ij = |z_i - z_j|, N pairs in a lag class:
enum class VariogramEstimator {
    Matheron,        ///< sum d^2 / (2 N) (1962): unbiased, not robust
    CressieHawkins,  ///< 1/2 (mean sqrt(d))^4 / (0.457 + 0.494/N + 0.045/N^2) (1980, eq. 12): resists
                     ///< outliers
    Dowd,            ///< 2.198 (median d)^2 / 2 (1984): resists up to half of the pairs being outliers
};

/// Pairs in a direction of the plane: those whose difference in the first two columns makes an angle of at
/// most `tolerance` with the axis at `angle` (radians, counter-clockwise from +x; opposite directions are the
/// same) and strays at most `bandwidth` sideways from it. Pairs without a difference there lie in every
/// direction.
struct VariogramDirection {
    double angle = 0;
    double tolerance = 0.39269908169872414;  ///< pi/8; in [0, pi/2]
    double bandwidth = std::numeric_limits<double>::infinity();
};

struct EmpiricalVariogramOptions {
    VariogramEstimator estimator = VariogramEstimator::Matheron;

    /// k + 1 increasing bounds of k lag classes (edges[b], edges[b+1]]; if the first is 0, coincident pairs
    /// belong to the first class.
    std::vector<double> edges;

    std::optional<VariogramDirection> direction;

    /// The broken constraint in words, or nothing.
    std::optional<std::string> validate() const;
};

/// `count` classes of equal width from 0 to `maxDistance`.
std::vector<double> uniformEdges(double maxDistance, int count);

/// One lag class. An empty one has pairs = 0, its centre as distance and NaN as semivariance.
struct VariogramBin {
    double lower = 0;
    double upper = 0;
    double pairs = 0;         ///< number of pairs; with data weights the effective number (sum w)^2 / sum w^2
    double distance = 0;      ///< (weighted) mean distance of the pairs
    double semivariance = 0;  ///< of the error-free field: noise subtracted. Unbiased, so it may be negative
    double noise = 0;         ///< what was subtracted: mean of (v_i + v_j) / 2, v the error variances
    double standardError = 0;  ///< of `semivariance`, see empiricalVariogram()
};

enum class VariogramStatus {
    Ok,
    TooFewData,  ///< fewer than two data are left: every class is empty
    NoPairs,     ///< no pair falls into any class
};

struct EmpiricalVariogram {
    VariogramStatus status = VariogramStatus::Ok;
    std::vector<VariogramBin> bins;  ///< all classes, in order, empty ones too

    /// Standard deviations (k) and correlations (k x k) of the classes' semivariances if the values were
    /// independent (pure nugget + errors), the null hypothesis of sillTest() in variogram_fit.h. 0 for empty
    /// classes. Formula at empiricalVariogram().
    Eigen::VectorXd nullError;
    Eigen::MatrixXd nullCorrelation;

    double variance = 0;   ///< sample variance of the values, errors included, summed over channels
    double meanNoise = 0;  ///< mean error variance
    Eigen::Index data = 0;
    Eigen::Index skipped = 0;

    std::string message() const;
};

/// The empirical variogram. `errorVariances`: n known measurement-error variances (summed over channels), or
/// empty; half the sum of a pair's two is subtracted from its semivariance: exact in the mean for Matheron;
/// for the robust estimators the class mean is subtracted after averaging, exact for Gaussian values with
/// equal errors. `dataWeights`: n, or empty; a pair weighs w_i w_j (declustering, or less trust in noisy
/// data); Matheron only (the robust estimators assert).
///
/// Cost: n^2/2 pairs at about 5 ns (Matheron, d = 2); memory is allocated once a call, not in the pair loop.
///
/// Standard errors. Pairs that share a datum are correlated, so gamma sqrt(2/N) (Cressie 1985, independent
/// pairs) is several times too small when pairs outnumber data. For independent values with variances s_i =
/// g + v_i the covariance of two classes is, exactly,
///     Cov(a, b) = [ V/4 sum_i s_i^2 m_ia m_ib + [a = b] t sum_pairs w_ij^2 s_i s_j ] / (W_a W_b)
/// with m_ia the weight of datum i's pairs in class a, W_a that of all its pairs, V = Var(|e|^2) / E(|e|^2)^2
/// (2 for one Gaussian channel, estimated from the data's fourth moment, so heavy tails widen it) and t =
/// tr(S^2) / tr(S)^2 for the covariance S of the channels (1 for one). `nullError` and `nullCorrelation` take
/// for g the sample variance less the mean error variance, `standardError` of a class its own semivariance.
/// The correlation of the field itself is not included: where ranges reach beyond a class the errors are
/// lower bounds. The robust estimators' are multiplied by the root of their asymptotic relative
/// variances 2.885/2 (Cressie and Hawkins 1980) and 5.44/2 (delta method on the sample median).
EmpiricalVariogram empiricalVariogram(
    const Eigen::Ref<const Eigen::MatrixXd>& positions, const Eigen::Ref<const Eigen::MatrixXd>& values,
    const EmpiricalVariogramOptions& options,
    const Eigen::Ref<const Eigen::VectorXd>& errorVariances = Eigen::VectorXd(),
    const Eigen::Ref<const Eigen::VectorXd>& dataWeights = Eigen::VectorXd());

/// One pair of the variogram cloud.
struct VariogramCloudPoint {
    Eigen::Index first = 0;  ///< rows of the data, first < second
    Eigen::Index second = 0;
    double distance = 0;
    double semivariance = 0;  ///< |z_i - z_j|^2 / 2 - (v_i + v_j) / 2
};

/// All pairs at most `maxDistance` apart, ordered by first, then second.
std::vector<VariogramCloudPoint> variogramCloud(
    const Eigen::Ref<const Eigen::MatrixXd>& positions, const Eigen::Ref<const Eigen::MatrixXd>& values,
    double maxDistance, const Eigen::Ref<const Eigen::VectorXd>& errorVariances = Eigen::VectorXd());

}  // namespace vlx
