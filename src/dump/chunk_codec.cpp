#include "chunk_codec.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>

namespace vlx {

namespace {

// Bytes of equal significance side by side, then differences: both make samples compress better.
Bytes separate(const Bytes& raw) {
    const std::size_t half = (raw.size() + 1) / 2;
    Bytes out(raw.size());
    for (std::size_t i = 0; i < raw.size() / 2; ++i) {
        out[i] = raw[2 * i];
        out[half + i] = raw[2 * i + 1];
    }
    if (raw.size() % 2 != 0) out[half - 1] = raw.back();
    unsigned char previous = out.empty() ? 0 : out[0];
    for (std::size_t i = 1; i < out.size(); ++i) {
        const unsigned char current = out[i];
        out[i] = static_cast<unsigned char>(current - previous + 128);
        previous = current;
    }
    return out;
}

Bytes join(Bytes separated) {
    for (std::size_t i = 1; i < separated.size(); ++i)
        separated[i] = static_cast<unsigned char>(separated[i - 1] + separated[i] - 128);
    const std::size_t half = (separated.size() + 1) / 2;
    Bytes raw(separated.size());
    for (std::size_t i = 0; i < raw.size() / 2; ++i) {
        raw[2 * i] = separated[i];
        raw[2 * i + 1] = separated[half + i];
    }
    if (raw.size() % 2 != 0) raw.back() = separated[half - 1];
    return raw;
}

// Samples hold hardly any repeated strings, but runs of equal differences: looking only for runs costs less
// than half of zlib's level 1 and gives files within a few per cent of its size (README, "Sample dumps").
Bytes deflateRuns(const Bytes& data) {
    z_stream stream{};
    if (deflateInit2(&stream, 1, Z_DEFLATED, 15, 8, Z_RLE) != Z_OK) throw std::bad_alloc();
    Bytes out(deflateBound(&stream, data.size()));
    stream.next_in = const_cast<unsigned char*>(data.data());
    stream.avail_in = static_cast<uInt>(data.size());
    stream.next_out = out.data();
    stream.avail_out = static_cast<uInt>(out.size());
    deflate(&stream, Z_FINISH);
    out.resize(stream.total_out);
    deflateEnd(&stream);
    return out;
}

std::optional<Bytes> inflateAll(const Bytes& packed, std::size_t rawBytes) {
    Bytes out(rawBytes);
    z_stream stream{};
    if (inflateInit(&stream) != Z_OK) throw std::bad_alloc();
    stream.next_in = const_cast<unsigned char*>(packed.data());
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = out.data();
    stream.avail_out = static_cast<uInt>(out.size());
    const int status = inflate(&stream, Z_FINISH);
    const bool whole = status == Z_STREAM_END && stream.total_out == rawBytes;
    inflateEnd(&stream);
    if (!whole) return std::nullopt;
    return out;
}

// OpenEXR's run lengths: a count byte c >= 0 says that the next byte stands c + 1 times, c < 0 that the next
// -c bytes stand for themselves.
constexpr std::size_t kMinRun = 3;
constexpr std::size_t kMaxRun = 127;

Bytes encodeRuns(const Bytes& data) {
    Bytes out;
    out.reserve(data.size());
    std::size_t literal = 0;  // start of the bytes that stand for themselves
    const auto flush = [&](std::size_t end) {
        while (literal < end) {
            const std::size_t count = std::min(end - literal, kMaxRun);
            out.push_back(static_cast<unsigned char>(256 - count));
            out.insert(out.end(), data.begin() + static_cast<std::ptrdiff_t>(literal),
                       data.begin() + static_cast<std::ptrdiff_t>(literal + count));
            literal += count;
        }
    };
    for (std::size_t begin = 0; begin < data.size();) {
        std::size_t end = begin + 1;
        while (end < data.size() && data[end] == data[begin] && end - begin < kMaxRun + 1) ++end;
        if (end - begin >= kMinRun) {
            flush(begin);
            out.push_back(static_cast<unsigned char>(end - begin - 1));
            out.push_back(data[begin]);
            literal = end;
        }
        begin = end;
    }
    flush(data.size());
    return out;
}

std::optional<Bytes> decodeRuns(const Bytes& packed, std::size_t rawBytes) {
    Bytes out(rawBytes);
    std::size_t done = 0;
    for (std::size_t i = 0; i < packed.size();) {
        const int count = static_cast<signed char>(packed[i++]);
        const auto length = static_cast<std::size_t>(count < 0 ? -count : count + 1);
        const std::size_t taken = count < 0 ? length : 1;
        if (length > rawBytes - done || taken > packed.size() - i) return std::nullopt;
        if (count < 0)
            std::copy_n(packed.data() + i, length, out.data() + done);
        else
            std::fill_n(out.data() + done, length, packed[i]);
        i += taken;
        done += length;
    }
    if (done != rawBytes) return std::nullopt;
    return out;
}

}  // namespace

Bytes pack(DumpCompression compression, Bytes raw) {
    if (compression == DumpCompression::None || raw.empty()) return raw;
    const Bytes separated = separate(raw);
    Bytes packed = compression == DumpCompression::Rle ? encodeRuns(separated) : deflateRuns(separated);
    return packed.size() < raw.size() ? packed : raw;
}

std::optional<Bytes> unpack(DumpCompression compression, Bytes packed, std::size_t rawBytes) {
    if (packed.size() == rawBytes) return packed;
    if (compression == DumpCompression::None || packed.size() > rawBytes) return std::nullopt;
    auto separated =
        compression == DumpCompression::Rle ? decodeRuns(packed, rawBytes) : inflateAll(packed, rawBytes);
    if (!separated) return std::nullopt;
    return join(std::move(*separated));
}

std::uint64_t maxRawBytes(DumpCompression compression, std::uint64_t packedBytes) {
    std::uint64_t ratio = 1;
    if (compression == DumpCompression::Rle) ratio = 64;     // two bytes for a run of 128
    if (compression == DumpCompression::Zips) ratio = 1032;  // two bits for a match of 258 bytes
    constexpr std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
    return packedBytes > limit / ratio ? limit : packedBytes * ratio;
}

}  // namespace vlx
