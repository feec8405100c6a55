#pragma once

#include <string_view>

#include "variolux/base/image.h"
#include "variolux/compare/colour_map.h"

namespace vlx {

/// Size of a character's cell, pixels at scale 1, spacing included. Only printable ASCII has glyphs; all else
/// is drawn as '?'.
inline constexpr int kGlyphAdvance = 6;
inline constexpr int kGlyphHeight = 9;

/// A picture of display values, three channels, filled with `background`.
Image makeCanvas(int width, int height, const DisplayColour& background);

// All of these leave out what lies outside of the canvas.
void setPixel(Image& canvas, int x, int y, const DisplayColour& colour);
void fillRectangle(Image& canvas, const Window& area, const DisplayColour& colour);

/// A frame of this thickness around `area`, outside of it.
void drawFrame(Image& canvas, const Window& area, int thickness, const DisplayColour& colour);

/// `image` with every pixel a square of `scale`, its corner at (x, y).
void drawImage(Image& canvas, const Image& image, int x, int y, int scale);

/// Text with the top left of its first cell at (x, y).
void drawText(Image& canvas, std::string_view text, int x, int y, int scale, const DisplayColour& colour);

/// Width of text in pixels.
int textWidth(std::string_view text, int scale);

}  // namespace vlx
