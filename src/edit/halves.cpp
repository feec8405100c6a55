#include "edit/halves.h"

#include <array>
#include <bit>
#include <cmath>
#include <fstream>
#include <memory>

#include "edit/band_rows.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/dump/half_samples.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

static_assert(std::endian::native == std::endian::little);

constexpr const char* kReplicateChannel = "sample.replicate";

/// Three channels of a picture, and what they are called.
struct Triple {
    const char* name;
    std::array<std::string, 3> channels;
};

const Triple kTriples[] = {{"color", {"R", "G", "B"}},
                           {"albedo", {"albedo.R", "albedo.G", "albedo.B"}},
                           {"normal", {"N.X", "N.Y", "N.Z"}}};

/// A picture of three floats a pixel under construction; rows come from the top, and lie from the bottom up.
class PfmFile {
  public:
    PfmFile(const std::string& path, int width, int height)
        : file_(path),
          out_(file_.temporaryPath(), std::ios::binary | std::ios::in | std::ios::out),
          width_(width),
          height_(height) {
        const std::string header = "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1.0\n";
        begin_ = static_cast<std::streamoff>(header.size());
        out_ << header;
        check();
    }
    void writeRow(int row, const std::vector<float>& values) {
        out_.seekp(begin_ + static_cast<std::streamoff>(height_ - 1 - row) * width_ * 12);
        out_.write(reinterpret_cast<const char*>(values.data()),
                   static_cast<std::streamsize>(values.size() * sizeof(float)));
        check();
    }
    void close() {
        out_.close();
        check();
    }
    void commit() { file_.commit(); }
    const std::string& path() const { return file_.path(); }

  private:
    void check() const {
        if (!out_) throw Error(file_.path(), "cannot be written: is the disk full?");
    }

    OutputFile file_;
    std::fstream out_;
    std::streamoff begin_ = 0;
    int width_, height_;
};

}  // namespace

HalvesReport writeHalves(const std::string& dump, const std::string& prefix, const Progress& progress) {
    const DumpReader reader(dump);
    const Window& window = reader.header().data;
    const bool replicates = hasReplicates(reader);
    std::vector<std::string> channels;
    std::vector<const Triple*> triples;
    for (const Triple& triple : kTriples) {
        bool all = true;
        for (const std::string& channel : triple.channels)
            all = all && findChannel(reader.header(), channel) >= 0;
        if (!all) continue;
        triples.push_back(&triple);
        channels.insert(channels.end(), triple.channels.begin(), triple.channels.end());
    }
    if (triples.empty() || triples.front() != kTriples)
        throw Error(dump, "expected channels R, G and B, found others");
    if (replicates) channels.emplace_back(kReplicateChannel);

    // Of even samples, of odd ones, of all.
    std::vector<std::unique_ptr<PfmFile>> files;
    for (const char* part : {"_even_", "_odd_", "_"})
        for (const Triple* triple : triples)
            files.push_back(std::make_unique<PfmFile>(prefix + part + triple->name + ".pfm", window.width,
                                                      window.height));

    HalvesReport report;
    const std::size_t values = 3 * triples.size(), width = static_cast<std::size_t>(window.width);
    std::vector<std::vector<float>> rows(files.size(), std::vector<float>(3 * width));
    std::vector<double> sums[2];
    for (int y = 0; y < window.height; y += kBandRows) {
        const int count = std::min(kBandRows, window.height - y);
        const SampleBand band = reader.read(window.y + y, count, channels);
        for (int row = 0; row < count; ++row) {
            for (std::size_t x = 0; x < width; ++x) {
                const std::size_t pixel = static_cast<std::size_t>(row) * width + x;
                double n[2] = {};
                for (auto& sum : sums) sum.assign(values, 0.0);
                for (std::size_t s = band.offsets[pixel]; s < band.offsets[pixel + 1]; ++s) {
                    bool finite = true;
                    for (std::size_t c = 0; c < 3; ++c) finite = finite && std::isfinite(band.values[c][s]);
                    report.droppedSamples += !finite;
                    if (!finite) continue;
                    const std::size_t half = (replicates ? replicateNumber(band.values.back()[s]).value()
                                                         : s - band.offsets[pixel]) %
                                             2;
                    n[half] += 1;
                    for (std::size_t c = 0; c < values; ++c)
                        if (std::isfinite(band.values[c][s]))
                            sums[half][c] += static_cast<double>(band.values[c][s]);
                }
                report.emptyPixels += n[0] + n[1] == 0;
                report.missingInHalves += n[0] + n[1] > 0 && (n[0] == 0 || n[1] == 0);
                for (std::size_t c = 0; c < values; ++c) {
                    const double both = n[0] + n[1] > 0 ? (sums[0][c] + sums[1][c]) / (n[0] + n[1]) : 0;
                    for (std::size_t part = 0; part < 3; ++part)
                        rows[part * triples.size() + c / 3][3 * x + c % 3] =
                            static_cast<float>(part < 2 && n[part] > 0 ? sums[part][c] / n[part] : both);
                }
            }
            for (std::size_t f = 0; f < files.size(); ++f) files[f]->writeRow(y + row, rows[f]);
        }
        if (progress) progress(y + count, window.height);
    }
    for (auto& file : files) file->close();
    for (auto& file : files) {
        file->commit();
        report.files.push_back(file->path());
    }
    return report;
}

std::uint64_t writeHalfDump(const std::string& dump, const std::string& output, int parity,
                            DumpCompression compression, const std::string& inputs,
                            const Progress& progress) {
    const DumpReader reader(dump);
    const bool replicates = hasReplicates(reader);
    const HalfSamples half(reader, replicates, parity);
    DumpHeader header = half.header();
    setInputs(header, inputs);
    header.splatReplicates = 0;  // the samples hold them
    header.compression = compression;
    if (header.samples) *header.samples /= 2;
    const double renderSeconds = header.renderSeconds.value_or(0);
    header.renderSeconds.reset();  // close() records it
    DumpWriter writer(output, header);
    const Window& window = header.data;
    std::uint64_t kept = 0;
    for (int row = 0; row < window.height; row += kBandRows) {
        const int count = std::min(kBandRows, window.height - row);
        SampleBand band = half.read(window.y + row, count);
        kept += band.samples();
        if (replicates)
            for (float& value : band.values[static_cast<std::size_t>(band.channel(kReplicateChannel))])
                value = static_cast<float>(replicateNumber(value).value() / 2);
        writer.write(std::move(band));
        if (progress) progress(row + count, window.height);
    }
    if (kept == 0)
        throw Error(dump, "expected samples of " + std::string(parity == 0 ? "even" : "odd") +
                              " number, two a pixel or more, found none");
    writer.close(renderSeconds / 2);
    return kept;
}

}  // namespace vlx
