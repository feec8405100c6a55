#include "import/stack/plan.h"

#include <algorithm>

#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr const char* kColours[] = {"R", "G", "B"};

// With denoising on, Combined is denoised and the samples' mean is the pass Noisy Image. What is mapped by
// hand stays.
bool takeNoisyImage(ChannelMap& map, const Names& names, const std::string& layer) {
    bool taken = false;
    for (const char* c : {"R", "G", "B", "A"}) {
        const std::string noisy = layer + "Noisy Image." + c;
        if (!contains(names, noisy) || !map.contains(c) || map[c] != layer + "Combined." + c) continue;
        map[c] = noisy;
        taken = true;
    }
    return taken;
}

// "L." of Blender's files: of the layer that --layer names, else of the first one that has Combined.
std::optional<std::string> blenderLayer(const std::string& path, const Names& names,
                                        const std::string& wanted) {
    const auto first = cyclesLayer(names);
    return first && !wanted.empty() ? layerPrefix(namedLayer(path, names, wanted).front()) : first;
}

// The dump's channels, motion whole or not at all: readers ask for all of it.
std::vector<DumpChannel> stackChannels(const ChannelMap& map) {
    std::vector<DumpChannel> channels = dumpChannels(map, true);
    const auto mapped = [&](std::string_view name) { return map.contains(std::string(name)); };
    if (std::any_of(std::begin(kMotionChannels), std::end(kMotionChannels), mapped))
        for (const std::string_view name : kMotionChannels)
            if (!mapped(name)) channels.push_back({std::string(name), ChannelType::Float});
    return channels;
}

}  // namespace

StackPlan planStack(const std::string& path, const Names& names, const StackOptions& options) {
    StackOptions all = options;
    const bool byLight = options.groups || !options.passes.empty();
    StackPlan plan;
    if (byLight) {
        const auto layer = blenderLayer(path, names, options.layer);
        const bool cycles = options.preset == StackPreset::Cycles || options.preset == StackPreset::Auto;
        if (!layer || !cycles)
            throw Error(
                path, std::string("expected Blender's multilayer file, a channel L.Combined.R of some "
                                  "layer L, as ") +
                          (options.groups ? "--groups auto" : "--passes") + " says, found " + listed(names) +
                          " (--radiance NAME keeps light of other files)");
        if (options.groups) plan.groups = lightGroups(names, *layer);
        for (const std::string& group : plan.groups)
            if (!contains(all.radiance, group)) all.radiance.push_back(group);
        if (!options.passes.empty()) plan.contributions = contributions(names, *layer);
    }
    const ChosenMap chosen = chooseStackMap(path, names, all);
    plan.preset = chosen.preset;
    plan.mapped = chosen.map;
    plan.radiance = all.radiance;
    if (plan.preset == StackPreset::Cycles) {
        plan.layer = blenderLayer(path, names, options.layer).value_or("");
        plan.noisyImage = takeNoisyImage(plan.mapped, names, plan.layer);
    }
    std::map<std::string, Recipe> made;
    for (const Contribution& part : plan.contributions) {
        if (contains(plan.radiance, part.name)) continue;
        plan.radiance.push_back(part.name);
        for (std::size_t c = 0; c < 3; ++c) {
            const std::string name = part.name + "." + kColours[c];
            if (!plan.mapped.try_emplace(name, toText(part.colours[c])).second ||
                contains(names, name) != (part.colours[c].sum == Names{name}))
                throw Error(path, "expected no channel " + name + ", which --passes makes, found one");
            made[name] = part.colours[c];
        }
    }
    for (const DumpChannel& channel : stackChannels(plan.mapped)) {
        StackChannel& added = plan.channels.emplace_back(StackChannel{channel, {}});
        if (const auto found = made.find(channel.name); found != made.end())
            added.recipe = found->second;
        else if (const auto source = plan.mapped.find(channel.name); source != plan.mapped.end())
            added.recipe.sum = {source->second};
    }
    return plan;
}

std::vector<Mixture> takeFromAll(FlatImages& images, const Recipe& recipe) {
    std::vector<Mixture> taken;
    for (std::size_t i = 0; i < images.size(); ++i) {
        Mixture& mixture = taken.emplace_back();
        for (const std::string& source : recipe.sum) mixture.sum.push_back(images.take(i, source));
        if (!recipe.times.empty()) mixture.times = images.take(i, recipe.times);
    }
    return taken;
}

}  // namespace vlx
