// How much memory reading and writing take, counted in the allocator.

#include <gtest/gtest.h>
#include <malloc.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <new>
#include <random>

#include "../base/temporary_folder.h"
#include "dump/exr_header.h"
#include "edit/info.h"
#include "exr/little_endian.h"
#include "test_dumps.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace {

std::atomic<std::int64_t> live{0};
std::atomic<std::int64_t> peak{0};

void* countedAllocation(std::size_t size) {
    void* block = std::malloc(size);
    if (block == nullptr) throw std::bad_alloc();
    const std::int64_t now = live += static_cast<std::int64_t>(::malloc_usable_size(block));
    std::int64_t before = peak;
    while (now > before && !peak.compare_exchange_weak(before, now)) {
    }
    return block;
}

void countedRelease(void* block) {
    if (block != nullptr) live -= static_cast<std::int64_t>(::malloc_usable_size(block));
    std::free(block);
}

}  // namespace

void* operator new(std::size_t size) { return countedAllocation(size); }
void* operator new[](std::size_t size) { return countedAllocation(size); }
void operator delete(void* block) noexcept { countedRelease(block); }
void operator delete[](void* block) noexcept { countedRelease(block); }
void operator delete(void* block, std::size_t) noexcept { countedRelease(block); }
void operator delete[](void* block, std::size_t) noexcept { countedRelease(block); }

namespace vlx {
namespace {

// The most that `action` held at once, in bytes.
template <class Action>
std::int64_t peakOf(const Action& action) {
    const std::int64_t before = live;
    peak = before;
    action();
    return peak - before;
}

TEST(DumpMemory, DoesNotGrowWithTheHeight) {
    const TemporaryFolder folder;
    const ThreadLimit oneThread(1);  // every further one has its own scratch
    std::int64_t writing[2], reading[2];
    const int heights[2] = {64, 2048};
    for (int i = 0; i < 2; ++i) {
        DumpHeader header = makeDump({0, 0, 32, 8}, standardChannels(), [](int, int) { return 6; }).header;
        header.data.height = header.display.height = heights[i];
        writing[i] = peakOf([&] {
            DumpWriter writer(folder / "a.exr", header);
            for (int row = 0; row < heights[i]; row += 8)
                writer.write(makeDump({0, row, 32, 8}, standardChannels(), [](int, int) { return 6; }).all);
            writer.close();
        });
        reading[i] = peakOf([&] { inspectDump(folder / "a.exr"); });
    }
    // How many bands wait in the queue is a matter of luck: at most two, one more in work, one in the making.
    const std::int64_t band = peakOf([] {
        makeDump({0, 0, 32, 8}, standardChannels(), [](int, int) { return 6; });
    });
    EXPECT_LT(writing[1], 6 * band);
    EXPECT_LT(reading[1], reading[0] + 20'000);
}

// 32 times the samples are read from the second file; a whole image would show.
TEST(DumpMemory, OfABandIsThatOfItsSamples) {
    const TemporaryFolder folder;
    const ThreadLimit oneThread(1);
    const TestDump dump = makeDump({0, 0, 40, 64}, standardChannels(), [](int, int) { return 10; });
    writeDump(folder / "a.exr", dump);
    const DumpReader reader(folder / "a.exr");
    for (const int rows : {1, 8, 64}) {
        const std::int64_t samples = std::int64_t{40} * 10 * rows;
        const std::int64_t needed = peakOf([&] { reader.read(0, rows, {"R", "G", "B"}); });
        EXPECT_GT(needed, samples * 12);
        // Beside the values: offsets, counts, and two rows' bytes as scratch.
        EXPECT_LT(needed, samples * 12 + std::int64_t{40} * rows * 16 + 120'000);
    }
}

TEST(DumpMemory, ClaimsAreRefusedBeforeMemoryIsTaken) {
    const TemporaryFolder folder;
    for (const DumpCompression compression :
         {DumpCompression::None, DumpCompression::Rle, DumpCompression::Zips}) {
        TestDump dump = makeDump({0, 0, 11, 9}, mixedChannels(), [](int, int) { return 3; });
        dump.header.compression = compression;
        writeDump(folder / "a.exr", dump);
        const auto whole = fileBytes(folder / "a.exr");
        const FileHeader header = decodeHeader("a.exr", whole, whole.size()).value();
        std::uint64_t chunk = 0;
        std::memcpy(&chunk, whole.data() + header.chunkTable, 8);
        const auto peakWith = [&](std::size_t at, const void* value, std::size_t size) {
            auto bytes = whole;
            std::memcpy(bytes.data() + at, value, size);
            writeBytes(folder / "a.exr", bytes);
            return peakOf([&] { EXPECT_NE(errorOf([&] { DumpReader(folder / "a.exr").read(0, 9); }), ""); });
        };
        // Each of a chunk's three sizes claims two gigabytes.
        const std::uint64_t twoGigabytes = 2147483640;
        for (const std::size_t field : {8, 16, 24})
            EXPECT_LT(peakWith(chunk + field, &twoGigabytes, 8), 300'000);
        // The data window claims 2^31 pixels: the last one in the header is the deep part's.
        const std::string pattern = std::string("dataWindow") + '\0' + "box2i" + '\0';
        const auto found = std::find_end(whole.begin(), whole.end(), pattern.begin(), pattern.end());
        const std::int32_t window[4] = {0, 0, 238609293, 8};
        EXPECT_LT(peakWith(static_cast<std::size_t>(found - whole.begin()) + pattern.size() + 4, window, 16),
                  300'000);
        // An attribute claims as much.
        EXPECT_LT(
            peakWith(static_cast<std::size_t>(found - whole.begin()) + pattern.size(), &twoGigabytes, 4),
            300'000);
    }
}

// A chunk whose numbers all agree with each other, on two gigabytes of samples in ten bytes.
TEST(DumpMemory, ConsistentLiesAreRefusedToo) {
    const TemporaryFolder folder;
    for (const DumpCompression compression :
         {DumpCompression::None, DumpCompression::Rle, DumpCompression::Zips}) {
        TestDump dump = makeDump({0, 0, 11, 9}, mixedChannels(), [](int, int) { return 3; });
        dump.header.compression = compression;
        writeDump(folder / "a.exr", dump);
        auto bytes = fileBytes(folder / "a.exr");
        const FileHeader header = decodeHeader("a.exr", bytes, bytes.size()).value();

        const auto samples = static_cast<std::uint32_t>(2'000'000'000 / header.bytesPerSample);
        Bytes counts;
        for (int x = 0; x < 11; ++x) append(counts, samples);
        Packer packer(compression);
        const auto packed = packer.pack(counts);
        const std::uint64_t end = bytes.size();
        append(bytes, std::int32_t{header.part});
        append(bytes, std::int32_t{0});
        append(bytes, std::uint64_t{packed.size()});
        append(bytes, std::uint64_t{10});
        append(bytes, std::uint64_t{samples} * header.bytesPerSample);
        bytes.insert(bytes.end(), packed.begin(), packed.end());
        bytes.insert(bytes.end(), 10, 0);
        std::memcpy(bytes.data() + header.chunkTable, &end, 8);
        writeBytes(folder / "a.exr", bytes);

        std::string message;
        const std::int64_t needed =
            peakOf([&] { message = errorOf([&] { DumpReader(folder / "a.exr").read(0, 1); }); });
        EXPECT_NE(message.find("10 bytes cannot unpack to"), std::string::npos) << message;
        EXPECT_LT(needed, 300'000);
    }
}

TEST(DumpMemory, DamagedFilesNeverTakeMuch) {
    const ThreadLimit oneThread(1);
    const TemporaryFolder folder;
    std::mt19937 random(11);
    TestDump dump = makeDump({0, 0, 11, 9}, mixedChannels(), [](int, int) { return 3; });
    writeDump(folder / "a.exr", dump);
    const auto whole = fileBytes(folder / "a.exr");
#ifdef VARIOLUX_SANITIZED
    const int attempts = 500;
#else
    const int attempts = 5000;
#endif
    std::int64_t worst = 0;
    for (int i = 0; i < attempts; ++i) {
        auto bytes = whole;
        for (int n = 0; n < 3; ++n) bytes[random() % bytes.size()] = static_cast<unsigned char>(random());
        writeBytes(folder / "b.exr", bytes);
        worst = std::max(worst, peakOf([&] {
                             try {
                                 const DumpReader reader(folder / "b.exr");
                                 reader.read(reader.header().data.y, reader.header().data.height);
                             } catch (const Error&) {
                             }
                         }));
    }
    // No file can claim more than what its bytes might unpack to.
    EXPECT_LT(worst, static_cast<std::int64_t>(whole.size()) * 1032 * 4);
}

}  // namespace
}  // namespace vlx
