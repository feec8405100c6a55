#pragma once

#include <bit>
#include <cstdint>
#include <cstring>

#include "exr/chunk_codec.h"

namespace vlx {

// OpenEXR files are little-endian, and so are all processors that Variolux is built for.
static_assert(std::endian::native == std::endian::little);

inline std::uint32_t loadWord(const unsigned char* bytes) {
    std::uint32_t value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

inline std::uint64_t loadLong(const unsigned char* bytes) {
    std::uint64_t value;
    std::memcpy(&value, bytes, sizeof value);
    return value;
}

/// Adds the bytes of a number.
template <class T>
void append(Bytes& bytes, T value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof value);
    std::memcpy(bytes.data() + at, &value, sizeof value);
}

}  // namespace vlx
