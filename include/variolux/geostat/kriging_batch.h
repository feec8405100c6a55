#pragma once

#include <vector>

#include "variolux/geostat/kriging.h"

/// Many small kriging problems at once. Below some hundred data a factorisation is too short to fill a
/// processor's vectors; here every lane of a vector is a system of its own (2, 4 or 8 at a time, by the
/// processor; interleaved storage as in Dongarra et al., Procedia Computer Science 108, 2017).
///
/// Only plain systems go that way: point targets, at most 128 data, distinct places, bounded models, pivots
/// and drift columns well above rounding. Everything else is solved by KrigingSystem, one at a time, and the
/// answer says so. Both satisfy the same tolerances.
namespace vlx {

struct KrigingBatchAnswer {
    KrigingReport report;
    KrigingPrediction prediction;
    bool batched = false;  ///< solved in a vector lane
};

struct KrigingBatchOptions {
    /// Lanes to use at most, a power of two; 0 = as many as the processor has. Results do not depend on it.
    int lanes = 0;
};

/// Answers problems[i] at targets[i]. An answer depends, bit by bit, on its own problem only: not on the
/// others, their order, or the processor. Shapes may differ from problem to problem; equal ones (data rounded
/// up to a multiple of four, targets, columns, drift, kinds of structures) share vectors.
std::vector<KrigingBatchAnswer> krigeBatch(const std::vector<KrigingProblem>& problems,
                                           const std::vector<KrigingTargets>& targets,
                                           const KrigingBatchOptions& options = {});

}  // namespace vlx
