#include "variolux/dump/splats.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "../base/temporary_folder.h"
#include "edit/merge.h"
#include "edit/subset.h"
#include "openexr_files.h"
#include "test_dumps.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace vlx {
namespace {

constexpr int kReplicates = 3, kEach = 2;
const std::vector<DumpChannel> kChannels = {{"G", ChannelType::Float},
                                            {"R", ChannelType::Float},
                                            {"sample.replicate", ChannelType::Uint},
                                            {"B", ChannelType::Float}};

float splatAt(int x, int y, int replicate, int channel) {
    return static_cast<float>((x * 7 + y * 3 + replicate) % 5) + 0.25f * static_cast<float>(channel);
}

/// Samples of kReplicates replicates, kEach of each, without what is not finite.
TestDump samples(const Window& data) {
    TestDump dump = makeDump(data, kChannels, [](int, int) { return kReplicates * kEach; });
    dump.header.splatReplicates = kReplicates;
    dump.header.replicatesShare = true;
    for (auto& values : dump.all.values)
        for (float& v : values) v = std::isfinite(v) && std::abs(v) < 100 ? v : 1;
    for (std::size_t i = 0; i < dump.all.samples(); ++i)
        dump.all.values[2][i] = static_cast<float>(i % (kReplicates * kEach) / kEach);
    return dump;
}

SplatImages splats(const Window& data) {
    SplatImages images(data, kReplicates);
    for (int y = data.y; y < data.y + data.height; ++y)
        for (int x = data.x; x < data.x + data.width; ++x)
            for (int r = 0; r < kReplicates; ++r)
                for (int c = 0; c < 3; ++c) images.at(x, y, r, c) = splatAt(x, y, r, c);
    return images;
}

void write(const std::string& path, const TestDump& dump, int bandRows) {
    DumpWriter writer(path, dump.header);
    for (int row = 0; row < dump.all.height; row += bandRows)
        writer.write(rowsOf(dump.all, row, std::min(bandRows, dump.all.height - row)));
    writer.writeSplats(splats(dump.header.data));
    writer.close();
}

/// The samples with the splats added.
SampleBand expected(const TestDump& dump) {
    SampleBand band = dump.all;
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        const int x = band.x + static_cast<int>(p) % band.width,
                  y = band.y + static_cast<int>(p) / band.width;
        for (auto i = band.offsets[p]; i < band.offsets[p + 1]; ++i) {
            const auto r = static_cast<int>(band.values[2][i]);
            band.values[1][i] += splatAt(x, y, r, 0);
            band.values[0][i] += splatAt(x, y, r, 1);
            band.values[3][i] += splatAt(x, y, r, 2);
        }
    }
    return band;
}

std::vector<float> flatChannel(const std::string& path, int part, const char* name) {
    Imf::MultiPartInputFile file(path.c_str());
    Imf::InputPart input(file, part);
    const Imath::Box2i box = input.header().dataWindow();
    const auto width = static_cast<std::size_t>(box.max.x - box.min.x + 1);
    std::vector<float> values(width * static_cast<std::size_t>(box.max.y - box.min.y + 1), -1);
    Imf::FrameBuffer frame;
    frame.insert(name,
                 Imf::Slice::Make(Imf::FLOAT, values.data(), box, sizeof(float), sizeof(float) * width));
    input.setFrameBuffer(frame);
    input.readPixels(box.min.y, box.max.y);
    return values;
}

const Window kLit{-3, 5, 11, 13};

TEST(Splats, ReadingAddsThemToTheSamplesOfTheirReplicate) {
    const TemporaryFolder folder;
    for (const DumpCompression compression :
         {DumpCompression::None, DumpCompression::Rle, DumpCompression::Zips}) {
        TestDump dump = samples(kLit);
        dump.header.compression = compression;
        write(folder / "a.exr", dump, 5);
        const DumpReader reader(folder / "a.exr");
        EXPECT_EQ(reader.header().splatReplicates, kReplicates);
        const std::vector<std::string> names = {"G", "R", "sample.replicate", "B"};
        const SampleBand all = expected(dump);
        expectSame(all, reader.read(kLit.y, kLit.height, names));
        expectSame(channelsOf(all, {"B"}), reader.read(kLit.y, kLit.height, {"B"}));
        expectSame(channelsOf(dump.all, {"sample.replicate"}),
                   reader.read(kLit.y, kLit.height, {"sample.replicate"}));
    }
}

TEST(Splats, OtherProgramsReadTheParts) {
    const TemporaryFolder folder;
    const TestDump dump = samples(kLit);
    write(folder / "a.exr", dump, 4);
    // The samples as they were, the splats, and in `beauty` the mean of both.
    expectSame(channelsOf(dump.all, {"B", "G", "R", "sample.replicate"}),
               readWithOpenExr(folder / "a.exr", 1));
    const std::vector<float> red = flatChannel(folder / "a.exr", 2, "r01.R");
    const std::vector<float> beauty = flatChannel(folder / "a.exr", 0, "G");
    for (std::size_t p = 0; p < dump.all.pixels(); ++p) {
        const int x = kLit.x + static_cast<int>(p) % kLit.width,
                  y = kLit.y + static_cast<int>(p) / kLit.width;
        ASSERT_EQ(red[p], splatAt(x, y, 1, 0));
        double mean = 0;
        for (auto i = dump.all.offsets[p]; i < dump.all.offsets[p + 1]; ++i)
            mean += static_cast<double>(dump.all.values[0][i]) / (kReplicates * kEach);
        for (int r = 0; r < kReplicates; ++r) mean += static_cast<double>(splatAt(x, y, r, 1)) / kReplicates;
        ASSERT_NEAR(beauty[p], mean, 1e-5 * (1 + std::abs(mean)));
    }
}

TEST(Splats, SameBytesForAnyBands) {
    const TemporaryFolder folder;
    const TestDump dump = samples(kLit);
    write(folder / "a.exr", dump, 1);
    write(folder / "b.exr", dump, 13);
    EXPECT_EQ(fileBytes(folder / "a.exr"), fileBytes(folder / "b.exr"));
}

TEST(Splats, SubsetsAndMergedDumpsHoldThemInTheirSamples) {
    const TemporaryFolder folder;
    const TestDump dump = samples(kLit);
    write(folder / "a.exr", dump, 13);
    const SampleBand all = expected(dump);
    mergeParts({folder / "a.exr"}, folder / "merged.exr", {.crop = true});
    const DumpReader merged(folder / "merged.exr");
    EXPECT_EQ(merged.header().splatReplicates, 0);
    EXPECT_TRUE(merged.header().replicatesShare);
    expectSame(channelsOf(all, {"R", "sample.replicate"}),
               merged.read(kLit.y, kLit.height, {"R", "sample.replicate"}));

    subsetDump(folder / "a.exr", folder / "part.exr", {.samples = kEach});
    const DumpReader part(folder / "part.exr");
    EXPECT_EQ(part.header().splatReplicates, 0);
    const SampleBand band = part.read(kLit.y, kLit.height, {"R"});
    ASSERT_EQ(band.samples(), band.pixels() * kEach);
    // One whole replicate, the same in every pixel.
    int matches = 0;
    for (int r = 0; r < kReplicates; ++r) {
        bool same = true;
        for (std::size_t i = 0; i < band.samples(); ++i)
            same =
                same && band.values[0][i] == all.values[1][i / kEach * kEach * kReplicates +
                                                           static_cast<std::size_t>(r * kEach) + i % kEach];
        matches += same;
    }
    EXPECT_EQ(matches, 1);
}

TEST(Splats, WritingThemIsNotForgotten) {
    const TemporaryFolder folder;
    const TestDump dump = samples(kLit);
    DumpWriter writer(folder / "a.exr", dump.header);
    writer.write(dump.all);
    EXPECT_NE(errorOf([&] { writer.writeSplats(SplatImages(kLit, 2)); }).find("3 replicates"),
              std::string::npos);
    EXPECT_NE(errorOf([&] { writer.close(); }).find("before the splats"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(folder / "a.exr"));
}

TEST(Splats, DamageIsAnError) {
    const TemporaryFolder folder;
    TestDump dump = samples(kLit);
    dump.header.compression = DumpCompression::None;
    dump.all.values[2][3] = kReplicates;  // a replicate that has no splats
    write(folder / "a.exr", dump, 13);
    const DumpReader reader(folder / "a.exr");
    EXPECT_NE(errorOf([&] { reader.read(kLit.y, 1); }).find("replicate 3"), std::string::npos);
    EXPECT_NO_THROW(reader.read(kLit.y + 1, 1));

    // The last bytes of the file are splats.
    std::vector<unsigned char> bytes = fileBytes(folder / "a.exr");
    bytes.resize(bytes.size() - 40);
    writeBytes(folder / "short.exr", bytes);
    const DumpReader damaged(folder / "short.exr");
    EXPECT_NE(errorOf([&] { damaged.read(kLit.y + kLit.height - 1, 1); }).find("part splats"),
              std::string::npos);
}

}  // namespace
}  // namespace vlx
