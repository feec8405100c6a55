#pragma once

#include <functional>
#include <random>
#include <vector>

#include "reconstruct/common/region.h"
#include "variolux/dump/band.h"

namespace vlx {

/// One sample of a made-up image.
struct MadeSample {
    float r, g, b, x, y;
};

/// A band of `window` with channels R, G, B, sample.x, sample.y and `count` samples a pixel from
/// sample(column, row, index).
inline SampleBand makeBand(const Window& window, int count,
                           const std::function<MadeSample(int, int, int)>& sample) {
    SampleBand band{
        window.x, window.y, window.width, window.height, {0}, {"R", "G", "B", "sample.x", "sample.y"}, {}};
    band.values.resize(5);
    for (int row = window.y; row < window.y + window.height; ++row)
        for (int column = window.x; column < window.x + window.width; ++column) {
            for (int i = 0; i < count; ++i) {
                const MadeSample s = sample(column, row, i);
                int c = 0;
                for (const float value : {s.r, s.g, s.b, s.x, s.y})
                    band.values[static_cast<std::size_t>(c++)].push_back(value);
            }
            band.offsets.push_back(band.values[0].size());
        }
    return band;
}

inline BandLayout madeLayout() { return {{0, 1, 2}, 3, 4}; }

/// Sixteen strata a pixel, in order: sample `index` lies in the cell index % 16, at its centre.
inline float stratumX(int column, int index) { return static_cast<float>(column + (index % 4 + 0.5) / 4); }
inline float stratumY(int row, int index) { return static_cast<float>(row + (index / 4 % 4 + 0.5) / 4); }

}  // namespace vlx
