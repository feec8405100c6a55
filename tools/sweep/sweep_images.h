#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "variolux/base/image.h"

/// What a sweep does with images.
namespace vlx {

struct ReferenceImage {
    Image colour;
    std::optional<Image> stddev;
};

/// See SweepMethod, {sigma}. Throws Error naming `path` when the images cannot be compared.
double bestSigma(const Image& average, const Image& reference, const std::string& path);

/// Pixels to inspect: `count` of an even grid, and a quarter as many where the error is largest in squares of
/// 8 x 8 pixels (one a square, so that they do not all sit on one firefly).
std::vector<std::pair<int, int>> inspectedPixels(const Image& error, int count);

/// Pixels with no error, that know it: the error, stddev and the reference's own stddev, where it has one,
/// are zero in all channels. Right and known to be right, they say nothing about an error map.
double exactPixels(const Image& colour, const Image& stddev, const ReferenceImage& reference);

/// |x - r|, or without a reference the predicted error.
Image errorImage(const Image& colour, const std::optional<Image>& stddev, const ReferenceImage* reference);

}  // namespace vlx
