#include "edit/subset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kTraced{-3, 5, 6, 37};

/// `count` samples a pixel, all values of R different; sample i belongs to replicate i / perReplicate.
TestDump numbered(int count, int perReplicate = 0) {
    TestDump dump;
    dump.header.data = dump.header.display = kTraced;
    dump.header.renderSeconds = 8;
    dump.all = {kTraced.x, kTraced.y, kTraced.width, kTraced.height, {0}, {"B", "G", "R"}, {}};
    if (perReplicate > 0) dump.all.channels.emplace_back("sample.replicate");
    dump.all.values.resize(dump.all.channels.size());
    for (std::size_t p = 0; p < dump.all.pixels(); ++p) {
        for (int i = 0; i < count; ++i) {
            const float value = static_cast<float>(p) * 1000 + static_cast<float>(i);
            for (std::size_t c = 0; c < 3; ++c) dump.all.values[c].push_back(value);
            if (perReplicate > 0) dump.all.values[3].push_back(static_cast<float>(i / perReplicate));
        }
        dump.all.offsets.push_back(dump.all.values[0].size());
    }
    for (const auto& name : dump.all.channels)
        dump.header.channels.push_back(
            {name, name == "sample.replicate" ? ChannelType::Uint : ChannelType::Float});
    return dump;
}

SampleBand subset(const TemporaryFolder& folder, const SubsetOptions& options) {
    subsetDump(folder / "all.exr", folder / "part.exr", options);
    return DumpReader(folder / "part.exr").read(kTraced.y, kTraced.height, {"R"});
}

TEST(Subset, PartsAreDisjointAndTogetherTheWholeDump) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", numbered(12));
    std::multiset<float> found;
    for (std::uint32_t part = 0; part < 4; ++part) {
        const SampleBand band = subset(folder, {.samples = 3, .part = part, .seed = 7});
        for (std::size_t p = 0; p < band.pixels(); ++p) ASSERT_EQ(band.offsets[p + 1], 3 * (p + 1));
        found.insert(band.values[0].begin(), band.values[0].end());
    }
    const TestDump whole = numbered(12);
    EXPECT_EQ(found, std::multiset<float>(whole.all.values[2].begin(), whole.all.values[2].end()));

    const DumpHeader header = DumpReader(folder / "part.exr").header();
    EXPECT_EQ(header.samples, 3.0);
    EXPECT_EQ(header.renderSeconds, 2.0);
    EXPECT_EQ(header.data, kTraced);
}

TEST(Subset, SameSeedSameFileOtherSeedOthers) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", numbered(16));
    const SampleBand first = subset(folder, {.samples = 4, .seed = 1});
    const auto bytes = fileBytes(folder / "part.exr");
    subset(folder, {.samples = 4, .seed = 1});
    EXPECT_EQ(fileBytes(folder / "part.exr"), bytes);
    EXPECT_NE(subset(folder, {.samples = 4, .seed = 2}).values, first.values);
    // Pixels are shuffled independently: not every pixel keeps the same indices.
    std::set<std::vector<int>> choices;
    for (std::size_t p = 0; p < first.pixels(); ++p) {
        std::vector<int> kept;
        for (std::size_t i = 4 * p; i < 4 * p + 4; ++i)
            kept.push_back(static_cast<int>(first.values[0][i]) % 1000);
        choices.insert(kept);
    }
    EXPECT_GT(choices.size(), 50u);
}

TEST(Subset, TakesIndependentHalvesByTurns) {
    const TemporaryFolder folder;
    TestDump whole = numbered(9);
    whole.header.independentHalves = true;
    writeDump(folder / "all.exr", whole);
    std::multiset<float> found;
    for (std::uint32_t part = 0; part < 3; ++part) {
        const SampleBand band = subset(folder, {.samples = 3, .part = part});
        EXPECT_TRUE(DumpReader(folder / "part.exr").header().independentHalves);
        for (std::size_t i = 0; i < band.samples(); ++i) {
            if (i % 3 == 0) continue;
            ASSERT_NE(static_cast<int>(band.values[0][i]) % 2, static_cast<int>(band.values[0][i - 1]) % 2)
                << i;
        }
        found.insert(band.values[0].begin(), band.values[0].end());
    }
    EXPECT_EQ(found, std::multiset<float>(whole.all.values[2].begin(), whole.all.values[2].end()));
}

TEST(Subset, KeepsWholeReplicatesAndNumbersThemAnew) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", numbered(12, 3));
    std::set<int> kept;
    for (std::uint32_t part = 0; part < 2; ++part) {
        subsetDump(folder / "all.exr", folder / "part.exr", {.samples = 6, .part = part});
        const SampleBand band =
            DumpReader(folder / "part.exr").read(kTraced.y, kTraced.height, {"R", "sample.replicate"});
        ASSERT_EQ(band.samples(), band.pixels() * 6);
        for (std::size_t i = 0; i < band.samples(); ++i) {
            EXPECT_EQ(band.values[1][i], static_cast<float>(i % 6 / 3));
            kept.insert(static_cast<int>(band.values[0][i]) % 1000 / 3 * 2 + static_cast<int>(part));
        }
        // The same two replicates in every pixel.
        EXPECT_EQ(kept.size(), 2u * (part + 1));
    }
    std::set<int> replicates;
    for (const int value : kept) replicates.insert(value / 2);
    EXPECT_EQ(replicates.size(), 4u);
}

TEST(Subset, OneReplicateIsDividedBySamples) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", numbered(8, 8));
    EXPECT_EQ(subset(folder, {.samples = 2}).samples(), static_cast<std::size_t>(2 * kTraced.pixels()));
}

TEST(Subset, SaysWhatTheDumpDoesNotHold) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", numbered(8));
    writeDump(folder / "replicates.exr", numbered(8, 4));
    const auto error = [&](const char* input, const SubsetOptions& options) {
        return errorOf([&] { subsetDump(folder / input, folder / "part.exr", options); });
    };
    EXPECT_NE(error("all.exr", {.samples = 9}).find("expected at least 9 samples in every pixel"),
              std::string::npos);
    EXPECT_NE(error("all.exr", {.samples = 3, .part = 2}).find("at least 9 samples"), std::string::npos);
    EXPECT_NE(error("all.exr", {.samples = 0}).find("at least 1 sample"), std::string::npos);
    EXPECT_NE(error("replicates.exr", {.samples = 3}).find("expected a multiple of the 4"),
              std::string::npos);
    EXPECT_NE(error("replicates.exr", {.samples = 4, .part = 2}).find("at least 3 replicates"),
              std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / "part.exr"));
}

}  // namespace
}  // namespace vlx
