#include "variolux/dump/reader.h"

#include <Imath/half.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <exception>
#include <functional>
#include <limits>

#include "dump/exr_header.h"
#include "dump/pool.h"
#include "dump/stored_values.h"
#include "exr/little_endian.h"
#include "exr/raw_file.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/splats.h"

// Why not OpenEXR's own reading classes: they want a table of pointers to every pixel of the image in every
// channel, before anything in the file has been checked, and are slower (tests/bench/dump_bench.cpp).
// Attributes do go through OpenEXR.

namespace vlx {

namespace {

constexpr std::size_t kFirstRead = 64 << 10;
constexpr std::size_t kMaxHeader = 64 << 20;
constexpr std::uint64_t kMaxInt = std::numeric_limits<std::int32_t>::max();

// A chunk whose head has been checked against the file.
struct Chunk {
    int y = 0;
    std::uint64_t counts = 0;  // position of the packed sample counts; the packed samples follow
    std::uint64_t countsBytes = 0;
    std::uint64_t packedBytes = 0;
    std::uint64_t rawBytes = 0;
    std::vector<std::uint32_t> ends;  // running sum of the pixels' sample counts
    std::uint64_t samples() const { return ends.back(); }
};

// Memory of a task.
struct Scratch {
    explicit Scratch(DumpCompression compression) : unpacker(compression) {}
    Unpacker unpacker;
    Bytes packed;
};

// A channel as read() gives it, and where its values are among those of a row.
struct Source {
    ChannelType type = ChannelType::Float;
    std::uint64_t bytesBefore = 0;  // of the channels before it, a sample
};

void widen(const unsigned char* bytes, ChannelType type, std::uint64_t count, float* to) {
    if (type == ChannelType::Float) {
        if (count > 0) std::memcpy(to, bytes, count * sizeof(float));
    } else if (type == ChannelType::Half) {
        for (std::uint64_t i = 0; i < count; ++i)
            to[i] = imath_half_to_float(static_cast<std::uint16_t>(bytes[2 * i] | bytes[2 * i + 1] << 8));
    } else {
        for (std::uint64_t i = 0; i < count; ++i) to[i] = static_cast<float>(loadWord(bytes + 4 * i));
    }
}

// parallelFor over rows that throws the first row's error, not the one that happened to come first.
void forRows(int rows, const std::function<void(std::size_t)>& body) {
    std::vector<std::exception_ptr> failures(static_cast<std::size_t>(rows));
    parallelFor(0, rows, [&](std::int64_t i) {
        const auto row = static_cast<std::size_t>(i);
        try {
            body(row);
        } catch (...) {
            failures[row] = std::current_exception();
        }
    });
    for (const auto& failure : failures)
        if (failure) std::rethrow_exception(failure);
}

}  // namespace

struct DumpReader::Impl {
    explicit Impl(const std::string& path)
        : file(path, path, RawFile::Mode::Read), fileBytes(file.size()), header(readHeader()) {}

    FileHeader readHeader() const {
        for (std::uint64_t size = kFirstRead;; size *= 2) {
            Bytes start(std::min(size, fileBytes));
            file.readAt(0, start);
            if (auto decoded = decodeHeader(file.name(), start, fileBytes)) return *decoded;
            if (size >= kMaxHeader) throw Error(file.name(), "damaged header: it does not end");
        }
    }

    [[noreturn]] void damaged(int y, const std::string& reason) const {
        throw Error(file.name(), "scanline " + std::to_string(y) + " (chunk " +
                                     std::to_string(std::int64_t{y} - header.dump.data.y) + "): " + reason);
    }

    std::span<const unsigned char> read(std::uint64_t position, std::uint64_t count, Scratch& scratch) const {
        if (scratch.packed.size() < count) scratch.packed.resize(count);
        const std::span<unsigned char> bytes(scratch.packed.data(), count);
        file.readAt(position, bytes);
        return bytes;
    }

    // The head and the sample counts of the chunk of row y.
    Chunk readCounts(int y, std::uint64_t position) const {
        if (position == 0) damaged(y, "missing: the file was not finished");
        const std::uint64_t head = kDeepChunkHead + (header.multiPart ? kPartNumber : 0);
        if (position > fileBytes || head > fileBytes - position)
            damaged(y, "truncated: it should start at byte " + std::to_string(position) + ", the file has " +
                           std::to_string(fileBytes));
        std::array<unsigned char, kDeepChunkHead + kPartNumber> bytes{};
        file.readAt(position, {bytes.data(), head});
        const unsigned char* at = bytes.data();
        if (header.multiPart) {
            if (static_cast<std::int32_t>(loadWord(at)) != header.part)
                damaged(y, "damaged: expected a chunk of part " + std::to_string(header.part) +
                               ", found part " + std::to_string(static_cast<std::int32_t>(loadWord(at))));
            at += kPartNumber;
        }
        Chunk chunk;
        chunk.y = y;
        if (static_cast<std::int32_t>(loadWord(at)) != y)
            damaged(y, "damaged: found the chunk of scanline " +
                           std::to_string(static_cast<std::int32_t>(loadWord(at))));
        chunk.counts = position + head;
        chunk.countsBytes = loadLong(at + 4);
        chunk.packedBytes = loadLong(at + 12);
        chunk.rawBytes = loadLong(at + 20);
        const std::uint64_t left = fileBytes - chunk.counts;
        if (chunk.countsBytes > left || chunk.packedBytes > left - chunk.countsBytes)
            damaged(y, "truncated or damaged: it claims " + std::to_string(chunk.countsBytes) + " + " +
                           std::to_string(chunk.packedBytes) + " bytes, the file has " +
                           std::to_string(left) + " left");
        const DumpCompression compression = header.dump.compression;
        const auto width = static_cast<std::uint64_t>(header.dump.data.width);
        if (4 * width > kMaxInt || 4 * width > maxRawBytes(compression, chunk.countsBytes))
            damaged(y, "damaged: " + std::to_string(chunk.countsBytes) + " bytes cannot hold the counts of " +
                           std::to_string(width) + " pixels");
        if (chunk.rawBytes > kMaxInt || chunk.rawBytes > maxRawBytes(compression, chunk.packedBytes))
            damaged(y, "damaged: " + std::to_string(chunk.packedBytes) + " bytes cannot unpack to " +
                           std::to_string(chunk.rawBytes));

        const auto scratch = pool.borrow();
        const auto unpacked =
            scratch->unpacker.unpack(read(chunk.counts, chunk.countsBytes, *scratch), 4 * width);
        if (!unpacked) damaged(y, "damaged: its sample counts do not unpack");
        chunk.ends.resize(width);
        std::uint32_t last = 0;
        for (std::size_t x = 0; x < width; ++x) {
            const std::uint32_t value = loadWord(unpacked->data() + 4 * x);
            if (value < last || value > kMaxInt)
                damaged(y, "damaged: its sample counts decrease at column " +
                               std::to_string(header.dump.data.x + static_cast<std::int64_t>(x)));
            chunk.ends[x] = last = value;
        }
        if (chunk.samples() * header.bytesPerSample != chunk.rawBytes)
            damaged(y, "damaged: " + std::to_string(chunk.samples()) + " samples take " +
                           std::to_string(chunk.samples() * header.bytesPerSample) + " bytes, it claims " +
                           std::to_string(chunk.rawBytes));
        return chunk;
    }

    // Row y of the part `splats`: its channels one after the other.
    std::vector<float> readSplats(int y) const {
        const auto broken = [&](const std::string& what) {
            throw Error(file.name(), "scanline " + std::to_string(y) + " of the part splats: " + what);
        };
        Bytes entry(8);
        const auto row = static_cast<std::uint64_t>(std::int64_t{y} - header.dump.data.y);
        file.readAt(header.splatTable + 8 * row, entry);
        const std::uint64_t position = loadLong(entry.data());
        std::array<unsigned char, 12> head{};
        if (position == 0 || position > fileBytes || head.size() > fileBytes - position)
            broken("missing or truncated");
        file.readAt(position, head);
        const std::uint64_t packed = loadWord(head.data() + 8);
        if (static_cast<std::int32_t>(loadWord(head.data())) != header.splatPart ||
            static_cast<std::int32_t>(loadWord(head.data() + 4)) != y)
            broken("damaged: found the chunk of another part or row");
        const std::uint64_t raw = std::uint64_t{12} *
                                  static_cast<std::uint64_t>(header.dump.splatReplicates) *
                                  static_cast<std::uint64_t>(header.dump.data.width);
        if (packed > fileBytes - position - head.size() || raw > maxRawBytes(header.dump.compression, packed))
            broken("truncated or damaged: " + std::to_string(packed) + " bytes cannot hold it");
        const auto scratch = pool.borrow();
        const auto unpacked = scratch->unpacker.unpack(read(position + head.size(), packed, *scratch), raw);
        if (!unpacked) broken("damaged: it does not unpack");
        std::vector<float> values(raw / 4);
        std::memcpy(values.data(), unpacked->data(), raw);
        return values;
    }

    // Adds the splats of its replicate to each sample. `replicate`: that channel's index in the band, or -1.
    void addSplats(SampleBand& band, int replicate) const {
        const auto width = static_cast<std::size_t>(band.width);
        const auto replicates = static_cast<float>(header.dump.splatReplicates);
        forRows(band.height, [&](std::size_t row) {
            const int y = band.y + static_cast<int>(row);
            const std::vector<float> splats = readSplats(y);
            for (std::size_t x = 0; x < width; ++x)
                for (auto i = band.offsets[row * width + x]; i < band.offsets[row * width + x + 1]; ++i) {
                    const float r = replicate < 0 ? 0 : band.values[static_cast<std::size_t>(replicate)][i];
                    if (!(r >= 0 && r < replicates))
                        damaged(y, "damaged: a sample of replicate " + std::to_string(r) + ", of " +
                                       std::to_string(header.dump.splatReplicates) + " with splats");
                    for (int c = 0; c < 3; ++c) {
                        const int channel =
                            band.channel(std::string_view("RGB").substr(static_cast<std::size_t>(c), 1));
                        if (channel >= 0)
                            band.values[static_cast<std::size_t>(channel)][i] +=
                                splats[SplatImages::plane(static_cast<int>(r), c) * width + x];
                    }
                }
        });
    }

    std::vector<Chunk> readCounts(int y, int rows) const {
        checkRows(file.name(), header.dump, y, rows);
        const auto first = static_cast<std::uint64_t>(std::int64_t{y} - header.dump.data.y);
        Bytes table(8 * static_cast<std::size_t>(rows));
        file.readAt(header.chunkTable + 8 * first, table);
        std::vector<Chunk> chunks(static_cast<std::size_t>(rows));
        forRows(rows, [&](std::size_t row) {
            chunks[row] = readCounts(y + static_cast<int>(row), loadLong(table.data() + 8 * row));
        });
        // Chunks that overlap could claim more memory together than the file is worth.
        std::uint64_t packed = 0;
        for (const Chunk& chunk : chunks) packed += chunk.countsBytes + chunk.packedBytes;
        if (packed > fileBytes)
            damaged(y, "damaged: the chunks of this and the next rows overlap in the file");
        return chunks;
    }

    const RawFile file;
    const std::uint64_t fileBytes;
    const FileHeader header;
    mutable Pool<Scratch> pool{[this] { return std::make_unique<Scratch>(header.dump.compression); }};
};

DumpReader::DumpReader(const std::string& path) : impl_(std::make_unique<Impl>(path)) {}
DumpReader::~DumpReader() = default;
DumpReader::DumpReader(DumpReader&&) noexcept = default;
DumpReader& DumpReader::operator=(DumpReader&&) noexcept = default;

const std::string& DumpReader::path() const { return impl_->file.name(); }
const DumpHeader& DumpReader::header() const { return impl_->header.dump; }
std::uint64_t DumpReader::fileBytes() const { return impl_->fileBytes; }

SampleBand DumpReader::read(int y, int rows, const std::vector<std::string>& channels) const {
    const DumpHeader& dump = impl_->header.dump;
    const auto wants = [&](const char* name) {
        return channels.empty() || std::ranges::find(channels, name) != channels.end();
    };
    const bool splats = dump.splatReplicates > 0 && (wants("R") || wants("G") || wants("B"));
    if (splats && dump.splatReplicates > 1 && !wants("sample.replicate")) {
        std::vector<std::string> more = channels;
        more.emplace_back("sample.replicate");
        SampleBand band = read(y, rows, more);
        band.channels.pop_back();
        band.values.pop_back();
        return band;
    }
    SampleBand band;
    band.x = dump.data.x;
    band.y = y;
    band.width = dump.data.width;
    band.height = rows;
    band.channels = channels;
    if (channels.empty())
        for (const auto& channel : dump.channels) band.channels.push_back(channel.name);
    std::vector<Source> sources;
    for (const auto& name : band.channels) {
        const int found = findChannel(dump, name);
        if (found < 0)
            throw Error(impl_->file.name(), "expected a channel " + name + ", found none of this name");
        Source& source = sources.emplace_back(Source{dump.channels[static_cast<std::size_t>(found)].type, 0});
        for (int i = 0; i < found; ++i)
            source.bytesBefore += valueBytes(dump.channels[static_cast<std::size_t>(i)].type);
    }

    const std::vector<Chunk> chunks = impl_->readCounts(y, rows);
    band.offsets.resize(band.pixels() + 1);
    std::vector<std::uint64_t> starts;
    std::uint64_t total = 0;
    std::size_t pixel = 1;
    for (const Chunk& chunk : chunks) {
        starts.push_back(total);
        for (const std::uint32_t end : chunk.ends) band.offsets[pixel++] = total + end;
        total += chunk.samples();
    }
    band.values.resize(band.channels.size());
    for (auto& values : band.values) values.resize(total);
    forRows(rows, [&](std::size_t row) {
        const Chunk& chunk = chunks[row];
        const auto scratch = impl_->pool.borrow();
        const auto raw = scratch->unpacker.unpack(
            impl_->read(chunk.counts + chunk.countsBytes, chunk.packedBytes, *scratch), chunk.rawBytes);
        if (!raw) impl_->damaged(chunk.y, "damaged: its samples do not unpack");
        for (std::size_t c = 0; c < sources.size(); ++c)
            widen(raw->data() + sources[c].bytesBefore * chunk.samples(), sources[c].type, chunk.samples(),
                  band.values[c].data() + starts[row]);
    });
    checkReplicates(path(), band);
    if (splats) impl_->addSplats(band, dump.splatReplicates > 1 ? band.channel("sample.replicate") : -1);
    return band;
}

std::vector<std::uint32_t> DumpReader::counts(int y, int rows) const {
    const std::vector<Chunk> chunks = impl_->readCounts(y, rows);
    std::vector<std::uint32_t> counts;
    counts.reserve(static_cast<std::size_t>(impl_->header.dump.data.width) * chunks.size());
    for (const Chunk& chunk : chunks) {
        std::uint32_t last = 0;
        for (const std::uint32_t end : chunk.ends) {
            counts.push_back(end - last);
            last = end;
        }
    }
    return counts;
}

}  // namespace vlx
