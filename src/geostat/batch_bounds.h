#pragma once

#include <algorithm>
#include <cmath>

#include "geostat/batch_kernel.h"
#include "geostat/entry_error.h"
#include "variolux/geostat/kriging.h"

namespace vlx::kernels {

/// Bounds of one lane's errors (their derivation: covariance_system.h; 6 of 2:
/// CovarianceSystem::quickBounds), with |L'w| <= sigma + sqrt(C00) for the weights, and as norm of the
/// inverse either the condition estimate or, where that is less, what the variances of nugget and errors
/// alone allow.
class LaneBounds {
  public:
    LaneBounds(const Batch& b, Eigen::Index lane, const KrigingProblem& problem, double placeError,
               double lowest)
        : b_(b), lane_(lane), n_(static_cast<double>(b.n)), sill_(problem.model.sill()) {
        const double error = problem.errorVariances.size() > 0 ? problem.errorVariances.minCoeff() : 0;
        smallestVariance_ = sill_ + error;
        const double least = (problem.model.nugget + error) / smallestVariance_;
        inverse_ = std::min(std::sqrt(n_) / lowest, 1 / least);
        noise_ = kEntryRounding + placeError / sill_ + kEpsilon * std::sqrt(n_);
    }

    double weights(double variance) const {
        return std::sqrt(n_ * inverse_) * (std::sqrt(std::max(0.0, variance)) + std::sqrt(sill_));
    }
    double estimate(Eigen::Index column, double weights) const {
        const auto at = static_cast<std::size_t>(column * b_.lanes + lane_);
        const double norm = std::sqrt(b_.squares[at]);
        return noise_ * std::sqrt(n_ * inverse_) * norm * (6 * weights + 2 * std::sqrt(sill_)) +
               kEpsilon * std::sqrt(n_) * weights * norm;
    }
    double variance(double weights) const {
        return noise_ * (sill_ + 2 * std::sqrt(sill_) * weights + 6 * weights * weights);
    }
    double smallestVariance() const { return smallestVariance_; }

  private:
    const Batch& b_;
    Eigen::Index lane_;
    double n_, sill_;
    double inverse_ = 1, noise_ = 0, smallestVariance_ = 0;
};

}  // namespace vlx::kernels
