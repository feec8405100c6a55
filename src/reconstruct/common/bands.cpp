#include "reconstruct/common/bands.h"

#include <algorithm>
#include <chrono>

#include "reconstruct/common/methods.h"
#include "reconstruct/common/rebin.h"
#include "variolux/base/memory.h"

namespace vlx {

namespace {

double secondsSince(std::chrono::steady_clock::time_point start) {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// The channels of some rows; one sample for each replicate where its samples have light in common.
SampleBand readBand(const SampleSource& reader, const ChannelChoice& channels, int y, int rows) {
    const DumpHeader& header = reader.header();
    if (!header.replicatesShare || findChannel(header, "sample.replicate") < 0)
        return reader.read(y, rows, channels.names);
    std::vector<std::string> names = channels.names;
    names.emplace_back("sample.replicate");
    SampleBand band = averageReplicates(reader.read(y, rows, names), channels.names.size());
    band.channels.pop_back();
    band.values.pop_back();
    return band;
}

}  // namespace

int nextMultiple(int a, int step) { return (a / step - (a % step < 0 ? 1 : 0) + 1) * step; }

ChannelChoice chooseChannels(const DumpHeader& header) {
    ChannelChoice choice;
    const auto add = [&](const char* channel) {
        choice.names.emplace_back(channel);
        return static_cast<int>(choice.names.size()) - 1;
    };
    for (const char* channel : {"R", "G", "B", "A"})
        if (findChannel(header, channel) >= 0) choice.layout.radiance.push_back(add(channel));
    if (findChannel(header, "sample.x") >= 0 && findChannel(header, "sample.y") >= 0) {
        choice.layout.x = add("sample.x");
        choice.layout.y = add("sample.y");
    }
    return choice;
}

void forEachBand(const SampleSource& reader, const ChannelChoice& channels, int step,
                 ReconstructionReport& report, const RowSink& sink, const Progress& progress,
                 const std::function<void(const SampleBand&, Image& rows)>& body) {
    std::vector<std::string> names(channels.names.begin(), channels.names.begin() + channels.radianceCount());
    names.insert(names.end(), std::begin(kStddevChannels), std::end(kStddevChannels));
    const Window& window = reader.header().data;
    const int end = window.y + window.height;
    for (int y = window.y; y < end;) {
        // 16 rows: enough regions in flight to keep threads busy, and a 32-spp 4K band stays near 100 MB.
        const int rows = step * std::max(1, 16 / std::max(step, 1));
        const int next = step == 0 ? end : std::min(end, nextMultiple(y, step) - step + rows);
        const auto start = std::chrono::steady_clock::now();
        const SampleBand band = readBand(reader, channels, y, next - y);
        const double readTime = secondsSince(start);
        report.readSeconds += readTime;
        report.samples += static_cast<std::int64_t>(band.samples());
        const Window rowsWindow{band.x, band.y, band.width, band.height};
        requireMemory(reader.path(), imageBytes(rowsWindow, names.size()), "rows as wide as these");
        Image image(rowsWindow, names);
        body(band, image);
        sink(image.pixels.data(), band.height);
        report.solveSeconds += secondsSince(start) - readTime;
        y = next;
        if (progress) progress(y - window.y, window.height);
    }
}

}  // namespace vlx
