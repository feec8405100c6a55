#include "import/moments.h"

#include <algorithm>
#include <array>

#include "exr/flat_images.h"
#include "import/channel_presets.h"
#include "import/moment_rows.h"
#include "import/origins.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

// What a preset knows: layers in the order of preference.
struct Convention {
    Names variance, albedo, normal, depth, alpha;
    std::optional<VarianceMeaning> meaning;
    bool xyz = false;
};

Convention conventionOf(MomentPreset preset) {
    using enum VarianceMeaning;
    switch (preset) {
        case MomentPreset::Pbrt:
            return {{"Variance"}, {"Albedo"}, {"Ns", "N"}, {}, {}, OfSample, true};
        case MomentPreset::Tungsten:
            return {{"variance"}, {"albedo"}, {"normal", "N"}, {"depth", "Z"}, {"A"}, OfMean, false};
        case MomentPreset::Arnold:
            return {{"variance", "RGBA_variance"},
                    {"denoise_albedo", "diffuse_albedo", "albedo"},
                    {"N"},
                    {"Z"},
                    {"A", "RGBA.A"},
                    OfSample,
                    false};
        case MomentPreset::RenderMan:
            return {{"mse"}, {"albedo"}, {"normal", "Nn"}, {"zfiltered", "z"}, {"A", "a", "Ci.A"},
                    OfMean,  false};
        case MomentPreset::Mitsuba:
            return {{}, {}, {}, {}, {"A"}, SecondMoment, true};
        default:
            return {{"variance", "Variance", "var"},
                    {"albedo"},
                    {"N", "normal"},
                    {"Z", "depth"},
                    {"A"},
                    std::nullopt,
                    false};
    }
}

// Names I of nested integrators whose second moments m2_I.X are there; AOVs inside I have longer names.
Names nestedIntegrators(const Names& names) {
    Names nested;
    for (const auto& name : names)
        if (name.starts_with("m2_") && name.ends_with(".X") && name.find('.') == name.size() - 2)
            nested.push_back(name.substr(3, name.size() - 5));
    return nested;
}

MomentPreset recogniseMoments(const Names& names) {
    if (!nestedIntegrators(names).empty()) return MomentPreset::Mitsuba;
    if (contains(names, "RelativeVariance.R")) return MomentPreset::Pbrt;
    if (findTriple(names, {"mse"})) return MomentPreset::RenderMan;
    if (findTriple(names, {"variance"}) && !contains(names, "Variance.R")) return MomentPreset::Arnold;
    return MomentPreset::Plain;
}

const char* nameOf(MomentPreset preset) {
    switch (preset) {
        case MomentPreset::Pbrt:
            return "pbrt's (--preset pbrt)";
        case MomentPreset::Mitsuba:
            return "Mitsuba's (--preset mitsuba)";
        case MomentPreset::Tungsten:
            return "Tungsten's (--preset tungsten)";
        case MomentPreset::Arnold:
            return "Arnold's (--preset arnold)";
        case MomentPreset::RenderMan:
            return "RenderMan's (--preset renderman)";
        default:
            return "no known renderer's (--preset plain)";
    }
}

const char* nameOf(VarianceMeaning meaning) {
    switch (meaning) {
        case VarianceMeaning::OfSample:
            return "the variance of a single sample";
        case VarianceMeaning::SecondMoment:
            return "the second moment";
        default:
            return "the variance of the mean";
    }
}

ChannelMap presetMap(const Names& names, MomentPreset preset, const Convention& convention,
                     const std::string& layer) {
    ChannelMap map;
    if (preset == MomentPreset::Mitsuba) {
        Names nested = nestedIntegrators(names);
        if (contains(nested, layer)) nested = {layer};
        const std::string own = nested.empty() ? "" : nested.front() + ".";
        Names albedo, normal;
        for (const auto& prefix : {own, std::string()}) {
            for (const char* name : {"albedo", "alb"}) albedo.push_back(prefix + name);
            for (const char* name : {"sh_normal", "normals", "nn", "N", "geo_normal"})
                normal.push_back(prefix + name);
        }
        enter(map, "albedo", findTriple(names, albedo));
        enter(map, "N", findTriple(names, normal));
        for (const auto& name : names)
            if (name.ends_with(".T") && !name.starts_with("m2_")) map.try_emplace("Z", name);
        Names colours = {""};
        for (const auto& name : nested) colours.push_back(name);
        enter(map, "", layer.empty() ? findTriple(names, colours) : findColour(names, layer));
        if (!nested.empty())
            for (const char* c : {"R", "G", "B"})
                map[std::string("variance.") + c] = "m2_" + nested.front() + "." +
                                                    (*c == 'R'   ? "X"
                                                     : *c == 'G' ? "Y"
                                                                 : "Z");
    } else {
        const auto colour = findColour(names, layer);
        auto variance = findTriple(names, convention.variance);
        if (colour && colour->front() == colour->back() && !variance)
            variance = findLuminance(names, convention.variance);
        if (preset == MomentPreset::Plain && cyclesLayer(names))
            map = chooseStackMap("", names, {.preset = StackPreset::Cycles, .layer = layer}).map;
        enter(map, "", colour);
        enter(map, "variance", variance);
        enter(map, "albedo", findTriple(names, convention.albedo));
        enter(map, "N", findTriple(names, convention.normal));
        if (const auto depth = findNumber(names, convention.depth)) map["Z"] = *depth;
    }
    if (map.contains("R"))
        if (const auto alpha = findAlpha(names, map["R"])) map.try_emplace("A", *alpha);
    if (layer.empty())
        for (const auto& alpha : convention.alpha)
            if (contains(names, alpha)) map.try_emplace("A", alpha);
    return map;
}

// 0, 1, 2 for a channel of red, green, blue by its last letter; else -1.
int colourOf(const std::string& channel) {
    const std::size_t dot = channel.rfind('.');
    if (dot == std::string::npos || dot + 2 != channel.size()) return -1;
    const std::size_t found = std::string("RGBrgbXYZxyz").find(channel.back());
    return found == std::string::npos ? -1 : static_cast<int>(found % 3);
}

bool isFeature(const std::string& channel) {
    return channel.size() > 1 ? !channel.starts_with("variance.") : channel == "A" || channel == "Z";
}

}  // namespace

std::unique_ptr<ImportedSamples> openMoments(const std::string& image, const MomentOptions& options) {
    std::vector<std::string> paths = {image};
    Companions companions(options.with);
    companions.appendTo(paths);
    auto opened = std::make_unique<FlatImages>(paths);
    FlatImages& images = *opened;
    const Names& names = images.channels(0);
    const MomentPreset preset =
        options.preset == MomentPreset::Auto ? recogniseMoments(names) : options.preset;
    const Convention convention = conventionOf(preset);

    if (!options.layer.empty()) namedLayer(image, names, options.layer);
    Origins origins;
    for (const auto& [channel, name] : presetMap(names, preset, convention, options.layer))
        origins[channel] = {0, name};
    companions.enterInto(origins, images);
    for (const auto& [channel, name] : options.map) {
        if (channel == "sample.replicate") throw Error(image, "sample.replicate cannot be mapped");
        origins[channel] = {0, name};
    }
    for (const char* channel : {"R", "G", "B"})
        require(images, origins, channel, std::string("name it: --map ") + channel + "=CHANNEL");
    for (const char* channel : {"variance.R", "variance.G", "variance.B"})
        if (!origins.contains(channel))
            throw Error(image,
                        "expected the variance of each pixel (variance.R, .G, .B, or a renderer's own "
                        "names), found " +
                            listed(names) +
                            ". Name its channels (--map variance.R=CHANNEL, .G and .B likewise, of luminance "
                            "one for all "
                            "three) or its image "
                            "(--variance), or make a dump of images with several seeds (vlx-pack "
                            "stack) or of two half-buffers (vlx-pack buffers)");

    MomentChannels source;
    const auto meaning = options.meaning ? options.meaning : convention.meaning;
    if (!meaning)
        throw Error(image,
                    "no renderer is known by these channels: say what its variance is (--variance-is sample, "
                    "mean or second-moment), or whose they are (--preset); the image has " +
                        listed(names));
    source.meaning = *meaning;
    source.xyz = options.xyz.value_or(convention.xyz);
    source.samples = options.samples > 0 ? options.samples : images.number(0, "samplesPerPixel").value_or(0);
    const double least = source.meaning == VarianceMeaning::SecondMoment ? 2
                         : source.meaning == VarianceMeaning::OfSample   ? 1
                                                                         : 0;
    if (source.samples < least)
        throw Error(image, std::string("its channels are taken for ") + nameOf(preset) +
                               ", its variance for " + nameOf(source.meaning) +
                               ": expected the number of samples a pixel, found none in the file. Say it "
                               "(--samples N), or what else the variance is (--variance-is mean)");
    source.mean = takeThree(images, origins, {"R", "G", "B"});
    source.variance = takeThree(images, origins, {"variance.R", "variance.G", "variance.B"});
    if (source.meaning == VarianceMeaning::SecondMoment) {
        // The first moments that belong to second ones named m2_...
        std::array<FlatChannel, 3> first;
        bool found = true;
        for (std::size_t c = 0; c < 3; ++c) {
            const Origin& second = origins.at(std::string("variance.") + "RGB"[c]);
            found = found && second.channel.starts_with("m2_") &&
                    contains(images.channels(second.image), second.channel.substr(3));
            if (found) first[c] = images.take(second.image, second.channel.substr(3));
        }
        if (found) source.first = first;
        if (!found && source.xyz)
            throw Error(image,
                        "second moments of X, Y, Z need their means: expected channels named like them "
                        "without m2_ (or --variance-of rgb where they are not of X, Y, Z); the image has " +
                            listed(names));
    }
    for (const auto& wanted : options.radiance) {
        const Names parts = radianceChannels(names, wanted);
        if (parts.empty())
            throw Error(image,
                        "expected a channel or layer " + wanted + " for --radiance, found " + listed(names));
        for (const auto& part : parts) {
            if (!origins.try_emplace(part, Origin{0, part}).second)
                throw Error(image, part + " is taken already and cannot be named by --radiance");
            source.radiance.push_back({part, images.take(0, part), colourOf(part)});
        }
    }
    for (const auto& [channel, origin] : origins)
        if (isFeature(channel) &&
            std::none_of(source.radiance.begin(), source.radiance.end(),
                         [&name = channel](const auto& part) { return part.name == name; }))
            source.features.emplace_back(channel, images.take(origin.image, origin.channel));

    ImportReport report;
    describe(images, origins, 1, report);
    report.notes.push_back(std::string("The channels are taken for ") + nameOf(preset) + ".");
    report.notes.push_back(std::string("The variance is taken as ") + nameOf(source.meaning) +
                           (least > 0 ? ", of " + std::to_string(source.samples) + " samples." : "."));
    if (preset == MomentPreset::Pbrt)
        report.notes.push_back(
            "pbrt's variance leaves out samples that hit nothing: where a pixel sees past the scene it is "
            "too "
            "small or too large.");
    if (preset == MomentPreset::Arnold)
        report.notes.push_back("Arnold's samples a pixel are the square of its AA samples.");
    const std::string renderer = options.renderer.empty() ? images.text(0, "Software") : options.renderer;
    return std::make_unique<MomentRows>(
        std::move(opened), std::move(source),
        MomentOutput{renderer, options.halves, options.seed, options.compression, options.inputs},
        std::move(report));
}

ImportReport importMoments(const std::string& image, const std::string& dump, const MomentOptions& options,
                           const Progress& progress) {
    const auto samples = openMoments(image, options);
    writeSamples(*samples, dump, progress);
    return samples->report();
}

}  // namespace vlx
