#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "../base/temporary_folder.h"
#include "test_dumps.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace vlx {
namespace {

struct Case {
    const char* name;
    Window data;
    DumpCompression compression;
};

class RoundTrip : public testing::TestWithParam<Case> {};

TEST_P(RoundTrip, GivesBackEverySample) {
    const TemporaryFolder folder;
    TestDump dump = makeDump(GetParam().data, mixedChannels(), kAdaptive);
    dump.header.compression = GetParam().compression;
    writeDump(folder / "a.exr", dump);

    const DumpReader reader(folder / "a.exr");
    EXPECT_EQ(reader.header().data, dump.header.data);
    EXPECT_EQ(reader.header().compression, dump.header.compression);
    const SampleBand found = reader.read(dump.header.data.y, dump.header.data.height, dump.all.channels);
    expectSame(dump.all, found);
    EXPECT_EQ(folder.entries(), 1);
}

std::vector<Case> cases() {
    std::vector<Case> all;
    for (const DumpCompression compression :
         {DumpCompression::None, DumpCompression::Rle, DumpCompression::Zips}) {
        all.push_back({"odd", {0, 0, 37, 23}, compression});
        all.push_back({"offset", {-11, 5, 16, 9}, compression});
        all.push_back({"above", {3, -40, 9, 21}, compression});
        all.push_back({"pixel", {2, 3, 1, 1}, compression});
        all.push_back({"column", {0, 0, 1, 50}, compression});
        all.push_back({"row", {0, 0, 500, 1}, compression});
    }
    return all;
}

std::string caseName(const testing::TestParamInfo<Case>& tested) {
    const char* compressions[] = {"None", "Rle", "Zips"};
    return std::string(tested.param.name) + compressions[static_cast<int>(tested.param.compression)];
}

INSTANTIATE_TEST_SUITE_P(Sizes, RoundTrip, testing::ValuesIn(cases()), caseName);

TEST(Dump, PixelsRowsAndImagesWithoutSamples) {
    const TemporaryFolder folder;
    const Window data{0, 0, 6, 8};
    const CountOf counts[] = {[](int, int) { return 0; }, [](int col, int row) { return row == 3 ? col : 0; },
                              [](int col, int row) { return col == 5 && row == 7 ? 3000 : 0; }};
    for (const CountOf& count : counts) {
        const TestDump dump = makeDump(data, mixedChannels(), count);
        writeDump(folder / "a.exr", dump);
        expectSame(dump.all, DumpReader(folder / "a.exr").read(0, 8, dump.all.channels));
    }
}

TEST(Dump, RowsInAnyOrderAndAnyNumber) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({4, -3, 19, 31}, mixedChannels(), kAdaptive);
    writeDump(folder / "a.exr", dump, 7);
    const DumpReader reader(folder / "a.exr");
    for (const auto& [row, rows] : {std::pair{30, 1}, {0, 1}, {12, 9}, {3, 28}, {12, 9}, {0, 31}})
        expectSame(rowsOf(dump.all, row, rows), reader.read(-3 + row, rows, dump.all.channels));
}

TEST(Dump, SeveralThreadsMayReadAtOnce) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 40, 32}, mixedChannels(), kAdaptive);
    writeDump(folder / "a.exr", dump);
    const DumpReader reader(folder / "a.exr");
    std::vector<std::thread> threads;
    for (int t = 0; t < 4; ++t)
        threads.emplace_back([&, t] {
            for (int row = t; row < 24; row += 3)
                expectSame(rowsOf(dump.all, row, 8), reader.read(row, 8, dump.all.channels));
        });
    for (auto& thread : threads) thread.join();
}

TEST(Dump, ChannelsAsAskedFor) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 12, 6}, mixedChannels(), kAdaptive);
    writeDump(folder / "a.exr", dump);
    const DumpReader reader(folder / "a.exr");
    for (const std::vector<std::string>& names :
         {std::vector<std::string>{"G"}, {"sample.replicate", "A", "R"}, {"R", "R"}})
        expectSame(channelsOf(dump.all, names), reader.read(0, 6, names));

    auto sorted = dump.all.channels;
    std::sort(sorted.begin(), sorted.end());
    expectSame(channelsOf(dump.all, sorted), reader.read(0, 6));
    EXPECT_NE(errorOf([&] { reader.read(0, 6, {"R", "albedo.Q"}); }).find("albedo.Q"), std::string::npos);
}

TEST(Dump, CountsWithoutSamples) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 9, 4}, mixedChannels(), kAdaptive);
    writeDump(folder / "a.exr", dump);
    const auto counts = DumpReader(folder / "a.exr").counts(1, 2);
    ASSERT_EQ(counts.size(), 18u);
    for (int i = 0; i < 18; ++i)
        EXPECT_EQ(counts[static_cast<std::size_t>(i)], static_cast<unsigned>(kAdaptive(i % 9, 1 + i / 9)));
}

TEST(Dump, RowsOutsideTheWindowAreErrors) {
    const TemporaryFolder folder;
    writeDump(folder / "a.exr", makeDump({0, 10, 3, 4}, mixedChannels(), kAdaptive));
    const DumpReader reader(folder / "a.exr");
    for (const auto& [y, rows] : {std::pair{9, 1}, {14, 1}, {10, 5}, {10, 0}, {12, -1}, {13, 2147483647}}) {
        EXPECT_NE(errorOf([&, y = y, rows = rows] { reader.read(y, rows); }).find("rows"), std::string::npos);
        EXPECT_NE(errorOf([&, y = y, rows = rows] { reader.counts(y, rows); }).find("rows"),
                  std::string::npos);
    }
}

TEST(Dump, HeaderComesBack) {
    const TemporaryFolder folder;
    TestDump dump = makeDump({10, 20, 5, 3}, mixedChannels(), kAdaptive);
    DumpHeader& header = dump.header;
    header.display = {0, 0, 640, 480};
    header.renderer = "a renderer";
    header.scene = "room.glb";
    header.pixelFilter = "box";
    header.effects = {"depth of field", "motion"};
    header.seed = -123456789012345;
    header.samples = 4.5;
    header.worldToCamera = std::vector<float>(16, 0.5f);
    header.worldToNDC = std::vector<float>(16, -2.0f);
    header.extra = {{"owner", "someone"}, {"comments", "a, b"}};
    {
        DumpWriter writer(folder / "a.exr", header);
        writer.write(dump.all);
        writer.close(12.75);
    }
    const DumpHeader found = DumpReader(folder / "a.exr").header();
    EXPECT_EQ(found.data, header.data);
    EXPECT_EQ(found.display, header.display);
    EXPECT_EQ(found.version, kDumpVersion);
    EXPECT_EQ(found.renderer, header.renderer);
    EXPECT_EQ(found.scene, header.scene);
    EXPECT_EQ(found.pixelFilter, header.pixelFilter);
    EXPECT_EQ(found.effects, header.effects);
    EXPECT_EQ(found.seed, header.seed);
    EXPECT_EQ(found.samples, header.samples);
    EXPECT_EQ(found.renderSeconds, 12.75);
    EXPECT_EQ(found.worldToCamera, header.worldToCamera);
    EXPECT_EQ(found.worldToNDC, header.worldToNDC);
    EXPECT_EQ(found.extra, header.extra);

    writeDump(folder / "b.exr", makeDump({0, 0, 1, 1}, mixedChannels(), kAdaptive));
    const DumpHeader plain = DumpReader(folder / "b.exr").header();
    EXPECT_EQ(plain.renderer, "");
    EXPECT_EQ(plain.renderSeconds, std::nullopt);
    EXPECT_EQ(plain.seed, std::nullopt);
    EXPECT_EQ(plain.samples, std::nullopt);
    EXPECT_EQ(plain.worldToCamera, std::nullopt);
    EXPECT_TRUE(plain.effects.empty());
    EXPECT_TRUE(plain.extra.empty());
}

TEST(Dump, StoredTypesRoundAndClamp) {
    const TemporaryFolder folder;
    TestDump dump = makeDump({0, 0, 1, 1},
                             {{"R", ChannelType::Half}, {"G", ChannelType::Uint}, {"B", ChannelType::Float}},
                             [](int, int) { return 5; });
    const float infinity = std::numeric_limits<float>::infinity();
    dump.all.values[0] = {1.0f / 3.0f, 1e6f, -1e6f, infinity, 65504.0f};
    dump.all.values[1] = {-4.0f, NAN, 2.5f, 1e20f, 16777216.0f};
    writeDump(folder / "a.exr", dump);
    const SampleBand found = DumpReader(folder / "a.exr").read(0, 1, {"R", "G"});
    EXPECT_EQ(found.values[0], (std::vector<float>{0.33325195f, infinity, -infinity, infinity, 65504.0f}));
    EXPECT_EQ(found.values[1], (std::vector<float>{0, 0, 3, 4294967296.0f, 16777216.0f}));
}

TEST(Dump, BeautyIsTheMeanOfFiniteSamples) {
    const TemporaryFolder folder;
    TestDump dump = makeDump({5, 6, 3, 1}, standardChannels(), [](int col, int) { return 2 * col; });
    const auto set = [&](const char* name, std::vector<float> values) {
        dump.all.values[static_cast<std::size_t>(dump.all.channel(name))] = std::move(values);
    };
    set("R", {1, 3, 1, 2, 3, NAN});
    set("G", {0, 0, INFINITY, -INFINITY, 8, 10});
    set("B", {0.5f, 0.5f, 0, 0, 0, 4});
    set("A", {1, 0, 1, 1, 0, 0});
    set("Z", {7, 0, 1, 2, 0, 0});
    writeDump(folder / "a.exr", dump);
    const Image beauty = readImage(folder / "a.exr");
    EXPECT_EQ(beauty.data, dump.header.data);
    const auto values = [&](const char* name) {
        const int c = beauty.channel(name);
        return std::vector<float>{beauty.at(0, 0)[c], beauty.at(1, 0)[c], beauty.at(2, 0)[c]};
    };
    EXPECT_EQ(values("R"), (std::vector<float>{0, 2, 2}));
    EXPECT_EQ(values("G"), (std::vector<float>{0, 0, 9}));
    EXPECT_EQ(values("B"), (std::vector<float>{0, 0.5f, 1}));
    EXPECT_EQ(values("A"), (std::vector<float>{0, 0.5f, 0.5f}));
    EXPECT_EQ(values("Z"), (std::vector<float>{0, 7, 1.5f}));
}

TEST(DumpDeterminism, SameBytesForAnyThreadsAndBands) {
    const TemporaryFolder folder;
    const TestDump dump = makeDump({0, 0, 64, 40}, standardChannels(), kAdaptive);
    std::vector<unsigned char> first;
    for (const int threads : {1, 2, 8})
        for (const int bandRows : {1, 7, 40}) {
            const ThreadLimit limit(threads);
            writeDump(folder / "a.exr", dump, bandRows);
            auto bytes = fileBytes(folder / "a.exr");
            if (first.empty()) first = bytes;
            ASSERT_EQ(bytes, first) << threads << " threads, bands of " << bandRows;
            expectSame(dump.all, DumpReader(folder / "a.exr").read(0, 40, dump.all.channels));
        }
}

}  // namespace
}  // namespace vlx
