#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "variolux/base/image.h"

namespace vlx {

/// A filtered image, and what could not be used of its input.
struct GaussianResult {
    Image image;
    std::int64_t excluded = 0;  ///< non-finite values of the input, left out of every sum
    std::int64_t empty = 0;     ///< values with no finite input in reach, set to 0
};

/// The baseline that every denoiser has to beat: each value becomes the mean of its channel around it,
/// weighted by exp(-d^2 / (2 sigma^2)), d the distance between pixel centres, sigma in pixels.
///
/// The kernel is the Gaussian sampled at pixel centres, truncated where a column or row is more than
/// ceil(4 sigma) away (6e-5 of the weight lies beyond). Weights are divided by their sum over the finite
/// values inside the data window: borders do not darken, and a non-finite value is a hole filled from around
/// it, so NaN may be used to mark pixels without data. Channels and windows are kept; every channel is
/// filtered.
///
/// Throws Error unless sigma is positive and finite. Bit-identical for any number of threads.
GaussianResult gaussianFilter(const Image& image, double sigma);

/// As a method: the average (mean.h), filtered. A pixel without samples has no part in its neighbours. The
/// error of a filtered pixel is mostly bias, which this filter cannot know: no layer stddev.
struct Gaussian {
    double sigma = 1;  ///< pixels; > 0, finite

    /// The broken constraint in words, or nothing.
    std::optional<std::string> validate() const;
};

}  // namespace vlx
