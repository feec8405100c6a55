#include "edit/halves.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "variolux/base/error.h"
#include "variolux/dump/half_samples.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kOf{-2, 3, 3, 37};  // more rows than are held at once

/// Sample i of pixel p has R = 100 p + i, G = 1, B = i % 2 and, if asked for, albedo p, replicate i / 2.
TestDump counting(bool features, bool replicates) {
    TestDump dump;
    dump.header.data = dump.header.display = kOf;
    dump.all = {kOf.x, kOf.y, kOf.width, kOf.height, {0}, {"R", "G", "B"}, {}};
    if (features)
        for (const char* channel : {"albedo.R", "albedo.G", "albedo.B"})
            dump.all.channels.emplace_back(channel);
    if (replicates) dump.all.channels.emplace_back("sample.replicate");
    dump.all.values.resize(dump.all.channels.size());
    for (std::size_t p = 0; p < dump.all.pixels(); ++p) {
        for (int i = 0; i < 4; ++i) {
            std::vector<float> values = {static_cast<float>(100 * p) + static_cast<float>(i), 1,
                                         static_cast<float>(i % 2)};
            if (features) values.insert(values.end(), 3, static_cast<float>(p));
            if (replicates) values.push_back(static_cast<float>(i / 2));
            for (std::size_t c = 0; c < values.size(); ++c) dump.all.values[c].push_back(values[c]);
        }
        dump.all.offsets.push_back(dump.all.values[0].size());
    }
    for (const auto& name : dump.all.channels)
        dump.header.channels.push_back(
            {name, name == "sample.replicate" ? ChannelType::Uint : ChannelType::Float});
    return dump;
}

/// The floats of a PFM file, rows from the top down.
std::vector<float> pfm(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::string magic;
    int width = 0, height = 0;
    double scale = 0;
    file >> magic >> width >> height >> scale;
    file.get();
    EXPECT_EQ(magic, "PF");
    EXPECT_EQ(width, kOf.width);
    EXPECT_EQ(height, kOf.height);
    EXPECT_EQ(scale, -1);
    std::vector<float> values(static_cast<std::size_t>(3 * width * height));
    for (int y = height - 1; y >= 0; --y)
        file.read(reinterpret_cast<char*>(values.data() + static_cast<std::ptrdiff_t>(3 * width * y)),
                  12 * width);
    EXPECT_TRUE(file);
    EXPECT_EQ(file.get(), std::ifstream::traits_type::eof());
    return values;
}

TEST(Halves, AreMeansOfEvenAndOddSamples) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", counting(true, false));
    const HalvesReport report = writeHalves(folder / "all.exr", folder / "x");
    EXPECT_EQ(report.files.size(), 6u);
    EXPECT_EQ(report.missingInHalves + report.emptyPixels + report.droppedSamples, 0);
    const auto even = pfm(folder / "x_even_color.pfm"), odd = pfm(folder / "x_odd_color.pfm"),
               all = pfm(folder / "x_color.pfm"), albedo = pfm(folder / "x_odd_albedo.pfm");
    for (std::size_t p = 0; p < static_cast<std::size_t>(kOf.pixels()); ++p) {
        EXPECT_EQ(even[3 * p], static_cast<float>(100 * p + 1));
        EXPECT_EQ(odd[3 * p], static_cast<float>(100 * p + 2));
        EXPECT_EQ(all[3 * p], static_cast<float>(100 * p) + 1.5f);
        EXPECT_EQ(even[3 * p + 2], 0);
        EXPECT_EQ(odd[3 * p + 2], 1);
        EXPECT_EQ(albedo[3 * p + 1], static_cast<float>(p));
    }
}

TEST(Halves, AreReplicatesWhereThereAreAny) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", counting(false, true));
    EXPECT_EQ(writeHalves(folder / "all.exr", folder / "x").files.size(), 3u);
    EXPECT_EQ(pfm(folder / "x_even_color.pfm")[0], 0.5f);
    EXPECT_EQ(pfm(folder / "x_odd_color.pfm")[0], 2.5f);
}

TEST(Halves, WhatIsMissingIsCounted) {
    const TemporaryFolder folder;
    TestDump dump = counting(false, false);
    dump.all.values[0][0] = dump.all.values[1][2] =
        std::numeric_limits<float>::quiet_NaN();  // both even ones of pixel 0
    writeDump(folder / "all.exr", dump);
    const HalvesReport report = writeHalves(folder / "all.exr", folder / "x");
    EXPECT_EQ(report.droppedSamples, 2);
    EXPECT_EQ(report.missingInHalves, 1);
    EXPECT_EQ(pfm(folder / "x_even_color.pfm")[0], 2);
    EXPECT_EQ(pfm(folder / "x_odd_color.pfm")[0], 2);
}

TEST(Halves, AreDumpsToo) {
    const TemporaryFolder folder;
    TestDump dump = counting(true, true);
    dump.header.samples = 4;
    writeDump(folder / "all.exr", dump);
    const DumpReader all(folder / "all.exr");
    for (const int parity : {0, 1}) {
        EXPECT_EQ(writeHalfDump(folder / "all.exr", folder / "half.exr", parity), dump.all.samples() / 2);
        const DumpReader half(folder / "half.exr");
        EXPECT_EQ(half.header().samples, 2);
        EXPECT_EQ(half.header().data, kOf);
        const HalfSamples wanted(all, true, parity);
        const SampleBand kept = half.read(kOf.y, kOf.height, {"R", "albedo.G"}),
                         expected = wanted.read(kOf.y, kOf.height, {"R", "albedo.G"});
        EXPECT_EQ(kept.values, expected.values);
        EXPECT_EQ(kept.offsets, expected.offsets);
        const SampleBand numbers = half.read(kOf.y, kOf.height, {"sample.replicate"});
        for (const float replicate : numbers.values[0])
            EXPECT_EQ(replicate, 0);  // 0 and 1 of all are 0 of each half
    }
}

TEST(Halves, LeaveNothingWhereTheyCannotBeWritten) {
    const TemporaryFolder folder;
    writeDump(folder / "all.exr", counting(false, false));
    EXPECT_THROW(writeHalves(folder / "all.exr", folder / "missing/x"), Error);
    EXPECT_THROW(writeHalves(folder / "none.exr", folder / "x"), Error);
    int files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder / "")) ++files;
    EXPECT_EQ(files, 1);
}

}  // namespace
}  // namespace vlx
