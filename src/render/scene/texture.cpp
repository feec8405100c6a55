#include "render/scene/texture.h"

#include <array>
#include <cassert>

namespace vlx::render {
namespace {

using ByteTable = std::array<float, 256>;

ByteTable byteTable(bool srgb) {
    ByteTable table{};
    for (std::size_t i = 0; i < table.size(); ++i) {
        const float v = static_cast<float>(i) / 255.f;
        table[i] = srgb ? srgbToLinear(v) : v;
    }
    return table;
}

const ByteTable kSrgbBytes = byteTable(true);
const ByteTable kLinearBytes = byteTable(false);

/// Texel index of `i` in [-1, 2 size]: lookups begin in the first two periods.
int wrapped(int i, int size, Wrap mode) {
    if (mode == Wrap::Clamp) return std::clamp(i, 0, size - 1);
    if (mode == Wrap::Mirror) {
        const int folded = i < 0 ? -1 - i : i < 2 * size ? i : i - 2 * size;
        return folded < size ? folded : 2 * size - 1 - folded;
    }
    const int up = i < 0 ? i + size : i;
    return up < size ? up : up - size < size ? up - size : up - 2 * size;
}

Rgba colourOf(Lanes v) { return {{v[0], v[1], v[2]}, v[3]}; }

}  // namespace

float srgbToLinear(float encoded) {
    return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

Texture::Texture(int width, int height, std::vector<std::uint8_t> rgba, ColourSpace space)
    : width_(width), height_(height), space_(space), bytes_(std::move(rgba)) {
    assert(bytes_.size() == 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
}

Texture::Texture(int width, int height, std::vector<float> rgba, ColourSpace space)
    : width_(width), height_(height), space_(ColourSpace::Linear), floats_(std::move(rgba)) {
    assert(floats_.size() == 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    if (space == ColourSpace::Linear) return;
    for (std::size_t i = 0; i < floats_.size(); ++i)
        if (i % 4 != 3) floats_[i] = srgbToLinear(floats_[i]);
}

inline Lanes Texture::texel(int x, int y) const {
    const std::size_t i =
        4 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
    if (!floats_.empty()) return Lanes{floats_[i], floats_[i + 1], floats_[i + 2], floats_[i + 3]};
    const ByteTable& table = space_ == ColourSpace::Srgb ? kSrgbBytes : kLinearBytes;
    return Lanes{table[bytes_[i]], table[bytes_[i + 1]], table[bytes_[i + 2]], kLinearBytes[bytes_[i + 3]]};
}

std::pair<Rgba, Rgba> Texture::range() const {
    const auto extremes = [](const auto& values) {
        using Value = typename std::decay_t<decltype(values)>::value_type;
        std::array<Value, 4> low{values[0], values[1], values[2], values[3]}, high = low;
        for (std::size_t i = 4; i + 3 < values.size(); i += 4) {
            for (std::size_t c = 0; c < 4; ++c) {
                low[c] = std::min(low[c], values[i + c]);
                high[c] = std::max(high[c], values[i + c]);
            }
        }
        return std::pair(low, high);
    };
    if (!floats_.empty()) {
        const auto [low, high] = extremes(floats_);
        return {{{low[0], low[1], low[2]}, low[3]}, {{high[0], high[1], high[2]}, high[3]}};
    }
    const ByteTable& table = space_ == ColourSpace::Srgb ? kSrgbBytes : kLinearBytes;
    const auto [low, high] = extremes(bytes_);
    const auto decoded = [&](const std::array<std::uint8_t, 4>& c) -> Rgba {
        return {{table[c[0]], table[c[1]], table[c[2]]}, kLinearBytes[c[3]]};
    };
    return {decoded(low), decoded(high)};
}

Rgba Texture::lookup(Vec2 uv) const {
    // Beyond +-2^20 repeats float coordinates carry no position; NaN goes there too.
    const auto scaled = [](float v, int size) {
        return std::abs(v) < 0x1p20f ? (v - std::floor(v / 2) * 2) * static_cast<float>(size) : 0.f;
    };
    const auto clampedScale = [](float v, int size) {
        return std::clamp(std::isnan(v) ? 0.f : v, -1.f, 2.f) * static_cast<float>(size);
    };
    const float x = wrapU == Wrap::Clamp ? clampedScale(uv.x, width_) : scaled(uv.x, width_);
    const float y = wrapV == Wrap::Clamp ? clampedScale(uv.y, height_) : scaled(uv.y, height_);
    if (nearest)
        return colourOf(texel(wrapped(static_cast<int>(std::floor(x)), width_, wrapU),
                              wrapped(static_cast<int>(std::floor(y)), height_, wrapV)));
    const float fx = std::floor(x - 0.5f), fy = std::floor(y - 0.5f);
    const float tx = x - 0.5f - fx, ty = y - 0.5f - fy;
    const int ix = static_cast<int>(fx), iy = static_cast<int>(fy);
    const int x0 = wrapped(ix, width_, wrapU), x1 = wrapped(ix + 1, width_, wrapU);
    const int y0 = wrapped(iy, height_, wrapV), y1 = wrapped(iy + 1, height_, wrapV);
    return colourOf((texel(x0, y0) * (1 - tx) + texel(x1, y0) * tx) * (1 - ty) +
                    (texel(x0, y1) * (1 - tx) + texel(x1, y1) * tx) * ty);
}

}  // namespace vlx::render
