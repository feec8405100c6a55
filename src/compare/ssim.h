#pragma once

#include <cstdint>

#include "variolux/base/image.h"

namespace vlx {

struct SsimResult {
    double value;  ///< NaN without a single window
    std::int64_t windows;
};

/// Metric::Ssim of two colour images of one size: see compareColour.
SsimResult structuralSimilarity(const Image& reference, const Image& image);

}  // namespace vlx
