// Dump reading against OpenEXR's own classes on the same file: the ratios say how many times OpenEXR's time
// Variolux takes (below 1: less). Writing: processor time a sample.

#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputPart.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfThreading.h>
#include <benchmark/benchmark.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace {

using namespace vlx;

constexpr int kWidth = 512;
constexpr int kHeight = 128;
constexpr int kSamples = 8;
constexpr int kBandRows = 16;

// The test dump's pixels over and over: real samples, enough of them.
class Fixture {
  public:
    Fixture() {
        const DumpReader piece(VLX_TESTDATA "/dumps/tungsten_cornell.exr");
        header_ = piece.header();
        const SampleBand all = piece.read(header_.data.y, header_.data.height);
        header_.data = header_.display = {0, 0, kWidth, kHeight};
        for (int y = 0; y < kHeight; y += kBandRows) bands_.push_back(makeBand(all, y));
        for (const DumpCompression compression :
             {DumpCompression::None, DumpCompression::Rle, DumpCompression::Zips}) {
            header_.compression = compression;
            write(path(compression));
        }
    }
    ~Fixture() {
        for (int i = 0; i < 3; ++i) std::filesystem::remove(path(static_cast<DumpCompression>(i)));
        std::filesystem::remove(path(static_cast<DumpCompression>(3)));
    }

    std::string path(DumpCompression compression) const {
        return (std::filesystem::temp_directory_path() /
                ("variolux-bench-" + std::to_string(::getpid()) + "-" +
                 std::to_string(static_cast<int>(compression)) + ".exr"))
            .string();
    }

    // Returns the processor time that compression took, a sample.
    double write(const std::string& to, DumpCompression compression) {
        header_.compression = compression;
        return write(to);
    }
    static constexpr std::int64_t samples() { return std::int64_t{kWidth} * kHeight * kSamples; }

  private:
    SampleBand makeBand(const SampleBand& all, int y) const {
        SampleBand band;
        band.y = y;
        band.width = kWidth;
        band.height = kBandRows;
        band.channels = all.channels;
        band.values.resize(all.channels.size());
        for (std::size_t p = 0; p <= band.pixels(); ++p) band.offsets.push_back(p * kSamples);
        for (int row = 0; row < kBandRows; ++row)
            for (int x = 0; x < kWidth; ++x) {
                const int from = (y + row) % all.height * all.width + x % all.width;
                const auto first = static_cast<std::size_t>(all.offsets[static_cast<std::size_t>(from)]);
                for (std::size_t c = 0; c < band.values.size(); ++c)
                    for (std::size_t i = 0; i < kSamples; ++i) {
                        // Copies must not look like copies to the compression.
                        const auto salt = static_cast<std::uint32_t>((x * 8191 + y + row) * 131 + int(i));
                        const float noise = static_cast<float>(salt * 2654435761u >> 8) * 0x1p-24f;
                        const bool exact = header_.channels[c].type == ChannelType::Half;
                        const float value = all.values[c][first + i];
                        band.values[c].push_back(exact ? value : value * (1 + 1e-3f * noise));
                    }
            }
        return band;
    }

    double write(const std::string& to) {
        DumpWriter writer(to, header_);
        for (const SampleBand& band : bands_) writer.write(band);
        writer.close();
        return writer.cpuSeconds() / static_cast<double>(samples());
    }

    DumpHeader header_;
    std::vector<SampleBand> bands_;
};

Fixture& fixture() {
    static Fixture made;
    return made;
}

// What plain OpenEXR does for the same channels, in the same bands of rows.
double readPlain(const std::string& path, const std::vector<std::string>& wanted) {
    Imf::MultiPartInputFile file(path.c_str(), vlx::threadCount());
    Imf::DeepScanLineInputPart part(file, 1);
    std::vector<std::string> names = wanted;
    const Imf::ChannelList& channels = part.header().channels();
    if (names.empty())
        for (auto it = channels.begin(); it != channels.end(); ++it) names.emplace_back(it.name());
    const auto pixels = std::size_t{kWidth} * kHeight;
    std::vector<unsigned int> counts(pixels);
    std::vector<std::vector<char*>> pointers(names.size(), std::vector<char*>(pixels));
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, reinterpret_cast<char*>(counts.data()), 4, std::size_t{4} * kWidth));
    for (std::size_t c = 0; c < names.size(); ++c)
        buffer.insert(names[c], Imf::DeepSlice(Imf::FLOAT, reinterpret_cast<char*>(pointers[c].data()),
                                               sizeof(char*), sizeof(char*) * kWidth, sizeof(float)));
    part.setFrameBuffer(buffer);
    double sum = 0;
    for (int y = 0; y < kHeight; y += kBandRows) {
        part.readPixelSampleCounts(y, y + kBandRows - 1);
        const auto first = std::size_t{kWidth} * static_cast<std::size_t>(y);
        const auto last = first + std::size_t{kWidth} * kBandRows;
        std::size_t total = 0;
        for (std::size_t p = first; p < last; ++p) total += counts[p];
        std::vector<std::vector<float>> values(names.size(), std::vector<float>(total));
        for (std::size_t c = 0; c < names.size(); ++c) {
            float* to = values[c].data();
            for (std::size_t p = first; p < last; ++p) {
                pointers[c][p] = reinterpret_cast<char*>(to);
                to += counts[p];
            }
        }
        part.readPixels(y, y + kBandRows - 1);
        sum += static_cast<double>(values[0][0]);
    }
    return sum;
}

double readDump(const std::string& path, const std::vector<std::string>& wanted) {
    const DumpReader reader(path);
    double sum = 0;
    for (int y = 0; y < kHeight; y += kBandRows)
        sum += static_cast<double>(reader.read(y, kBandRows, wanted).values[0][0]);
    return sum;
}

double seconds(clockid_t clock) {
    timespec now{};
    ::clock_gettime(clock, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

// Wall and processor time of an action, on all threads.
struct Cost {
    double wall = 0, cpu = 0;
    template <class Action>
    void measure(const Action& action) {
        const double wallBefore = seconds(CLOCK_MONOTONIC), cpuBefore = seconds(CLOCK_PROCESS_CPUTIME_ID);
        benchmark::DoNotOptimize(action());
        wall += seconds(CLOCK_MONOTONIC) - wallBefore;
        cpu += seconds(CLOCK_PROCESS_CPUTIME_ID) - cpuBefore;
    }
};

// Both readers in turn, so that a busy machine slows both; the time shown is Variolux's.
void runRead(benchmark::State& state, DumpCompression compression, bool radianceOnly) {
    const std::string path = fixture().path(compression);
    const std::vector<std::string> wanted =
        radianceOnly ? std::vector<std::string>{"R", "G", "B"} : std::vector<std::string>{};
    Cost plain, dump;
    for ([[maybe_unused]] auto _ : state) {
        plain.measure([&] { return readPlain(path, wanted); });
        const double before = dump.wall;
        dump.measure([&] { return readDump(path, wanted); });
        state.SetIterationTime(dump.wall - before);
    }
    const double samples = static_cast<double>(state.iterations()) * static_cast<double>(Fixture::samples());
    state.counters["ns_per_sample"] = 1e9 * dump.wall / samples;
    state.counters["cpu_ns_per_sample"] = 1e9 * dump.cpu / samples;
    state.counters["wall_OpenEXR_ratio"] = dump.wall / plain.wall;
    state.counters["cpu_OpenEXR_ratio"] = dump.cpu / plain.cpu;
}

void runWrite(benchmark::State& state, DumpCompression compression) {
    const std::string path = fixture().path(static_cast<DumpCompression>(3));
    double cost = 0;
    for ([[maybe_unused]] auto _ : state) cost += fixture().write(path, compression);
    state.counters["cpu_ns_per_sample"] = 1e9 * cost / static_cast<double>(state.iterations());
    state.counters["bytes_per_sample"] =
        static_cast<double>(std::filesystem::file_size(path)) / static_cast<double>(Fixture::samples());
}

}  // namespace

int main(int argc, char** argv) {
    // Both sides get the same number of threads; OpenEXR's are set up beside the calling one.
    Imf::setGlobalThreadCount(vlx::threadCount());
    const char* names[] = {"none", "rle", "zips"};
    for (int i = 0; i < 3; ++i) {
        const auto compression = static_cast<DumpCompression>(i);
        for (const bool radianceOnly : {false, true})
            benchmark::RegisterBenchmark(
                (std::string("read/") + names[i] + (radianceOnly ? "/3_channels" : "/all_channels")).c_str(),
                runRead, compression, radianceOnly)
                ->UseManualTime();
        benchmark::RegisterBenchmark((std::string("write/") + names[i]).c_str(), runWrite, compression)
            ->UseRealTime();
    }
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
