#pragma once

#include <array>

namespace vlx {

/// A display colour (sRGB encoded), R, G, B in [0, 1].
using DisplayColour = std::array<float, 3>;

/// Sequential map of t in [0, 1] (clamped): nearly black, violet, red, orange, pale yellow. Lightness rises
/// in equal steps in Ottosson's perceptual space Oklab ("A perceptual color space for image processing",
/// 2020), so that equal steps of t look equal, in grey as well.
DisplayColour sequentialColour(double t);

/// Diverging map of t in [-1, 1] (clamped): blue, white at 0, red. Both ends are equally dark; lightness
/// falls in equal steps in Oklab with |t|.
DisplayColour divergingColour(double t);

/// Marks values that are not finite: a green that neither map contains.
inline constexpr DisplayColour kNonFiniteColour = {0.0f, 1.0f, 0.0f};

}  // namespace vlx
