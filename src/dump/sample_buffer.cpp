#include "variolux/dump/sample_buffer.h"

#include <algorithm>
#include <utility>

#include "dump/exr_header.h"
#include "dump/stored_values.h"
#include "variolux/base/error.h"

namespace vlx {

SampleBuffer::SampleBuffer(DumpHeader header, SampleBand samples, std::string name)
    : name_(std::move(name)), header_(std::move(header)), samples_(std::move(samples)) {
    const auto expect = [&](bool condition, const std::string& what) {
        if (!condition) throw Error(name_, what);
    };
    const Window found{samples_.x, samples_.y, samples_.width, samples_.height};
    expect(header_.data.width > 0 && header_.data.height > 0,
           "expected a data window with pixels, found " + windowText(header_.data));
    expect(header_.display.width > 0 && header_.display.height > 0,
           "expected a display window (header.display: the whole picture) with pixels, found " +
               windowText(header_.display));
    expect(found == header_.data, "expected the samples of the data window, " + windowText(header_.data) +
                                      ", found those of " + windowText(found));
    for (const char* channel : {"R", "G", "B"})
        expect(findChannel(header_, channel) >= 0,
               std::string("expected channels R, G and B, found no ") + channel);
    expect(samples_.channels.size() == header_.channels.size() &&
               std::equal(samples_.channels.begin(), samples_.channels.end(), header_.channels.begin(),
                          [](const std::string& a, const DumpChannel& b) { return a == b.name; }),
           "expected the header's " + std::to_string(header_.channels.size()) +
               " channels in their order, found " + std::to_string(samples_.channels.size()) + " or others");
    const auto& offsets = samples_.offsets;
    expect(offsets.size() == samples_.pixels() + 1 && offsets.front() == 0 &&
               std::is_sorted(offsets.begin(), offsets.end()),
           "expected " + std::to_string(samples_.pixels() + 1) +
               " offsets from 0 that do not decrease, found " + std::to_string(offsets.size()) +
               " or decreasing ones");
    expect(
        samples_.values.size() == samples_.channels.size() &&
            std::all_of(samples_.values.begin(), samples_.values.end(),
                        [&](const auto& values) { return values.size() == samples_.samples(); }),
        "expected " + std::to_string(samples_.samples()) + " values of each channel, found another number");
    roundToStored(samples_, header_);
    checkReplicates(name_, samples_);
}

SampleBand SampleBuffer::read(int y, int rows, const std::vector<std::string>& channels) const {
    checkRows(name_, header_, y, rows);
    SampleBand band;
    band.x = samples_.x;
    band.y = y;
    band.width = samples_.width;
    band.height = rows;
    const auto width = static_cast<std::size_t>(samples_.width);
    const std::size_t first = static_cast<std::size_t>(y - samples_.y) * width;
    const std::uint64_t begin = samples_.offsets[first];
    const std::uint64_t end = samples_.offsets[first + band.pixels()];
    band.offsets.reserve(band.pixels() + 1);
    for (std::size_t p = 0; p <= band.pixels(); ++p)
        band.offsets.push_back(samples_.offsets[first + p] - begin);
    band.channels = channels.empty() ? samples_.channels : channels;
    for (const std::string& channel : band.channels) {
        const int found = samples_.channel(channel);
        if (found < 0) throw Error(name_, "expected a channel " + channel + ", found none of this name");
        const auto values = samples_.values[static_cast<std::size_t>(found)].begin();
        band.values.emplace_back(values + static_cast<std::ptrdiff_t>(begin),
                                 values + static_cast<std::ptrdiff_t>(end));
    }
    return band;
}

}  // namespace vlx
