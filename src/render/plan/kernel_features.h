#pragma once

#include <array>
#include <string_view>

namespace vlx::render {

/// Which parts of the tracer a kernel is compiled with. A part that is missing must not be called for by any
/// material that a path can meet; parts that are there but not called for change no bit of the result.
struct Features {
    bool reflection = false;  ///< glossy and mirror
    bool layers = false;      ///< clearcoat and sheen
    bool glass = false;       ///< transmission, smooth and rough
    bool textures = false;    ///< textures, normal maps, vertex colours
    bool rare = false;        ///< absorption, object motion, effects left out

    constexpr bool operator==(const Features&) const = default;
};

// The kernels that are compiled, smallest first.
inline constexpr Features kMatte{};
inline constexpr Features kMatteTextured{.textures = true};
inline constexpr Features kReflecting{.reflection = true};
inline constexpr Features kReflectingTextured{.reflection = true, .textures = true};
inline constexpr Features kLayered{.reflection = true, .layers = true, .glass = true};
inline constexpr Features kLayeredTextured{
    .reflection = true, .layers = true, .glass = true, .textures = true};
inline constexpr Features kEveryFeature{true, true, true, true, true};
inline constexpr std::array<std::string_view, 7> kKernelNames = {
    "matte",   "matte, textured",   "reflecting", "reflecting, textured",
    "layered", "layered, textured", "everything"};

}  // namespace vlx::render
