#include "variolux/compare/colour_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "variolux/base/image_io.h"

namespace vlx {

namespace {

/// Lightness, chroma and hue (degrees) in Oklab.
struct Lch {
    double lightness, chroma, hue;
};

struct Lab {
    double lightness, a, b;
};

Lab toLab(const Lch& colour) {
    const double angle = colour.hue * std::numbers::pi / 180;
    return {colour.lightness, colour.chroma * std::cos(angle), colour.chroma * std::sin(angle)};
}

Lab mix(const Lab& from, const Lab& to, double t) {
    return {std::lerp(from.lightness, to.lightness, t), std::lerp(from.a, to.a, t),
            std::lerp(from.b, to.b, t)};
}

/// Ottosson's matrices from Oklab to linear sRGB.
DisplayColour toDisplay(const Lab& c) {
    const auto cube = [](double x) { return x * x * x; };
    const double l = cube(c.lightness + 0.3963377774 * c.a + 0.2158037573 * c.b);
    const double m = cube(c.lightness - 0.1055613458 * c.a - 0.0638541728 * c.b);
    const double s = cube(c.lightness - 0.0894841775 * c.a - 1.2914855480 * c.b);
    return {linearToSrgb(static_cast<float>(4.0767416621 * l - 3.3077115913 * m + 0.2309699292 * s)),
            linearToSrgb(static_cast<float>(-1.2684380046 * l + 2.6097574011 * m - 0.3413193965 * s)),
            linearToSrgb(static_cast<float>(-0.0041960863 * l - 0.7034186147 * m + 1.7076147010 * s))};
}

// Chosen inside the sRGB gamut, as are all mixtures of neighbours: a clipped colour would bend the lightness.
constexpr std::array<Lch, 5> kSequential = {
    {{0.1500, 0.03, 290}, {0.3525, 0.14, 305}, {0.5550, 0.18, 10}, {0.7575, 0.14, 55}, {0.9600, 0.07, 105}}};
constexpr Lch kLow = {0.45, 0.14, 255};
constexpr Lch kMiddle = {0.97, 0, 0};
constexpr Lch kHigh = {0.45, 0.16, 27};

}  // namespace

DisplayColour sequentialColour(double t) {
    const double position = std::clamp(t, 0.0, 1.0) * static_cast<double>(kSequential.size() - 1);
    const auto index = std::min(static_cast<std::size_t>(position), kSequential.size() - 2);
    return toDisplay(
        mix(toLab(kSequential[index]), toLab(kSequential[index + 1]), position - static_cast<double>(index)));
}

DisplayColour divergingColour(double t) {
    return toDisplay(mix(toLab(kMiddle), toLab(t < 0 ? kLow : kHigh), std::min(std::abs(t), 1.0)));
}

}  // namespace vlx
