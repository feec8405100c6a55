#pragma once

#include <vector>

#include "variolux/base/image.h"
#include "variolux/dump/sample_source.h"

/// What samples say of another denoiser's image, for certain.
namespace vlx {

/// Means of a source's pixels and the error variances of these means, R, G, B after each other; rows from
/// the top.
struct SampleMeans {
    int width = 0, height = 0;
    std::vector<float> mean[3];      ///< NaN where there is no sample
    std::vector<float> own[3];       ///< variance that the pixel's samples show, 0 without any
    std::vector<float> variance[3];  ///< averaged over 11 x 11 pixels or 3 x 3, whichever is more, and 1e-4
                                     ///< of the mean level squared

    std::size_t at(int x, int y) const {
        return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    }
    bool known(std::size_t pixel) const { return mean[0][pixel] == mean[0][pixel]; }
};

SampleMeans sampleMeans(const SampleSource& source);

/// A lower bound of the mean squared error of `image` (R, G, B) around each pixel, mean over colours: what
/// it differs from the samples' means z by beyond their error variances v, less three standard errors,
///     max over windows of v max(0, t - 3 s(t)),    t = sum g ((z - D)^2 / v - 1) / sum g
/// within 2, 7 and 15 pixels, which an image of the wrong shape fails; and, within 60 pixels, of its bias,
/// in units of r = sqrt(D^2 + v) of each pixel and colour, d = (z - D) / r,
///     mean over colours of r^2 max(0, |sum g d| / sum g - 3 sqrt(sum g^2 max(v / r^2, d^2)) / sum g)^2,
/// which one of the wrong brightness fails. g: window_sum.h. An image that follows the samples' noise lowers
/// t: it is a lower bound all the same.
std::vector<float> certainError(const SampleMeans& samples, const Image& image);

/// What samples say against an image, pixel by pixel.
struct Doubts {
    /// What the image is too bright by, R, G, B: r m (1 - s^2 / m^2), m = -sum g d / sum g within 7 or
    /// 15 pixels, the fewest for which |m| passes three standard errors s; 0 where none does.
    std::vector<float> bias[3];
    /// The probability that noise alone makes samples around the pixel differ from the image as much as these
    /// do, by the tests of certainError() and of bias, for how many they are (Bonferroni); at most 1.
    std::vector<float> confidence;
};

Doubts doubtsOf(const SampleMeans& samples, const Image& image);

}  // namespace vlx
