#pragma once

#include <Eigen/Core>
#include <map>
#include <string>
#include <vector>

#include "variolux/geostat/kriging.h"

/// One hard case: a kriging problem with its exact answer and the properties to assert (the format is in
/// testdata/hard/README.md).
namespace vlx::testing {

struct HardCase {
    std::string id;
    KrigingProblem problem;
    KrigingTargets targets;
    bool extraTargetIsInvalid = false;  ///< the last target is not finite and must not disturb the others

    std::string status;
    Eigen::VectorXd prediction, variance;  ///< empty if the case expects an error
    Eigen::MatrixXd weights;
    Eigen::VectorXd beta, betaVariance;
    std::map<std::string, double> tolerance;
    std::vector<std::string> properties;
    double condition = 0;  ///< infinite if unknown

    bool has(const std::string& property) const;
};

/// Throws std::exception on a file that is not a hard case.
HardCase readHardCase(const std::string& path);

/// Everything that is wrong with the answer to this case, factorised as told; empty = passed.
std::vector<std::string> checkHardCase(const HardCase& hardCase, KrigingPrecision precision);

}  // namespace vlx::testing
