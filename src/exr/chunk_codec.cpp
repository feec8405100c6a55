#include "exr/chunk_codec.h"

#include <zlib.h>

#include <algorithm>
#include <limits>
#include <new>

namespace vlx {

namespace {

using Span = std::span<const unsigned char>;

void atLeast(Bytes& bytes, std::size_t size) {
    if (bytes.size() < size) bytes.resize(size);
}

// Bytes of equal significance side by side: samples compress better so.
void separate(Span raw, unsigned char* to) {
    const std::size_t half = (raw.size() + 1) / 2;
    for (std::size_t i = 0; i < raw.size() / 2; ++i) to[i] = raw[2 * i];
    for (std::size_t i = 0; i < raw.size() / 2; ++i) to[half + i] = raw[2 * i + 1];
    if (raw.size() % 2 != 0) to[half - 1] = raw.back();
}

void join(Span separated, unsigned char* to) {
    const std::size_t half = (separated.size() + 1) / 2;
    for (std::size_t i = 0; i < separated.size() / 2; ++i) {
        to[2 * i] = separated[i];
        to[2 * i + 1] = separated[half + i];
    }
    if (separated.size() % 2 != 0) to[separated.size() - 1] = separated[half - 1];
}

void differentiate(Span values, unsigned char* to) {
    if (!values.empty()) to[0] = values[0];
    for (std::size_t i = 1; i < values.size(); ++i)
        to[i] = static_cast<unsigned char>(values[i] - values[i - 1] + 128);
}

void integrate(std::span<unsigned char> values) {
    for (std::size_t i = 1; i < values.size(); ++i)
        values[i] = static_cast<unsigned char>(values[i - 1] + values[i] - 128);
}

// OpenEXR's run lengths: a byte c < 128 says that the next byte stands c + 1 times, c >= 128 that the next
// 256 - c bytes stand for themselves.
constexpr std::size_t kMinRun = 3;
constexpr std::size_t kMaxRun = 128;
constexpr std::size_t kMaxLiteral = 127;

std::size_t runBound(std::size_t size) { return size + size / kMaxLiteral + 1; }

// Returns the number of bytes written.
std::size_t encodeRuns(Span data, unsigned char* to) {
    const unsigned char* const start = to;
    std::size_t literal = 0;  // first byte that stands for itself
    const auto flush = [&](std::size_t end) {
        while (literal < end) {
            const std::size_t count = std::min(end - literal, kMaxLiteral);
            *to++ = static_cast<unsigned char>(256 - count);
            to = std::copy_n(data.data() + literal, count, to);
            literal += count;
        }
    };
    for (std::size_t begin = 0; begin < data.size();) {
        std::size_t end = begin + 1;
        while (end < data.size() && data[end] == data[begin] && end - begin < kMaxRun) ++end;
        if (end - begin >= kMinRun) {
            flush(begin);
            *to++ = static_cast<unsigned char>(end - begin - 1);
            *to++ = data[begin];
            literal = end;
        }
        begin = end;
    }
    flush(data.size());
    return static_cast<std::size_t>(to - start);
}

bool decodeRuns(Span packed, std::span<unsigned char> to) {
    std::size_t done = 0;
    for (std::size_t i = 0; i < packed.size();) {
        const std::size_t code = packed[i++];
        const bool literal = code >= 128;
        const std::size_t length = literal ? 256 - code : code + 1;
        const std::size_t taken = literal ? length : 1;
        if (length > to.size() - done || taken > packed.size() - i) return false;
        if (literal)
            std::copy_n(packed.data() + i, length, to.data() + done);
        else
            std::fill_n(to.data() + done, length, packed[i]);
        i += taken;
        done += length;
    }
    return done == to.size();
}

}  // namespace

std::uint64_t maxRawBytes(DumpCompression compression, std::uint64_t packedBytes) {
    std::uint64_t ratio = 1;
    if (compression == DumpCompression::Rle) ratio = 64;     // two bytes for a run of 128
    if (compression == DumpCompression::Zips) ratio = 1032;  // two bits for a match of 258 bytes
    constexpr std::uint64_t limit = std::numeric_limits<std::uint64_t>::max();
    return packedBytes > limit / ratio ? limit : packedBytes * ratio;
}

Packer::Packer(DumpCompression compression) : compression_(compression) {
    if (compression_ != DumpCompression::Zips) return;
    // Samples hold hardly any repeated strings, but runs of equal differences: looking only for runs takes
    // less than half of the time of zlib's level 1, for files a few per cent larger.
    stream_ = std::make_unique<z_stream>();
    if (deflateInit2(stream_.get(), 1, Z_DEFLATED, 15, 8, Z_RLE) != Z_OK) throw std::bad_alloc();
}

Packer::~Packer() {
    if (stream_) deflateEnd(stream_.get());
}

Span Packer::pack(Span raw) {
    if (compression_ == DumpCompression::None || raw.empty()) return raw;
    atLeast(separated_, raw.size());
    atLeast(differences_, raw.size());
    separate(raw, separated_.data());
    differentiate({separated_.data(), raw.size()}, differences_.data());
    std::size_t size = 0;
    if (stream_) {
        // What does not fit is not smaller than `raw`.
        atLeast(packed_, raw.size());
        deflateReset(stream_.get());
        stream_->next_in = differences_.data();
        stream_->avail_in = static_cast<uInt>(raw.size());
        stream_->next_out = packed_.data();
        stream_->avail_out = static_cast<uInt>(raw.size());
        if (deflate(stream_.get(), Z_FINISH) != Z_STREAM_END) return raw;
        size = stream_->total_out;
    } else {
        atLeast(packed_, runBound(raw.size()));
        size = encodeRuns({differences_.data(), raw.size()}, packed_.data());
    }
    return size < raw.size() ? Span(packed_.data(), size) : raw;
}

Unpacker::Unpacker(DumpCompression compression) : compression_(compression) {
    if (compression_ != DumpCompression::Zips) return;
    stream_ = std::make_unique<z_stream>();
    if (inflateInit(stream_.get()) != Z_OK) throw std::bad_alloc();
}

Unpacker::~Unpacker() {
    if (stream_) inflateEnd(stream_.get());
}

std::optional<Span> Unpacker::unpack(Span packed, std::size_t rawBytes) {
    if (packed.size() == rawBytes) return packed;
    if (compression_ == DumpCompression::None || packed.size() > rawBytes) return std::nullopt;
    atLeast(differences_, rawBytes);
    atLeast(raw_, rawBytes);
    const std::span<unsigned char> differences(differences_.data(), rawBytes);
    if (stream_) {
        inflateReset(stream_.get());
        stream_->next_in = const_cast<unsigned char*>(packed.data());  // zlib only reads it
        stream_->avail_in = static_cast<uInt>(packed.size());
        stream_->next_out = differences.data();
        stream_->avail_out = static_cast<uInt>(rawBytes);
        if (inflate(stream_.get(), Z_FINISH) != Z_STREAM_END || stream_->total_out != rawBytes)
            return std::nullopt;
    } else if (!decodeRuns(packed, differences)) {
        return std::nullopt;
    }
    integrate(differences);
    join(differences, raw_.data());
    return Span(raw_.data(), rawBytes);
}

}  // namespace vlx
