#pragma once

#include <cstdint>

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

}  // namespace vlx
