#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "../base/temporary_folder.h"
#include "variolux/base/error.h"
#include "variolux/base/luminance.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

/// A made-up picture: what it truly shows, and samples of it.
struct Picture {
    Window window{-7, 11, 70, 61};
    int spp = 8;
    double noise = 0.5;  ///< standard deviation of a sample, of the signal
    bool features = true;
    unsigned seed = 1;
    /// Truth of R; G and B are 0.7 and 0.4 of it.
    std::function<double(int, int)> truth = [](int x, int y) { return (x + y > 40 ? 0.9 : 0.3) + 0.004 * x; };
    std::function<double(int, int)> albedo = [](int x, int y) { return x + y > 40 ? 0.8 : 0.2; };

    SampleBand samples() const {
        SampleBand band{window.x, window.y, window.width, window.height, {0}, {"R", "G", "B"}, {}};
        if (features)
            for (const char* c : {"albedo.R", "albedo.G", "albedo.B"}) band.channels.emplace_back(c);
        band.values.resize(band.channels.size());
        std::mt19937 random(seed);
        std::normal_distribution<double> normal;
        for (int y = window.y; y < window.y + window.height; ++y)
            for (int x = window.x; x < window.x + window.width; ++x) {
                for (int s = 0; s < spp; ++s) {
                    const double z = truth(x, y) * (1 + noise * normal(random));
                    for (int c = 0; c < 3; ++c)
                        band.values[static_cast<std::size_t>(c)].push_back(
                            static_cast<float>(z * (1 - 0.3 * c)));
                    for (std::size_t c = 3; c < band.values.size(); ++c)
                        band.values[c].push_back(static_cast<float>(albedo(x, y)));
                }
                band.offsets.push_back(band.values[0].size());
            }
        return band;
    }

    /// Mean squared relative error of R.
    double error(const Image& image) const {
        double sum = 0;
        for (int row = 0; row < window.height; ++row)
            for (int col = 0; col < window.width; ++col) {
                const double z = truth(window.x + col, window.y + row);
                const double d = static_cast<double>(image.at(col, row)[0]) - z;
                sum += d * d / (z * z);
            }
        return sum / static_cast<double>(window.pixels());
    }
};

class DriftKriging : public testing::Test {
  protected:
    void write(const SampleBand& band) {
        DumpHeader header;
        header.data = header.display = {band.x, band.y, band.width, band.height};
        for (const std::string& channel : band.channels)
            header.channels.push_back({channel, ChannelType::Float});
        DumpWriter writer(folder_ / "a.exr", header);
        writer.write(band);
        writer.close();
    }
    Reconstruction krige(const Drift& options = {}) const {
        return reconstruct(DumpReader(folder_ / "a.exr"), options);
    }
    Image mean() const { return reconstruct(DumpReader(folder_ / "a.exr"), Mean{}).image; }

    TemporaryFolder folder_;
};

TEST_F(DriftKriging, SamePixelsForAnyNumberOfThreads) {
    write(Picture{}.samples());
    Image first;
    for (const int threads : {1, 2, 3, 8}) {
        const ThreadLimit limit(threads);
        const Image image = krige().image;
        if (threads == 1) first = image;
        EXPECT_EQ(image.pixels, first.pixels) << threads;
    }
}

/// Of pictures that are kriged at half the resolution as well, and of those that are too narrow for it: their
/// rings are of other lengths.
class Bands : public DriftKriging, public testing::WithParamInterface<int> {};

INSTANTIATE_TEST_SUITE_P(Widths, Bands, testing::Values(40, 20));

TEST_P(Bands, AreTheWholeImage) {
    Picture picture;
    picture.window = {3, -20, GetParam(), 733};  // rows leave the rings that hold them
    picture.truth = [](int x, int y) { return 1 + 0.5 * std::sin(0.1 * y) + (x > 3 + GetParam() / 2); };
    write(picture.samples());
    const Reconstruction whole = krige();
#ifdef VARIOLUX_SANITIZED
    const std::vector<int> counts = {2, 5};  // with assertions: rings notice rows that were overwritten
#else
    const std::vector<int> counts = {2, 5, 13};
#endif
    for (const int count : counts) {
        int row = 0;
        std::int64_t samples = 0;
        for (int i = 0; i < count; ++i) {
            const Reconstruction band = krige({.band = {i, count}});
            const Image& image = band.image;
            EXPECT_EQ(image.data.y, -20 + row);
            EXPECT_EQ(image.display, whole.image.display);
            const auto from =
                whole.image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * image.data.width *
                                                 static_cast<std::ptrdiff_t>(image.channelCount());
            EXPECT_TRUE(std::equal(image.pixels.begin(), image.pixels.end(), from)) << i << " of " << count;
            row += image.data.height;
            samples += band.report.samples;
        }
        EXPECT_EQ(row, 733);
        EXPECT_EQ(samples, whole.report.samples);
    }
}

TEST_F(DriftKriging, FeaturesCarryEdgesThroughTheNoise) {
    Picture picture;
    picture.noise = 1;
    write(picture.samples());
    const double plain = picture.error(mean()), with = picture.error(krige().image);
    const double without = picture.error(krige({.standardFeatures = false}).image);
    EXPECT_NEAR(plain, 1.0 / 8, 0.02);
    EXPECT_LT(with, plain / 25);
    EXPECT_LT(without, plain / 4);  // the colours show the edge as well, less clearly
    EXPECT_LT(with, without);
}

TEST_F(DriftKriging, ErrorFallsAtLeastLikeTheMeansAndStaysBelowIt) {
#ifdef VARIOLUX_SANITIZED
    GTEST_SKIP() << "statistics of minutes; the code is the other tests'";
#endif
    // A picture that no feature explains and no polynomial follows: steps of one pixel.
    Picture picture;
    picture.features = false;
    picture.truth = [](int x, int y) { return 1 + 0.6 * ((x / 3 + y / 2) % 2); };
    double ratio = 1;
    for (const int spp : {8, 64, 512}) {
        picture.spp = spp;
        write(picture.samples());
        const double now = picture.error(krige().image) / picture.error(mean());
        EXPECT_LT(now, 1.05) << spp;
        EXPECT_LT(now, 1.5 * ratio) << spp;
        ratio = now;
    }
}

TEST_F(DriftKriging, ErrorMapCoversTheError) {
#ifdef VARIOLUX_SANITIZED
    GTEST_SKIP() << "statistics of minutes; the code is the other tests'";
#endif
    Picture picture;
    picture.window = {0, 0, 96, 96};
    picture.truth = [](int x, int y) { return 1 + 0.5 * std::sin(0.05 * x) * std::cos(0.04 * y); };
    picture.albedo = [](int, int) { return 0.5; };
    for (const int spp : {8, 32, 128}) {
        picture.spp = spp;
        picture.seed = static_cast<unsigned>(spp);
        write(picture.samples());
        const Image image = krige().image;
        int one = 0, two = 0, count = 0;
        for (int row = 0; row < 96; ++row)
            for (int col = 0; col < 96; ++col) {
                const float* pixel = image.at(col, row);
                const double z = std::abs(static_cast<double>(pixel[0]) - picture.truth(col, row)) /
                                 static_cast<double>(pixel[image.channel("stddev.R")]);
                one += z < 1;
                two += z < 2;
                ++count;
            }
        // Errors of neighbours are alike: 96 x 96 pixels are some hundred independent ones, 4 % each way.
        EXPECT_GT(static_cast<double>(one) / count, 0.56) << spp;
        EXPECT_LT(static_cast<double>(one) / count, 0.88) << spp;
        EXPECT_GT(static_cast<double>(two) / count, 0.88) << spp;
    }
}

TEST_F(DriftKriging, NoSeamsAtTilesAndCentres) {
#ifdef VARIOLUX_SANITIZED
    GTEST_SKIP() << "statistics of minutes; the code is the other tests'";
#endif
    // Mean squared second differences across the columns of a lattice, divided by those across all others.
    constexpr int kLattices[] = {3, 4, 5, 32};
    double on[4] = {}, off[4] = {};
    for (unsigned seed = 1; seed <= 8; ++seed) {
        Picture picture;
        picture.window = {0, 0, 192, 64};
        picture.noise = 1;
        picture.features = false;
        picture.seed = seed;
        picture.truth = [](int x, int y) { return 1 + 0.003 * x + 0.001 * y; };
        write(picture.samples());
        const Image image = krige().image;
        for (int l = 0; l < 4; ++l)
            for (int row = 0; row < 64; ++row)
                for (int col = 16; col < 176; ++col) {
                    const auto at = [&](int x) { return static_cast<double>(image.at(x, row)[0]); };
                    const double d = at(col - 1) - 2 * at(col) + at(col + 1);
                    const bool border = col % kLattices[l] == 0 || (col + 1) % kLattices[l] == 0;
                    (border ? on : off)[l] += d * d * (border ? kLattices[l] / 2.0 - 1 : 1);
                }
    }
    // Squares are heavy-tailed: their means over eight pictures are right to about 20 %.
    for (int l = 0; l < 4; ++l) EXPECT_LT(on[l], 1.6 * off[l]) << kLattices[l];
}

TEST_F(DriftKriging, PartsOfTheLightAddUp) {
    Picture picture;
    // Lines that no feature knows, whose light is given back: also to parts that noise makes negative.
    picture.truth = [](int x, int y) { return (x % 16 == 0 ? 4 : 0.5) + 0.004 * y; };
    SampleBand band = picture.samples();
    std::mt19937 random(9);
    std::uniform_real_distribution<float> share(-1.5f, 1.5f);
    band.channels.insert(band.channels.end(), {"key.R", "fill.R"});
    band.values.resize(band.channels.size());
    for (const float r : band.values[0]) {
        const float s = share(random);
        band.values[band.values.size() - 2].push_back(s * r);
        band.values[band.values.size() - 1].push_back(r - s * r);
    }
    write(band);
    for (const Fireflies fireflies : {Fireflies::Keep, Fireflies::Robust, Fireflies::Clamp}) {
        const Image image =
            krige({.fireflies = fireflies, .clamp = 1.5, .radiance = {"key.R", "fill.R"}}).image;
        const int key = image.channel("key.R"), fill = image.channel("fill.R");
        ASSERT_GE(std::min(key, fill), 0);
        for (int row = 0; row < image.data.height; ++row)
            for (int col = 0; col < image.data.width; ++col) {
                const float* pixel = image.at(col, row);
                ASSERT_NEAR(pixel[key] + pixel[fill], pixel[0], 2e-5) << col << " " << row;
            }
    }
}

TEST_F(DriftKriging, OneNonFiniteSampleCostsNoMoreThanItself) {
    SampleBand band = Picture{}.samples();
    const std::size_t bad = 30 * 8 * 70 + 35 * 8 + 3;
    SampleBand without = band;
    for (auto& channel : without.values) channel.erase(channel.begin() + static_cast<std::ptrdiff_t>(bad));
    for (std::uint64_t& offset : without.offsets) offset -= offset > bad;
    write(without);
    const Reconstruction expected = krige();
    for (const float value :
         {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity()}) {
        band.values[1][bad] = value;
        write(band);
        const Reconstruction found = krige();
        EXPECT_EQ(found.image.pixels, expected.image.pixels);
        EXPECT_EQ(found.report.droppedSamples, 1);
    }
}

// A part of the light that is not finite would break the sum: the sample counts as left out.
TEST_F(DriftKriging, OneNonFinitePartCostsTheSampleAndSumsHold) {
    SampleBand band = Picture{}.samples();
    for (const char* layer : {"key", "fill"})
        for (std::size_t c = 0; c < 3; ++c) {
            band.channels.push_back(std::string(layer) + "." + "RGB"[c]);
            std::vector<float> part = band.values[c];
            for (float& value : part) value *= layer[0] == 'k' ? 0.25f : 0.75f;
            band.values.push_back(std::move(part));
        }
    const Drift options{.radiance = {"key", "fill"}};
    const std::size_t bad = 30 * 8 * 70 + 35 * 8 + 3;
    SampleBand without = band;
    for (auto& channel : without.values) channel.erase(channel.begin() + static_cast<std::ptrdiff_t>(bad));
    for (std::uint64_t& offset : without.offsets) offset -= offset > bad;
    write(without);
    const Reconstruction expected = krige(options);
    band.values[7][bad] = std::numeric_limits<float>::quiet_NaN();  // key.G
    write(band);
    const Reconstruction found = krige(options);
    EXPECT_EQ(found.image.pixels, expected.image.pixels);
    EXPECT_EQ(found.report.droppedSamples, 1);
    const Image& image = found.image;
    for (const char* c : {"R", "G", "B"}) {
        const int whole = image.channel(c), key = image.channel(std::string("key.") + c),
                  fill = image.channel(std::string("fill.") + c);
        ASSERT_GE(std::min(key, fill), 0);
        for (int i = 0; i < image.data.width * image.data.height; ++i) {
            const float* pixel = image.at(i % image.data.width, i / image.data.width);
            ASSERT_NEAR(pixel[key] + pixel[fill], pixel[whole], 4e-6);
        }
    }
}

// Premultiplied radiance and its alpha have nearly the same weights: their ratio, the colour, shows no halo.
TEST_F(DriftKriging, AlphaBelongsToItsRadiance) {
    Picture picture;
    picture.features = false;
    SampleBand band = picture.samples();
    std::mt19937 random(4);
    std::bernoulli_distribution hit(0.5);
    band.channels.emplace_back("A");
    auto& alpha = band.values.emplace_back();
    for (std::size_t p = 0; p < band.pixels(); ++p)
        for (std::size_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
            const std::size_t col = p % 70;
            alpha.push_back(col < 30 ? 0.f : col > 40 ? 1.f : hit(random) ? 1.f : 0.f);
            for (std::size_t c = 0; c < 3; ++c) band.values[c][s] = alpha.back() * (c == 1 ? 0.5f : 2.f);
        }
    write(band);
    const Image image = krige().image;
    const int a = image.channel("A");
    double apart = 0;
    for (int row = 0; row < image.data.height; ++row)
        for (int col = 0; col < image.data.width; ++col) {
            const float* pixel = image.at(col, row);
            ASSERT_GE(pixel[a], 0);
            ASSERT_LE(pixel[a], 1);
            apart += (pixel[0] - 2 * pixel[a]) * (pixel[0] - 2 * pixel[a]);
            if (col < 10 || col > 60) {
                ASSERT_EQ(pixel[a], col < 10 ? 0 : 1);
            }
        }
    // The standard error of a pixel's own radiance is 0.35 in the columns between.
    EXPECT_LT(std::sqrt(apart / (11 * image.data.height)), 0.18);
}

TEST_F(DriftKriging, PixelsWithoutSamplesArePredicted) {
    Picture picture;
    SampleBand band = picture.samples();
    // Take all samples of a 3 x 3 block away.
    SampleBand holed{band.x, band.y, band.width, band.height, {0}, band.channels, {}};
    holed.values.resize(band.values.size());
    for (int row = 0; row < band.height; ++row)
        for (int col = 0; col < band.width; ++col) {
            const std::size_t pixel = static_cast<std::size_t>(row * band.width + col);
            if (std::abs(row - 20) > 1 || std::abs(col - 20) > 1)
                for (std::size_t c = 0; c < band.values.size(); ++c)
                    holed.values[c].insert(
                        holed.values[c].end(),
                        band.values[c].begin() + static_cast<std::ptrdiff_t>(band.offsets[pixel]),
                        band.values[c].begin() + static_cast<std::ptrdiff_t>(band.offsets[pixel + 1]));
            holed.offsets.push_back(holed.values[0].size());
        }
    write(holed);
    const Reconstruction result = krige();
    EXPECT_EQ(result.report.emptyPixels, 9);
    const double truth = picture.truth(20 + band.x, 20 + band.y);
    EXPECT_NEAR(result.image.at(20, 20)[0], truth, 0.25 * truth);
}

TEST_F(DriftKriging, FirefliesAsAskedFor) {
    Picture picture;
    SampleBand band = picture.samples();
    const std::size_t hot = 30 * 8 * 70 + 35 * 8 + 3;
    for (std::size_t c = 0; c < 3; ++c) band.values[c][hot] = 5000;
    write(band);
    const auto total = [](const Image& image) {
        double sum = 0;
        for (std::size_t i = 0; i < image.pixels.size(); i += static_cast<std::size_t>(image.channelCount()))
            sum += static_cast<double>(image.pixels[i]);
        return sum;
    };
    const double plain = total(mean());
    const Reconstruction robust = krige(), kept = krige({.fireflies = Fireflies::Keep}),
                         clamped = krige({.fireflies = Fireflies::Clamp, .clamp = 8});
    EXPECT_LT(picture.error(robust.image), 0.01);
    EXPECT_GT(robust.report.drift().energyRemoved, 0.1);  // 5000 of about 34160 samples of 0.6
    EXPECT_LT(robust.report.drift().energyRemoved, 0.4);
    EXPECT_EQ(kept.report.drift().limitedSamples, 0);
    EXPECT_EQ(kept.report.drift().energyRemoved, 0);
    EXPECT_EQ(clamped.report.drift().limitedSamples, 1);
    const auto light = [](const Image& image) {
        double sum = 0;
        for (int y = 0; y < image.data.height; ++y)
            for (int x = 0; x < image.data.width; ++x) {
                const float* z = image.at(x, y);
                sum += luminance<double>(z[0], z[1], z[2]);
            }
        return sum;
    };
    for (const Reconstruction* of : {&robust, &kept, &clamped})
        EXPECT_NEAR(of->report.drift().light, light(of->image) / light(mean()), 1e-3);
    EXPECT_GT(plain - total(robust.image), 400);  // 5000 / 8 of light, gone
}

TEST_F(DriftKriging, StrengthMixesWithTheMean) {
    const Picture picture;
    write(picture.samples());
    const Image plain = mean(), full = krige().image, none = krige({.strength = 0}).image,
                half = krige({.strength = 0.5}).image;
    for (int row = 0; row < 61; ++row)
        for (int col = 0; col < 70; ++col)
            for (int c = 0; c < 3; ++c) {
                ASSERT_NEAR(half.at(col, row)[c], (full.at(col, row)[c] + none.at(col, row)[c]) / 2, 2e-6);
                // All but the brightest samples of 5 x 5 pixels.
                ASSERT_LE(none.at(col, row)[c], plain.at(col, row)[c] + 1e-5f);
            }
}

TEST_F(DriftKriging, ScaleShowsWhatLiesWithinPixels) {
    // An edge through the middle of pixels: sub-pixels left and right of it differ, pixels cannot tell.
    Picture picture;
    picture.window = {0, 0, 40, 36};
    picture.noise = 0.2;
    picture.spp = 16;
    SampleBand band = picture.samples();
    band.channels.insert(band.channels.end(), {"sample.x", "sample.y"});
    band.values.resize(band.channels.size(), std::vector<float>(band.samples()));
    for (std::size_t p = 0; p + 1 < band.offsets.size(); ++p)
        for (std::size_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
            const auto i = static_cast<int>(s - band.offsets[p]);
            const float x =
                static_cast<float>(static_cast<int>(p) % 40) + (static_cast<float>(i % 4) + 0.5f) / 4;
            const float y =
                static_cast<float>(static_cast<int>(p) / 40) + (static_cast<float>(i / 4) + 0.5f) / 4;
            const float bright = x > 20.5f ? 2 : 1;
            for (std::size_t c = 0; c < 3; ++c)
                band.values[c][s] = bright * (1 + 0.1f * std::sin(31.f * static_cast<float>(s)));
            for (std::size_t c = 3; c < 6; ++c) band.values[c][s] = 0.4f * bright;
            band.values[6][s] = x;
            band.values[7][s] = y;
        }
    write(band);
    const Reconstruction whole = krige({.scale = 2});
    EXPECT_EQ(whole.image.data, (Window{0, 0, 80, 72}));
    EXPECT_EQ(whole.report.samples, 40 * 36 * 16);
    for (int row = 10; row < 60; ++row) {
        EXPECT_NEAR(whole.image.at(40, row)[0], 1, 0.1) << row;
        EXPECT_NEAR(whole.image.at(41, row)[0], 2, 0.2) << row;
    }
    const Image band2 = krige({.scale = 2, .band = {1, 3}}).image;
    EXPECT_TRUE(std::equal(band2.pixels.begin(), band2.pixels.end(), whole.image.at(0, 24)));
    write(picture.samples());
    EXPECT_THROW(krige({.scale = 2}), Error);  // no positions
    EXPECT_TRUE(Drift{.scale = 5}.validate());
}

TEST_F(DriftKriging, OneSampleAPixelIsEnough) {
    Picture picture;
    picture.spp = 1;
    write(picture.samples());
    for (const Quality quality : {Quality::Draft, Quality::Standard}) {
        const Image image = krige({.quality = quality}).image;
        EXPECT_LT(picture.error(image), 0.03);  // of 0.25, the sample's
        double sum = 0;
        for (int row = 0; row < image.data.height; ++row)
            for (int col = 0; col < image.data.width; ++col)
                sum += static_cast<double>(image.at(col, row)[image.channel("stddev.R")]);
        EXPECT_GT(sum, 0);
    }
}

TEST_F(DriftKriging, KnownErrorVariancesStandForTheScatter) {
    Picture picture;
    picture.spp = 1;
    picture.truth = [](int, int) { return 2.0; };
    picture.albedo = [](int, int) { return 0.5; };
    SampleBand band = picture.samples();
    for (const char* channel : {"variance.R", "variance.G", "variance.B"}) {
        band.channels.emplace_back(channel);
        band.values.emplace_back(band.values[0].size(), 0.09f);
    }
    write(band);
    const Image image = krige({.strength = 0}).image;
    for (const int channel : {image.channel("stddev.R"), image.channel("stddev.B")})
        EXPECT_NEAR(image.at(30, 30)[channel], 0.3, 1e-3);
    // Where one is not known, scatter counts again: the truth is 2 with a standard deviation of 1.
    band.values.back().assign(band.values[0].size(), -1.f);
    write(band);
    const Image scattered = krige({.strength = 0}).image;
    EXPECT_NEAR(scattered.at(30, 30)[scattered.channel("stddev.R")], 1, 0.3);
}

TEST_F(DriftKriging, FewestAndOddestSamples) {
    // One sample a pixel; one pixel; one column; black; huge; tiny: finite, and not negative.
    for (const auto& [window, spp, scale] : {std::tuple{Window{0, 0, 40, 40}, 1, 1.0},
                                             {Window{5, 5, 1, 1}, 1, 1.0},
                                             {Window{0, 0, 1, 50}, 2, 1.0},
                                             {Window{0, 0, 40, 3}, 4, 0.0},
                                             {Window{0, 0, 33, 33}, 4, 1e12},
                                             {Window{0, 0, 33, 33}, 4, 1e-12}}) {
        Picture picture;
        picture.window = window;
        picture.spp = spp;
        picture.truth = [scale = scale](int x, int) { return scale * (x > 15 ? 1 : 0.1); };
        picture.albedo = [](int x, int) { return x > 15 ? 0.8 : 0.1; };
        picture.noise = 0.3;
        write(picture.samples());
        for (const Quality quality : {Quality::Draft, Quality::Standard, Quality::High}) {
            const Image image = krige({.quality = quality}).image;
            for (const float value : image.pixels) ASSERT_TRUE(std::isfinite(value)) << spp << " " << scale;
            if (window.width > 1 && scale > 0) {
                EXPECT_LT(picture.error(image), 0.09 / spp) << scale;
            }
        }
    }
}

TEST_F(DriftKriging, BadOptionsAreTold) {
    write(Picture{}.samples());
    EXPECT_TRUE(Drift{.strength = 2}.validate());
    EXPECT_TRUE((Drift{.fireflies = Fireflies::Clamp, .clamp = 0}).validate());
    EXPECT_TRUE((Drift{.band = {2, 2}}).validate());
    EXPECT_FALSE(Drift{}.validate());
    EXPECT_THROW(krige({.strength = -1}), Error);
    EXPECT_THROW(krige({.features = {"no.such"}}), Error);
    EXPECT_THROW(krige({.radiance = {"R"}}), Error);
    EXPECT_THROW(krige({.band = {0, 62}}), Error);  // of 61 rows: the first band has none
}

}  // namespace
}  // namespace vlx
