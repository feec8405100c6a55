#pragma once

#include <vector>

namespace vlx {

/// A feature's values in a neighbourhood.
struct WeightedValues {
    float* values;
    const float* weights;
    int count, padded;  ///< whole vectors: beyond `count` both are 0
    double total;       ///< of the weights
};

/// Weighted variance of the values, once wild ones are forgotten: a few (2 %) that lie farther from the range
/// of all others than it is wide, and than `square` allows features to differ at all, would fix a coefficient
/// by themselves. They count as not known: as the mean of the others. `sorted`: scratch.
double forgetWild(const WeightedValues& of, float square, std::vector<float>& sorted);

}  // namespace vlx
