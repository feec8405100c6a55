#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "exr/chunk_codec.h"
#include "variolux/dump/format.h"

namespace vlx {

/// What stands before the chunks of an OpenEXR file that holds a dump.
struct FileHeader {
    DumpHeader dump;                   ///< channels in the file's order, which is by name
    bool multiPart = false;            ///< chunks start with their part's number
    int part = 0;                      ///< number of the deep part
    std::uint64_t chunkTable = 0;      ///< where the deep part's table of chunk positions is in the file
    std::uint64_t bytesPerSample = 0;  ///< of all channels together
    int splatPart = 0;                 ///< number of the part `splats`, when dump.splatReplicates > 0,
    std::uint64_t splatTable = 0;      ///< and where its table is
};

/// Reads the header of the file that starts with `start` and is `fileBytes` long. Returns nothing when the
/// header goes on after `start`; throws Error when it is not a deep scanline file's, or claims more than
/// `fileBytes` can hold.
std::optional<FileHeader> decodeHeader(const std::string& path, const Bytes& start, std::uint64_t fileBytes);

/// The bytes before the first chunk table, and where in them stands what is known only at the end.
struct EncodedHeader {
    Bytes bytes;
    std::size_t renderSeconds = 0;       ///< an IEEE double
    std::size_t maxSamplesPerPixel = 0;  ///< a 32-bit integer
};

/// Throws Error when no dump can have this header: windows, names of channels, what splats and matrices need.
void checkHeader(const std::string& path, const DumpHeader& header);

/// Header of the file that DumpWriter writes, for the header `dump` with its channels sorted by
/// name. Throws Error on what cannot be written.
EncodedHeader encodeHeader(const std::string& path, const DumpHeader& dump);

/// Names of the channels of the flat part that `dump` gets, sorted.
std::vector<std::string> beautyChannels(const DumpHeader& dump);

/// Bytes of a chunk before its data: part number, row, and sizes.
constexpr std::size_t kDeepChunkHead = 4 + 3 * 8;  ///< without the part number
constexpr std::size_t kPartNumber = 4;

}  // namespace vlx
