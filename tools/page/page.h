#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "variolux/base/image.h"
#include "variolux/compare/statistics.h"

/// Reports that are one HTML file without any reference to another, readable offline.
namespace vlx {

/// What a page is made of, embedded at build time by embed.cmake.
struct PageSources {
    std::string_view html;  ///< with @TITLE@, @CSS@, @SCRIPT@ and @DATA@
    std::string_view css;
    std::string_view script;
};

std::string pageOf(const PageSources& sources, const std::string& title, const nlohmann::ordered_json& data);

/// A number, or null when it is not finite.
nlohmann::ordered_json numberJson(double value);

/// [value, lower, upper, count].
nlohmann::ordered_json intervalJson(const Interval& interval);

/// Longest side of images in a page; larger ones are reduced by a whole factor, which the page says.
inline constexpr int kPageImageSide = 512;

/// The least whole factor that reduces the image to kPageImageSide.
int pageImageFactor(const Window& window);

/// The image's channels one after the other, reduced by a whole factor (box average), as half floats,
/// deflated, base64: exposure and error views are computed where they are seen (decode.js).
std::string packedPlanes(const Image& image, int factor);

/// A colour image as decode.js takes it: its place, the factor and the planes `radiance`.
nlohmann::ordered_json pageImage(const Image& colour, int factor);

}  // namespace vlx
