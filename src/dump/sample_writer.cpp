#include "variolux/dump/sample_writer.h"

#include <algorithm>
#include <mutex>
#include <numeric>
#include <optional>
#include <tuple>

#include "dump/exr_header.h"
#include "exr/raw_file.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr int kBandRows = 8;

bool within(const Window& inner, const Window& outer) {
    const auto inside = [](int a, int an, int b, int bn) {
        return a >= b && std::int64_t{a} + an <= std::int64_t{b} + bn;
    };
    return inside(inner.x, inner.width, outer.x, outer.width) &&
           inside(inner.y, inner.height, outer.y, outer.height);
}

// Where the samples of a tile are: counts of its pixels, then samples by pixel.
struct StoredTile {
    Window window;
    std::uint32_t pass = 0;
    std::uint64_t position = 0;             // of the counts; grows in the order of arrival
    std::vector<std::uint64_t> rowSamples;  // samples before each row, and after the last
};

// A file without a name: it goes with the process, however that ends.
RawFile namelessFile(const std::string& path) {
    const OutputFile name(path + ".tiles");  // removes the name when this function returns
    return RawFile(path, name.temporaryPath(), RawFile::Mode::Write);
}

template <class T>
std::span<const unsigned char> bytesOf(const std::vector<T>& values) {
    return {reinterpret_cast<const unsigned char*>(values.data()), values.size() * sizeof(T)};
}

template <class T>
std::vector<T> readValues(const RawFile& file, std::uint64_t position, std::uint64_t count) {
    std::vector<T> values(count);
    file.readAt(position, {reinterpret_cast<unsigned char*>(values.data()), count * sizeof(T)});
    return values;
}

}  // namespace

void SampleTile::add(int x, int y, std::span<const float> values) {
    if (!window_.contains(x, y))
        throw Error("", "expected a pixel of " + windowText(window_) + ", found (" + std::to_string(x) +
                            ", " + std::to_string(y) + ")");
    if (values.size() != channels_)
        throw Error("", "expected " + std::to_string(channels_) + " values a sample, found " +
                            std::to_string(values.size()));
    pixels_.push_back(
        static_cast<std::uint32_t>(std::int64_t{y - window_.y} * window_.width + (x - window_.x)));
    values_.insert(values_.end(), values.begin(), values.end());
}

struct SampleWriter::Impl {
    Impl(const std::string& path, const DumpHeader& dump)
        : header(dump), writer(std::in_place, path, dump), spool(namelessFile(path)) {}

    StoredTile store(const SampleTile& tile) {
        const std::size_t channels = tile.channels_;
        const auto pixels = static_cast<std::size_t>(tile.window_.pixels());
        // Samples by pixel, those of a pixel in the order they were added.
        std::vector<std::uint32_t> counts(pixels);
        for (const std::uint32_t pixel : tile.pixels_) ++counts[pixel];
        std::vector<std::uint64_t> next(pixels);
        std::exclusive_scan(counts.begin(), counts.end(), next.begin(), std::uint64_t{0});
        std::vector<float> sorted(tile.values_.size());
        for (std::size_t i = 0; i < tile.pixels_.size(); ++i)
            std::copy_n(tile.values_.begin() + static_cast<std::ptrdiff_t>(i * channels), channels,
                        sorted.begin() + static_cast<std::ptrdiff_t>(next[tile.pixels_[i]]++ * channels));

        StoredTile stored{tile.window_, tile.pass_, 0, {0}};
        const auto width = static_cast<std::size_t>(tile.window_.width);
        for (std::size_t p = width; p <= pixels; p += width) stored.rowSamples.push_back(next[p - 1]);
        const std::uint64_t bytes = counts.size() * sizeof counts[0] + sorted.size() * sizeof sorted[0];
        {
            const std::lock_guard lock(mutex);
            if (!writer) throw Error(spool.name(), "expected no more tiles after it was closed");
            stored.position = spoolEnd;
            spoolEnd += bytes;
        }
        spool.writeAt(stored.position, bytesOf(counts));
        spool.writeAt(stored.position + counts.size() * sizeof counts[0], bytesOf(sorted));
        return stored;
    }

    // The rows of `tile` that are in the band: counts and samples go to the band's pixels.
    struct Part {
        const StoredTile* tile;
        int y, rows;
        std::vector<std::uint32_t> counts;
        std::vector<float> values;
    };

    Part readPart(const StoredTile& tile, int y, int rows) const {
        Part part{&tile, std::max(y, tile.window.y), 0, {}, {}};
        part.rows = std::min(y + rows, tile.window.y + tile.window.height) - part.y;
        const auto width = static_cast<std::uint64_t>(tile.window.width);
        const auto first = static_cast<std::uint64_t>(part.y - tile.window.y);
        const auto last = first + static_cast<std::uint64_t>(part.rows);
        part.counts = readValues<std::uint32_t>(spool, tile.position + 4 * width * first,
                                                width * static_cast<std::uint64_t>(part.rows));
        const std::uint64_t samples = tile.position + 4 * static_cast<std::uint64_t>(tile.window.pixels());
        const std::uint64_t channels = header.channels.size();
        part.values = readValues<float>(spool, samples + 4 * channels * tile.rowSamples[first],
                                        channels * (tile.rowSamples[last] - tile.rowSamples[first]));
        return part;
    }

    SampleBand band(int y, int rows) const {
        SampleBand band{header.data.x, y, header.data.width, rows, {}, {}, {}};
        std::vector<Part> parts;
        for (const StoredTile& tile : tiles)
            if (tile.window.y < y + rows && tile.window.y + tile.window.height > y)
                parts.push_back(readPart(tile, y, rows));

        const auto forEachPixel = [&](const Part& part, const auto& body) {
            std::size_t i = 0;
            for (int row = part.y; row < part.y + part.rows; ++row)
                for (int col = 0; col < part.tile->window.width; ++col, ++i)
                    body(static_cast<std::size_t>(row - y) * static_cast<std::size_t>(band.width) +
                             static_cast<std::size_t>(part.tile->window.x + col - band.x),
                         part.counts[i]);
        };
        band.offsets.assign(band.pixels() + 1, 0);
        for (const Part& part : parts)
            forEachPixel(part, [&](std::size_t p, std::uint32_t count) { band.offsets[p + 1] += count; });
        std::partial_sum(band.offsets.begin(), band.offsets.end(), band.offsets.begin());

        std::vector<std::uint64_t> next(band.offsets.begin(), band.offsets.end() - 1);
        for (const auto& channel : header.channels) {
            band.channels.push_back(channel.name);
            band.values.emplace_back(band.samples());
        }
        for (const Part& part : parts) {
            const float* from = part.values.data();
            forEachPixel(part, [&](std::size_t p, std::uint32_t count) {
                for (std::uint32_t i = 0; i < count; ++i, ++next[p])
                    for (auto& values : band.values) values[static_cast<std::size_t>(next[p])] = *from++;
            });
        }
        return band;
    }

    const DumpHeader header;
    std::optional<DumpWriter> writer;  // until closed
    RawFile spool;
    std::mutex mutex;  // guards the following, and the writer's end
    std::uint64_t spoolEnd = 0;
    std::vector<StoredTile> tiles;
};

SampleWriter::SampleWriter(const std::string& path, const DumpHeader& header)
    : impl_(std::make_unique<Impl>(path, header)) {}

SampleWriter::~SampleWriter() = default;

SampleTile SampleWriter::tile(const Window& window, std::uint32_t pass) const {
    if (window.width < 1 || window.height < 1 || window.pixels() > 0x7fffffff ||
        !within(window, impl_->header.data))
        throw Error(impl_->spool.name(), "expected a tile within " + windowText(impl_->header.data) +
                                             ", found " + windowText(window));
    return {window, impl_->header.channels.size(), pass};
}

void SampleWriter::add(SampleTile tile) {
    StoredTile stored = impl_->store(tile);
    const std::lock_guard lock(impl_->mutex);
    impl_->tiles.push_back(std::move(stored));
}

void SampleWriter::close(double renderSeconds) {
    if (!impl_->writer) throw Error(impl_->spool.name(), "this dump is closed already");
    std::sort(impl_->tiles.begin(), impl_->tiles.end(), [](const StoredTile& a, const StoredTile& b) {
        return std::tuple(a.pass, a.window.y, a.window.x, a.position) <
               std::tuple(b.pass, b.window.y, b.window.x, b.position);
    });
    const Window& data = impl_->header.data;
    for (int row = 0; row < data.height; row += kBandRows)
        impl_->writer->write(impl_->band(data.y + row, std::min(kBandRows, data.height - row)));
    impl_->writer->close(renderSeconds);
    const std::lock_guard lock(impl_->mutex);
    impl_->writer.reset();
}

}  // namespace vlx
