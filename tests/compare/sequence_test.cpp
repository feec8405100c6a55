#include "variolux/compare/sequence.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "variolux/base/error.h"
#include "variolux/base/parallel.h"

namespace vlx {
namespace {

// Tolerances of 1e-12 are for the rounding of sums.

Image flat(int width, int height, float value) {
    Image image(Window{3, -2, width, height}, {"R", "G", "B"});
    for (float& pixel : image.pixels) pixel = value;
    return image;
}

Image motionOf(const Image& image, float x, float y) {
    Image motion(image.data, {"motion.x", "motion.y"});
    for (std::size_t i = 0; i < motion.pixels.size(); i += 2) {
        motion.pixels[i] = x;
        motion.pixels[i + 1] = y;
    }
    return motion;
}

/// A picture of random values that has moved by `shift` columns: the same value at col + shift.
Image moved(int width, int height, unsigned seed, int shift) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<float> value(0, 1);
    Image wide(Window{0, 0, width + 40, height}, {"R", "G", "B"});
    for (float& pixel : wide.pixels) pixel = value(random);
    Image image = flat(width, height, 0);
    for (int row = 0; row < height; ++row)
        for (int col = 0; col < width; ++col)
            for (int c = 0; c < 3; ++c) image.at(col, row)[c] = wide.at(col + 20 - shift, row)[c];
    return image;
}

TEST(Sequence, ErrorAndFlickerOfConstantsAreExact) {
    SequenceComparison comparison;
    const Image reference = flat(5, 4, 0.5f);
    comparison.add(1, reference, flat(5, 4, 0.75f));  // e = 0.25
    comparison.add(2, reference, flat(5, 4, 0.25f));  // e = -0.25
    comparison.add(3, reference, flat(5, 4, 0.25f));
    comparison.add(5, reference, flat(5, 4, 1.5f));  // frame 4 is not there: no flicker
    const SequenceErrors errors = comparison.errors();
    ASSERT_EQ(errors.frames.size(), 4u);
    EXPECT_NEAR(errors.frames[0].comparison[Metric::RelMse], 0.0625 / 0.26, 1e-12);
    EXPECT_TRUE(std::isnan(errors.frames[0].flicker));
    EXPECT_NEAR(errors.frames[1].flicker, 0.25 / 0.26, 1e-12);
    EXPECT_EQ(errors.frames[2].flicker, 0);
    EXPECT_TRUE(std::isnan(errors.frames[3].flicker));
    EXPECT_EQ(errors.frames[3].number, 5);
    EXPECT_NEAR(errors.flicker.value, 0.125 / 0.26, 1e-12);
    EXPECT_NEAR(errors.relMse.value, (3 * 0.0625 + 1) / 4 / 0.26, 1e-12);
    EXPECT_TRUE(std::isnan(errors.flickerAlongMotion.value));
    EXPECT_TRUE(std::isnan(errors.flicker.lower));  // one tile: its scatter is not known
}

TEST(Sequence, TheReferenceOfTheEarlierFrameDivides) {
    SequenceComparison comparison;
    comparison.add(1, flat(2, 2, 0), flat(2, 2, 0));
    comparison.add(2, flat(2, 2, 1), flat(2, 2, 1.5f));
    EXPECT_NEAR(comparison.errors().flicker.value, 0.25 / 0.01, 1e-12);
}

TEST(Sequence, ErrorsThatMoveAlongDoNotFlickerAlongMotion) {
    SequenceComparison comparison;
    for (int frame = 0; frame < 4; ++frame) {
        const Image reference = moved(40, 24, 1, 2 * frame);
        Image image = moved(40, 24, 2, 2 * frame);
        const Image motion = motionOf(image, -2, 0);  // to the left is where it was
        comparison.add(frame, reference, image, &motion);
    }
    const SequenceErrors errors = comparison.errors();
    EXPECT_GT(errors.flicker.value, 0.1);
    EXPECT_LT(errors.flicker.lower, errors.flicker.value);
    EXPECT_GT(errors.flicker.upper, errors.flicker.value);
    EXPECT_EQ(errors.flicker.count, 6);  // tiles of 16 pixels
    EXPECT_EQ(errors.flickerAlongMotion.value, 0);
    EXPECT_EQ(errors.frames[1].flickerAlongMotion, 0);
}

TEST(Sequence, ThePixelThatIsNearestCountsIfItIsInThePicture) {
    // Errors 1, 2, 4 in three columns, then none: what is compared with column c is where it points to.
    const auto flickerOf = [](float x, float y) {
        SequenceComparison comparison;
        const Image reference = flat(3, 1, 0);
        Image image = reference;
        for (int col = 0; col < 3; ++col)
            for (int c = 0; c < 3; ++c) image.at(col, 0)[c] = static_cast<float>(1 << col);
        const Image motion = motionOf(image, x, y);
        comparison.add(7, reference, image);
        comparison.add(8, reference, reference, &motion);
        return comparison.errors().flickerAlongMotion.value * 0.01;
    };
    EXPECT_NEAR(flickerOf(0, 0), (1 + 4 + 16) / 3.0, 1e-12);
    EXPECT_NEAR(flickerOf(0.49f, -0.49f), (1 + 4 + 16) / 3.0, 1e-12);
    EXPECT_NEAR(flickerOf(0.51f, 0), (4 + 16) / 2.0, 1e-12);
    EXPECT_NEAR(flickerOf(-2, 0), 1, 1e-12);
    EXPECT_TRUE(std::isnan(flickerOf(3, 0)));
    EXPECT_TRUE(std::isnan(flickerOf(0, 1)));
    EXPECT_TRUE(std::isnan(flickerOf(1e30f, 0)));
    EXPECT_TRUE(std::isnan(flickerOf(0, std::numeric_limits<float>::quiet_NaN())));
}

TEST(Sequence, PixelsThatAreNotFiniteAreLeftOut) {
    SequenceComparison comparison;
    Image reference = flat(2, 1, 0), first = flat(2, 1, 1), second = flat(2, 1, 3);
    first.at(0, 0)[1] = std::numeric_limits<float>::infinity();
    comparison.add(1, reference, first);
    comparison.add(2, reference, second);
    second.at(1, 0)[2] = std::numeric_limits<float>::quiet_NaN();
    comparison.add(3, reference, second);
    const SequenceErrors errors = comparison.errors();
    EXPECT_NEAR(errors.frames[1].flicker, 400, 1e-12);  // of the second pixel
    EXPECT_EQ(errors.frames[2].flicker, 0);             // of the first
    EXPECT_NEAR(errors.flicker.value, 200, 1e-12);
    EXPECT_NEAR(errors.relMse.value, (100 + 900 + 900 + 900) / 4.0, 1e-12);
}

TEST(Sequence, WindowsMustBeEqual) {
    SequenceComparison comparison;
    comparison.add(1, flat(4, 4, 0), flat(4, 4, 0));
    const auto message = [&](const Image& reference, const Image& image) {
        try {
            comparison.add(2, reference, image, nullptr, "b.exr");
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    EXPECT_NE(message(flat(4, 4, 0), flat(4, 5, 0)).find("b.exr: expected the reference's data window"),
              std::string::npos);
    EXPECT_NE(
        message(flat(4, 5, 0), flat(4, 5, 0)).find("b.exr: expected the data window of the frame before"),
        std::string::npos);
}

TEST(Sequence, ThreadsDoNotChangeABit) {
    const auto run = [](int threads) {
        const ThreadLimit limit(threads);
        SequenceComparison comparison;
        for (int frame = 0; frame < 3; ++frame) {
            const Image image = moved(50, 70, 5, 3 * frame), motion = motionOf(image, -3, 1);
            comparison.add(frame, moved(50, 70, 4, frame), image, &motion);
        }
        return comparison.errors();
    };
    const SequenceErrors one = run(1), four = run(4);
    EXPECT_EQ(one.flicker.value, four.flicker.value);
    EXPECT_EQ(one.flicker.lower, four.flicker.lower);
    EXPECT_EQ(one.flickerAlongMotion.upper, four.flickerAlongMotion.upper);
    EXPECT_EQ(one.relMse.value, four.relMse.value);
}

}  // namespace
}  // namespace vlx
