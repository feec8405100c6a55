#include "import/stack.h"

#include <algorithm>
#include <map>

#include "exr/flat_images.h"
#include "import/channel_presets.h"
#include "variolux/base/error.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr char kReplicate[] = "sample.replicate";

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
    header.channels = dumpChannels(report.mapped, true);
    header.compression = options.compression;
    header.renderer = options.renderer.empty() ? sources.text(0, "Software") : options.renderer;
    header.samples = static_cast<double>(images.size());

    Names taken;
    std::vector<std::vector<FlatChannel>> channels;  // of each dump channel: of each image
    for (const auto& channel : header.channels) {
        auto& ofImages = channels.emplace_back();
        if (channel.name == kReplicate) continue;
        taken.push_back(report.mapped.at(channel.name));
        for (std::size_t i = 0; i < sources.size(); ++i) ofImages.push_back(sources.take(i, taken.back()));
    }
    for (const auto& name : sources.channels(0))
        if (!contains(taken, name)) report.ignored.push_back(name);

    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);
    const int bandRows = sources.bandRows(header.channels.size() * images.size());
    std::int64_t misses = 0;
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
            const bool replicate = name == kReplicate;
            for (std::size_t p = 0; p < band.pixels(); ++p)
                for (std::size_t i = 0; i < sources.size(); ++i)
                    values.push_back(replicate ? static_cast<float>(i) : sources.value(channels[c][i], p));
            if (name == "Z")
                for (float& z : values) misses += cleanDepth(z) ? 1 : 0;
        }
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
