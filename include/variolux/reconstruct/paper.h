#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

/// Yue and Nishita's method (METHOD.md sections 4 to 6): ordinary kriging of sub-pixel cell means with known
/// measurement errors, in regions of 4 x 4 pixels, on a composite distance.
namespace vlx {

/// The method's options. No pixel is sure of itself: where not two of a region's N samples differ, one
/// sample's variance is taken to be that of what they may not have seen, 3 / N times the square of the
/// pixel's level or the picture's mean (drift.h, 9); it changes the errors, not the estimates. A region
/// without samples is 0, with the picture's spread about 0 as its error. reconstruct() throws Error when a
/// region holds more than kMaxRegionData cells.
struct Paper {
    /// Side of the square regions in pixels, on a raster grid through (0, 0); 0: the whole image is one
    /// region.
    int regionSize = 4;
    /// Join the distance in colour space with the distance on the image plane.
    bool colourDistance = true;
    /// Raster coordinates (x, y) of pixels of the data window whose regions are to be inspected
    /// (PaperReport::inspections).
    std::vector<std::pair<int, int>> inspect = {};

    /// The broken constraint in words, or nothing.
    std::optional<std::string> validate() const;
};

/// Most data that one kriging system may hold (its matrix is then 128 MB).
inline constexpr int kMaxRegionData = 4096;

}  // namespace vlx
