// What other programs write, we read; what we write, they read.

#include <OpenImageIO/deepdata.h>
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "../base/temporary_folder.h"
#include "openexr_files.h"
#include "test_dumps.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

TestDump makeCase(DumpCompression compression) {
    TestDump dump = makeDump({-7, 12, 29, 18}, mixedChannels(), kAdaptive);
    dump.header.display = {0, 0, 100, 60};
    dump.header.compression = compression;
    return dump;
}

std::vector<std::string> sortedNames(const SampleBand& band) {
    auto names = band.channels;
    std::sort(names.begin(), names.end());
    return names;
}

SampleBand readWithOiio(const std::string& path, int part) {
    const auto input = OIIO::ImageInput::open(path);
    OIIO::DeepData deep;
    if (!input || !input->read_native_deep_image(part, 0, deep)) {
        ADD_FAILURE() << OIIO::geterror();
        return {};
    }
    const OIIO::ImageSpec spec = input->spec(part);
    SampleBand band;
    band.x = spec.x;
    band.y = spec.y;
    band.width = spec.width;
    band.height = spec.height;
    band.offsets.push_back(0);
    for (std::int64_t p = 0; p < deep.pixels(); ++p)
        band.offsets.push_back(band.offsets.back() + static_cast<std::uint64_t>(deep.samples(p)));
    for (int c = 0; c < spec.nchannels; ++c) {
        band.channels.push_back(spec.channelnames[static_cast<std::size_t>(c)]);
        auto& values = band.values.emplace_back();
        const bool whole = deep.channeltype(c) == OIIO::TypeDesc::UINT32;
        for (std::int64_t p = 0; p < deep.pixels(); ++p)
            for (int i = 0; i < deep.samples(p); ++i)
                values.push_back(whole ? static_cast<float>(deep.deep_value_uint(p, c, i))
                                       : deep.deep_value(p, c, i));
    }
    return band;
}

TEST(DumpInterop, ReadsWhatOpenExrWrites) {
    const TemporaryFolder folder;
    for (const DumpCompression compression : kAllCompressions)
        for (const bool decreasingY : {false, true})
            for (const bool severalParts : {false, true}) {
                const TestDump dump = makeCase(compression);
                writeWithOpenExr(folder / "a.exr", dump, {decreasingY, severalParts});
                const DumpReader reader(folder / "a.exr");
                EXPECT_EQ(reader.header().data, dump.header.data);
                EXPECT_EQ(reader.header().display, dump.header.display);
                EXPECT_EQ(reader.header().compression, compression);
                expectSame(dump.all, reader.read(12, 18, dump.all.channels));
            }
}

TEST(DumpInterop, OpenExrReadsWhatWeWrite) {
    const TemporaryFolder folder;
    for (const DumpCompression compression : kAllCompressions) {
        const TestDump dump = makeCase(compression);
        writeDump(folder / "a.exr", dump);
        expectSame(channelsOf(dump.all, sortedNames(dump.all)), readWithOpenExr(folder / "a.exr", 1));
    }
}

TEST(DumpInterop, OpenImageIoReadsWhatWeWrite) {
    const TemporaryFolder folder;
    for (const DumpCompression compression : kAllCompressions) {
        const TestDump dump = makeCase(compression);
        writeDump(folder / "a.exr", dump);
        const SampleBand found = readWithOiio(folder / "a.exr", 1);
        expectSame(channelsOf(dump.all, found.channels), found);
    }
}

TEST(DumpInterop, RowsOfAnUnfinishedFileUpToTheMissingOnes) {
    const TemporaryFolder folder;
    const TestDump dump = makeCase(DumpCompression::Zips);
    writeWithOpenExr(folder / "a.exr", dump, {false, false, 11});
    const DumpReader reader(folder / "a.exr");
    expectSame(rowsOf(dump.all, 0, 11), reader.read(12, 11, dump.all.channels));
    const std::string message = errorOf([&] { reader.read(20, 5); });
    EXPECT_NE(message.find("a.exr"), std::string::npos);
    EXPECT_NE(message.find("scanline 23 (chunk 11): missing"), std::string::npos) << message;
}

TEST(DumpInterop, FlatAndTiledFilesAreErrorsThatSayWhatToDo) {
    const TemporaryFolder folder;
    const TestDump dump = makeCase(DumpCompression::None);
    writeDeepTiles(folder / "tiles.exr", dump);
    EXPECT_NE(errorOf([&] { DumpReader(folder / "tiles.exr"); }).find("deep tiles"), std::string::npos);

    const auto output = OIIO::ImageOutput::create(folder / "flat.exr");
    const float pixel[3] = {1, 2, 3};
    output->open(folder / "flat.exr", OIIO::ImageSpec(1, 1, 3, OIIO::TypeDesc::FLOAT));
    output->write_image(OIIO::TypeDesc::FLOAT, pixel);
    output->close();
    EXPECT_NE(errorOf([&] { DumpReader(folder / "flat.exr"); }).find("flat pixels"), std::string::npos);
}

TEST(DumpInterop, NeedsRadianceChannels) {
    const TemporaryFolder folder;
    const TestDump dump =
        makeDump({0, 0, 3, 3}, {{"R", ChannelType::Float}, {"Z", ChannelType::Float}}, kAdaptive);
    writeWithOpenExr(folder / "a.exr", dump);
    EXPECT_NE(errorOf([&] { DumpReader(folder / "a.exr"); }).find("channels R, G and B, found R, Z"),
              std::string::npos);
    // Also of luminance: what else there is to do.
    const TestDump grey = makeDump({0, 0, 4, 4}, {{"Y", ChannelType::Float}}, [](int, int) { return 2; });
    writeWithOpenExr(folder / "grey.exr", grey);
    const std::string message = errorOf([&] { DumpReader(folder / "grey.exr"); });
    for (const char* words : {"found Y", "luminance as all three", "--map R=CHANNEL", "vlx-pack stack"})
        EXPECT_NE(message.find(words), std::string::npos) << message;
}

// Part of a dump of another renderer, written by OpenImageIO: see testdata/dumps/README.md.
TEST(DumpInterop, ReadsTheTungstenDumpAsItIs) {
    const std::string path = VLX_TESTDATA "/dumps/tungsten_cornell.exr";
    const DumpReader reader(path);
    EXPECT_EQ(reader.header().data, (Window{100, 120, 20, 20}));
    EXPECT_EQ(reader.header().display, (Window{0, 0, 256, 256}));
    EXPECT_EQ(reader.header().renderer, "Tungsten");
    EXPECT_EQ(reader.header().channels.size(), 13u);
    for (const std::uint32_t count : reader.counts(120, 20)) EXPECT_EQ(count, 8u);
    const SampleBand judge = readWithOpenExr(path, 0);
    const SampleBand found = reader.read(120, 20);
    expectSame(judge, found);
    // Positions lie in their pixels, hits are finite.
    const auto& x = found.values[static_cast<std::size_t>(found.channel("sample.x"))];
    const auto& z = found.values[static_cast<std::size_t>(found.channel("Z"))];
    for (std::size_t p = 0; p < found.pixels(); ++p)
        for (std::uint64_t i = found.offsets[p]; i < found.offsets[p + 1]; ++i) {
            const float column = static_cast<float>(100 + p % 20);
            EXPECT_TRUE(x[i] >= column && x[i] <= column + 1);
            EXPECT_TRUE(z[i] > 0 && z[i] < 20);
        }
}

// Runs a program; empty when there is none of this name.
std::string outputOf(const std::string& program, const std::string& arguments, int& status) {
    if (std::system(("command -v " + program + " >/dev/null 2>&1").c_str()) != 0) return {};
    std::string text;
    std::FILE* pipe = ::popen((program + " " + arguments + " 2>&1").c_str(), "r");
    std::array<char, 4096> buffer;
    while (const std::size_t count = std::fread(buffer.data(), 1, buffer.size(), pipe))
        text.append(buffer.data(), count);
    status = ::pclose(pipe);
    return text;
}

TEST(DumpInterop, ExrheaderOpensOurFiles) {
    const TemporaryFolder folder;
    writeDump(folder / "a.exr", makeCase(DumpCompression::Zips));
    int status = -1;
    const std::string text = outputOf("exrheader", folder / "a.exr", status);
    if (text.empty()) GTEST_SKIP() << "exrheader is not installed";
    EXPECT_EQ(status, 0);
    for (const char* part :
         {"\"beauty\"", "\"samples\"", "\"deepscanline\"", "sample.replicate, 32-bit unsigned",
          "maxSamplesPerPixel (type int): 12", "deepImageState"})
        EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
}

TEST(DumpInterop, OiiotoolOpensOurFiles) {
    const TemporaryFolder folder;
    const TestDump dump = makeCase(DumpCompression::Zips);
    writeDump(folder / "a.exr", dump);
    int status = -1;
    const std::string text = outputOf("oiiotool", "--info -v -a --stats " + folder / "a.exr", status);
    if (text.empty()) GTEST_SKIP() << "oiiotool is not installed";
    EXPECT_EQ(status, 0);
    for (const char* part : {"2 subimages", "9 channel, deep"})
        EXPECT_NE(text.find(part), std::string::npos) << part << " in\n" << text;
    EXPECT_NE(text.find(std::to_string(dump.all.samples())), std::string::npos) << text;
}

}  // namespace
}  // namespace vlx
