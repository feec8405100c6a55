#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "variolux/dump/format.h"

namespace vlx {

using Bytes = std::vector<unsigned char>;

/// Bytes of one value in the file.
constexpr std::size_t valueBytes(ChannelType type) { return type == ChannelType::Half ? 2 : 4; }

/// Compresses the pixel data or the sample counts of a chunk as OpenEXR does: the even bytes, then the odd
/// ones, each less its predecessor, then run lengths (RLE) or a zlib stream (ZIPS). Returns the input when
/// compression does not make it smaller, which is OpenEXR's mark of uncompressed data.
Bytes pack(DumpCompression compression, Bytes raw);

/// The inverse: exactly `rawBytes` bytes, or nothing when the data is corrupt or of another size.
std::optional<Bytes> unpack(DumpCompression compression, Bytes packed, std::size_t rawBytes);

/// The most bytes that `packedBytes` bytes can stand for: what larger claims are refused by before memory is
/// asked for.
std::uint64_t maxRawBytes(DumpCompression compression, std::uint64_t packedBytes);

}  // namespace vlx
