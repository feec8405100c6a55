#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "render/math/vec.h"

namespace vlx::render {

struct Rgba {
    Rgb rgb;
    float a = 1;
};

enum class Wrap : std::uint8_t { Repeat, Clamp, Mirror };
enum class ColourSpace : std::uint8_t { Linear, Srgb };

/// An image with its sampler. 8-bit images stay 8-bit in memory and are decoded on look-up; deeper ones are
/// float. Always four channels.
class Texture {
  public:
    Texture(int width, int height, std::vector<std::uint8_t> rgba, ColourSpace space);
    Texture(int width, int height, std::vector<float> rgba, ColourSpace space);

    Wrap wrapU = Wrap::Repeat;
    Wrap wrapV = Wrap::Repeat;
    bool nearest = false;  ///< take the nearest texel instead of interpolating

    /// Linear value at uv, (0, 0) being the upper left corner of the first texel. Bilinear between texel
    /// centres, decoded to linear first.
    Rgba lookup(Vec2 uv) const;

    /// Least and greatest linear value of each channel: lookups lie between them.
    std::pair<Rgba, Rgba> range() const;

    int width() const { return width_; }
    int height() const { return height_; }

  private:
    Lanes texel(int x, int y) const;  ///< r, g, b, a

    int width_;
    int height_;
    ColourSpace space_;
    std::vector<std::uint8_t> bytes_;  ///< one of these two is empty
    std::vector<float> floats_;
};

/// How a material refers to a texture: an index into the scene's textures (-1: none), a set of coordinates
/// (0: TEXCOORD_0; n: the material's furtherUvSets[n - 1]), and KHR_texture_transform's affine map of them.
struct TextureRef {
    int texture = -1;
    int uvSlot = 0;
    bool transformed = false;
    Vec2 offset{0, 0};
    Vec2 rowU{1, 0};  ///< u' = rowU . uv + offset.x
    Vec2 rowV{0, 1};

    explicit operator bool() const { return texture >= 0; }

    Vec2 map(Vec2 uv) const {
        if (!transformed) return uv;
        return {rowU.x * uv.x + rowU.y * uv.y + offset.x, rowV.x * uv.x + rowV.y * uv.y + offset.y};
    }
};

/// The inverse of the sRGB transfer function; in [0, 1].
float srgbToLinear(float encoded);

}  // namespace vlx::render
