#include "import/channel_presets.h"

#include <algorithm>

#include "exr/flat_images.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr char kReplicate[] = "sample.replicate";
// Cycles and others write 1e10 for the depth of what no surface stopped.
constexpr float kFarAway = 1e9f;

ChannelMap cyclesMap(const Names& names, const std::string& layer) {
    ChannelMap map;
    const auto take = [&](const std::string& channel, const std::string& pass) {
        if (!map.contains(channel) && contains(names, layer + pass)) map[channel] = layer + pass;
    };
    for (const char* c : {"R", "G", "B", "A"}) take(c, std::string("Combined.") + c);
    for (const char* c : {"R", "G", "B"})
        take(std::string("albedo.") + c, std::string("Denoising Albedo.") + c);
    for (const char* c : {"X", "Y", "Z"}) take(std::string("N.") + c, std::string("Denoising Normal.") + c);
    for (const char* pass : {"Denoising Depth.Z", "Denoising Depth.V", "Depth.Z", "Depth.V"}) take("Z", pass);
    // In pixels, y upwards: (X, Y) to where the point was in the frame before, (Z, W) from where it will be
    // in the next.
    const auto takeMotion = [&](std::size_t i, const std::string& sign, const std::string& end) {
        if (contains(names, layer + "Vector." + end))
            map[std::string(kMotionChannels[i])] = sign + layer + "Vector." + end;
    };
    takeMotion(0, "", "X");
    takeMotion(1, "-1*", "Y");
    takeMotion(2, "-1*", "Z");
    takeMotion(3, "", "W");
    return map;
}

ChannelMap plainMap(const Names& names) {
    ChannelMap map;
    for (const auto& channel : standardChannels())
        if (channel.name != kReplicate && contains(names, channel.name)) map[channel.name] = channel.name;
    for (const std::string_view channel : kMotionChannels)
        if (contains(names, std::string(channel))) map[std::string(channel)] = channel;
    if (!cyclesLayer(names)) enter(map, "", findColour(names));
    if (map.contains("R"))
        if (const auto alpha = findAlpha(names, map["R"])) map.try_emplace("A", *alpha);
    return map;
}

// Prefixes of names that end with `ending`.
Names layersWith(const Names& names, const std::string& ending) {
    Names layers;
    for (const auto& name : names)
        if (name.ends_with(ending)) layers.push_back(name.substr(0, name.size() - ending.size()));
    return layers;
}

const Names kMitsubaAlbedo = {"albedo", "alb", "albedos", "diffuse_reflectance"};
const Names kMitsubaNormals = {"sh_normal", "sh_normals", "normals", "normal", "nn", "n", "N", "geo_normal"};

ChannelMap mitsubaMap(const Names& names) {
    ChannelMap map;
    enter(map, "albedo", findTriple(names, kMitsubaAlbedo));
    enter(map, "N", findTriple(names, kMitsubaNormals));
    if (const Names depth = layersWith(names, ".T"); !depth.empty()) map["Z"] = depth.front() + ".T";
    // The film's own channels, or those of the first nested integrator.
    Names colours = {""};
    for (const auto& layer : layersWith(names, ".R"))
        if (!map.contains("albedo.R") || map["albedo.R"] != layer + ".R") colours.push_back(layer);
    enter(map, "", findTriple(names, colours));
    if (map.contains("R"))
        if (const auto alpha = findAlpha(names, map["R"])) map["A"] = *alpha;
    return map;
}

ChannelMap pbrtMap(const Names& names) {
    ChannelMap map;
    enter(map, "", findTriple(names, {""}));
    enter(map, "albedo", findTriple(names, {"Albedo"}));
    enter(map, "N", findTriple(names, {"Ns", "N"}));
    return map;
}

StackPreset recogniseStack(const Names& names) {
    if (cyclesLayer(names)) return StackPreset::Cycles;
    if (contains(names, "Albedo.R") && contains(names, "Ns.X")) return StackPreset::Pbrt;
    const bool mitsuba = !layersWith(names, ".T").empty() || contains(names, "nn.X") ||
                         contains(names, "sh_normal.X") || contains(names, "normals.X");
    return mitsuba ? StackPreset::Mitsuba : StackPreset::Plain;
}

}  // namespace

std::optional<std::array<std::string, 3>> findTriple(const Names& names, const Names& layers) {
    for (const auto& layer : layers)
        if (auto triple = layerTriple(names, layer)) return triple;
    return std::nullopt;
}

std::optional<std::array<std::string, 3>> findLuminance(const Names& names, const Names& layers) {
    for (const auto& layer : layers)
        if (const std::string name = layer + (layer.empty() ? "Y" : ".Y"); contains(names, name))
            return std::array{name, name, name};
    return std::nullopt;
}

std::optional<std::string> findNumber(const Names& names, const Names& layers) {
    for (const auto& layer : layers)
        for (const char* end : {"", ".Z", ".z", ".T", ".V", ".Y", ".R", ".r", ".X"})
            if (contains(names, layer + end)) return layer + end;
    return std::nullopt;
}

void enter(ChannelMap& map, const std::string& to, const std::optional<std::array<std::string, 3>>& from) {
    if (!from) return;
    const std::string ends = to == "N" ? "XYZ" : "RGB";
    for (std::size_t c = 0; c < 3; ++c) map.try_emplace((to.empty() ? "" : to + ".") + ends[c], (*from)[c]);
}

ChannelTriple namedLayer(const std::string& path, const Names& names, const std::string& layer) {
    if (auto found = findColour(names, layer)) return *found;
    throw Error(path, "expected a layer " + layer + " of colours, or a view layer " + layer +
                          " that has Combined, as --layer says, found the layers " + listedLayers(names));
}

ChosenMap chooseStackMap(const std::string& path, const Names& names, const StackOptions& options) {
    ChosenMap chosen;
    chosen.preset = options.preset == StackPreset::Auto ? recogniseStack(names) : options.preset;
    std::optional<ChannelTriple> named;
    if (!options.layer.empty()) named = namedLayer(path, names, options.layer);
    switch (chosen.preset) {
        case StackPreset::Cycles: {
            const auto layer = named ? std::optional(layerPrefix(named->front())) : cyclesLayer(names);
            if (!layer)
                throw Error(path,
                            "expected a channel L.Combined.R of some layer L, as --preset cycles says, found "
                            "the layers " +
                                listedLayers(names));
            chosen.map = cyclesMap(names, *layer);
            break;
        }
        case StackPreset::Mitsuba:
            chosen.map = mitsubaMap(names);
            break;
        case StackPreset::Pbrt:
            chosen.map = pbrtMap(names);
            break;
        default:
            chosen.map = plainMap(names);
    }
    if (named) {
        for (const char* c : {"R", "G", "B", "A"}) chosen.map.erase(c);
        enter(chosen.map, "", named);
        if (const auto alpha = findAlpha(names, named->front())) chosen.map["A"] = *alpha;
    }
    for (const auto& [channel, source] : options.map) {
        if (channel == kReplicate)
            throw Error(path, "sample.replicate cannot be mapped: it is the image's number");
        chosen.map[channel] = source;
    }
    for (const auto& wanted : options.radiance) {
        const Names parts = radianceChannels(names, wanted);
        if (parts.empty())
            throw Error(path,
                        "expected a channel or layer " + wanted + " for --radiance, found " + listed(names));
        for (const auto& part : parts)
            if (!chosen.map.try_emplace(part, part).second)
                throw Error(path, part + " is taken already and cannot be named by --radiance");
    }
    for (const char* needed : {"R", "G", "B"})
        if (!chosen.map.contains(needed))
            throw Error(path, std::string("found nothing to take as ") + needed + " (name it: --map " +
                                  needed + "=CHANNEL); the image has " + listed(names));
    return chosen;
}

std::vector<DumpChannel> dumpChannels(const ChannelMap& map, bool replicates) {
    std::vector<DumpChannel> channels;
    for (const auto& standard : standardChannels())
        if (standard.name == kReplicate ? replicates : map.contains(standard.name))
            channels.push_back(standard);
    for (const auto& [name, source] : map) {
        const auto known = [&name = name](const DumpChannel& channel) { return channel.name == name; };
        if (std::none_of(channels.begin(), channels.end(), known))
            channels.push_back({name, ChannelType::Float});
    }
    return channels;
}

bool cleanDepth(float& z) {
    if (z >= 0 && z < kFarAway) return false;
    z = 0;
    return true;
}

}  // namespace vlx
