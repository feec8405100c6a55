#include "variolux/compare/picture.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <functional>

#include "compare/canvas.h"
#include "compare/constants.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"
#include "variolux/compare/colour_map.h"

namespace vlx {

namespace {

constexpr DisplayColour kPaper = {0.95f, 0.95f, 0.95f};
constexpr DisplayColour kInk = {0.1f, 0.1f, 0.1f};
constexpr DisplayColour kFaintInk = {0.35f, 0.35f, 0.35f};
constexpr std::array<DisplayColour, 4> kCropColours = {
    {{1.0f, 0.55f, 0.0f}, {0.0f, 0.75f, 1.0f}, {1.0f, 0.25f, 0.65f}, {0.65f, 0.95f, 0.2f}}};
constexpr int kMargin = 10;
constexpr int kTextScale = 2;
constexpr int kLineHeight = kGlyphHeight * kTextScale + 4;
constexpr int kSmallestPanel = 384;
constexpr int kWidestPicture = 2400;
constexpr int kFrame = 3;
constexpr int kLegendHeight = 2 * kMargin + 4 * kLineHeight + 24;
constexpr double kRelativeDecades = 3;  // 0.1 % to 100 %

struct Panel {
    std::string caption;
    std::string note;
    Image picture;  // display values
};

void requireOneWindow(const Window& expected, const std::vector<CaptionedImage>& images) {
    for (const CaptionedImage& entry : images)
        if (entry.image.data != expected)
            throw Error(entry.name, "expected the data window " + windowText(expected) + ", found " +
                                        windowText(entry.image.data));
}

void requireInside(const std::vector<Window>& crops, const Window& data) {
    for (const Window& crop : crops)
        if (crop.width <= 0 || crop.height <= 0 || !data.contains(crop.x, crop.y) ||
            crop.width > data.width - (crop.x - data.x) || crop.height > data.height - (crop.y - data.y))
            throw Error("crop",
                        "expected a part of the image, " + windowText(data) + ", found " + windowText(crop));
}

DisplayColour cropColour(std::size_t index) { return kCropColours[index % kCropColours.size()]; }

/// Draws text in the largest of the two sizes that fits, cut short where neither does.
void drawFitted(Image& canvas, std::string text, int x, int y, int room, const DisplayColour& colour) {
    const int scale = textWidth(text, kTextScale) <= room ? kTextScale : 1;
    const int fits = room / (kGlyphAdvance * scale);
    if (static_cast<int>(text.size()) > fits)
        text = text.substr(0, static_cast<std::size_t>(std::max(fits - 2, 0))) + "..";
    drawText(canvas, text, x, y + (kTextScale - scale) * kGlyphHeight / 2, scale, colour);
}

/// The factor that brings the longer side of a panel to kSmallestPanel or more.
int enlargement(int width, int height) {
    const int side = std::max({width, height, 1});
    return std::max(1, (kSmallestPanel + side - 1) / side);
}

/// Width of a panel's place in the grid: captions and the legend need some even when panels are narrow.
int cellWidth(int panelWidth) { return std::max(panelWidth, kSmallestPanel); }

/// Panels of one size in rows of `columns`, every panel's pixels as squares of `scale`; `below` pixels of
/// empty paper at the foot.
Image arrange(const std::vector<Panel>& panels, int columns, int scale, int below) {
    const Window size = panels.empty() ? Window{} : panels.front().picture.data;
    const int width = size.width * scale;
    const int height = size.height * scale;
    const int rows = (static_cast<int>(panels.size()) + columns - 1) / columns;
    const int stepX = cellWidth(width) + kMargin;
    const int stepY = height + 2 * kLineHeight + kMargin;
    Image canvas = makeCanvas(kMargin + columns * stepX, kMargin + rows * stepY + below, kPaper);
    for (std::size_t i = 0; i < panels.size(); ++i) {
        const int x = kMargin + static_cast<int>(i) % columns * stepX;
        const int y = kMargin + static_cast<int>(i) / columns * stepY;
        drawFitted(canvas, panels[i].caption, x, y, cellWidth(width), kInk);
        drawFitted(canvas, panels[i].note, x, y + kLineHeight, cellWidth(width), kFaintInk);
        drawImage(canvas, panels[i].picture, x, y + 2 * kLineHeight, scale);
    }
    return canvas;
}

/// As many columns as fit, with rows filled evenly.
int gridColumns(std::size_t panels, int panelWidth) {
    const int count = std::max(1, static_cast<int>(panels));
    const int most = std::clamp((kWidestPicture - kMargin) / (cellWidth(panelWidth) + kMargin), 1, count);
    const int rows = (count + most - 1) / most;
    return (count + rows - 1) / rows;
}

Image arrangeInGrid(const std::vector<Panel>& panels, int below = 0) {
    const Window size = panels.empty() ? Window{} : panels.front().picture.data;
    const int scale = enlargement(size.width, size.height);
    return arrange(panels, gridColumns(panels.size(), size.width * scale), scale, below);
}

Image mapPixels(const Window& data, const std::function<DisplayColour(int col, int row)>& colour) {
    Image picture(Window{0, 0, data.width, data.height}, {"R", "G", "B"});
    parallelFor(0, data.height, [&](std::int64_t row) {
        for (int col = 0; col < data.width; ++col) {
            const DisplayColour value = colour(col, static_cast<int>(row));
            std::copy(value.begin(), value.end(), picture.at(col, static_cast<int>(row)));
        }
    });
    return picture;
}

Image displayed(const Image& image, double exposure) {
    const auto factor = static_cast<float>(std::exp2(exposure));
    return mapPixels(image.data, [&](int col, int row) -> DisplayColour {
        const float* pixel = image.at(col, row);
        if (!std::isfinite(pixel[0]) || !std::isfinite(pixel[1]) || !std::isfinite(pixel[2]))
            return kNonFiniteColour;
        return {linearToSrgb(factor * pixel[0]), linearToSrgb(factor * pixel[1]),
                linearToSrgb(factor * pixel[2])};
    });
}

double signedError(const float* reference, const float* image) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) sum += static_cast<double>(image[c]) - reference[c];
    return sum / 3;
}

double relativeError(const float* reference, const float* image) {
    double sum = 0;
    for (int c = 0; c < 3; ++c)
        sum += std::abs(static_cast<double>(image[c]) - reference[c]) /
               (std::abs(static_cast<double>(reference[c])) + kRelativeFloor);
    return sum / 3;
}

/// The smallest 1, 2 or 5 times a power of ten that is not below `value`; 1 for 0.
double roundUp(double value) {
    if (!(value > 0)) return 1;
    const double power = std::pow(10.0, std::floor(std::log10(value)));
    for (const double step : {1.0, 2.0, 5.0})
        if (step * power >= value * (1 - 1e-9)) return step * power;
    return 10 * power;
}

double automaticRange(const Image& reference, const std::vector<CaptionedImage>& images) {
    std::vector<double> errors;
    for (const CaptionedImage& entry : images)
        for (std::size_t i = 0; i < reference.pixels.size(); i += 3) {
            const double error = signedError(&reference.pixels[i], &entry.image.pixels[i]);
            if (std::isfinite(error)) errors.push_back(std::abs(error));
        }
    if (errors.empty()) return 1;
    const auto rank = static_cast<std::ptrdiff_t>(std::ceil(0.99 * static_cast<double>(errors.size()))) - 1;
    std::nth_element(errors.begin(), errors.begin() + rank, errors.end());
    return roundUp(errors[static_cast<std::size_t>(rank)]);
}

bool containsColour(const Image& picture, const DisplayColour& colour) {
    for (std::size_t i = 0; i < picture.pixels.size(); i += 3)
        if (std::equal(colour.begin(), colour.end(), &picture.pixels[i])) return true;
    return false;
}

/// A bar of colours with numbers at equal distances, at the foot of the canvas.
struct Legend {
    std::string title;
    std::string formula;
    std::vector<std::string> labels;
    std::function<DisplayColour(double)> colour;  ///< of a position in [0, 1]
};

void drawLegend(Image& canvas, const Legend& legend, bool nonFinite) {
    const int room = canvas.data.width - 2 * kMargin;
    const int side = kMargin + 40;  // numbers are centred under the ends of the bar
    const int barWidth = std::min(canvas.data.width - 2 * side, 640);
    int y = canvas.data.height - kLegendHeight + kMargin;
    drawFitted(canvas, legend.title, kMargin, y, room, kInk);
    drawFitted(canvas, legend.formula + (nonFinite ? "; green: not finite" : ""), kMargin, y + kLineHeight,
               room, kFaintInk);
    y += 2 * kLineHeight + 4;
    for (int x = 0; x < barWidth; ++x)
        fillRectangle(canvas, {side + x, y, 1, 20}, legend.colour((x + 0.5) / barWidth));
    drawFrame(canvas, {side, y, barWidth, 20}, 1, kInk);
    for (std::size_t i = 0; i < legend.labels.size(); ++i) {
        const int x = side + static_cast<int>(static_cast<double>(i) * (barWidth - 1) /
                                              static_cast<double>(legend.labels.size() - 1));
        fillRectangle(canvas, {x, y + 20, 1, 6}, kInk);
        const int scale = barWidth / static_cast<int>(legend.labels.size()) > 8 * kGlyphAdvance * kTextScale
                              ? kTextScale
                              : 1;
        drawText(canvas, legend.labels[i], x - (textWidth(legend.labels[i], scale) - scale) / 2, y + 30,
                 scale, kInk);
    }
}

std::string number(double value, bool sign) { return formatted(sign && value != 0 ? "%+g" : "%g", value); }

}  // namespace

Window parseCrop(const std::string& text) {
    std::array<int, 4> values{};
    const char* at = text.data();
    const char* const end = at + text.size();
    for (std::size_t i = 0; i < values.size(); ++i) {
        if (i > 0 && (at == end || *at++ != ','))
            throw Error({}, "expected x,y,width,height, found '" + text + "'");
        const auto [next, status] = std::from_chars(at, end, values[i]);
        if (status != std::errc()) throw Error({}, "expected x,y,width,height, found '" + text + "'");
        at = next;
    }
    if (at != end) throw Error({}, "expected x,y,width,height, found '" + text + "'");
    if (values[2] <= 0 || values[3] <= 0)
        throw Error({}, "expected a positive width and height, found '" + text + "'");
    return {values[0], values[1], values[2], values[3]};
}

Image sideBySide(const std::vector<CaptionedImage>& images, const PictureOptions& options) {
    if (images.empty()) throw Error({}, "expected at least one image to show, found none");
    const Window data = images.front().image.data;
    requireOneWindow(data, images);
    requireInside(options.crops, data);
    // Outlines are two pixels of the panel as shown, whatever the enlargement: drawn on the enlarged picture.
    const int scale = enlargement(data.width, data.height);
    std::vector<Panel> panels;
    for (const CaptionedImage& entry : images) {
        Image panel = makeCanvas(data.width * scale, data.height * scale, kPaper);
        drawImage(panel, displayed(entry.image, options.exposure), 0, 0, scale);
        for (std::size_t i = 0; i < options.crops.size(); ++i) {
            const Window& crop = options.crops[i];
            const Window shown = {(crop.x - data.x) * scale, (crop.y - data.y) * scale, crop.width * scale,
                                  crop.height * scale};
            drawFrame(panel, shown, 3, kInk);
            drawFrame(panel, shown, 2, cropColour(i));
        }
        panels.push_back({entry.name, entry.note, std::move(panel)});
    }
    return arrangeInGrid(panels);
}

Image enlargedCrops(const std::vector<CaptionedImage>& images, const PictureOptions& options) {
    if (images.empty() || options.crops.empty())
        throw Error("crop", "expected at least one image and one crop, found none");
    const Window data = images.front().image.data;
    requireOneWindow(data, images);
    requireInside(options.crops, data);
    int widest = 0, highest = 0;
    for (const Window& crop : options.crops) {
        widest = std::max(widest, crop.width);
        highest = std::max(highest, crop.height);
    }
    const int scale = std::max(2, enlargement(widest, highest));
    std::vector<Panel> panels;
    for (std::size_t i = 0; i < options.crops.size(); ++i)
        for (const CaptionedImage& entry : images) {
            const Window& crop = options.crops[i];
            Image part(crop, {"R", "G", "B"});
            for (int row = 0; row < crop.height; ++row)
                std::copy_n(entry.image.at(crop.x - data.x, crop.y - data.y + row),
                            3 * static_cast<std::size_t>(crop.width), part.at(0, row));
            // Crops may differ in size: each stands in the corner of a panel that holds the largest.
            Image panel = makeCanvas(widest * scale + 2 * kFrame, highest * scale + 2 * kFrame, kPaper);
            drawImage(panel, displayed(part, options.exposure), kFrame, kFrame, scale);
            drawFrame(panel, {kFrame, kFrame, crop.width * scale, crop.height * scale}, kFrame,
                      cropColour(i));
            panels.push_back({entry.name,
                              std::to_string(crop.x) + "," + std::to_string(crop.y) + "," +
                                  std::to_string(crop.width) + "," + std::to_string(crop.height) + "  x" +
                                  std::to_string(scale),
                              std::move(panel)});
        }
    return arrange(panels, static_cast<int>(images.size()), 1, 0);
}

Image signedErrors(const Image& reference, const std::vector<CaptionedImage>& images,
                   const PictureOptions& options) {
    requireOneWindow(reference.data, images);
    const double range = options.signedRange > 0 ? options.signedRange : automaticRange(reference, images);
    std::vector<Panel> panels;
    bool nonFinite = false;
    for (const CaptionedImage& entry : images) {
        Image map = mapPixels(reference.data, [&](int col, int row) {
            const double error = signedError(reference.at(col, row), entry.image.at(col, row));
            return std::isfinite(error) ? divergingColour(error / range) : kNonFiniteColour;
        });
        nonFinite = nonFinite || containsColour(map, kNonFiniteColour);
        panels.push_back({entry.name, entry.note, std::move(map)});
    }
    Image picture = arrangeInGrid(panels, kLegendHeight);
    Legend legend{"signed error", "image - reference, mean of R, G, B", {}, [](double t) {
                      return divergingColour(2 * t - 1);
                  }};
    for (const double t : {-1.0, -0.5, 0.0, 0.5, 1.0}) legend.labels.push_back(number(t * range, true));
    drawLegend(picture, legend, nonFinite);
    return picture;
}

Image relativeErrors(const Image& reference, const std::vector<CaptionedImage>& images) {
    requireOneWindow(reference.data, images);
    std::vector<Panel> panels;
    bool nonFinite = false;
    for (const CaptionedImage& entry : images) {
        Image map = mapPixels(reference.data, [&](int col, int row) {
            const double error = relativeError(reference.at(col, row), entry.image.at(col, row));
            if (!std::isfinite(error)) return kNonFiniteColour;
            return sequentialColour(1 + std::log10(std::max(error, 1e-30)) / kRelativeDecades);
        });
        nonFinite = nonFinite || containsColour(map, kNonFiniteColour);
        panels.push_back({entry.name, entry.note, std::move(map)});
    }
    Image picture = arrangeInGrid(panels, kLegendHeight);
    drawLegend(picture,
               {"relative error",
                "|image - reference| / (|reference| + 0.01)",
                {"0.1 %", "1 %", "10 %", "100 %"},
                sequentialColour},
               nonFinite);
    return picture;
}

}  // namespace vlx
