#include "variolux/dump/format.h"

#include <cmath>

#include "variolux/base/image_io.h"

namespace vlx {

const std::vector<DumpChannel>& standardChannels() {
    using enum ChannelType;
    static const std::vector<DumpChannel> channels = {{"R", Float},        {"G", Float},
                                                      {"B", Float},        {"A", Half},
                                                      {"Z", Float},        {"sample.x", Float},
                                                      {"sample.y", Float}, {"albedo.R", Half},
                                                      {"albedo.G", Half},  {"albedo.B", Half},
                                                      {"N.X", Half},       {"N.Y", Half},
                                                      {"N.Z", Half},       {"sample.replicate", Uint}};
    return channels;
}

std::optional<std::uint32_t> replicateNumber(float value) {
    if (!(value >= 0 && value < 4294967296.f) || value != std::floor(value)) return std::nullopt;
    return static_cast<std::uint32_t>(value);
}

void setInputs(DumpHeader& header, const std::string& inputs) {
    header.extra.erase(kInputsAttribute);
    if (!inputs.empty()) header.extra[kInputsAttribute] = inputs;
}

int findChannel(const DumpHeader& header, std::string_view name) {
    for (std::size_t i = 0; i < header.channels.size(); ++i)
        if (header.channels[i].name == name) return static_cast<int>(i);
    return -1;
}

}  // namespace vlx
