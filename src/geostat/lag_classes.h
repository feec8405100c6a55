#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "variolux/geostat/empirical_variogram.h"

namespace vlx {

/// Finds the class of a distance: -1 for none.
class LagClasses {
  public:
    explicit LagClasses(const std::vector<double>& edges) : edges_(edges) {
        const double width = (edges.back() - edges.front()) / static_cast<double>(count());
        uniform_ = true;
        for (std::size_t b = 0; b < edges.size(); ++b)
            uniform_ = uniform_ &&
                       std::abs(edges[b] - edges.front() - width * static_cast<double>(b)) < 0.01 * width;
        inverseWidth_ = 1 / width;
    }

    int count() const { return static_cast<int>(edges_.size()) - 1; }

    int find(double distance) const {
        if (distance <= edges_.front()) return distance == 0 && edges_.front() == 0 ? 0 : -1;
        if (!(distance <= edges_.back())) return -1;
        if (!uniform_)
            return static_cast<int>(std::lower_bound(edges_.begin(), edges_.end(), distance) -
                                    edges_.begin()) -
                   1;
        // The quotient may round across an edge; the edges themselves decide.
        int b = std::min(static_cast<int>((distance - edges_.front()) * inverseWidth_), count() - 1);
        while (distance <= edges_[static_cast<std::size_t>(b)]) --b;
        while (distance > edges_[static_cast<std::size_t>(b) + 1]) ++b;
        return b;
    }

  private:
    const std::vector<double>& edges_;
    bool uniform_ = true;
    double inverseWidth_ = 1;
};

/// Classes without pairs.
inline std::vector<VariogramBin> emptyBins(const std::vector<double>& edges) {
    constexpr double nan = std::numeric_limits<double>::quiet_NaN();
    std::vector<VariogramBin> bins;
    for (std::size_t b = 0; b + 1 < edges.size(); ++b)
        bins.push_back({edges[b], edges[b + 1], 0, 0.5 * (edges[b] + edges[b + 1]), nan, 0, nan});
    return bins;
}

}  // namespace vlx
