#include "variolux/reconstruct/sampling_map.h"

#include <gtest/gtest.h>

#include <cmath>

namespace vlx {
namespace {

Image estimate() {
    Image image({-2, 3, 4, 2}, {"R", "G", "B", "stddev.R", "stddev.G", "stddev.B"});
    image.display = {0, 0, 100, 50};
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 6 < 3 ? 1.f : 0.f;
    return image;
}

TEST(SamplingMap, IsTheRelativeErrorOfMeanOne) {
    Image image = estimate();
    for (int c = 3; c < 6; ++c) {
        image.at(0, 0)[c] = 0.2f;
        image.at(3, 1)[c] = 0.2f;
    }
    for (int c = 0; c < 3; ++c) image.at(3, 1)[c] = 3;
    const Image map = samplingMap(image);
    EXPECT_EQ(map.data, image.data);
    EXPECT_EQ(map.display, image.display);
    double sum = 0;
    for (const float density : map.pixels) sum += static_cast<double>(density);
    EXPECT_NEAR(sum, 8, 1e-5);
    EXPECT_NEAR(*map.at(0, 0) / *map.at(3, 1), std::sqrt(9.01 / 1.01), 1e-5);
    EXPECT_EQ(*map.at(1, 0), 0);
}

TEST(SamplingMap, WithoutErrorsIsEven) {
    for (const float density : samplingMap(estimate()).pixels) EXPECT_EQ(density, 1);
}

}  // namespace
}  // namespace vlx
