#include "variolux/reconstruct/sampling_map.h"

#include <cassert>
#include <cmath>

#include "reconstruct/common/relative_error.h"

namespace vlx {

Image samplingMap(const Image& estimate) {
    const RelativeError error(estimate);
    assert(error.known());
    Image map(estimate.data, {"sampling.density"});
    map.display = estimate.display;
    double sum = 0;
    for (int row = 0; row < map.data.height; ++row)
        for (int col = 0; col < map.data.width; ++col) {
            const double squares = error.of(estimate.at(col, row));
            sum += std::sqrt(squares);
            *map.at(col, row) = static_cast<float>(std::sqrt(squares));
        }
    const double mean = sum / static_cast<double>(map.data.pixels());
    for (float& density : map.pixels)
        density = mean > 0 ? static_cast<float>(static_cast<double>(density) / mean) : 1.f;
    return map;
}

}  // namespace vlx
