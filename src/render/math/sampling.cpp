#include "render/math/sampling.h"

#include <cassert>
#include <numeric>

namespace vlx::render {

Distribution::Distribution(std::span<const float> weights) {
    assert(!weights.empty());
    const double total = std::accumulate(weights.begin(), weights.end(), 0.0);
    cumulative_.reserve(weights.size() + 1);
    double sum = 0;
    for (std::size_t i = 0; i < weights.size(); ++i) {
        cumulative_.push_back(static_cast<float>(sum));
        sum += total > 0 ? weights[i] / total : 1.0 / static_cast<double>(weights.size());
    }
    cumulative_.push_back(1.f);
    // Rounding must not give the entries after the last positive one a probability.
    for (std::size_t i = weights.size(); total > 0 && i-- > 0 && weights[i] == 0;) cumulative_[i] = 1.f;
}

}  // namespace vlx::render
