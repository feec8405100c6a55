#include "variolux/base/channel_names.h"

#include <algorithm>
#include <initializer_list>

#include "variolux/base/text.h"

namespace vlx {

namespace {

bool hasName(const std::vector<std::string>& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::optional<ChannelTriple> tripleOf(const std::vector<std::string>& names, const std::string& layer,
                                      std::initializer_list<ChannelTriple> endings) {
    for (ChannelTriple triple : endings) {
        for (std::string& name : triple)
            if (!layer.empty()) name.insert(0, layer + ".");
        if (std::ranges::all_of(triple, [&](const std::string& name) { return hasName(names, name); }))
            return triple;
    }
    return std::nullopt;
}

// Of what is a picture: coordinates are only when they are asked for.
std::optional<ChannelTriple> coloursOf(const std::vector<std::string>& names, const std::string& layer) {
    if (auto colours = tripleOf(names, layer, {{"R", "G", "B"}, {"r", "g", "b"}, {"red", "green", "blue"}}))
        return colours;
    return layerTriple(names, layer) ? std::nullopt : tripleOf(names, layer, {{"Y", "Y", "Y"}});
}

}  // namespace

std::string layerOf(const std::string& channel) {
    const std::size_t dot = channel.rfind('.');
    return dot == std::string::npos ? std::string() : channel.substr(0, dot);
}

std::string layerPrefix(const std::string& channel) {
    const std::string above = layerOf(layerOf(channel));
    return above.empty() ? above : above + ".";
}

std::string partChannel(int part, const std::string& partName, const std::string& channel) {
    if (part == 0 || partName.empty() || channel.starts_with(partName + ".")) return channel;
    const std::string prefix = layerPrefix(partName + ".R");
    if (!prefix.empty() && channel.starts_with(prefix)) return channel;
    return partName + "." + channel;
}

std::optional<ChannelTriple> layerTriple(const std::vector<std::string>& names, const std::string& layer) {
    return tripleOf(names, layer, {{"R", "G", "B"}, {"r", "g", "b"}, {"X", "Y", "Z"}, {"x", "y", "z"}});
}

std::optional<std::string> cyclesLayer(const std::vector<std::string>& names) {
    const std::string pass = "Combined.R";
    std::optional<std::string> composite;
    for (const std::string& name : names) {
        if (!name.ends_with(pass)) continue;
        const std::string layer = name.substr(0, name.size() - pass.size());
        if (!layer.empty() && layer.back() != '.') continue;
        if (layer != "Composite.") return layer;
        composite = layer;
    }
    return composite;
}

std::optional<ChannelTriple> findColour(const std::vector<std::string>& names, const std::string& layer) {
    if (!layer.empty()) {
        if (auto combined = layerTriple(names, layer + ".Combined")) return combined;
        if (auto colours = coloursOf(names, layer)) return colours;
        return layerTriple(names, layer);
    }
    if (const auto cycles = cyclesLayer(names))
        if (auto combined = layerTriple(names, *cycles + "Combined")) return combined;
    for (const char* known : {"", "RGBA", "rgba", "beauty", "Ci"})
        if (auto colours = coloursOf(names, known)) return colours;
    return std::nullopt;
}

std::optional<std::string> findAlpha(const std::vector<std::string>& names, const std::string& red) {
    const std::string layer = layerOf(red);
    const std::string last = layer.empty() ? red : red.substr(layer.size() + 1);
    const std::string alpha = (layer.empty() ? "" : layer + ".") + (last == "red"                ? "alpha"
                                                                    : last == "r"                ? "a"
                                                                    : last == "R" || last == "Y" ? "A"
                                                                                                 : "");
    return hasName(names, alpha) ? std::optional(alpha) : std::nullopt;
}

std::optional<ChannelTriple> findError(const std::vector<std::string>& names, const std::string& red) {
    const std::string stddev = "stddev", layer = layerOf(red);
    // Of a part after the first the part's name stands before both.
    for (const std::string& prefix : {layer.empty() ? layer : layer + ".", layerPrefix(red), std::string()})
        if (auto error = tripleOf(names, prefix + stddev, {{"R", "G", "B"}})) return error;
    return std::nullopt;
}

std::string listedLayers(const std::vector<std::string>& names) {
    std::vector<std::string> layers;
    for (const std::string& name : names) {
        const std::string layer = layerOf(name);
        const std::string& shown = layer.empty() ? name : layer;
        if (!hasName(layers, shown)) layers.push_back(shown);
    }
    return listed(layers);
}

}  // namespace vlx
