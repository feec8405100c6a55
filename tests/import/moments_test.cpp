// Importers of means and variances: each renderer's idea of a variance, and the halves made of them.

#include "import/moments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "../base/temporary_folder.h"
#include "../dump/renderer_files.h"
#include "../dump/test_dumps.h"
#include "edit/info.h"
#include "import/bcd.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kImages{2, -1, 6, 37};

// A pixel's mean and variance as the dump has them, of R, G, B.
struct Pixel {
    double mean[3] = {}, variance[3] = {};
    std::size_t samples = 0;
};

std::vector<Pixel> pixelsOf(const std::string& path) {
    const DumpReader dump(path);
    const Window window = dump.header().data;
    const SampleBand band =
        dump.read(window.y, window.height, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    std::vector<Pixel> pixels;
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        Pixel& pixel = pixels.emplace_back();
        pixel.samples = band.offsets[p + 1] - band.offsets[p];
        const double n = static_cast<double>(pixel.samples);
        for (std::size_t i = band.offsets[p]; i < band.offsets[p + 1]; ++i)
            for (std::size_t c = 0; c < 3; ++c) {
                pixel.mean[c] += band.values[c][i] / n;
                pixel.variance[c] += band.values[3 + c][i] / (n * n);
            }
    }
    return pixels;
}

float meanOf(int c, int x, int y) {
    return 1.0f + 0.5f * static_cast<float>(c) + 0.125f * static_cast<float>(x + y);
}
float varianceOf(int c, int x, int y) {
    return 0.25f * static_cast<float>(c + 1) + 0.0625f * static_cast<float>((x + 2 * y + 4) % 8);
}

// Expects means and variances, in R, G, B, of every pixel.
void expectMoments(const std::string& dump, double varianceFactor) {
    const auto pixels = pixelsOf(dump);
    ASSERT_EQ(pixels.size(), static_cast<std::size_t>(kImages.pixels()));
    std::size_t p = 0;
    for (int y = kImages.y; y < kImages.y + kImages.height; ++y)
        for (int x = kImages.x; x < kImages.x + kImages.width; ++x, ++p)
            for (int c = 0; c < 3; ++c) {
                ASSERT_NEAR(pixels[p].mean[c], meanOf(c, x, y), 1e-5);
                ASSERT_NEAR(pixels[p].variance[c], varianceFactor * varianceOf(c, x, y), 1e-5);
            }
}

Image withVariance(const std::string& layer) {
    return imageOf(kImages, {"R", "G", "B", layer + ".R", layer + ".G", layer + ".B"},
                   [](int c, int x, int y) { return c < 3 ? meanOf(c, x, y) : varianceOf(c - 3, x, y); });
}

TEST(ImportMoments, EachConventionBecomesTheVarianceOfTheMean) {
    const TemporaryFolder folder;
    const std::string dump = folder / "d.exr";
    for (const bool halves : {true, false}) {
        MomentOptions options;
        options.halves = halves;
        options.samples = 16;

        writeImage(folder / "arnold.exr", withVariance("variance"));
        importMoments(folder / "arnold.exr", dump, options);
        expectMoments(dump, 1.0 / 16);  // of a single sample

        writeImage(folder / "renderman.exr", withVariance("mse"));
        const ImportReport report = importMoments(folder / "renderman.exr", dump, options);
        expectMoments(dump, 1);
        EXPECT_TRUE(anyContains(report.notes, "the variance of the mean"));

        writeImage(folder / "color.exr", imageOf(kImages, {"R", "G", "B"}, meanOf));
        writeImage(folder / "colorVariance.exr", imageOf(kImages, {"R", "G", "B"}, varianceOf));
        options.preset = MomentPreset::Tungsten;
        options.with.variance = folder / "colorVariance.exr";
        importMoments(folder / "color.exr", dump, options);
        expectMoments(dump, 1);

        const DumpReader reader(dump);
        EXPECT_EQ(reader.header().data, kImages);
        EXPECT_EQ(findChannel(reader.header(), "sample.replicate") >= 0, halves);
        for (const Pixel& pixel : pixelsOf(dump)) ASSERT_EQ(pixel.samples, halves ? 2u : 1u);
    }
}

// pbrt: variances of X, Y, Z of single samples; the number of samples is given. A grey error of variance v in
// Y has variance v in R, G and B.
TEST(ImportMoments, PbrtsVariancesAreOfItsSensor) {
    const TemporaryFolder folder;
    const double white[3] = {0.95047, 1, 1.08883};
    const auto channels = pbrtChannels();
    const auto value = [&](int channel, int x, int y) {
        const std::string& name = channels[static_cast<std::size_t>(channel)];
        if (channel < 3) return meanOf(channel, x, y);
        if (name.starts_with("Variance."))
            return static_cast<float>(varianceOf(0, x, y) * white[channel - 19] * white[channel - 19]);
        return 0.5f;
    };
    writeImage(folder / "pbrt.exr", imageOf(kImages, channels, value));
    MomentOptions options;
    EXPECT_NE(errorOf([&] {
                  importMoments(folder / "pbrt.exr", folder / "d.exr", options);
              }).find("expected the number of samples a pixel"),
              std::string::npos);
    options.samples = 4;
    const ImportReport report = importMoments(folder / "pbrt.exr", folder / "d.exr", options);
    EXPECT_TRUE(anyContains(report.notes, "X, Y, Z"));
    EXPECT_EQ(report.mapped.at("N.X"), "Ns.X");
    EXPECT_EQ(report.mapped.at("albedo.B"), "Albedo.B");
    const auto pixels = pixelsOf(folder / "d.exr");
    std::size_t p = 0;
    for (int y = kImages.y; y < kImages.y + kImages.height; ++y)
        for (int x = kImages.x; x < kImages.x + kImages.width; ++x, ++p)
            for (const double v : pixels[p].variance) ASSERT_NEAR(v, varianceOf(0, x, y) / 4, 1e-4);
    // Another sensor: as they are.
    options.xyz = false;
    importMoments(folder / "pbrt.exr", folder / "d.exr", options);
    EXPECT_NEAR(pixelsOf(folder / "d.exr")[0].variance[0],
                varianceOf(0, kImages.x, kImages.y) * white[0] * white[0] / 4, 1e-5);
}

// Mitsuba: (m2 - m^2) / (n - 1), from real samples: what Bessel's formula gives of them.
TEST(ImportMoments, MitsubasSecondMomentsGiveBesselsVariance) {
    const TemporaryFolder folder;
    const double white[3] = {0.95047, 1, 1.08883};
    constexpr int kSamples = 8;
    std::mt19937 random(3);
    std::exponential_distribution<double> noise(1);
    std::vector<double> means, variances;  // of Y
    std::vector<double> squares;
    for (int p = 0; p < kImages.pixels(); ++p) {
        double sum = 0, sum2 = 0;
        for (int i = 0; i < kSamples; ++i) {
            const double v = noise(random);
            sum += v;
            sum2 += v * v;
        }
        means.push_back(sum / kSamples);
        squares.push_back(sum2 / kSamples);
        variances.push_back((sum2 - sum * sum / kSamples) / (kSamples - 1) / kSamples);
    }
    const auto channels = mitsubaMomentChannels();
    const auto value = [&](int channel, int x, int y) {
        const auto p = static_cast<std::size_t>((y - kImages.y) * kImages.width + x - kImages.x);
        const std::string& name = channels[static_cast<std::size_t>(channel)];
        const double w = white[name.back() == 'X' ? 0 : name.back() == 'Y' ? 1 : 2];
        if (name.starts_with("m2_img.") && name.size() == 8) return static_cast<float>(squares[p] * w * w);
        if (name.starts_with("img.") && name.size() == 5) return static_cast<float>(means[p] * w);
        return static_cast<float>(means[p]);
    };
    writeImage(folder / "m.exr", imageOf(kImages, channels, value));
    MomentOptions options;
    options.samples = kSamples;
    const ImportReport report = importMoments(folder / "m.exr", folder / "d.exr", options);
    EXPECT_EQ(report.mapped.at("variance.G"), "m2_img.Y");
    EXPECT_EQ(report.mapped.at("R"), "R");
    EXPECT_EQ(report.mapped.at("A"), "A");
    EXPECT_EQ(report.mapped.at("albedo.R"), "img.albedo.R");
    EXPECT_EQ(report.mapped.at("N.X"), "img.nn.X");
    EXPECT_EQ(report.mapped.at("Z"), "img.dd.y.T");
    const auto pixels = pixelsOf(folder / "d.exr");
    for (std::size_t p = 0; p < pixels.size(); ++p)
        for (std::size_t c = 0; c < 3; ++c) {
            ASSERT_NEAR(pixels[p].mean[c], means[p], 1e-5);
            ASSERT_NEAR(pixels[p].variance[c], variances[p], 2e-4 * variances[p] + 1e-5);
        }
}

// The halves' errors: each of variance 2 v, uncorrelated, when the image's own error has variance v.
TEST(ImportMoments, HalvesHaveUncorrelatedNoise) {
    const TemporaryFolder folder;
    const Window window{0, 0, 160, 120};
    std::mt19937 random(11);
    std::normal_distribution<float> normal;
    constexpr float kTruth = 2, kVariance = 0.25f;
    writeImage(
        folder / "i.exr",
        imageOf(window, {"R", "G", "B", "variance.R", "variance.G", "variance.B"}, [&](int c, int, int) {
            return c < 3 ? kTruth + std::sqrt(kVariance) * normal(random) : kVariance;
        }));
    MomentOptions options;
    options.preset = MomentPreset::Plain;
    options.meaning = VarianceMeaning::OfMean;
    importMoments(folder / "i.exr", folder / "d.exr", options);
    const SampleBand band = DumpReader(folder / "d.exr").read(0, window.height, {"R", "sample.replicate"});
    double sums[5] = {};  // a, b, aa, bb, ab
    const std::size_t n = band.pixels();
    ASSERT_EQ(band.samples(), 2 * n);
    for (std::size_t p = 0; p < n; ++p) {
        const double a = band.values[0][2 * p] - kTruth, b = band.values[0][2 * p + 1] - kTruth;
        ASSERT_EQ(band.values[1][2 * p], 0);
        ASSERT_EQ(band.values[1][2 * p + 1], 1);
        ASSERT_NEAR(a - b, std::copysign(2 * std::sqrt(kVariance), a - b), 1e-5)
            << "the two tell the variance";
        sums[0] += a;
        sums[1] += b;
        sums[2] += a * a;
        sums[3] += b * b;
        sums[4] += a * b;
    }
    const double count = static_cast<double>(n), expected = 2 * kVariance;
    // Four standard deviations of each statistic.
    EXPECT_NEAR(sums[0] / count, 0, 4 * std::sqrt(expected / count));
    EXPECT_NEAR(sums[1] / count, 0, 4 * std::sqrt(expected / count));
    EXPECT_NEAR(sums[2] / count, expected, 4 * expected * std::sqrt(2 / count));
    EXPECT_NEAR(sums[3] / count, expected, 4 * expected * std::sqrt(2 / count));
    EXPECT_NEAR(sums[4] / count, 0, 4 * expected / std::sqrt(count));

    // Another seed, other halves; the same, the same file.
    const auto first = fileBytes(folder / "d.exr");
    importMoments(folder / "i.exr", folder / "d.exr", options);
    EXPECT_EQ(fileBytes(folder / "d.exr"), first);
    options.seed = 1;
    importMoments(folder / "i.exr", folder / "d.exr", options);
    EXPECT_NE(fileBytes(folder / "d.exr"), first);
}

TEST(ImportMoments, UnusableVariancesAreTold) {
    const TemporaryFolder folder;
    writeImage(folder / "i.exr",
               imageOf({0, 0, 4, 1}, {"R", "G", "B", "mse.R", "mse.G", "mse.B"}, [](int c, int x, int) {
                   if (c < 3) return 1.0f;
                   if (x == 1) return std::numeric_limits<float>::quiet_NaN();
                   if (x == 2) return -0.5f;
                   return 0.5f;
               }));
    const ImportReport report = importMoments(folder / "i.exr", folder / "d.exr", {});
    EXPECT_TRUE(anyContains(report.notes, "2 pixels have no usable variance"));
    EXPECT_TRUE(anyContains(report.notes, "1 variances are negative: they count as not known"));
    const auto pixels = pixelsOf(folder / "d.exr");
    EXPECT_EQ(pixels[1].samples, 1u);
    EXPECT_EQ(pixels[1].variance[0], -1);
    EXPECT_EQ(pixels[2].samples, 1u);
    EXPECT_EQ(pixels[2].variance[0], -1);
    EXPECT_EQ(pixels[3].variance[0], 0.5);
}

TEST(ImportMoments, WhatCannotBeFoundIsAnErrorWithTheChannels) {
    const TemporaryFolder folder;
    const auto outcome = [&](const Image& image, const MomentOptions& options) {
        writeImage(folder / "i.exr", image);
        return errorOf([&] { importMoments(folder / "i.exr", folder / "d.exr", options); });
    };
    const Image plain = imageOf(kImages, {"R", "G", "B"}, meanOf);
    EXPECT_NE(outcome(plain, {}).find("expected the variance of each pixel"), std::string::npos);
    EXPECT_NE(outcome(withVariance("var"), {}).find("say what its variance is (--variance-is sample, "),
              std::string::npos);
    MomentOptions options;
    options.map["R"] = "nonsense";
    EXPECT_NE(outcome(withVariance("mse"), options).find("expected a channel nonsense"), std::string::npos);
    options = {};
    writeImage(folder / "small.exr", imageOf({0, 0, 2, 2}, {"R", "G", "B"}, varianceOf));
    options.preset = MomentPreset::Tungsten;
    options.with.variance = folder / "small.exr";
    EXPECT_NE(outcome(plain, options).find("small.exr: expected the windows of the first image"),
              std::string::npos);
    EXPECT_EQ(folder.entries(), 2);
}

TEST(ImportBuffers, HalvesWithVarianceAreCompared) {
    const TemporaryFolder folder;
    const Window window{0, 0, 64, 64};
    std::mt19937 random(5);
    std::normal_distribution<float> normal;
    const auto half = [&](int, int, int) { return 3 + std::sqrt(0.5f) * normal(random); };
    writeImage(folder / "a.exr", imageOf(window, {"R", "G", "B"}, half));
    writeImage(folder / "b.exr", imageOf(window, {"R", "G", "B"}, half));
    const auto variance = [&](float v) {
        writeImage(folder / "v.exr", imageOf(window, {"R", "G", "B"}, [&](int, int, int) { return v; }));
    };
    writeImage(folder / "depth.exr",
               imageOf(window, {"Y"}, [](int, int x, int) { return x == 0 ? -1.0f : 4.0f; }));
    writeImage(folder / "normal.exr",
               imageOf(window, {"R", "G", "B"}, [](int c, int, int) { return c == 2; }));
    BufferOptions options;
    options.with.variance = folder / "v.exr";
    options.with.depth = folder / "depth.exr";
    options.with.normal = folder / "normal.exr";
    variance(0.25f);  // of the mean of two of variance 0.5
    const ImportReport report = importBuffers(folder / "a.exr", folder / "b.exr", folder / "d.exr", options);
    EXPECT_TRUE(anyContains(report.notes, "The buffers differ by"));
    EXPECT_FALSE(anyContains(report.notes, "WARNING"));
    const SampleBand band =
        DumpReader(folder / "d.exr").read(0, window.height, {"variance.R", "Z", "N.Z", "sample.replicate"});
    EXPECT_EQ(band.samples(), 2 * band.pixels());
    EXPECT_EQ(band.values[0][5], 0.5f);
    EXPECT_EQ(band.values[1][0], 0);
    EXPECT_EQ(band.values[1][2], 4);
    EXPECT_EQ(band.values[2][0], 1);
    EXPECT_EQ(band.values[3][3], 1);

    variance(8);
    EXPECT_TRUE(
        anyContains(importBuffers(folder / "a.exr", folder / "b.exr", folder / "d.exr", options).notes,
                    "WARNING: The buffers differ"));
    EXPECT_TRUE(anyContains(importBuffers(folder / "a.exr", folder / "a.exr", folder / "d.exr", {}).notes,
                            "is identical"));
}

TEST(ImportBcdStatistics, CovariancesOfSamplesAndCounts) {
    const TemporaryFolder folder;
    writeImage(folder / "i.exr", imageOf(kImages, {"R", "G", "B"}, meanOf));
    std::vector<std::string> bins;
    for (int i = 0; i < 61; ++i) {
        char name[16];
        std::snprintf(name, sizeof name, "Bin_%04d", i);
        bins.push_back(name);
    }
    writeImage(folder / "hist.exr",
               imageOf(kImages, bins, [](int c, int, int) { return c == 60 ? 32.0f : 1.0f; }));
    bins.resize(6);
    writeImage(folder / "cov.exr", imageOf(kImages, bins, [](int c, int x, int y) {
                   return c < 3 ? varianceOf(c, x, y) : 0.1f;
               }));
    importBcdStatistics(folder / "i.exr", folder / "cov.exr", folder / "hist.exr", folder / "d.exr", {});
    expectMoments(folder / "d.exr", 1.0 / 32);
    BcdOptions options;
    EXPECT_NE(errorOf([&] {
                  importBcdStatistics(folder / "i.exr", folder / "cov.exr", "", folder / "d.exr", options);
              }).find("number of samples"),
              std::string::npos);
    options.samples = 8;
    importBcdStatistics(folder / "i.exr", folder / "cov.exr", "", folder / "d.exr", options);
    expectMoments(folder / "d.exr", 1.0 / 8);
    EXPECT_TRUE(isOpenExr(folder / "i.exr"));
}

// A dump of known variances does not lack a second sample.
TEST(ImportMoments, InfoSeesTheVariance) {
    const TemporaryFolder folder;
    writeImage(folder / "i.exr", withVariance("mse"));
    MomentOptions options;
    options.halves = false;
    importMoments(folder / "i.exr", folder / "d.exr", options);
    for (const MissingPart& part : inspectDump(folder / "d.exr").missing)
        EXPECT_EQ(part.what.find("second sample"), std::string::npos);
}

// Without the dump between: the same samples, rows in any order, halves rounded as a file would.
TEST(OpenMoments, GivesWhatTheDumpHolds) {
    const TemporaryFolder folder;
    writeImage(folder / "in.exr", imageOf(kImages,
                                          {"R", "G", "B", "mse.R", "mse.G", "mse.B", "A", "albedo.R",
                                           "albedo.G", "albedo.B", "key.R", "key.G", "key.B", "id"},
                                          [](int c, int x, int y) {
                                              if (c == 0 && x == 4 && y == 9) return NAN;
                                              return c < 3   ? meanOf(c, x, y)
                                                     : c < 6 ? varianceOf(c - 3, x, y)
                                                             : 0.1f * static_cast<float>(c) +
                                                                   0.001f * static_cast<float>(x * y);
                                          }));
    for (const bool halves : {true, false}) {
        MomentOptions options;
        options.halves = halves;
        options.radiance = {"key", "id"};
        importMoments(folder / "in.exr", folder / "d.exr", options);
        const DumpReader dump(folder / "d.exr");
        const auto samples = openMoments(folder / "in.exr", options);
        std::vector<std::string> names;
        for (const auto& channel : dump.header().channels) names.push_back(channel.name);
        EXPECT_EQ(samples->header().channels.size(), names.size());
        EXPECT_EQ(samples->header().display, dump.header().display);
        for (const auto& [y, rows] : {std::pair{20, 16}, {-1, 37}, {5, 1}})
            expectSame(dump.read(y, rows, names), samples->read(y, rows, names));
        const SampleBand pixel = samples->read(9, 1, {"R"});
        EXPECT_EQ(pixel.offsets[3] - pixel.offsets[2], 1u);  // not two halves of nothing
        EXPECT_NE(errorOf([&] { samples->read(30, 7); }).find("expected rows within"), std::string::npos);
        EXPECT_NE(errorOf([&] { samples->read(0, 1, {"Q"}); }).find("expected a channel Q"),
                  std::string::npos);
    }
}

// Parts of R, G and B have no variance of their own; their halves must add up to those of the whole.
TEST(OpenMoments, PartsOfTheLightAddUpInEachHalf) {
    const TemporaryFolder folder;
    writeImage(folder / "in.exr", imageOf(kImages,
                                          {"R", "G", "B", "mse.R", "mse.G", "mse.B", "key.R", "key.G",
                                           "key.B", "fill.R", "fill.G", "fill.B"},
                                          [](int c, int x, int y) {
                                              if (c < 3) return meanOf(c, x, y);
                                              if (c < 6) return varianceOf(c - 3, x, y);
                                              const float key =
                                                  0.25f * static_cast<float>((x + 3 * y + 64) % 4);
                                              return (c < 9 ? key : 1 - key) * meanOf(c % 3, x, y);
                                          }));
    MomentOptions options;
    options.radiance = {"key", "fill"};
    const SampleBand band =
        openMoments(folder / "in.exr", options)
            ->read(kImages.y, kImages.height,
                   {"R", "G", "B", "key.R", "key.G", "key.B", "fill.R", "fill.G", "fill.B"});
    ASSERT_EQ(band.samples(), 2 * band.pixels());
    for (std::size_t c = 0; c < 3; ++c)
        for (std::size_t i = 0; i < band.samples(); ++i)
            ASSERT_NEAR(band.values[3 + c][i] + band.values[6 + c][i], band.values[c][i], 1e-6);
    options.radiance = {"rim"};
    EXPECT_NE(errorOf([&] {
                  openMoments(folder / "in.exr", options);
              }).find("layer rim for --radiance, found R, G"),
              std::string::npos);
    options.radiance = {"R"};
    EXPECT_NE(errorOf([&] { openMoments(folder / "in.exr", options); }).find("R is taken already"),
              std::string::npos);
}

TEST(OpenMoments, WithoutAVarianceSaysWhatIsMissing) {
    const TemporaryFolder folder;
    writeImage(folder / "in.exr", imageOf(kImages, {"R", "G", "B"}, meanOf));
    const std::string text = errorOf([&] { openMoments(folder / "in.exr", {}); });
    EXPECT_NE(text.find("in.exr: expected the variance of each pixel"), std::string::npos) << text;
    for (const char* remedy : {"--variance", "vlx-pack stack", "vlx-pack buffers"})
        EXPECT_NE(text.find(remedy), std::string::npos) << text;
}

}  // namespace
}  // namespace vlx
