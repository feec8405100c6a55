#include "page/page.h"

#include <Imath/half.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "variolux/base/error.h"

namespace vlx {

namespace {

/// Too large becomes the largest finite half, because error views subtract; NaN stays NaN.
std::uint16_t halfOf(float value) {
    constexpr auto kMost = static_cast<float>(HALF_MAX);
    return imath_float_to_half(std::clamp(value, -kMost, kMost));
}

std::string base64(const std::vector<unsigned char>& bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(bytes.size() / 3 * 4 + 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) word = (word << 8) | (k < count ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[(word >> (18 - 6 * k)) & 63] : '=';
    }
    return text;
}

/// Halves, high bytes before low ones (which deflates better), deflated, base64.
std::string packed(const std::vector<float>& values) {
    std::vector<unsigned char> bytes(2 * values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::uint16_t half = halfOf(values[i]);
        bytes[i] = static_cast<unsigned char>(half >> 8);
        bytes[values.size() + i] = static_cast<unsigned char>(half & 255);
    }
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    std::vector<unsigned char> deflated(size);
    if (compress2(deflated.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 6) != Z_OK)
        throw Error("", "zlib failed to compress an image");
    deflated.resize(size);
    return base64(deflated);
}

/// The image reduced by a whole factor, channel by channel: all of R, then G, then B.
std::vector<float> planes(const Image& image, int factor) {
    const int width = image.data.width / factor, height = image.data.height / factor;
    std::vector<float> result;
    for (int c = 0; c < image.channelCount(); ++c)
        for (int row = 0; row < height; ++row)
            for (int col = 0; col < width; ++col) {
                double sum = 0;
                for (int y = 0; y < factor; ++y)
                    for (int x = 0; x < factor; ++x) sum += image.at(col * factor + x, row * factor + y)[c];
                result.push_back(static_cast<float>(sum / (factor * factor)));
            }
    return result;
}

void replace(std::string& text, std::string_view place, std::string_view content) {
    for (std::size_t at = text.find(place); at != std::string::npos;
         at = text.find(place, at + content.size()))
        text.replace(at, place.size(), content);
}

std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else
            result += c;
    }
    return result;
}

}  // namespace

std::string pageOf(const PageSources& sources, const std::string& title, const nlohmann::ordered_json& data) {
    std::string text = data.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
    // Inside <script>, "</script>" or "<!--" of a name would end or change it.
    for (std::size_t at = text.find('<'); at != std::string::npos; at = text.find('<', at))
        text.replace(at, 1, "\\u003c");
    std::string html(sources.html);
    replace(html, "@TITLE@", escaped(title));
    replace(html, "@CSS@", sources.css);
    replace(html, "@SCRIPT@", sources.script);
    replace(html, "@DATA@", text);
    return html;
}

nlohmann::ordered_json numberJson(double value) {
    return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

nlohmann::ordered_json intervalJson(const Interval& i) {
    return {numberJson(i.value), numberJson(i.lower), numberJson(i.upper), i.count};
}

int pageImageFactor(const Window& window) {
    return (std::max(window.width, window.height) + kPageImageSide - 1) / kPageImageSide;
}

std::string packedPlanes(const Image& image, int factor) { return packed(planes(image, factor)); }

nlohmann::ordered_json pageImage(const Image& colour, int factor) {
    const Window& window = colour.data;
    return {{"x", window.x},
            {"y", window.y},
            {"width", window.width / factor},
            {"height", window.height / factor},
            {"factor", factor},
            {"radiance", packedPlanes(colour, factor)}};
}

}  // namespace vlx
