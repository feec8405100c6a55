#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "variolux/base/channel_type.h"

struct z_stream_s;  // of zlib

namespace vlx {

using Bytes = std::vector<unsigned char>;

/// Bytes of one value in the file.
constexpr std::size_t valueBytes(ChannelType type) { return type == ChannelType::Half ? 2 : 4; }

/// The most bytes that `packedBytes` bytes can stand for: what larger claims are refused by before memory is
/// asked for.
std::uint64_t maxRawBytes(DumpCompression compression, std::uint64_t packedBytes);

/// Compresses the pixel data or the sample counts of a chunk as OpenEXR does: the even bytes, then the odd
/// ones, each less its predecessor, then run lengths (RLE) or a zlib stream (ZIPS). Keeps its memory from
/// chunk to chunk: fresh pages for each would cost as much as the compression. One thread at a time.
class Packer {
  public:
    explicit Packer(DumpCompression compression);
    ~Packer();
    Packer(const Packer&) = delete;
    Packer& operator=(const Packer&) = delete;

    /// Packed bytes, valid until the next call; `raw` itself when compression does not make it smaller, which
    /// is OpenEXR's mark of uncompressed data.
    std::span<const unsigned char> pack(std::span<const unsigned char> raw);

  private:
    const DumpCompression compression_;
    std::unique_ptr<z_stream_s> stream_;
    Bytes separated_, differences_, packed_;
};

/// The inverse of Packer.
class Unpacker {
  public:
    explicit Unpacker(DumpCompression compression);
    ~Unpacker();
    Unpacker(const Unpacker&) = delete;
    Unpacker& operator=(const Unpacker&) = delete;

    /// Exactly `rawBytes` bytes, valid until the next call (`packed` itself when it is of that size), or
    /// nothing when the data is corrupt or of another size.
    std::optional<std::span<const unsigned char>> unpack(std::span<const unsigned char> packed,
                                                         std::size_t rawBytes);

  private:
    const DumpCompression compression_;
    std::unique_ptr<z_stream_s> stream_;
    Bytes differences_, raw_;
};

}  // namespace vlx
