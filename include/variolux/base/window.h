#pragma once

#include <cstdint>
#include <string>

namespace vlx {

/// A rectangle of pixels: columns [x, x + width), rows [y, y + height). y grows downwards, as in OpenEXR.
/// The data window of an image may start anywhere, also at negative coordinates.
struct Window {
    int x = 0;
    int y = 0;
    int width = 0;
    int height = 0;

    std::int64_t pixels() const { return std::int64_t{width} * height; }
    bool contains(int px, int py) const { return px >= x && px - x < width && py >= y && py - y < height; }
    bool operator==(const Window&) const = default;
};

/// "4 x 3 pixels at (0, 0)".
inline std::string windowText(const Window& window) {
    return std::to_string(window.width) + " x " + std::to_string(window.height) + " pixels at (" +
           std::to_string(window.x) + ", " + std::to_string(window.y) + ")";
}

/// Coordinates of pixels are at most this far from 0: OpenEXR takes no others, and sums of two fit an int.
inline constexpr int kMostCoordinate = 0x3ffffffe;

/// Whether a window has pixels, all of them within kMostCoordinate.
inline bool isPossible(std::int64_t x, std::int64_t y, std::int64_t width, std::int64_t height) {
    const auto fits = [](std::int64_t first, std::int64_t count) {
        return count >= 1 && first >= -kMostCoordinate && first + count - 1 <= kMostCoordinate;
    };
    return fits(x, width) && fits(y, height);
}

/// One of `count` bands of nearly equal numbers of rows that a window is cut into, from the top.
struct Band {
    int index = 0;  ///< from 0
    int count = 1;
};

/// The rows [h index / count, h (index + 1) / count) of a window of h rows, rounded down; none where there
/// are more bands than rows.
inline Window bandOf(const Window& window, const Band& band) {
    const auto row = [&](int i) {
        return static_cast<int>(static_cast<std::int64_t>(window.height) * i / band.count);
    };
    return {window.x, window.y + row(band.index), window.width, row(band.index + 1) - row(band.index)};
}

}  // namespace vlx
