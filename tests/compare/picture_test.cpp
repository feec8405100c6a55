#include "variolux/compare/picture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "compare/constants.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"
#include "variolux/compare/colour_map.h"

namespace vlx {
namespace {

// The layout that picture.cpp states: panels begin below a margin and two lines of text.
constexpr int kLeft = 10;
constexpr int kTop = 10 + 2 * 22;
constexpr int kGap = 10;

Image constant(const Window& window, float value) {
    Image image(window, {"R", "G", "B"});
    for (float& pixel : image.pixels) pixel = value;
    return image;
}

DisplayColour probe(const Image& picture, int x, int y) {
    const float* pixel = picture.at(x, y);
    return {pixel[0], pixel[1], pixel[2]};
}

DisplayColour grey(float value) { return {value, value, value}; }

int count(const Image& picture, const DisplayColour& colour) {
    int found = 0;
    for (int y = 0; y < picture.data.height; ++y)
        for (int x = 0; x < picture.data.width; ++x) found += probe(picture, x, y) == colour;
    return found;
}

/// CIE lightness of a display colour, by the textbook's definition, which is not the one the maps are made
/// with.
double cieLightness(const DisplayColour& colour) {
    double luminance = 0;
    const double weights[] = {0.2126, 0.7152, 0.0722};
    for (std::size_t c = 0; c < 3; ++c) {
        const double v = colour[c];
        luminance += weights[c] * (v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4));
    }
    return luminance > 0.008856 ? 116 * std::cbrt(luminance) - 16 : 903.3 * luminance;
}

TEST(ColourMap, SequentialLightnessRisesSteadilyInsideTheGamut) {
    double before = cieLightness(sequentialColour(0));
    EXPECT_LT(before, 10);
    for (int i = 1; i <= 100; ++i) {
        const DisplayColour colour = sequentialColour(i / 100.0);
        const double lightness = cieLightness(colour);
        EXPECT_GT(lightness - before, 0.3) << i;
        EXPECT_LT(lightness - before, 1.8) << i;
        before = lightness;
        for (const float channel : colour) {
            EXPECT_GT(channel, 0.0f) << i;
            EXPECT_LT(channel, 1.0f) << i;
        }
    }
    EXPECT_GT(before, 93);
    EXPECT_EQ(sequentialColour(-3), sequentialColour(0));
    EXPECT_EQ(sequentialColour(7), sequentialColour(1));
}

TEST(ColourMap, DivergingIsBalancedAroundWhite) {
    EXPECT_GT(cieLightness(divergingColour(0)), 95);
    for (int i = 1; i <= 100; ++i) {
        const DisplayColour low = divergingColour(-i / 100.0), high = divergingColour(i / 100.0);
        EXPECT_NEAR(cieLightness(low), cieLightness(high), 6) << i;
        EXPECT_LT(cieLightness(high), cieLightness(divergingColour((i - 1) / 100.0))) << i;
        EXPECT_LT(cieLightness(low), cieLightness(divergingColour((1 - i) / 100.0))) << i;
        EXPECT_GT(low[2], low[0]) << i;    // blue
        EXPECT_GT(high[0], high[2]) << i;  // red
        for (const float channel : {low[0], low[1], low[2], high[0], high[1], high[2]}) {
            EXPECT_GT(channel, 0.0f) << i;
            EXPECT_LT(channel, 1.0f) << i;
        }
    }
    EXPECT_EQ(divergingColour(-9), divergingColour(-1));
    EXPECT_EQ(divergingColour(9), divergingColour(1));
}

TEST(SideBySide, ShowsEveryImageThroughTheTransferFunctionAndExposure) {
    const Window window{-5, 3, 400, 200};
    const std::vector<CaptionedImage> images = {{"reference", "", constant(window, 0.25f)},
                                                {"a", "note", constant(window, 0.5f)},
                                                {"b", "", constant(window, -1.0f)}};
    const Image picture = sideBySide(images);
    EXPECT_EQ(picture.data, (Window{0, 0, kLeft + 3 * 410, kTop + 200 + kGap}));
    const int y = kTop + 100;
    EXPECT_EQ(probe(picture, kLeft + 200, y), grey(linearToSrgb(0.25f)));
    EXPECT_EQ(probe(picture, kLeft + 610, y), grey(linearToSrgb(0.5f)));
    EXPECT_EQ(probe(picture, kLeft + 1020, y), grey(0.0f));
    EXPECT_EQ(probe(picture, kLeft, kTop), grey(linearToSrgb(0.25f)));
    EXPECT_NE(probe(picture, kLeft - 1, kTop), grey(linearToSrgb(0.25f)));
    EXPECT_NE(probe(picture, kLeft + 400, kTop), grey(linearToSrgb(0.25f)));

    PictureOptions brighter;
    brighter.exposure = 1;
    EXPECT_EQ(probe(sideBySide(images, brighter), kLeft, kTop), grey(linearToSrgb(0.5f)));
}

TEST(SideBySide, CaptionsDifferWithTheirText) {
    const Window window{0, 0, 400, 4};
    const auto caption = [&](const std::string& name) {
        const Image picture = sideBySide({{name, "", constant(window, 0.5f)}});
        std::vector<float> text(picture.at(0, 0), picture.at(0, kTop));
        return text;
    };
    EXPECT_EQ(caption("krige"), caption("krige"));
    EXPECT_NE(caption("krige"), caption("kri9e"));
    EXPECT_NE(caption("a"), caption(""));
    EXPECT_EQ(caption("\xc3\xa4"), caption("??"));  // no glyph
    EXPECT_EQ(caption(std::string(500, 'x')).size(), caption("").size());
}

TEST(SideBySide, OutlinesCropsAroundNotOver) {
    const Window window{100, 50, 400, 400};
    PictureOptions options;
    options.crops = {{110, 60, 20, 30}, {200, 300, 50, 50}};
    const Image picture = sideBySide({{"a", "", constant(window, 0.25f)}}, options);
    const DisplayColour inside = grey(linearToSrgb(0.25f));
    const int x = kLeft + 10, y = kTop + 10;
    EXPECT_EQ(probe(picture, x, y), inside);
    EXPECT_EQ(probe(picture, x + 19, y + 29), inside);
    const DisplayColour first = probe(picture, x - 1, y);
    EXPECT_NE(first, inside);
    EXPECT_EQ(probe(picture, x + 20, y + 30), first);
    EXPECT_EQ(probe(picture, x + 5, y - 2), first);
    EXPECT_NE(probe(picture, kLeft + 99, kTop + 260), first);  // the second crop has its own colour
    EXPECT_NE(probe(picture, kLeft + 99, kTop + 260), inside);
}

TEST(SideBySide, NonFinitePixelsAreMarked) {
    Image image = constant({0, 0, 384, 10}, 0.5f);
    image.at(3, 2)[1] = kNan;
    image.at(4, 2)[0] = std::numeric_limits<float>::infinity();
    const Image picture = sideBySide({{"a", "", image}});
    EXPECT_EQ(count(picture, kNonFiniteColour), 2);
    EXPECT_EQ(probe(picture, kLeft + 3, kTop + 2), kNonFiniteColour);
}

TEST(SideBySide, SmallImagesAreEnlargedInWholePixels) {
    Image image = constant({0, 0, 100, 2}, 0.0f);
    image.at(99, 1)[0] = 1.0f;
    const Image picture = sideBySide({{"a", "", image}});  // 384 / 100, rounded up: 4
    EXPECT_EQ(picture.data.width, kLeft + 400 + kGap);
    EXPECT_EQ(count(picture, {1.0f, 0.0f, 0.0f}), 16);
    EXPECT_EQ(probe(picture, kLeft + 399, kTop + 7), (DisplayColour{1.0f, 0.0f, 0.0f}));
    EXPECT_EQ(probe(picture, kLeft + 396, kTop + 4), (DisplayColour{1.0f, 0.0f, 0.0f}));
    // Narrow images get captions and legends that can be read.
    EXPECT_GE(relativeErrors(constant({0, 0, 1, 500}, 1.0f), {{"a", "", constant({0, 0, 1, 500}, 1.0f)}})
                  .data.width,
              384);
}

TEST(SideBySide, ManyImagesWrapIntoRows) {
    const Window window{0, 0, 1000, 20};
    const std::vector<CaptionedImage> images(5, {"a", "", constant(window, 0.5f)});
    const Image picture = sideBySide(images);
    EXPECT_EQ(picture.data.width, kLeft + 2 * 1010);
    EXPECT_EQ(picture.data.height, 10 + 3 * (44 + 20 + 10));
}

TEST(EnlargedCrops, ShowTheCropsPixelsAsSquares) {
    Image image = constant({100, 50, 60, 60}, 0.0f);
    image.at(12, 13)[2] = 1.0f;  // raster (112, 63)
    PictureOptions options;
    options.crops = {{110, 60, 8, 6}};
    const Image picture = enlargedCrops({{"a", "", image}, {"b", "", image}}, options);
    const int scale = 48, frame = 3;  // 384 / 8
    const DisplayColour blue = {0.0f, 0.0f, 1.0f};
    EXPECT_EQ(count(picture, blue), 2 * scale * scale);
    EXPECT_EQ(probe(picture, kLeft + frame + 2 * scale, kTop + frame + 3 * scale), blue);
    EXPECT_NE(probe(picture, kLeft + frame + 2 * scale - 1, kTop + frame + 3 * scale), blue);
    // The frame has the colour of the outline.
    EXPECT_EQ(probe(picture, kLeft, kTop),
              probe(sideBySide({{"a", "", image}}, options), kLeft + 70 - 1, kTop + 70));
}

TEST(Crops, MustLieInsideTheImage) {
    const Image image = constant({10, 20, 30, 40}, 0.5f);
    PictureOptions options;
    for (const Window& crop : {Window{9, 20, 5, 5}, Window{10, 19, 5, 5}, Window{36, 20, 5, 5},
                               Window{10, 56, 5, 5}, Window{10, 20, 0, 5}, Window{12, 20, 2147483647, 5}}) {
        options.crops = {crop};
        EXPECT_THROW(sideBySide({{"a", "", image}}, options), Error) << crop.x << ' ' << crop.y;
        EXPECT_THROW(enlargedCrops({{"a", "", image}}, options), Error) << crop.x << ' ' << crop.y;
    }
    options.crops = {image.data};
    EXPECT_NO_THROW(enlargedCrops({{"a", "", image}}, options));
    EXPECT_THROW(enlargedCrops({{"a", "", image}}, {}), Error);
}

TEST(Crops, AreParsedStrictly) {
    EXPECT_EQ(parseCrop("1,2,3,4"), (Window{1, 2, 3, 4}));
    EXPECT_EQ(parseCrop("-10,-20,3,4"), (Window{-10, -20, 3, 4}));
    for (const char* text : {"", "1,2,3", "1,2,3,4,5", "1,2,3,x", "1;2;3;4", " 1,2,3,4", "1,2,3,4 ",
                             "1,2,-3,4", "1,2,3,0", "1.5,2,3,4", "1,2,3,4294967296"})
        EXPECT_THROW(parseCrop(text), Error) << text;
}

TEST(SignedErrors, MapTheErrorOntoTheDivergingScale) {
    const Window window{0, 0, 384, 10};
    const Image reference = constant(window, 1.0f);
    Image image = reference;
    image.at(0, 0)[0] = 1.6f;   // mean error +0.2
    image.at(1, 0)[1] = -0.5f;  // -0.5
    image.at(2, 0)[2] = kNan;
    image.at(3, 0)[0] = 1e9f;
    PictureOptions options;
    options.signedRange = 0.4;
    const Image picture = signedErrors(reference, {{"a", "", image}}, options);
    const auto expectColour = [&](int x, const DisplayColour& expected) {
        const DisplayColour found = probe(picture, kLeft + x, kTop);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-5) << x;
    };
    expectColour(0, divergingColour(0.5));
    expectColour(1, divergingColour(-1));
    expectColour(2, kNonFiniteColour);
    expectColour(3, divergingColour(1));
    expectColour(4, divergingColour(0));
    // The ends of the legend's bar are the ends of the scale.
    EXPECT_GT(count(picture, divergingColour(2 * 0.5 / (picture.data.width - 100) - 1)), 19);
}

TEST(SignedErrors, ScaleIsTheRounded99thPercentileOfAllImages) {
    const Window window{0, 0, 400, 100};
    const Image reference = constant(window, 1.0f);
    // Of 40,000 pixels, 400 may exceed the scale.
    const auto shown = [&](float typical, float outlier, int outliers = 400) {
        Image image = constant(window, 1.0f + typical);
        for (std::size_t i = 0; i < 3 * static_cast<std::size_t>(outliers); ++i)
            image.pixels[image.pixels.size() - 1 - i] = 1.0f + outlier;
        return probe(signedErrors(reference, {{"a", "", image}}), kLeft + 399, kTop);
    };
    const auto expectNear = [](const DisplayColour& found, const DisplayColour& expected) {
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-4);
    };
    expectNear(shown(0.03f, 100.0f), divergingColour(0.03 / 0.05));
    expectNear(shown(-0.0015f, 1.0f), divergingColour(-0.0015 / 0.002));
    expectNear(shown(0.75f, 1.0f), divergingColour(0.75));
    expectNear(shown(0.03f, 4.0f, 401), divergingColour(0.03 / 5));
    expectNear(shown(0.0f, 1.0f), divergingColour(0));
}

TEST(RelativeErrors, MapDecadesOntoTheSequentialScale) {
    const Window window{0, 0, 384, 10};
    const Image reference = constant(window, 0.99f);  // + 0.01 is 1
    Image image = reference;
    const std::vector<double> errors = {0.0, 0.001, 0.01, 0.1, 1.0, 50.0};
    for (std::size_t i = 0; i < errors.size(); ++i)
        for (int c = 0; c < 3; ++c)
            image.at(static_cast<int>(i), 0)[c] =
                static_cast<float>(0.99 + (i % 2 == 0 ? errors[i] : -errors[i]));
    image.at(7, 3)[0] = kNan;
    const Image picture = relativeErrors(reference, {{"a", "", image}});
    for (std::size_t i = 0; i < errors.size(); ++i) {
        const double t = std::clamp(1 + std::log10(std::max(errors[i], 1e-9)) / 3, 0.0, 1.0);
        const DisplayColour found = probe(picture, kLeft + static_cast<int>(i), kTop);
        const DisplayColour expected = sequentialColour(t);
        for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-3) << errors[i];
    }
    EXPECT_EQ(probe(picture, kLeft + 7, kTop + 3), kNonFiniteColour);
}

TEST(Pictures, NeedOneDataWindow) {
    const Image reference = constant({0, 0, 30, 40}, 0.5f);
    const std::vector<CaptionedImage> other = {{"other.exr", "", constant({0, 0, 40, 30}, 0.5f)}};
    EXPECT_THROW(signedErrors(reference, other), Error);
    EXPECT_THROW(relativeErrors(reference, other), Error);
    EXPECT_THROW(sideBySide({{"a", "", reference}, other[0]}), Error);
    EXPECT_THROW(sideBySide({}), Error);
}

TEST(Pictures, AreBitIdenticalForAnyNumberOfThreads) {
    Image reference = constant({0, 0, 61, 47}, 0.5f), image = reference;
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] += 0.01f * static_cast<float>(i % 17) - 0.05f;
    std::vector<float> expected;
    for (int threads = 1; threads <= 8; ++threads) {
        const ThreadLimit limit(threads);
        std::vector<float> pixels = signedErrors(reference, {{"a", "", image}}).pixels;
        const std::vector<float> more = relativeErrors(reference, {{"a", "", image}}).pixels;
        pixels.insert(pixels.end(), more.begin(), more.end());
        if (threads == 1) expected = pixels;
        EXPECT_EQ(pixels, expected) << threads;
    }
}

}  // namespace
}  // namespace vlx
