// Files that lie: every one must end in an Error or in a band that is consistent in itself.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <random>

#include "../base/temporary_folder.h"
#include "dump/exr_header.h"
#include "edit/info.h"
#include "exr/little_endian.h"
#include "openexr_files.h"
#include "test_dumps.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

#ifdef VARIOLUX_SANITIZED
constexpr int kFlips = 700;
constexpr std::size_t kTruncationStep = 7;
#else
constexpr int kFlips = 4000;
constexpr std::size_t kTruncationStep = 3;
#endif

constexpr Window kWindow{3, -2, 11, 9};
const CountOf kFew = [](int col, int row) { return (col * 5 + row * 3) % 4; };

// A small dump in the file's bytes, and where things are in them.
struct Victim {
    explicit Victim(DumpCompression compression, bool byOpenExr = false) {
        const TemporaryFolder folder;
        dump = makeDump(kWindow, mixedChannels(), kFew);
        dump.header.compression = compression;
        if (byOpenExr)
            writeWithOpenExr(folder / "a.exr", dump);
        else
            writeDump(folder / "a.exr", dump);
        bytes = fileBytes(folder / "a.exr");
        header = decodeHeader("a.exr", bytes, bytes.size()).value();
    }
    std::uint64_t chunk(int row) const {
        std::uint64_t position = 0;
        std::memcpy(&position, bytes.data() + table(row), 8);
        return position;
    }
    std::size_t table(int row) const {
        return static_cast<std::size_t>(header.chunkTable) + 8 * static_cast<std::size_t>(row);
    }
    // Where the last attribute of this name and type has its value.
    std::size_t attribute(const std::string& name, const std::string& type) const {
        const std::string pattern = name + '\0' + type + '\0';
        const auto found = std::find_end(bytes.begin(), bytes.end(), pattern.begin(), pattern.end());
        EXPECT_NE(found, bytes.end()) << name;
        return static_cast<std::size_t>(found - bytes.begin()) + pattern.size() + 4;
    }

    TestDump dump;
    std::vector<unsigned char> bytes;
    FileHeader header;
};

template <class T>
void put(std::vector<unsigned char>& bytes, std::size_t at, T value) {
    std::memcpy(bytes.data() + at, &value, sizeof value);
}

class Malformed : public testing::Test {
  protected:
    // Reads all there is; empty when it could be read, else the Error's message.
    std::string outcome(const std::vector<unsigned char>& bytes) {
        writeBytes(path_, bytes);
        try {
            const DumpReader reader(path_);
            const Window window = reader.header().data;
            for (int row = 0; row < window.height; row += 4) {
                const SampleBand band = reader.read(window.y + row, std::min(4, window.height - row));
                EXPECT_EQ(band.offsets.size(), band.pixels() + 1);
                EXPECT_TRUE(std::is_sorted(band.offsets.begin(), band.offsets.end()));
                for (const auto& values : band.values) EXPECT_EQ(values.size(), band.samples());
            }
        } catch (const Error& error) {
            const std::string message = error.what();
            EXPECT_TRUE(message.starts_with(path_ + ": ")) << message;
            return message;
        }
        return {};
    }

    const ThreadLimit oneThread_{1};  // thousands of tiny reads would mostly wait for threads to wake up
    const TemporaryFolder folder_;
    const std::string path_ = folder_ / "bad.exr";
};

TEST_F(Malformed, EveryTruncationIsAnError) {
    for (const DumpCompression compression : kAllCompressions)
        for (const bool byOpenExr : {false, true}) {
            const Victim victim(compression, byOpenExr);
            ASSERT_EQ(outcome(victim.bytes), "");
            std::vector<std::size_t> sizes;
            for (std::size_t size = 0; size < victim.bytes.size(); size += kTruncationStep)
                sizes.push_back(size);
            // And around each chunk's borders, whatever the step.
            for (int row = 0; row < kWindow.height; ++row)
                for (const int by : {-1, 0, 1, 28, 32})
                    sizes.push_back(
                        static_cast<std::size_t>(static_cast<std::int64_t>(victim.chunk(row)) + by));
            sizes.push_back(victim.bytes.size() - 1);
            for (const std::size_t size : sizes)
                ASSERT_NE(
                    outcome({victim.bytes.begin(), victim.bytes.begin() + static_cast<std::ptrdiff_t>(size)}),
                    "")
                    << size << " of " << victim.bytes.size();
        }
}

TEST_F(Malformed, RandomDamageIsAnErrorOrABand) {
    std::mt19937 random(20240607);
    int errors = 0;
    for (const DumpCompression compression : kAllCompressions)
        for (const bool byOpenExr : {false, true}) {
            const Victim victim(compression, byOpenExr);
            for (int i = 0; i < kFlips / 2; ++i) {
                auto bytes = victim.bytes;
                for (unsigned n = 1 + random() % 4; n > 0; --n)
                    bytes[random() % bytes.size()] = static_cast<unsigned char>(random());
                if (!outcome(bytes).empty()) ++errors;
            }
        }
    EXPECT_GT(errors, kFlips);
}

// The header is a small part of a file: damage it as often as the rest.
TEST_F(Malformed, RandomDamageToTheHeader) {
    std::mt19937 random(5);
    const Victim victim(DumpCompression::Zips);
    for (int i = 0; i < kFlips; ++i) {
        auto bytes = victim.bytes;
        for (unsigned n = 1 + random() % 3; n > 0; --n)
            bytes[random() % victim.table(kWindow.height)] =
                static_cast<unsigned char>(random() % 3 == 0 ? 255 * (random() % 2) : random());
        outcome(bytes);
    }
}

TEST_F(Malformed, LyingChunksNameScanlineChunkAndReason) {
    const std::uint64_t claims[] = {0, 1, 2147483647, 2147483648, 1ull << 40, 1ull << 63, ~0ull};
    for (const DumpCompression compression : kAllCompressions) {
        const Victim victim(compression);
        const auto head = static_cast<std::size_t>(victim.chunk(6));
        for (const std::size_t field : {8, 16, 24})  // packed counts, packed samples, unpacked samples
            for (const std::uint64_t claim : claims) {
                auto bytes = victim.bytes;
                put(bytes, head + field, claim);
                const std::string message = outcome(bytes);
                EXPECT_NE(message.find("scanline 4 (chunk 6): "), std::string::npos)
                    << field << " claims " << claim << ": " << message;
            }
        for (const std::uint64_t claim : claims) {
            auto bytes = victim.bytes;
            put(bytes, victim.table(6), claim);
            EXPECT_NE(outcome(bytes).find("scanline 4 (chunk 6): "), std::string::npos) << claim;
        }
    }
}

TEST_F(Malformed, ChunksOfOtherRowsAndParts) {
    const Victim victim(DumpCompression::Zips);
    auto bytes = victim.bytes;
    put(bytes, victim.table(2), victim.chunk(3));
    EXPECT_NE(outcome(bytes).find("scanline 0 (chunk 2): damaged: found the chunk of scanline 1"),
              std::string::npos);

    bytes = victim.bytes;
    put(bytes, static_cast<std::size_t>(victim.chunk(2)), std::uint32_t{0});
    EXPECT_NE(outcome(bytes).find("expected a chunk of part 1, found part 0"), std::string::npos);

    bytes = victim.bytes;
    put(bytes, victim.table(2), std::uint64_t{0});
    EXPECT_NE(outcome(bytes).find("missing"), std::string::npos);
}

TEST_F(Malformed, DecreasingCountsAndWrongSums) {
    const Victim victim(DumpCompression::None);
    const auto counts = static_cast<std::size_t>(victim.chunk(1)) + 32;
    auto bytes = victim.bytes;
    put(bytes, counts + 8, std::uint32_t{100});  // more than the pixel after it
    EXPECT_NE(outcome(bytes).find("its sample counts decrease at column 6"), std::string::npos)
        << outcome(bytes);

    bytes = victim.bytes;
    put(bytes, counts + 4 * (kWindow.width - 1), std::uint32_t{100});
    EXPECT_NE(outcome(bytes).find("100 samples take"), std::string::npos) << outcome(bytes);

    bytes = victim.bytes;
    put(bytes, counts + 4 * (kWindow.width - 1), std::uint32_t{0xffffffff});
    EXPECT_NE(outcome(bytes), "");
}

TEST_F(Malformed, HugeWindowsAreRefusedWhenOpened) {
    for (const DumpCompression compression : kAllCompressions) {
        const Victim victim(compression);
        const std::size_t window = victim.attribute("dataWindow", "box2i");
        const auto claim = [&](int minX, int minY, int maxX, int maxY) {
            auto bytes = victim.bytes;
            put(bytes, window, minX);
            put(bytes, window + 4, minY);
            put(bytes, window + 8, maxX);
            put(bytes, window + 12, maxY);
            put(bytes, victim.attribute("chunkCount", "int"), maxY - minY + 1);
            writeBytes(path_, bytes);
            return errorOf([&] { DumpReader reader(path_); });
        };
        EXPECT_NE(claim(0, 0, 65535, 32767).find("65536 x 32768 pixels"), std::string::npos);
        EXPECT_NE(claim(0, 0, 0, kMostCoordinate).find("more than the file's"), std::string::npos);
        EXPECT_NE(claim(0, 0, kMostCoordinate, 0).find("more than the file's"), std::string::npos);
        // Further away OpenEXR would refuse what is made of it.
        for (const int far : {kMostCoordinate + 1, 2147483646})
            for (const std::string& message : {claim(far, 0, far, 0), claim(0, far, 0, far),
                                               claim(-far, 0, 1 - far, 0), claim(-far, 0, far, 0)})
                EXPECT_NE(message.find("data window of pixels within 2^30 of 0"), std::string::npos)
                    << message;
        EXPECT_NE(claim(5, 5, 4, 4), "");
    }
}

TEST_F(Malformed, LyingAttributeSizes) {
    const Victim victim(DumpCompression::Zips);
    for (const auto& [name, type] : {std::pair{"name", "string"},
                                     {"channels", "chlist"},
                                     {"dataWindow", "box2i"},
                                     {"variolux:version", "int"},
                                     {"compression", "compression"}})
        for (const std::uint32_t size : {0u, 3u, 5u, 100000u, 0x7fffffffu, 0xffffffffu}) {
            auto bytes = victim.bytes;
            put(bytes, victim.attribute(name, type) - 4, size);
            // What little is missing may be made up for by chance; what is beyond the file may not.
            const std::string message = outcome(bytes);
            if (size >= 100000) {
                EXPECT_NE(message.find("claims"), std::string::npos) << name << ": " << message;
            }
        }
}

// Chunks that share their bytes: together they would claim many times the file.
TEST_F(Malformed, OverlappingChunks) {
    const Victim victim(DumpCompression::None);
    auto bytes = victim.bytes;
    const std::uint64_t perSample = victim.header.bytesPerSample;
    const auto samples = static_cast<std::uint32_t>(20'000 / perSample);
    for (int row = 0; row < kWindow.height; ++row) {
        put(bytes, victim.table(row), std::uint64_t{bytes.size()});
        append(bytes, std::int32_t{victim.header.part});
        append(bytes, std::int32_t{kWindow.y + row});
        append(bytes, std::uint64_t{4 * kWindow.width});
        append(bytes, samples * perSample);
        append(bytes, samples * perSample);
        for (int x = 0; x < kWindow.width; ++x) append(bytes, samples);
    }
    bytes.resize(bytes.size() + 20'000);
    EXPECT_NE(outcome(bytes).find("overlap"), std::string::npos) << outcome(bytes);
}

TEST_F(Malformed, OtherVersionsOfDeepData) {
    const Victim victim(DumpCompression::Zips);
    auto bytes = victim.bytes;
    put(bytes, victim.attribute("version", "int"), std::int32_t{2});
    EXPECT_NE(outcome(bytes).find("version 2"), std::string::npos);
}

TEST_F(Malformed, NotADumpAtAll) {
    EXPECT_NE(outcome({}).find("expected an OpenEXR file"), std::string::npos);
    EXPECT_NE(outcome(std::vector<unsigned char>(1000, 0)).find("expected an OpenEXR file"),
              std::string::npos);
    EXPECT_NE(errorOf([&] { DumpReader reader(folder_ / "no.exr"); }).find("No such file"),
              std::string::npos);
    EXPECT_NE(errorOf([&] { DumpReader reader(folder_ / "."); }).find("regular file"), std::string::npos);
}

TEST_F(Malformed, FileThatShrinksWhileItIsRead) {
    const Victim victim(DumpCompression::Zips);
    writeBytes(path_, victim.bytes);
    const DumpReader reader(path_);
    std::filesystem::resize_file(path_, 3000);
    EXPECT_NE(errorOf([&] { reader.read(kWindow.y, kWindow.height); }).find("became shorter"),
              std::string::npos);
}

// Text for a terminal shows no control characters, JSON no broken UTF-8.
TEST_F(Malformed, HostileNamesAreShownSafely) {
    TestDump dump = makeDump(kWindow, mixedChannels(), kFew);
    dump.header.renderer = "\x1b[2J\xff\n";
    writeDump(path_, dump);
    const DumpInfo info = inspectDump(path_);
    const std::string text = toText(info);
    EXPECT_EQ(text.find('\x1b'), std::string::npos);
    EXPECT_EQ(toJson(info).find('\xff'), std::string::npos);
}

}  // namespace
}  // namespace vlx
