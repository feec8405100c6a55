#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "../base/temporary_folder.h"
#include "make_band.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/sample_buffer.h"
#include "variolux/dump/writer.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

DumpHeader headerFor(const SampleBand& band) {
    DumpHeader header;
    header.data = header.display = {band.x, band.y, band.width, band.height};
    for (const std::string& channel : band.channels) header.channels.push_back({channel, ChannelType::Float});
    return header;
}

void writeDump(const std::string& path, const SampleBand& band) {
    DumpWriter writer(path, headerFor(band));
    writer.write(band);
    writer.close();
}

/// A noisy image with an edge, on a window that does not fit the regions.
SampleBand noisyEdge(const Window& window, int count) {
    std::mt19937 random(3);
    std::gamma_distribution<float> noise(2, 0.5f);
    return makeBand(window, count, [&](int column, int row, int i) {
        const float z = (column + row > 14 ? 1.0f : 0.1f) * noise(random);
        return MadeSample{z, 0.7f * z, 0.2f, stratumX(column, i), stratumY(row, i)};
    });
}

TEST(ReconstructPaper, SamePixelsForAnyNumberOfThreads) {
    const TemporaryFolder folder;
    writeDump(folder / "a.exr", noisyEdge({-3, 5, 38, 27}, 8));
    Image first;
    for (const int threads : {1, 2, 8}) {
        const ThreadLimit limit(threads);
        const Reconstruction result = reconstruct(DumpReader(folder / "a.exr"), Paper{});
        if (threads == 1) first = result.image;
        EXPECT_EQ(result.image.pixels, first.pixels) << threads;
        EXPECT_EQ(result.image.data, (Window{-3, 5, 38, 27}));
    }
}

TEST(ReconstructPaper, RegionsLieOnTheRasterGrid) {
    const TemporaryFolder folder;
    writeDump(folder / "a.exr", noisyEdge({-3, 5, 9, 7}, 4));
    const Reconstruction result = reconstruct(DumpReader(folder / "a.exr"), Paper{});
    ASSERT_EQ(result.report.paper().regions.size(), 6u);
    EXPECT_EQ(result.report.paper().regions[0].pixels, (Window{-3, 5, 3, 3}));
    EXPECT_EQ(result.report.paper().regions[4].pixels, (Window{0, 8, 4, 4}));
    std::int64_t covered = 0;
    for (const RegionDiagnostics& region : result.report.paper().regions) covered += region.pixels.pixels();
    EXPECT_EQ(covered, 63);
}

TEST(ReconstructPaper, BeatsTheMeanOnANoisyEdge) {
    const TemporaryFolder folder;
    const Window window{0, 0, 32, 32};
    writeDump(folder / "a.exr", noisyEdge(window, 16));
    const DumpReader dump(folder / "a.exr");
    const auto squareError = [&](const Image& image) {
        double sum = 0;
        for (int row = 0; row < 32; ++row)
            for (int col = 0; col < 32; ++col) {
                const double error =
                    static_cast<double>(image.at(col, row)[0]) - (col + row > 14 ? 1.0 : 0.1);
                sum += error * error;
            }
        return sum;
    };
    EXPECT_LT(squareError(reconstruct(dump, Paper{}).image),
              0.5 * squareError(reconstruct(dump, Mean{}).image));
}

TEST(ReconstructPaper, NeedsNeitherPositionsNorFeaturesNorAlpha) {
    const TemporaryFolder folder;
    SampleBand band = noisyEdge({0, 0, 10, 6}, 4);
    band.channels.resize(3);
    band.values.resize(3);
    writeDump(folder / "a.exr", band);
    const Reconstruction result = reconstruct(DumpReader(folder / "a.exr"), Paper{});
    EXPECT_EQ(result.image.channels,
              (std::vector<std::string>{"R", "G", "B", "stddev.R", "stddev.G", "stddev.B"}));
    for (const float value : result.image.pixels) EXPECT_TRUE(std::isfinite(value));
}

TEST(ReconstructPaper, BadSamplesAndEmptyPixelsAreCountedAndTheImageStaysFinite) {
    const TemporaryFolder folder;
    SampleBand band = noisyEdge({0, 0, 8, 8}, 2);
    band.values[1][17] = std::numeric_limits<float>::quiet_NaN();
    band.values[0][40] = std::numeric_limits<float>::infinity();
    // Pixels of the top left region lose their samples.
    SampleBand sparse = band;
    for (auto& values : sparse.values) values.clear();
    sparse.offsets = {0};
    for (int p = 0; p < 64; ++p) {
        if (p % 8 >= 4 || p / 8 >= 4)
            for (std::size_t c = 0; c < band.values.size(); ++c)
                for (std::uint64_t s = band.offsets[static_cast<std::size_t>(p)];
                     s < band.offsets[static_cast<std::size_t>(p) + 1]; ++s)
                    sparse.values[c].push_back(band.values[c][s]);
        sparse.offsets.push_back(sparse.values[0].size());
    }
    writeDump(folder / "a.exr", sparse);
    const DumpReader dump(folder / "a.exr");
    for (const Method& method : {Method(Paper{}), Method(Mean{})}) {
        const Reconstruction result = reconstruct(dump, method);
        EXPECT_EQ(result.report.samples, 96);
        EXPECT_EQ(result.report.droppedSamples, 1);  // the NaN was in a pixel that was emptied
        EXPECT_EQ(result.report.emptyPixels, 16);
        for (const float value : result.image.pixels) EXPECT_TRUE(std::isfinite(value));
    }
    EXPECT_EQ(
        reconstruct(dump, Paper{}).report.paper().outcomes[static_cast<std::size_t>(RegionOutcome::Empty)],
        1);
}

TEST(ReconstructPaper, WholeImageIsOneRegionForAFewScatteredPoints) {
    const TemporaryFolder folder;
    // 64 points of a smooth image on a jittered lattice, one sample each; most pixels have none.
    SampleBand band{3, 2, 40, 40, {0}, {"R", "G", "B", "sample.x", "sample.y"}, {}};
    band.values.resize(5);
    const auto truth = [](double x, double y) { return 1 + std::sin(x / 10) * std::cos(y / 12); };
    for (int p = 0; p < 1600; ++p) {
        const int col = p % 40, row = p / 40;
        if (col % 5 == 2 && row % 5 == 2) {
            const double x = 3 + col + 0.3, y = 2 + row + 0.6, z = truth(x, y);
            int c = 0;
            for (const double value : {z, z, z, x, y})
                band.values[static_cast<std::size_t>(c++)].push_back(static_cast<float>(value));
        }
        band.offsets.push_back(band.values[0].size());
    }
    writeDump(folder / "a.exr", band);
    const Reconstruction result =
        reconstruct(DumpReader(folder / "a.exr"), Paper{.regionSize = 0, .colourDistance = false});
    ASSERT_EQ(result.report.paper().regions.size(), 1u);
    EXPECT_EQ(result.report.paper().regions[0].data, 64);
    double worst = 0;
    for (int row = 2; row < 38; ++row)
        for (int col = 2; col < 38; ++col)
            worst = std::max(worst, std::abs(static_cast<double>(result.image.at(col, row)[0]) -
                                             truth(3 + col + 0.5, 2 + row + 0.5)));
    EXPECT_LT(worst, 0.06);
}

TEST(ReconstructMean, IsTheAverageWithItsStandardError) {
    const TemporaryFolder folder;
    SampleBand band{0, 0, 2, 1, {0, 3, 4}, {"R", "G", "B"}, {{1, 2, 6, 5}, {0, 0, 0, 0}, {1, 1, 1, 1}}};
    writeDump(folder / "a.exr", band);
    const Image image = reconstruct(DumpReader(folder / "a.exr"), Mean{}).image;
    EXPECT_FLOAT_EQ(image.at(0, 0)[0], 3);
    EXPECT_FLOAT_EQ(image.at(0, 0)[3], std::sqrt(7.0f / 3));  // s^2 = 7
    EXPECT_FLOAT_EQ(image.at(1, 0)[0], 5);
    EXPECT_FLOAT_EQ(image.at(1, 0)[3], std::sqrt(7.0f));  // borrowed
}

TEST(Report, IsJsonWithEveryRegion) {
    const TemporaryFolder folder;
    writeDump(folder / "a.exr", noisyEdge({0, 0, 8, 4}, 4));
    Reconstruction result = reconstruct(DumpReader(folder / "a.exr"), Paper{});
    const auto document = nlohmann::json::parse(toJson(result));
    EXPECT_EQ(document["regions"].size(), 2u);
    EXPECT_EQ(document["report"]["samples"], 128);
    addDiagnosticLayers(result);
    const int layer = result.image.channel("diagnostics.range");
    ASSERT_GE(layer, 0);
    EXPECT_FLOAT_EQ(result.image.at(5, 2)[layer], static_cast<float>(result.report.paper().regions[1].range));
    EXPECT_GE(result.image.channel("stddev.B"), 0);
}

TEST(Reconstruct, BadOptionsAreErrorsThatBothDoorsTell) {
    DumpHeader header;
    header.data = header.display = {0, 0, 2, 1};
    header.channels = {{"R"}, {"G"}, {"B"}};
    const SampleBuffer source(header, {0, 0, 2, 1, {0, 1, 2}, {"R", "G", "B"}, {{1, 2}, {1, 2}, {1, 2}}});
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const Method& method :
         {Method(Gaussian{0}), Method(Gaussian{nan}), Method(Paper{.regionSize = 65}),
          Method(Paper{.inspect = {{2, 0}}}), Method(Drift{.strength = -1}), Method(Drift{.scale = 9}),
          Method(Drift{.fireflies = Fireflies::Clamp, .clamp = 0})}) {
        EXPECT_THROW(outline(source, method), Error) << method.index();
        EXPECT_THROW(reconstruct(source, method), Error) << method.index();
        EXPECT_THROW(reconstruct(source, method, [](const float*, int) {}), Error) << method.index();
    }
    header.display = {};
    EXPECT_THROW(SampleBuffer(header, source.read(0, 1, {})), Error);
}

TEST(Reconstruct, RowsAndTheWholeAreTheSame) {
    const SampleBand band = makeBand({0, 0, 9, 7}, 4, [](int column, int row, int i) {
        return MadeSample{0.1f * static_cast<float>(column + i), 0.2f * static_cast<float>(row), 0.3f,
                          stratumX(column, i), stratumY(row, i)};
    });
    const SampleBuffer source(headerFor(band), band);
    for (const Method& method : {Method(Drift{}), Method(Paper{}), Method(Mean{}), Method(Gaussian{1.5})}) {
        const Image whole = reconstruct(source, method).image, like = outline(source, method);
        EXPECT_EQ(whole.channels, like.channels);
        EXPECT_EQ(whole.data, like.data);
        std::vector<float> rows;
        reconstruct(source, method, [&](const float* values, int count) {
            rows.insert(rows.end(), values, values + count * whole.data.width * whole.channelCount());
        });
        EXPECT_EQ(rows, whole.pixels) << method.index();
    }
}

}  // namespace
}  // namespace vlx
