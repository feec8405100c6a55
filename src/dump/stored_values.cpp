#include "dump/stored_values.h"

#include <Imath/half.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "dump/exr_header.h"
#include "variolux/base/error.h"

namespace vlx {

std::uint32_t toUint(float value) {
    if (!(value > 0.0f)) return 0;
    if (value >= 4294967296.0f) return std::numeric_limits<std::uint32_t>::max();
    return static_cast<std::uint32_t>(std::lround(static_cast<double>(value)));
}

float asStored(float value, ChannelType type) {
    switch (type) {
        case ChannelType::Half:
            return imath_half_to_float(imath_float_to_half(value));
        case ChannelType::Uint:
            return static_cast<float>(toUint(value));
        default:
            return value;
    }
}

void roundToStored(SampleBand& band, const DumpHeader& header) {
    for (std::size_t c = 0; c < band.values.size(); ++c)
        if (header.channels[c].type != ChannelType::Float)
            for (float& value : band.values[c]) value = asStored(value, header.channels[c].type);
}

SampleBand selectChannels(SampleBand band, const std::vector<std::string>& channels,
                          const std::string& path) {
    if (channels.empty()) return band;
    std::vector<std::vector<float>> values;
    for (const std::string& name : channels) {
        const int found = band.channel(name);
        if (found < 0) throw Error(path, "expected a channel " + name + ", found none of this name");
        values.push_back(band.values[static_cast<std::size_t>(found)]);
    }
    band.channels = channels;
    band.values = std::move(values);
    return band;
}

void checkReplicates(const std::string& path, const SampleBand& band) {
    const int channel = band.channel("sample.replicate");
    if (channel < 0) return;
    const std::vector<float>& values = band.values[static_cast<std::size_t>(channel)];
    const auto broken = std::ranges::find_if(values, [](float v) { return !replicateNumber(v); });
    if (broken == values.end()) return;
    const auto sample = static_cast<std::uint64_t>(broken - values.begin());
    const auto pixel = std::ranges::upper_bound(band.offsets, sample) - band.offsets.begin() - 1;
    throw Error(path, "expected whole numbers from 0 to 2^32-1 in channel sample.replicate, found " +
                          std::to_string(*broken) + " in pixel (" +
                          std::to_string(band.x + pixel % band.width) + ", " +
                          std::to_string(band.y + pixel / band.width) + ")");
}

void checkRows(const std::string& path, const DumpHeader& header, int y, int rows) {
    const Window& window = header.data;
    if (rows < 1 || y < window.y || std::int64_t{y} + rows > std::int64_t{window.y} + window.height)
        throw Error(path, "expected rows within " + windowText(window) + ", found rows " + std::to_string(y) +
                              " to " + std::to_string(std::int64_t{y} + rows - 1));
}

}  // namespace vlx
