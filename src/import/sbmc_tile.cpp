#include "import/sbmc_tile.h"

#include <lz4frame.h>

#include <array>
#include <cstring>
#include <memory>

#include "exr/raw_file.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

constexpr std::uint64_t kHeaderBytes = 9 * 4 + 4 * 4 + 2 * 4;
// What LZ4 can make of a byte: a match of 255 more bytes.
constexpr std::uint64_t kMostUnpacked = 255;
constexpr std::int32_t kMaxTile = 4096;
constexpr std::int32_t kMaxSide = 1 << 16;

struct FreeContext {
    void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};

// Reads the blocks of a tile one after the other.
class Blocks {
  public:
    explicit Blocks(const RawFile& file) : file_(file), size_(file.size()) {
        LZ4F_dctx* context = nullptr;
        if (LZ4F_isError(LZ4F_createDecompressionContext(&context, LZ4F_VERSION))) throw std::bad_alloc();
        context_.reset(context);
    }

    // Skips a block without unpacking it.
    void skip() { position_ += blockBytes(); }

    // Unpacks a block, which must have exactly `bytes` bytes.
    const std::vector<unsigned char>& read(std::uint64_t bytes) {
        const std::uint64_t packed = blockBytes();
        if (bytes > packed * kMostUnpacked)
            damaged("claims " + std::to_string(bytes) + " bytes in " + std::to_string(packed) +
                    " packed ones, more than LZ4 can hold");
        packed_.resize(packed);
        file_.readAt(position_, packed_);
        position_ += packed;
        unpacked_.resize(bytes);

        LZ4F_resetDecompressionContext(context_.get());
        std::size_t from = 0, to = 0, more = 1;
        while (more != 0 && from < packed_.size()) {
            std::size_t taken = packed_.size() - from, made = unpacked_.size() - to;
            more = LZ4F_decompress(context_.get(), unpacked_.data() + to, &made, packed_.data() + from,
                                   &taken, nullptr);
            if (LZ4F_isError(more)) damaged(std::string("is not an LZ4 frame: ") + LZ4F_getErrorName(more));
            from += taken;
            to += made;
            if (taken == 0 && made == 0) break;
        }
        if (more != 0 || to != unpacked_.size())
            damaged("does not unpack to the " + std::to_string(bytes) + " bytes that the header says");
        ++number_;
        return unpacked_;
    }

  private:
    // Bytes of the block that comes next; afterwards the position is its frame's.
    std::uint64_t blockBytes() {
        std::array<unsigned char, 4> bytes{};
        if (position_ + bytes.size() > size_) damaged("is missing: the file ends");
        file_.readAt(position_, bytes);
        position_ += bytes.size();
        std::int32_t packed = 0;
        std::memcpy(&packed, bytes.data(), sizeof packed);
        if (packed < 1 || std::uint64_t(packed) > size_ - position_)
            damaged("claims " + std::to_string(packed) + " bytes, found " +
                    std::to_string(size_ - position_));
        return std::uint64_t(packed);
    }

    [[noreturn]] void damaged(const std::string& what) const {
        throw Error(file_.name(), "block " + std::to_string(number_) + " " + what);
    }

    const RawFile& file_;
    const std::uint64_t size_;
    std::uint64_t position_ = kHeaderBytes;
    int number_ = 1;  // 0 is the reference
    std::unique_ptr<LZ4F_dctx, FreeContext> context_;
    std::vector<unsigned char> packed_, unpacked_;
};

}  // namespace

SbmcTileHeader readSbmcHeader(const std::string& path) {
    const RawFile file(path, path, RawFile::Mode::Read);
    std::array<unsigned char, kHeaderBytes> bytes{};
    if (file.size() < bytes.size())
        throw Error(path, "expected a sample file of SBMC, found " + std::to_string(file.size()) +
                              " bytes, fewer than its header's " + std::to_string(kHeaderBytes));
    file.readAt(0, bytes);
    std::array<std::int32_t, 9> words{};
    std::memcpy(words.data(), bytes.data(), sizeof words);
    SbmcTileHeader header{words[0], words[1], words[2], words[3], words[4], words[5],
                          words[6], words[7], words[8], 0,        0};
    std::memcpy(&header.x, bytes.data() + 52, 4);
    std::memcpy(&header.y, bytes.data() + 56, 4);
    if (header.version != 20181212 && header.version != 20190401)
        throw Error(path, "expected a sample file of SBMC, version 20181212 or 20190401, found version " +
                              std::to_string(header.version));
    const auto check = [&](const char* what, std::int32_t value, std::int32_t least, std::int32_t most) {
        if (value < least || value > most)
            throw Error(path, std::string("expected ") + what + " of " + std::to_string(least) + " to " +
                                  std::to_string(most) + ", found " + std::to_string(value));
    };
    check("a tile size", header.tileSize, 1, kMaxTile);
    check("a width", header.width, 1, kMaxSide);
    check("a height", header.height, 1, kMaxSide);
    check("a number of samples", header.samples, 1, 1 << 16);
    check("a number of features of a sample", header.sampleFeatures, kSbmcFeatures, 1024);
    check("a number of features of a pixel", header.pixelFeatures, 1, 1024);
    check("a path depth", header.pathDepth, 0, 256);
    check("a column of the tile", header.x, 0, header.width - 1);
    check("a row of the tile", header.y, 0, header.height - 1);
    return header;
}

std::vector<float> readSbmcSamples(const std::string& path, const SbmcTileHeader& header) {
    const RawFile file(path, path, RawFile::Mode::Read);
    Blocks blocks(file);
    blocks.skip();
    const std::uint64_t pixels = std::uint64_t(header.tileSize) * std::uint64_t(header.tileSize);
    const std::uint64_t depth = std::uint64_t(header.pathDepth);
    const std::uint64_t bytes =
        pixels * (4 * std::uint64_t(header.sampleFeatures) + 4 * 4 * depth + 4 * 2 * depth + 2 * depth);
    const std::uint64_t kept = pixels * kSbmcFeatures;
    std::vector<float> values;
    for (int sample = 0; sample < header.samples; ++sample) {
        const auto& block = blocks.read(bytes);
        values.resize(values.size() + kept);
        std::memcpy(values.data() + values.size() - kept, block.data(), 4 * kept);
    }
    return values;
}

}  // namespace vlx
