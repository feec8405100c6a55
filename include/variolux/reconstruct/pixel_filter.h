#pragma once

#include <vector>

#include "variolux/base/image.h"

namespace vlx {

/// How the light that falls around a pixel makes its value. t is the distance from its centre in pixels,
/// along each axis.
enum class PixelFilter {
    Box,             ///< 1 for |t| < 1/2: what reconstructions are
    Gaussian,        ///< exp(-2 t^2) - exp(-2 1.5^2) for |t| < 1.5 (standard deviation 1/2)
    BlackmanHarris,  ///< 0.35875 + 0.48829 cos u + 0.14128 cos 2u + 0.01168 cos 3u, u = 2 pi t / 3, |t| < 1.5
};

/// Weights of the pixels at -2 ... 2 along an axis: the integrals of the filter over them, summing to 1.
std::vector<double> filterWeights(PixelFilter filter);

/// Filters an image whose pixels are averages over their squares: each channel with the same weights, those
/// beyond the image left out. Layers stddev.* likewise: errors of neighbours count as the same error, which
/// cannot understate the filtered one's. What varies within a pixel is not known any more: the difference
/// from filtering the samples themselves is of second order in it.
Image applyPixelFilter(const Image& image, PixelFilter filter);

}  // namespace vlx
