#include "variolux/dump/writer.h"

#include <Imath/half.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <condition_variable>
#include <cstring>
#include <deque>
#include <limits>
#include <mutex>
#include <optional>
#include <thread>

#include "dump/cpu_timer.h"
#include "dump/exr_header.h"
#include "dump/pool.h"
#include "dump/stored_values.h"
#include "exr/little_endian.h"
#include "exr/raw_file.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"

// Why not OpenEXR's own writing classes: MultiPartOutputFile takes a table of pointers to every pixel, shares
// one global thread pool whose processor time cannot be told, and compresses with a zlib strategy that costs
// more than twice as much; the C core writes one part after the other, so that the flat part could not be
// streamed beside the samples. Header bytes do come from OpenEXR.

namespace vlx {

namespace {

// Bands that wait for compression; one more is being compressed.
constexpr std::size_t kQueuedBands = 2;

constexpr std::int64_t kMostBytes = std::numeric_limits<std::int32_t>::max();

void appendValues(Bytes& bytes, ChannelType type, const float* values, std::size_t count) {
    bytes.resize(bytes.size() + count * valueBytes(type));
    unsigned char* to = bytes.data() + bytes.size() - count * valueBytes(type);
    if (type == ChannelType::Float) {
        if (count > 0) std::memcpy(to, values, count * sizeof(float));
        return;
    }
    for (std::size_t i = 0; i < count; ++i)
        if (type == ChannelType::Half) {
            const std::uint16_t bits = imath_float_to_half(values[i]);
            std::memcpy(to + 2 * i, &bits, sizeof bits);
        } else {
            const std::uint32_t bits = toUint(values[i]);
            std::memcpy(to + 4 * i, &bits, sizeof bits);
        }
}

// One of the flat part's values: the mean of a pixel's finite samples, of Z over its hits; 0 without any.
float pixelMean(const float* values, const float* hits, std::uint64_t begin, std::uint64_t end) {
    double sum = 0;
    int count = 0;
    for (std::uint64_t i = begin; i < end; ++i)
        if (std::isfinite(values[i]) && (hits == nullptr || hits[i] > 0)) {
            sum += values[i];
            ++count;
        }
    return count > 0 ? static_cast<float>(sum / count) : 0.0f;
}

// Memory of a task, and what it makes; kept from band to band.
struct PackScratch {
    explicit PackScratch(DumpCompression compression) : packer(compression) {}
    Packer packer;
    Bytes values;
};
struct RowChunks {
    std::vector<float> means;  // of the flat part
    Bytes beauty, samples;
};

DumpHeader sortedByName(DumpHeader header) {
    std::sort(header.channels.begin(), header.channels.end(),
              [](const DumpChannel& a, const DumpChannel& b) { return a.name < b.name; });
    return header;
}

}  // namespace

struct DumpWriter::Impl {
    Impl(const std::string& path, const DumpHeader& dump)
        : header(dump),
          sorted(sortedByName(dump)),
          nextRow(dump.data.y),
          file((checkHeader(path, dump), path)),
          disk(path, file.temporaryPath(), RawFile::Mode::Write) {
        for (const auto& channel : sorted.channels) order.push_back(findChannel(header, channel.name));
        for (const auto& name : beautyChannels(header)) beauty.push_back(findChannel(header, name));
        for (const auto& channel : header.channels) bytesPerSample += valueBytes(channel.type);
        encoded = encodeHeader(path, sorted);
        disk.writeAt(0, encoded.bytes);
        // Both parts have a chunk a row; their tables are filled in as chunks come.
        beautyTable = encoded.bytes.size();
        samplesTable = beautyTable + 8 * static_cast<std::uint64_t>(header.data.height);
        splatsTable = samplesTable + 8 * static_cast<std::uint64_t>(header.data.height);
        end = splatsTable;
        if (hasSplats()) end += 8 * static_cast<std::uint64_t>(header.data.height);
        worker = std::thread([this] { work(); });
    }

    ~Impl() { stopWorker(true); }

    // --- on the caller's thread ---

    void check(const SampleBand& band) const {
        const auto& window = header.data;
        if (band.x != window.x || band.width != window.width || band.y != nextRow || band.height < 1 ||
            band.height > std::int64_t{window.y} + window.height - nextRow)
            throw Error(file.path(), "expected a band of columns " + std::to_string(window.x) + " to " +
                                         std::to_string(window.x + (window.width - 1)) +
                                         " that starts at row " + std::to_string(nextRow) +
                                         " and ends within the data window, found " +
                                         windowText({band.x, band.y, band.width, band.height}));
        const auto damaged = [&](const std::string& what) {
            throw Error(file.path(), "the band at row " + std::to_string(band.y) + " " + what);
        };
        if (band.offsets.size() != band.pixels() + 1 || band.offsets.front() != 0 ||
            !std::is_sorted(band.offsets.begin(), band.offsets.end()))
            damaged("has offsets that do not count its pixels' samples");
        bool named =
            band.channels.size() == header.channels.size() && band.values.size() == band.channels.size();
        for (std::size_t c = 0; named && c < band.channels.size(); ++c)
            named = band.channels[c] == header.channels[c].name && band.values[c].size() == band.samples();
        if (!named) damaged("does not hold the header's channels with a value for each sample");
        for (int row = 0; row < band.height; ++row) {
            const std::size_t first = static_cast<std::size_t>(row) * static_cast<std::size_t>(band.width);
            const std::uint64_t samples =
                band.offsets[first + static_cast<std::size_t>(band.width)] - band.offsets[first];
            if (samples > static_cast<std::uint64_t>(kMostBytes) / bytesPerSample)
                damaged("has a row of " + std::to_string(samples) + " samples, more than OpenEXR can hold");
        }
    }

    void enqueue(SampleBand band) {
        std::unique_lock lock(mutex);
        room.wait(lock, [&] { return queue.size() < kQueuedBands || failure; });
        rethrowFailure();
        nextRow += band.height;
        queue.push_back(std::move(band));
        ready.notify_one();
    }

    void finish(double renderSeconds) {
        if (!worker.joinable()) throw Error(file.path(), "this dump is closed already");
        stopWorker(false);
        rethrowFailure();
        if (nextRow != std::int64_t{header.data.y} + header.data.height)
            throw Error(file.path(), "closed before all rows were written: row " + std::to_string(nextRow) +
                                         " of " + windowText(header.data) + " is missing");
        if (hasSplats()) writeFlatRows();
        Bytes value;
        append(value, static_cast<std::uint32_t>(std::min<std::uint64_t>(maxSamples, kMostBytes)));
        disk.writeAt(encoded.maxSamplesPerPixel, value);
        if (renderSeconds > 0) {
            value.clear();
            append(value, renderSeconds);
            disk.writeAt(encoded.renderSeconds, value);
        }
        disk.close();
        file.commit();
    }

    bool hasSplats() const { return header.splatReplicates > 0; }

    void takeSplats(SplatImages given) {
        if (!hasSplats() || given.data() != header.data || given.replicates() != header.splatReplicates)
            throw Error(file.path(), "expected splats of " + std::to_string(header.splatReplicates) +
                                         " replicates and " + windowText(header.data) + ", found " +
                                         std::to_string(given.replicates()) + " and " +
                                         windowText(given.data()));
        splats = std::move(given);
    }

    // `splats`, and `beauty`, which waited for them.
    void writeFlatRows() {
        if (!splats) throw Error(file.path(), "closed before the splats were written");
        const CpuTimer timer(cpu);
        const auto scratch = pool.borrow();
        const auto width = static_cast<std::size_t>(header.data.width);
        const std::size_t beautyRow = beauty.size() * width;
        Bytes beautyPositions, splatsPositions, chunk;
        for (int row = 0; row < header.data.height; ++row) {
            const int y = header.data.y + row;
            const auto light = splats->row(y);
            float* means = beautyMeans.data() + beautyRow * static_cast<std::size_t>(row);
            for (std::size_t c = 0; c < beauty.size(); ++c) {
                const auto& name = header.channels[static_cast<std::size_t>(beauty[c])].name;
                const int rgb = name == "R" ? 0 : name == "G" ? 1 : name == "B" ? 2 : -1;
                for (std::size_t x = 0; rgb >= 0 && x < width; ++x) {
                    double sum = 0;
                    for (int r = 0; r < header.splatReplicates; ++r)
                        sum += static_cast<double>(light[SplatImages::plane(r, rgb) * width + x]);
                    means[c * width + x] += static_cast<float>(sum / header.splatReplicates);
                }
            }
            append(beautyPositions, end);
            packFlat(0, y, {means, beautyRow}, *scratch, chunk);
            disk.writeAt(end, chunk);
            end += chunk.size();
            append(splatsPositions, end);
            packFlat(2, y, light, *scratch, chunk);
            disk.writeAt(end, chunk);
            end += chunk.size();
        }
        disk.writeAt(beautyTable, beautyPositions);
        disk.writeAt(splatsTable, splatsPositions);
    }

    void rethrowFailure() const {
        if (failure) std::rethrow_exception(failure);
    }

    void stopWorker(bool discard) {
        if (!worker.joinable()) return;
        {
            const std::lock_guard lock(mutex);
            if (discard) queue.clear();
            closing = true;
        }
        ready.notify_one();
        worker.join();
    }

    // --- on the writer's thread ---

    void work() {
        for (;;) {
            SampleBand band;
            {
                std::unique_lock lock(mutex);
                ready.wait(lock, [&] { return !queue.empty() || closing; });
                if (queue.empty()) return;
                band = std::move(queue.front());
                queue.pop_front();
            }
            room.notify_one();
            try {
                writeBand(band);
            } catch (...) {
                const std::lock_guard lock(mutex);
                failure = std::current_exception();
                room.notify_all();
                return;
            }
        }
    }

    void writeBand(const SampleBand& band) {
        const auto rows = static_cast<std::size_t>(band.height);
        if (chunks.size() < rows) chunks.resize(rows);
        parallelFor(0, band.height, [&](std::int64_t row) {
            const CpuTimer timer(cpu);
            RowChunks& to = chunks[static_cast<std::size_t>(row)];
            const auto scratch = pool.borrow();
            meansOf(band, static_cast<int>(row), to.means);
            if (!hasSplats()) packFlat(0, band.y + static_cast<int>(row), to.means, *scratch, to.beauty);
            encodeSamples(band, static_cast<int>(row), *scratch, to.samples);
        });
        const CpuTimer timer(cpu);
        for (std::size_t p = 0; p < band.pixels(); ++p)
            maxSamples = std::max(maxSamples, band.offsets[p + 1] - band.offsets[p]);
        Bytes beautyPositions, samplesPositions;
        for (std::size_t row = 0; row < rows; ++row) {
            if (hasSplats()) {
                beautyMeans.insert(beautyMeans.end(), chunks[row].means.begin(), chunks[row].means.end());
            } else {
                append(beautyPositions, end);
                disk.writeAt(end, chunks[row].beauty);
                end += chunks[row].beauty.size();
            }
            append(samplesPositions, end);
            disk.writeAt(end, chunks[row].samples);
            end += chunks[row].samples.size();
        }
        const auto firstRow = static_cast<std::uint64_t>(std::int64_t{band.y} - header.data.y);
        if (!hasSplats()) disk.writeAt(beautyTable + 8 * firstRow, beautyPositions);
        disk.writeAt(samplesTable + 8 * firstRow, samplesPositions);
    }

    // A row of `beauty`, channel by channel.
    void meansOf(const SampleBand& band, int row, std::vector<float>& means) const {
        const auto width = static_cast<std::size_t>(band.width);
        const std::uint64_t* offsets = band.offsets.data() + static_cast<std::size_t>(row) * width;
        const int alpha = findChannel(header, "A");
        means.clear();
        for (const int channel : beauty) {
            const auto& name = header.channels[static_cast<std::size_t>(channel)].name;
            const float* values = band.values[static_cast<std::size_t>(channel)].data();
            const float* hits = values;  // without A, hits are what has a distance
            if (alpha >= 0) hits = band.values[static_cast<std::size_t>(alpha)].data();
            for (std::size_t x = 0; x < width; ++x)
                means.push_back(pixelMean(values, name == "Z" ? hits : nullptr, offsets[x], offsets[x + 1]));
        }
    }

    static void packFlat(std::uint32_t part, int y, std::span<const float> values, PackScratch& scratch,
                         Bytes& chunk) {
        scratch.values.clear();
        for (const float v : values) append(scratch.values, v);
        const auto packed = scratch.packer.pack(scratch.values);
        chunk.clear();
        append(chunk, part);
        append(chunk, static_cast<std::int32_t>(y));
        append(chunk, static_cast<std::uint32_t>(packed.size()));
        chunk.insert(chunk.end(), packed.begin(), packed.end());
    }

    void encodeSamples(const SampleBand& band, int row, PackScratch& scratch, Bytes& chunk) const {
        const auto width = static_cast<std::size_t>(band.width);
        const std::uint64_t* offsets = band.offsets.data() + static_cast<std::size_t>(row) * width;
        const std::uint64_t samples = offsets[width] - offsets[0];
        chunk.clear();
        append(chunk, std::uint32_t{1});
        append(chunk, static_cast<std::int32_t>(band.y + row));
        const std::size_t sizes = chunk.size();
        chunk.resize(sizes + 3 * sizeof(std::uint64_t));

        scratch.values.clear();
        for (std::size_t x = 1; x <= width; ++x)
            append(scratch.values, static_cast<std::uint32_t>(offsets[x] - offsets[0]));
        const auto counts = scratch.packer.pack(scratch.values);
        const std::uint64_t countsBytes = counts.size();
        chunk.insert(chunk.end(), counts.begin(), counts.end());

        scratch.values.clear();
        for (std::size_t c = 0; c < order.size(); ++c)
            appendValues(scratch.values, sorted.channels[c].type,
                         band.values[static_cast<std::size_t>(order[c])].data() + offsets[0], samples);
        const auto packed = scratch.packer.pack(scratch.values);
        chunk.insert(chunk.end(), packed.begin(), packed.end());

        const std::uint64_t head[] = {countsBytes, packed.size(), scratch.values.size()};
        std::memcpy(chunk.data() + sizes, head, sizeof head);
    }

    const DumpHeader header;
    const DumpHeader sorted;  // channels in the file's order
    std::vector<int> order;   // header's index of each channel of `sorted`
    std::vector<int> beauty;  // header's index of each channel of the flat part
    std::uint64_t bytesPerSample = 0;
    EncodedHeader encoded;
    std::int64_t nextRow;  // the caller's
    OutputFile file;
    RawFile disk;
    std::uint64_t beautyTable = 0;  // from here on the worker's, while it runs
    std::uint64_t samplesTable = 0;
    std::uint64_t splatsTable = 0;
    std::uint64_t end = 0;
    std::uint64_t maxSamples = 0;
    std::vector<RowChunks> chunks;
    std::vector<float> beautyMeans;     // of all rows, where splats are to be added
    std::optional<SplatImages> splats;  // the caller's
    std::atomic<std::int64_t> cpu{0};
    mutable Pool<PackScratch> pool{[this] { return std::make_unique<PackScratch>(header.compression); }};

    std::mutex mutex;  // guards the following
    std::condition_variable room, ready;
    std::deque<SampleBand> queue;
    std::exception_ptr failure;
    bool closing = false;
    std::thread worker;
};

DumpWriter::DumpWriter(const std::string& path, const DumpHeader& header)
    : impl_(std::make_unique<Impl>(path, header)) {}

DumpWriter::~DumpWriter() = default;

void DumpWriter::write(SampleBand band) {
    impl_->check(band);
    impl_->enqueue(std::move(band));
}

void DumpWriter::writeSplats(SplatImages splats) { impl_->takeSplats(std::move(splats)); }

void DumpWriter::close(double renderSeconds) { impl_->finish(renderSeconds); }

double DumpWriter::cpuSeconds() const { return static_cast<double>(impl_->cpu) * 1e-9; }

}  // namespace vlx
