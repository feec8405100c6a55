#include "variolux/dump/format.h"

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

int findChannel(const DumpHeader& header, std::string_view name) {
    for (std::size_t i = 0; i < header.channels.size(); ++i)
        if (header.channels[i].name == name) return static_cast<int>(i);
    return -1;
}

}  // namespace vlx
