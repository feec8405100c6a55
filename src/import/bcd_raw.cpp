#include <algorithm>
#include <array>
#include <cstring>

#include "exr/little_endian.h"
#include "exr/raw_file.h"
#include "import/bcd.h"
#include "variolux/base/error.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr std::uint64_t kHeaderBytes = 20;
// Values of a band, at four bytes, twice.
constexpr std::uint64_t kBandValues = std::uint64_t{8} << 20;
constexpr int kMaxSide = 1 << 20;

struct RawHeader {
    std::int32_t version, width, height, samples, channels;
};

RawHeader readHeader(const RawFile& file) {
    std::array<unsigned char, kHeaderBytes> bytes{};
    const std::uint64_t size = file.size();
    if (size < kHeaderBytes)
        throw Error(file.name(), "expected BCD's raw samples, found a file of " + std::to_string(size) +
                                     " bytes, fewer than their header's 20");
    file.readAt(0, bytes);
    RawHeader header{};
    std::memcpy(&header, bytes.data(), sizeof header);
    const auto inside = [](std::int32_t value, std::int32_t most) { return value >= 1 && value <= most; };
    if (!inside(header.width, kMaxSide) || !inside(header.height, kMaxSide) ||
        !inside(header.samples, 1 << 24) || (header.channels != 3 && header.channels != 4))
        throw Error(file.name(),
                    "expected BCD's raw samples: width, height, samples and 3 or 4 channels; found " +
                        std::to_string(header.width) + " x " + std::to_string(header.height) + " pixels of " +
                        std::to_string(header.samples) + " samples of " + std::to_string(header.channels) +
                        " channels");
    // At most 2^20 * 2^24 * 4 * 4 = 2^48 bytes a row, and that times 2^20 rows does not fit: row by row.
    const std::uint64_t row =
        std::uint64_t(header.width) * std::uint64_t(header.samples) * std::uint64_t(header.channels) * 4;
    const std::uint64_t rows = (size - kHeaderBytes) / row;
    if (rows != std::uint64_t(header.height) || (size - kHeaderBytes) % row != 0)
        throw Error(file.name(), "expected " + std::to_string(header.height) + " rows of " +
                                     std::to_string(row) + " bytes as its header says, found " +
                                     std::to_string(size - kHeaderBytes) + " bytes");
    return header;
}

}  // namespace

bool isOpenExr(const std::string& path) {
    const RawFile file(path, path, RawFile::Mode::Read);
    std::array<unsigned char, 4> magic{};
    if (file.size() < magic.size()) return false;
    file.readAt(0, magic);
    return magic == std::array<unsigned char, 4>{0x76, 0x2f, 0x31, 0x01};
}

ImportReport importBcdRaw(const std::string& raw, const std::string& dump, const BcdOptions& options,
                          const Progress& progress) {
    const RawFile file(raw, raw, RawFile::Mode::Read);
    const RawHeader source = readHeader(file);
    DumpHeader header;
    header.data = header.display = {0, 0, source.width, source.height};
    header.channels = {{"R"}, {"G"}, {"B"}};
    header.compression = options.compression;
    header.renderer = options.renderer;
    header.samples = source.samples;

    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);
    const auto channels = static_cast<std::uint64_t>(source.channels);
    const std::uint64_t rowSamples = std::uint64_t(source.width) * std::uint64_t(source.samples);
    const int bandRows =
        static_cast<int>(std::clamp<std::uint64_t>(kBandValues / (rowSamples * channels), 1, 32));
    std::vector<unsigned char> bytes;
    for (int row = 0; row < source.height;) {
        const int rows = std::min(bandRows, source.height - row);
        bytes.resize(rowSamples * channels * 4 * static_cast<std::uint64_t>(rows));
        file.readAt(kHeaderBytes + rowSamples * channels * 4 * static_cast<std::uint64_t>(row), bytes);
        SampleBand band{0, row, source.width, rows, {}, {"R", "G", "B"}, {}};
        for (std::size_t p = 0; p <= band.pixels(); ++p)
            band.offsets.push_back(p * static_cast<std::uint64_t>(source.samples));
        for (std::size_t c = 0; c < 3; ++c) {
            auto& values = band.values.emplace_back(band.samples());
            for (std::size_t i = 0; i < values.size(); ++i)
                std::memcpy(&values[i], bytes.data() + 4 * (i * channels + c), 4);
        }
        writer.write(std::move(band));
        row += rows;
        if (progress) progress(row, source.height);
    }
    writer.close();

    ImportReport report;
    for (const char* name : {"R", "G", "B"}) report.mapped[name] = std::string("channel ") + name;
    if (source.channels == 4) report.ignored.push_back("the fourth channel (BCD reads three)");
    report.notes.push_back(std::to_string(source.samples) + " samples in each pixel; version " +
                           std::to_string(source.version) + ".");
    report.missing = missingChannels(header);
    return report;
}

}  // namespace vlx
