#include "edit/subset.h"

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "edit/band_rows.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr const char* kReplicate = "sample.replicate";

template <typename Body>
void forEachBandOf(const Window& window, const Body& body) {
    for (int row = 0; row < window.height; row += kBandRows)
        body(window.y + row, std::min(kBandRows, window.height - row));
}

/// The new numbers of the replicates to keep.
using ReplicateChoice = std::map<std::uint32_t, float>;

/// Which replicates to keep, or nothing when the dump has fewer than two.
std::optional<ReplicateChoice> chooseReplicates(const DumpReader& reader, const SubsetOptions& options) {
    if (findChannel(reader.header(), kReplicate) < 0) return std::nullopt;
    std::set<std::uint32_t> all;
    std::uint64_t samples = 0;
    forEachBandOf(reader.header().data, [&](int y, int rows) {
        const SampleBand band = reader.read(y, rows, {kReplicate});
        for (const float value : band.values[0]) all.insert(replicateNumber(value).value());
        samples += band.samples();
    });
    if (all.size() < 2) return std::nullopt;

    const std::uint64_t asked = std::uint64_t{options.samples} * all.size() *
                                static_cast<std::uint64_t>(reader.header().data.pixels());
    const std::uint64_t kept = asked / samples;
    if (kept * samples != asked)
        throw Error(reader.path(), "expected a multiple of the " +
                                       std::to_string(static_cast<double>(samples) /
                                                      static_cast<double>(reader.header().data.pixels()) /
                                                      static_cast<double>(all.size())) +
                                       " samples a pixel that each of its " + std::to_string(all.size()) +
                                       " replicates holds, found " + std::to_string(options.samples));
    const std::uint64_t first = options.part * kept;
    if (first + kept > all.size())
        throw Error(reader.path(), "expected at least " + std::to_string(first + kept) +
                                       " replicates for part " + std::to_string(options.part) + ", found " +
                                       std::to_string(all.size()));
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    for (const std::uint32_t replicate : all)
        order.emplace_back(hashOf(options.seed, static_cast<std::int64_t>(replicate)), replicate);
    std::sort(order.begin(), order.end());
    ReplicateChoice choice;
    for (std::uint64_t i = first; i < first + kept; ++i) choice[order[i].second] = 0;
    float number = 0;
    for (auto& [old, renumbered] : choice) renumbered = number++;
    return choice;
}

/// The samples of one pixel to keep, in increasing order; where halves are independent, of either by turns.
class PixelChoice {
  public:
    PixelChoice(const DumpReader& reader, const SubsetOptions& options)
        : path_(reader.path()), options_(options), halves_(reader.header().independentHalves) {}

    const std::vector<std::uint64_t>& operator()(int x, int y, std::uint64_t count) {
        const std::uint64_t first = std::uint64_t{options_.part} * options_.samples;
        if (first + options_.samples > count)
            throw Error(path_, "expected at least " + std::to_string(first + options_.samples) +
                                   " samples in every pixel for part " + std::to_string(options_.part) +
                                   ", found " + std::to_string(count) + " in pixel (" + std::to_string(x) +
                                   ", " + std::to_string(y) + ")");
        order_.clear();
        for (std::uint64_t i = 0; i < count; ++i) order_.emplace_back(hashOf(options_.seed, x, y, i), i);
        std::sort(order_.begin(), order_.end());
        if (halves_) takeTurns();
        kept_.clear();
        for (std::uint64_t i = first; i < first + options_.samples; ++i) kept_.push_back(order_[i].second);
        if (!halves_) std::sort(kept_.begin(), kept_.end());
        return kept_;
    }

  private:
    /// Samples of even and of odd number by turns, those of each in the order in which they are.
    void takeTurns() {
        std::ranges::stable_partition(order_, [](const auto& sample) { return sample.second % 2 == 0; });
        const std::vector<std::pair<std::uint64_t, std::uint64_t>> apart = order_;
        const std::size_t even = (apart.size() + 1) / 2;
        for (std::size_t i = 0; i < apart.size(); ++i) order_[i] = apart[i % 2 == 0 ? i / 2 : even + i / 2];
    }

    std::string path_;
    SubsetOptions options_;
    bool halves_;
    std::vector<std::pair<std::uint64_t, std::uint64_t>> order_;
    std::vector<std::uint64_t> kept_;
};

SampleBand emptyLike(const SampleBand& band) {
    SampleBand out{band.x, band.y, band.width, band.height, {0}, band.channels, {}};
    out.values.resize(band.values.size());
    return out;
}

void append(SampleBand& out, const SampleBand& band, std::uint64_t sample) {
    for (std::size_t c = 0; c < band.values.size(); ++c)
        out.values[c].push_back(band.values[c][static_cast<std::size_t>(sample)]);
}

}  // namespace

SubsetReport subsetDump(const std::string& input, const std::string& output, const SubsetOptions& options,
                        const Progress& progress) {
    if (options.samples == 0) throw Error("", "expected at least 1 sample a pixel, found 0");
    const DumpReader reader(input);
    const auto replicates = chooseReplicates(reader, options);

    DumpHeader header = reader.header();
    setInputs(header, options.inputs);  // not those of the whole dump
    header.splatReplicates = 0;         // the samples hold them
    const Window window = header.data;
    header.compression = options.compression;
    const std::optional<double> renderSeconds = header.renderSeconds;
    header.samples = options.samples;
    header.renderSeconds.reset();  // close() records it
    DumpWriter writer(output, header);

    SubsetReport report;
    std::uint64_t read = 0;
    PixelChoice choose(reader, options);
    forEachBandOf(window, [&](int y, int rows) {
        const SampleBand band = reader.read(y, rows);
        const int channel = band.channel(kReplicate);
        SampleBand out = emptyLike(band);
        for (std::size_t p = 0; p < band.pixels(); ++p) {
            if (replicates) {
                for (std::uint64_t i = band.offsets[p]; i < band.offsets[p + 1]; ++i) {
                    const float value =
                        band.values[static_cast<std::size_t>(channel)][static_cast<std::size_t>(i)];
                    const auto found = replicates->find(replicateNumber(value).value());
                    if (found == replicates->end()) continue;
                    append(out, band, i);
                    out.values[static_cast<std::size_t>(channel)].back() = found->second;
                }
            } else {
                const auto width = static_cast<std::size_t>(band.width);
                for (const std::uint64_t i :
                     choose(band.x + static_cast<int>(p % width), band.y + static_cast<int>(p / width),
                            band.offsets[p + 1] - band.offsets[p]))
                    append(out, band, band.offsets[p] + i);
            }
            out.offsets.push_back(out.values[0].size());
        }
        read += band.samples();
        report.samples += out.samples();
        writer.write(std::move(out));
        if (progress) progress(y + rows - window.y, window.height);
    });
    if (replicates) report.replicates = static_cast<std::uint32_t>(replicates->size());
    writer.close(renderSeconds.value_or(0) * static_cast<double>(report.samples) /
                 static_cast<double>(std::max<std::uint64_t>(read, 1)));
    return report;
}

}  // namespace vlx
