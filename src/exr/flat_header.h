#pragma once

#include <string>

namespace vlx {

/// Whether a file is a flat image rather than a dump: one that is not OpenEXR, or OpenEXR without deep data.
/// False when it cannot be read.
bool isFlatImage(const std::string& path);

/// Checks the headers of an OpenEXR file before a library that trusts them sees them: attributes lie within
/// the file, windows have pixels, and the file is long enough for its tables of chunks and for its chunks
/// unpacked, at a ratio that no image reaches (2048, and 2^20 bytes more). Files of other formats pass.
/// Throws Error.
void checkFlatHeader(const std::string& path);

}  // namespace vlx
