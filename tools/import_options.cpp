#include "import_options.h"

#include <algorithm>
#include <map>

#include "exr/flat_images.h"
#include "tool_main.h"
#include "variolux/base/channel_names.h"
#include "variolux/base/text.h"

namespace vlx {

ChannelMap parseMappings(const std::vector<std::string>& mappings) {
    ChannelMap map;
    for (const auto& mapping : mappings) {
        const std::size_t sign = mapping.find('=');
        if (sign == 0 || sign == std::string::npos || sign + 1 == mapping.size())
            throw CLI::ValidationError("--map",
                                       "expected NAME=SOURCE or NAME=FACTOR*SOURCE, found '" + mapping + "'");
        const std::string source = mapping.substr(sign + 1);
        if (source.find('*') != std::string::npos && !parseScaled(source))
            throw CLI::ValidationError(
                "--map",
                "expected NAME=FACTOR*SOURCE, FACTOR a finite number other than 0 (a source with a * in "
                "its name: 1*SOURCE), found '" +
                    mapping + "'");
        map[mapping.substr(0, sign)] = source;
    }
    return map;
}

void bindMap(CLI::App& app, std::vector<std::string>& mappings) {
    app.add_option(
           "--map", mappings,
           "Take a dump's channel from an image's, for example R=Combined.R, or from its values times "
           "a factor, motion.y=-1*flow.y; goes before the preset. Repeatable")
        ->type_name("NAME=SOURCE")
        ->expected(1)
        ->take_all();
}

void bindLayer(CLI::App& app, std::string& layer) {
    app.add_option("--layer", layer,
                   "Where R, G, B are: a layer (beauty, ViewLayer.Combined_key) or the view layer whose "
                   "Combined to take (ViewLayer2)")
        ->option_text("NAME");
}

void bindCompanions(CLI::App& app, CompanionImages& with) {
    app.add_option("--albedo", with.albedo, "Image of the albedo, if it is not in the same file");
    app.add_option("--normal", with.normal, "Image of the normals, likewise");
    app.add_option("--depth", with.depth, "Image of the distance, likewise");
}

void bindSamples(CLI::App& app, double& samples) {
    app.add_option("--samples", samples, "Samples a pixel, where the variance is of single ones")
        ->check(finiteWithin(1, 1e9));
}

void MomentFlags::bind(CLI::App& app, const std::string& group) {
    const std::vector<CLI::Option*> before = app.get_options();
    using enum MomentPreset;
    addChoice(app, "--preset", options_.preset,
              {{"auto", Auto},
               {"pbrt", Pbrt},
               {"mitsuba", Mitsuba},
               {"tungsten", Tungsten},
               {"arnold", Arnold},
               {"renderman", RenderMan},
               {"plain", Plain}},
              "Whose channels and whose idea of variance; plain: R, G, B and variance.R, .G, .B");
    addChoice(app, "--variance-is", meaning_,
              {{"preset", Meaning::Preset},
               {"sample", Meaning::Sample},
               {"mean", Meaning::Mean},
               {"second-moment", Meaning::Second}},
              "Of a single sample, of the pixel's mean, or the mean of squares");
    addChoice(app, "--variance-of", colours_,
              {{"preset", Colours::Preset}, {"rgb", Colours::Rgb}, {"xyz", Colours::Xyz}},
              "Colours that the variance belongs to: pbrt's default sensor and Mitsuba have X, Y, Z");
    app.add_option("--variance", options_.with.variance, "Image of the variance, if it is another file");
    bindCompanions(app, options_.with);
    bindSamples(app, options_.samples);
    bindLayer(app, options_.layer);
    bindMap(app, mappings_);
    for (CLI::Option* option : app.get_options())
        if (std::ranges::find(before, option) == before.end()) option->group(group);
}

MomentOptions MomentFlags::options() const {
    MomentOptions options = options_;
    options.map = parseMappings(mappings_);
    if (meaning_ == Meaning::Sample) options.meaning = VarianceMeaning::OfSample;
    if (meaning_ == Meaning::Mean) options.meaning = VarianceMeaning::OfMean;
    if (meaning_ == Meaning::Second) options.meaning = VarianceMeaning::SecondMoment;
    if (colours_ != Colours::Preset) options.xyz = colours_ == Colours::Xyz;
    return options;
}

std::vector<std::string> MomentFlags::files() const {
    const CompanionImages& with = options_.with;
    return {with.variance, with.albedo, with.normal, with.depth};
}

std::vector<std::string*> MomentFlags::fileNames() {
    CompanionImages& with = options_.with;
    return {&with.variance, &with.albedo, &with.normal, &with.depth};
}

namespace {

// A line for each view layer: Blender's files have ninety channels that nobody asked for. What is no channel
// of a layer (of SBMC's files, for example) is a line of its own.
std::string leftOut(const std::vector<std::string>& ignored) {
    constexpr std::size_t kNamed = 4;
    std::vector<std::vector<std::string>> lines;
    std::map<std::string, std::size_t> ofLayer;
    for (const std::string& name : ignored) {
        const bool alone = layerOf(name).empty();
        const std::size_t line =
            alone ? lines.size() : ofLayer.emplace(layerPrefix(name), lines.size()).first->second;
        if (line == lines.size()) lines.emplace_back();
        lines[line].push_back(name);
    }
    std::string text;
    for (const auto& names : lines) {
        std::vector<std::string> shown = names;
        if (names.size() > kNamed) {
            shown.clear();
            for (const std::string& name : names)
                if (shown.empty() || shown.back() != layerOf(name)) shown.push_back(layerOf(name));
            if (shown.size() > kNamed) {
                shown.resize(kNamed);
                shown.emplace_back("...");
            }
        }
        text += "  left out: " +
                (names.size() > kNamed ? std::to_string(names.size()) + " channels of " : std::string()) +
                listed(shown) + "\n";
    }
    return text;
}

}  // namespace

std::string toText(const ImportReport& report) {
    std::string text;
    for (const auto& [channel, source] : report.mapped) text += "  " + channel + " from " + source + "\n";
    text += leftOut(report.ignored);
    for (const auto& part : report.missing) text += "  lacks " + part.what + ": " + part.cost + "\n";
    for (const auto& note : report.notes) text += note + "\n";
    return text;
}

}  // namespace vlx
