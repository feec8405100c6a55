#include "variolux/dump/sample_writer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <thread>

#include "../base/temporary_folder.h"
#include "test_dumps.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kBuckets{-3, 5, 37, 29};

DumpHeader headerOf(const Window& window) {
    DumpHeader header;
    header.data = header.display = window;
    header.channels = {
        {"R"}, {"G"}, {"B"}, {"A", ChannelType::Half}, {"sample.replicate", ChannelType::Uint}};
    header.compression = DumpCompression::Rle;
    return header;
}

int countOf(int x, int y) { return ((x * 7 + y * 3) % 5 + 5) % 5; }

std::array<float, 5> sampleOf(int x, int y, int i) {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(i) + 0.5f, 1,
            static_cast<float>(i % 3)};
}

std::vector<Window> tilesOf(int size) {
    std::vector<Window> tiles;
    for (int y = kBuckets.y; y < kBuckets.y + kBuckets.height; y += size)
        for (int x = kBuckets.x; x < kBuckets.x + kBuckets.width; x += size)
            tiles.push_back({x, y, std::min(size, kBuckets.x + kBuckets.width - x),
                             std::min(size, kBuckets.y + kBuckets.height - y)});
    return tiles;
}

SampleTile filled(const SampleWriter& writer, const Window& window, unsigned seed) {
    SampleTile tile = writer.tile(window);
    // Pixels in any order, samples of a pixel in theirs.
    std::vector<std::pair<int, int>> pixels;
    for (int y = window.y; y < window.y + window.height; ++y)
        for (int x = window.x; x < window.x + window.width; ++x) pixels.emplace_back(x, y);
    std::shuffle(pixels.begin(), pixels.end(), std::mt19937(seed));
    for (int i = 0; i < 5; ++i)
        for (const auto& [x, y] : pixels)
            if (i < countOf(x, y)) tile.add(x, y, sampleOf(x, y, i));
    return tile;
}

TEST(SampleWriter, TilesInAnyOrderFromManyThreadsGiveTheSameBytes) {
    const TemporaryFolder folder;
    std::vector<unsigned char> expected;
    for (const int size : {7, 64, 1}) {
        auto tiles = tilesOf(size);
        for (unsigned run = 0; run < 3; ++run) {
            std::shuffle(tiles.begin(), tiles.end(), std::mt19937(run));
            SampleWriter writer(folder / "a.exr", headerOf(kBuckets));
            std::vector<std::thread> threads;
            const std::size_t workers = run + 1;
            for (std::size_t t = 0; t < workers; ++t)
                threads.emplace_back([&, t] {
                    for (std::size_t i = t; i < tiles.size(); i += workers)
                        writer.add(filled(writer, tiles[i], static_cast<unsigned>(i)));
                });
            for (auto& thread : threads) thread.join();
            EXPECT_EQ(folder.entries(), expected.empty() ? 1 : 2)
                << "only the dump's hidden name beside others";
            writer.close(1.5);
            const auto bytes = fileBytes(folder / "a.exr");
            if (expected.empty()) expected = bytes;
            EXPECT_EQ(bytes, expected) << size << " " << run;
        }
    }
    EXPECT_EQ(folder.entries(), 1);

    const DumpReader dump(folder / "a.exr");
    EXPECT_EQ(dump.header().renderSeconds, 1.5);
    const SampleBand band = dump.read(kBuckets.y, kBuckets.height, {"R", "G", "B", "A", "sample.replicate"});
    std::size_t i = 0;
    for (int y = kBuckets.y; y < kBuckets.y + kBuckets.height; ++y)
        for (int x = kBuckets.x; x < kBuckets.x + kBuckets.width; ++x)
            for (int s = 0; s < countOf(x, y); ++s, ++i)
                for (std::size_t c = 0; c < 5; ++c) ASSERT_EQ(band.values[c][i], sampleOf(x, y, s)[c]);
    EXPECT_EQ(band.samples(), i);
}

// Tiles of the same pixels and pass follow each other as they came, whatever other threads add meanwhile.
TEST(SampleWriter, OverlappingTilesOfAThreadKeepTheirOrder) {
    const TemporaryFolder folder;
    const Window window{0, 0, 1, 1};
    constexpr int kThreads = 8, kTiles = 60;
    SampleWriter writer(folder / "a.exr", headerOf(window));
    std::vector<std::thread> threads;
    for (int t = 0; t < kThreads; ++t)
        threads.emplace_back([&, t] {
            for (int i = 0; i < kTiles; ++i) {
                SampleTile tile = writer.tile(window);
                tile.add(0, 0, std::array{static_cast<float>(t), static_cast<float>(i), 0.f, 1.f, 0.f});
                writer.add(std::move(tile));
            }
        });
    for (auto& thread : threads) thread.join();
    writer.close();
    const SampleBand band = DumpReader(folder / "a.exr").read(0, 1, {"R", "G"});
    ASSERT_EQ(band.samples(), std::uint64_t{kThreads} * kTiles);
    std::array<float, kThreads> next{};
    for (std::size_t s = 0; s < band.samples(); ++s)
        EXPECT_EQ(band.values[1][s], next[static_cast<std::size_t>(band.values[0][s])]++);
}

TEST(SampleWriter, PassesFollowEachOther) {
    const TemporaryFolder folder;
    const Window window{0, 0, 4, 3};
    SampleWriter writer(folder / "a.exr", headerOf(window));
    for (const std::uint32_t pass : {2u, 0u, 1u}) {
        SampleTile tile = writer.tile(window, pass);
        tile.add(1, 2, std::array{static_cast<float>(pass), 0.f, 0.f, 1.f, static_cast<float>(pass)});
        EXPECT_EQ(tile.samples(), 1u);
        writer.add(std::move(tile));
    }
    writer.close();
    const SampleBand band = DumpReader(folder / "a.exr").read(0, 3, {"R"});
    EXPECT_EQ(band.values[0], (std::vector<float>{0, 1, 2}));
    EXPECT_EQ(band.offsets[9], 0u);
    EXPECT_EQ(band.offsets[10], 3u);
}

TEST(SampleWriter, MisuseIsAnErrorAndLeavesNoFile) {
    const TemporaryFolder folder;
    {
        SampleWriter writer(folder / "a.exr", headerOf(kBuckets));
        EXPECT_NE(errorOf([&] { writer.tile({-4, 5, 3, 3}); }).find("within 37 x 29"), std::string::npos);
        EXPECT_NE(errorOf([&] { writer.tile({-3, 5, 0, 3}); }), "");
        EXPECT_NE(errorOf([&] { writer.tile({30, 5, 2147483647, 1}); }), "");
        SampleTile tile = writer.tile({0, 6, 2, 2});
        EXPECT_NE(errorOf([&] { tile.add(2, 6, sampleOf(0, 0, 0)); }).find("found (2, 6)"),
                  std::string::npos);
        EXPECT_NE(errorOf([&] { tile.add(0, 6, std::array{1.f, 2.f}); }).find("5 values"), std::string::npos);
        writer.add(std::move(tile));
    }
    EXPECT_EQ(folder.entries(), 0);
    SampleWriter writer(folder / "a.exr", headerOf(kBuckets));
    SampleTile late = writer.tile({0, 6, 2, 2});
    writer.close();
    EXPECT_NE(errorOf([&] { writer.add(std::move(late)); }).find("no more tiles"), std::string::npos);
    EXPECT_NE(errorOf([&] { writer.close(); }).find("closed already"), std::string::npos);
    EXPECT_EQ(DumpReader(folder / "a.exr").read(5, 29).samples(), 0u);
    EXPECT_NE(errorOf([&] { SampleWriter(folder / "none/a.exr", headerOf(kBuckets)); }), "");
}

}  // namespace
}  // namespace vlx
