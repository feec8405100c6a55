#include "variolux/dump/format.h"

#include <algorithm>
#include <cmath>

#include "variolux/base/channel_names.h"
#include "variolux/base/fingerprint.h"
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

std::vector<MissingPart> missingChannels(const DumpHeader& header) {
    const auto has = [&](std::initializer_list<const char*> names) {
        return std::all_of(names.begin(), names.end(),
                           [&](const char* name) { return findChannel(header, name) >= 0; });
    };
    std::vector<MissingPart> missing;
    const auto lacks = [&](const std::string& what, const std::string& cost) {
        missing.push_back({what, cost});
    };
    if (!has({"sample.x", "sample.y"}))
        lacks("sample positions (sample.x, sample.y)",
              "samples count as taken at their pixel's centre: nothing finer than a pixel can be told apart");
    if (!has({"albedo.R", "albedo.G", "albedo.B"}))
        lacks("albedo (albedo.R, albedo.G, albedo.B)",
              "texture must be told from noise by radiance alone: it comes out softer");
    if (!has({"N.X", "N.Y", "N.Z"}))
        lacks("normals (N.X, N.Y, N.Z)", "edges and curvature of surfaces do not guide the reconstruction");
    if (!has({"Z"})) lacks("distance (Z)", "borders between near and far do not guide the reconstruction");
    if (!has({"A"}))
        lacks("hit flag (A)", "pixels that see past the scene are not told apart, the image has no alpha");
    if (!has({"sample.replicate"}) && !header.independentHalves)
        lacks("replicates (sample.replicate)",
              "samples count as independent: of low-discrepancy samples the error map tells less");
    if (header.pixelFilter.empty())
        lacks("pixel filter (variolux:pixelFilter)", "a box filter of one pixel is assumed");
    return missing;
}

std::vector<std::string> radianceChannels(const std::vector<std::string>& names, const std::string& name) {
    if (std::find(names.begin(), names.end(), name) != names.end()) return {name};
    if (const auto triple = name.empty() ? std::nullopt : layerTriple(names, name))
        return {triple->begin(), triple->end()};
    return {};
}

int findChannel(const DumpHeader& header, std::string_view name) {
    for (std::size_t i = 0; i < header.channels.size(); ++i)
        if (header.channels[i].name == name) return static_cast<int>(i);
    return -1;
}

}  // namespace vlx
