#pragma once

namespace vlx {

/// The plain average of each pixel's samples (a box filter of one pixel): what every renderer writes, and
/// what reconstruction must beat. stddev is the standard error of the mean, sqrt(s^2 / n) with the unbiased
/// sample variance s^2; a pixel of one sample borrows s^2 from the pixels of its 4 x 4 neighbourhood on the
/// raster (their pooled variance, or else the variance between them). It is the samples' own statistic: 0
/// where they agree, whatever they have not seen, where the other methods stay in doubt. A pixel without
/// samples is `empty`, with the picture's spread about 0 as its error, and counted. Non-finite samples are
/// dropped and counted.
struct Mean {
    float empty = 0;
};

}  // namespace vlx
