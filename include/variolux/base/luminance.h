#pragma once

#include <concepts>

namespace vlx {

/// Relative luminance of linear R, G, B with the primaries of Rec. 709 (ITU-R BT.709-6), computed in T.
template <std::floating_point T>
constexpr T luminance(T r, T g, T b) {
    return static_cast<T>(0.2126) * r + static_cast<T>(0.7152) * g + static_cast<T>(0.0722) * b;
}

}  // namespace vlx
