#pragma once

#include "variolux/geostat/kriging.h"

namespace vlx {

/// What KrigingSystem does where double precision has lost too many digits (kriging_precise.cpp): a table, so
/// that it is only linked into programs that have a system which may.
struct KrigingSystem::MoreDigits {
    void (KrigingSystem::*prepare)();
    void (KrigingSystem::*predict)(const KrigingTargets& targets, const KrigingPredictOptions& options,
                                   const CovarianceTargets& lower, KrigingPrediction& prediction) const;
    void (KrigingSystem::*drift)(DriftEstimate& estimate) const;
    void (KrigingSystem::*leaveOneOut)(LeaveOneOut& merged) const;
};

}  // namespace vlx
