#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "exr/chunk_codec.h"
#include "test_dumps.h"

namespace vlx {
namespace {

// Runs of random lengths and values: what run-length coding has its borders in.
Bytes runs(std::mt19937& random, std::size_t size) {
    Bytes bytes;
    while (bytes.size() < size) {
        const std::size_t length =
            std::min<std::size_t>(1 + random() % (random() % 3 == 0 ? 400 : 4), size - bytes.size());
        bytes.insert(bytes.end(), length, static_cast<unsigned char>(random()));
    }
    return bytes;
}

TEST(ChunkCodec, GivesBackEveryBlock) {
    std::mt19937 random(7);
    for (const DumpCompression compression : kAllCompressions) {
        Packer packer(compression);
        Unpacker unpacker(compression);
        for (std::size_t size = 0; size < 700; ++size) {
            const Bytes raw = runs(random, size);
            const auto packed = packer.pack(raw);
            ASSERT_LE(packed.size(), raw.size());
            const auto back = unpacker.unpack(packed, raw.size());
            ASSERT_TRUE(back.has_value()) << size;
            ASSERT_TRUE(std::equal(back->begin(), back->end(), raw.begin(), raw.end())) << size;
        }
    }
}

TEST(ChunkCodec, ConstantBlocksShrinkWithinTheStatedBound) {
    for (const DumpCompression compression : {DumpCompression::Rle, DumpCompression::Zips}) {
        const Bytes raw(1 << 20, 0);
        Packer packer(compression);
        const std::size_t packed = packer.pack(raw).size();
        EXPECT_LT(packed, raw.size() / 50);
        EXPECT_GE(maxRawBytes(compression, packed), raw.size());
    }
    EXPECT_EQ(maxRawBytes(DumpCompression::Zips, ~std::uint64_t{0} / 2), ~std::uint64_t{0});
}

TEST(ChunkCodec, RefusesWhatDoesNotUnpackToTheClaimedSize) {
    std::mt19937 random(3);
    for (const DumpCompression compression : {DumpCompression::Rle, DumpCompression::Zips}) {
        Packer packer(compression);
        Unpacker unpacker(compression);
        const Bytes raw(5000, 17);
        const auto packed = packer.pack(raw);
        for (const std::size_t wrong : {4999, 5001, 4000, 100000})
            EXPECT_FALSE(unpacker.unpack(packed, wrong).has_value());
        EXPECT_FALSE(unpacker.unpack(packed.first(packed.size() - 1), raw.size()).has_value());
        EXPECT_TRUE(unpacker.unpack(packed, raw.size()).has_value())
            << "a failure must not spoil what follows";
        // Garbage is refused, or gives bytes; it never reads or writes out of bounds (for the sanitizers).
        for (int i = 0; i < 3000; ++i) {
            Bytes garbage(1 + random() % 60);
            for (auto& byte : garbage) byte = static_cast<unsigned char>(random());
            unpacker.unpack(garbage, 61 + random() % 300);
        }
    }
}

}  // namespace
}  // namespace vlx
