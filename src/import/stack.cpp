#include "import/stack.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "exr/flat_images.h"
#include "import/channel_presets.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr char kReplicate[] = "sample.replicate";

// The dump's channels but for its replicates', motion whole or not at all: readers ask for all of it.
std::vector<DumpChannel> stackChannels(const ChannelMap& map) {
    std::vector<DumpChannel> channels = dumpChannels(map, true);
    const auto mapped = [&](std::string_view name) { return map.contains(std::string(name)); };
    if (std::any_of(std::begin(kMotionChannels), std::end(kMotionChannels), mapped))
        for (const std::string_view name : kMotionChannels)
            if (!mapped(name)) channels.push_back({std::string(name), ChannelType::Float});
    return channels;
}

// Cycles writes the motion of surfaces, and leaves 0 where a camera ray meets none: of a sky that a moving
// camera sees that is wrong, of what else it may be (a pane before it) not known either. Returns of how many
// samples.
std::int64_t forgetMotionOfMisses(SampleBand& band) {
    std::vector<std::vector<float>*> motion;
    for (const std::string_view name : kMotionChannels)
        if (const int c = band.channel(std::string(name)); c >= 0)
            motion.push_back(&band.values[static_cast<std::size_t>(c)]);
    const int depth = band.channel("Z");
    if (motion.empty() || depth < 0) return 0;
    std::int64_t count = 0;
    for (std::size_t s = 0; s < band.samples(); ++s) {
        const auto still = [&](const auto* values) { return (*values)[s] == 0 || std::isnan((*values)[s]); };
        if (band.values[static_cast<std::size_t>(depth)][s] != 0 ||
            !std::all_of(motion.begin(), motion.end(), still))
            continue;
        for (auto* values : motion) (*values)[s] = std::numeric_limits<float>::quiet_NaN();
        ++count;
    }
    return count;
}

void noteMotion(const ChannelMap& map, std::int64_t unknown, std::vector<std::string>& notes) {
    std::vector<std::string> missing;
    for (const std::string_view name : kMotionChannels)
        if (!map.contains(std::string(name))) missing.emplace_back(name);
    if (missing.size() == std::size(kMotionChannels)) return;
    if (!missing.empty())
        notes.push_back("The images say nothing about " + listed(missing) + ": not known (NaN) anywhere.");
    if (unknown > 0)
        notes.push_back("The motion of " + std::to_string(unknown) +
                        " samples is not known: Cycles leaves out what is no surface.");
}

// What the preset could not find, or takes in the renderer's own sense.
void notePreset(StackPreset preset, const ChannelMap& map, std::vector<std::string>& notes) {
    if (preset == StackPreset::Cycles && map.contains("N.X"))
        notes.push_back(
            "Normals are taken as they are: Cycles' denoising normals are in camera space and "
            "may be shorter than 1.");
    if (preset == StackPreset::Pbrt && !map.contains("Z"))
        notes.push_back(
            "pbrt's gbuffer has positions, no distances: with its default coordinates, camera space, "
            "--map Z=P.Z takes the depth along the axis.");
    if (preset == StackPreset::Pbrt || preset == StackPreset::Mitsuba)
        notes.push_back(
            "Pixels of these renderers average samples with a filter: only a box filter of one pixel keeps "
            "pixels independent.");
}

}  // namespace

ImportReport stackImages(const std::vector<std::string>& images, const std::string& dump,
                         const StackOptions& options, const Progress& progress) {
    if (images.empty()) throw Error(dump, "expected images to make a dump of, found none");
    FlatImages sources(images);
    ImportReport report;
    const ChosenMap chosen = chooseStackMap(images.front(), sources.channels(0), options);
    report.mapped = chosen.map;

    DumpHeader header;
    header.data = sources.data();
    header.display = sources.display();
    header.channels = stackChannels(report.mapped);
    header.compression = options.compression;
    header.renderer = options.renderer.empty() ? sources.text(0, "Software") : options.renderer;
    header.samples = static_cast<double>(images.size());

    Names taken;
    std::vector<std::vector<FlatChannel>> channels;  // of each dump channel: of each image, if of any
    for (const auto& channel : header.channels) {
        auto& ofImages = channels.emplace_back();
        const auto source = report.mapped.find(channel.name);
        if (source == report.mapped.end()) continue;
        taken.push_back(channelFor(sources.channels(0), source->second).name);
        for (std::size_t i = 0; i < sources.size(); ++i) ofImages.push_back(sources.take(i, source->second));
    }
    for (const auto& name : sources.channels(0))
        if (!contains(taken, name)) report.ignored.push_back(name);

    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);
    const int bandRows = sources.bandRows(header.channels.size() * images.size());
    std::int64_t misses = 0, motionless = 0;
    for (int row = 0; row < header.data.height;) {
        const int rows = std::min(bandRows, header.data.height - row);
        sources.read(header.data.y + row, rows);
        SampleBand band;
        band.x = header.data.x;
        band.y = header.data.y + row;
        band.width = header.data.width;
        band.height = rows;
        for (std::size_t p = 0; p <= band.pixels(); ++p) band.offsets.push_back(p * sources.size());
        for (std::size_t c = 0; c < header.channels.size(); ++c) {
            const std::string& name = header.channels[c].name;
            band.channels.push_back(name);
            auto& values = band.values.emplace_back();
            values.reserve(band.samples());
            const float unknown = std::numeric_limits<float>::quiet_NaN();
            for (std::size_t p = 0; p < band.pixels(); ++p)
                for (std::size_t i = 0; i < sources.size(); ++i)
                    values.push_back(name == kReplicate    ? static_cast<float>(i)
                                     : channels[c].empty() ? unknown
                                                           : sources.value(channels[c][i], p));
            if (name == "Z")
                for (float& z : values) misses += cleanDepth(z) ? 1 : 0;
        }
        if (chosen.preset == StackPreset::Cycles) motionless += forgetMotionOfMisses(band);
        writer.write(std::move(band));
        row += rows;
        if (progress) progress(row, header.data.height);
    }
    writer.close();

    auto& notes = report.notes;
    notes.push_back("Each image is one sample a pixel and one replicate, in the order given.");
    if (!report.mapped.contains("sample.x"))
        notes.push_back("The images say nothing about positions within pixels: none are written.");
    if (report.mapped.contains("Z"))
        notes.push_back(std::to_string(misses) +
                        " samples had a depth that is negative, not finite, or 1e9 and more (nothing hit): "
                        "their Z is 0.");
    noteMotion(report.mapped, motionless, notes);
    notePreset(chosen.preset, report.mapped, notes);
    std::map<std::uint64_t, std::string> seen;
    for (std::size_t i = 0; i < sources.size(); ++i) {
        const auto [same, isNew] = seen.emplace(sources.hash(i), sources.path(i));
        if (!isNew)
            notes.push_back("WARNING: " + sources.path(i) + " is identical to " + same->second +
                            ": rendered with the same seed? Errors will be underestimated.");
    }
    report.missing = missingChannels(header);
    return report;
}

}  // namespace vlx
