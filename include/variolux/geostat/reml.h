#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "variolux/geostat/variogram_fit.h"
#include "variolux/geostat/variogram_model.h"

/// Restricted maximum likelihood (Patterson and Thompson, Biometrika 58, 1971; Kitanidis, Water Resources
/// Research 19, 1983): the likelihood of those contrasts of the data that the drift does not touch, so that
/// estimating the drift does not bias the variances. Needs no lag classes and takes each datum's known error
/// variance exactly; costs O(n^3) an evaluation, so it is the reference for fitVariogram(), or for few data.
/// Double precision throughout.
namespace vlx {

/// The data of a likelihood: n positions (n x d), values (n x c; columns are independent realisations with
/// the same covariance and their own drift), drift functions (n x p, p >= 0; dependent columns are dropped by
/// rank), error variances (n, or empty for 0). All finite.
struct RemlData {
    Eigen::MatrixXd positions;
    Eigen::MatrixXd values;
    Eigen::MatrixXd drift;
    Eigen::VectorXd errorVariances;

    /// The broken constraint in words, or nothing.
    std::optional<std::string> validate() const;
};

struct RemlLikelihood {
    bool ok =
        false;  ///< false: the covariance matrix is not positive definite, or too few data for the drift
    double logLikelihood = 0;
    Eigen::VectorXd gradient;     ///< by the model's parameters, ordered as semivarianceGradient()
    Eigen::MatrixXd information;  ///< expected (Fisher) information of the same parameters
};

/// With K = [C(x_i - x_j)] + diag(v), F the drift with orthonormal columns (Harville 1974),
///     -2 l = c [(n-p) log 2 pi + log|K| + log|F' K^-1 F|] + tr(Z' P Z),
///     P = K^-1 - K^-1 F (F' K^-1 F)^-1 F' K^-1,
///     dl/dt = -1/2 [c tr(P dK/dt) - tr(Z' P dK/dt P Z)],  I_st = c/2 tr(P dK/ds P dK/dt).
/// The model must be valid and bounded. `derivatives` false leaves gradient and information empty.
RemlLikelihood remlLikelihood(const RemlData& data, const VariogramModel& model, bool derivatives = true);

struct RemlOptions {
    /// As in FitOptions, without Linear. Bounds 0 of a range stand for a third of the shortest positive, and
    /// ten times the longest distance between data.
    std::vector<FitStructure> structures = {FitStructure{StructureType::Exponential}};
    bool nugget = true;
    int starts = 3;       ///< of 9 starting points the best so many are followed
    int iterations = 60;  ///< of one start
    double level = 0.05;  ///< of the likelihood ratio test, in (0, 1)

    std::optional<std::string> validate() const;
};

enum class RemlStatus {
    Ok,
    NotConverged,  ///< the best point found; its gradient is not yet small
    TooFewData,    ///< no degree of freedom beside the drift, or all data at one position
    Zero,          ///< the drift explains the data exactly: no variance is left to model
    Singular,      ///< no starting point has a positive definite covariance matrix
};

struct RemlFit {
    RemlStatus status = RemlStatus::TooFewData;
    VariogramModel model;  ///< always valid
    double logLikelihood = 0;
    /// Square roots of the diagonal of the inverse information; NaN where a parameter is fixed or at a bound.
    Eigen::VectorXd standardErrors;
    /// Twice the gain in log-likelihood over pure nugget (or over the errors alone, without nugget).
    double likelihoodRatio = 0;
    /// exp(-likelihoodRatio / 2): the chi-squared probability with two degrees of freedom, for sill and
    /// range. The range has no meaning under the null hypothesis, so this is not exact; it is conservative.
    double pValue = 1;
    bool significant = false;
    int evaluations = 0;

    bool ok() const { return status == RemlStatus::Ok || status == RemlStatus::NotConverged; }
    std::string message() const;
};

/// Maximises the likelihood over log nugget, log sills, log ranges and shapes in their bounds by BFGS with
/// projection from several starts. Variances below 1e-8 of the data's are reported as 0 where the likelihood
/// agrees.
RemlFit fitReml(const RemlData& data, const RemlOptions& options = {});

}  // namespace vlx
