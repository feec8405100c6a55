#include "edit/info.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>

#include "dump/exr_header.h"
#include "edit/band_rows.h"
#include "variolux/base/text.h"
#include "variolux/dump/layers.h"
#include "variolux/dump/reader.h"

namespace vlx {

namespace {

const char* typeText(ChannelType type) {
    switch (type) {
        case ChannelType::Half:
            return "half";
        case ChannelType::Uint:
            return "uint";
        default:
            return "float";
    }
}

const char* compressionText(DumpCompression compression) {
    switch (compression) {
        case DumpCompression::None:
            return "none";
        case DumpCompression::Rle:
            return "rle";
        default:
            return "zips";
    }
}

std::vector<MissingPart> findMissing(const DumpInfo& info) {
    std::vector<MissingPart> missing = missingChannels(info.header);
    if (info.maxSamples == 1 && findChannel(info.header, "variance.R") < 0)
        missing.push_back(
            {"a second sample in any pixel",
             "the samples' noise can only be estimated from neighbouring pixels, not measured"});
    if (info.emptyPixels > 0)
        missing.push_back({"samples in " + std::to_string(info.emptyPixels) + " pixels",
                           "these pixels are predicted from their neighbours"});
    return missing;
}

std::string bytesText(std::uint64_t bytes) {
    if (bytes < 10'000) return std::to_string(bytes) + " bytes";
    const auto value = static_cast<double>(bytes);
    if (bytes < 1'000'000) return formatted("%.1f kB", value * 1e-3);
    if (bytes < 1'000'000'000) return formatted("%.1f MB", value * 1e-6);
    return formatted("%.2f GB", value * 1e-9);
}

}  // namespace

DumpInfo inspectDump(const std::string& path, const Progress& progress) {
    const DumpReader reader(path);
    DumpInfo info;
    info.path = path;
    info.header = reader.header();
    info.fileBytes = reader.fileBytes();
    info.minSamples = std::numeric_limits<std::uint32_t>::max();
    const Window& window = info.header.data;
    std::vector<std::string> channels = {"R", "G", "B"};
    if (findChannel(info.header, "sample.replicate") >= 0) channels.emplace_back("sample.replicate");
    const bool positions =
        findChannel(info.header, "sample.x") >= 0 && findChannel(info.header, "sample.y") >= 0;
    if (positions) channels.insert(channels.end(), {"sample.x", "sample.y"});
    PositionCheck check(info.header);
    MotionCheck motion(info.header);
    for (const std::string& name : motion.channels())
        if (std::ranges::find(channels, name) == channels.end()) channels.push_back(name);
    info.layers = layersFoundBy(reader);
    std::set<std::uint32_t> replicates;
    for (int row = 0; row < window.height;) {
        const int rows = std::min(kBandRows, window.height - row);
        const SampleBand band = reader.read(window.y + row, rows, channels);
        if (const int c = band.channel("sample.replicate"); c >= 0)
            for (const float value : band.values[static_cast<std::size_t>(c)])
                replicates.insert(replicateNumber(value).value());
        if (positions) check.add(band);
        motion.add(band);
        for (std::size_t p = 0; p < band.pixels(); ++p) {
            const auto count = static_cast<std::uint32_t>(band.offsets[p + 1] - band.offsets[p]);
            info.minSamples = std::min(info.minSamples, count);
            info.maxSamples = std::max(info.maxSamples, count);
            if (count == 0) ++info.emptyPixels;
        }
        for (std::size_t i = 0; i < band.samples(); ++i)
            if (!std::isfinite(band.values[0][i]) || !std::isfinite(band.values[1][i]) ||
                !std::isfinite(band.values[2][i]))
                ++info.nonFiniteSamples;
        info.samples += band.samples();
        row += rows;
        if (progress) progress(row, window.height);
    }
    info.positions = check.report();
    if (!motion.channels().empty()) info.motion = motion.report();
    info.replicates = static_cast<std::uint32_t>(replicates.size());
    info.meanSamples = static_cast<double>(info.samples) / static_cast<double>(window.pixels());
    std::uint64_t bytesPerSample = 0;
    for (const auto& channel : info.header.channels) bytesPerSample += valueBytes(channel.type);
    info.rawBytes = info.samples * bytesPerSample;
    info.missing = findMissing(info);
    return info;
}

std::string toText(const DumpInfo& info) {
    const DumpHeader& header = info.header;
    std::string text = printable(info.path) + "\n";
    const auto line = [&](const std::string& label, const std::string& content) {
        text += "  " + label + std::string(label.size() < 14 ? 14 - label.size() : 1, ' ') + content + "\n";
    };
    const auto given = [](const std::string& content) {
        return content.empty() ? std::string("not given") : printable(content);
    };
    line("renderer", given(header.renderer));
    line("scene", given(header.scene));
    line("size",
         windowText(header.data) +
             (header.display == header.data ? "" : ", of a picture of " + windowText(header.display)));
    line("samples", std::to_string(info.samples) + "; a pixel has " + std::to_string(info.minSamples) +
                        " (least), " + formatted("%.2f", info.meanSamples) + " (mean), " +
                        std::to_string(info.maxSamples) + " (most)");
    line("not finite", std::to_string(info.nonFiniteSamples) + " samples");
    if (const std::string where = toText(info.positions); !where.empty()) line("WARNING", where);
    if (!info.layers.empty())
        line("WARNING",
             "a layered deep image, by " + info.layers + ": layers are to be composited, not averaged");
    const double share =
        info.rawBytes > 0 ? 100.0 * static_cast<double>(info.fileBytes) / static_cast<double>(info.rawBytes)
                          : 100.0;
    line("file", bytesText(info.fileBytes) + ", compression " + compressionText(header.compression) + ", " +
                     formatted("%.0f %%", share) + " of the samples' " + bytesText(info.rawBytes));
    std::string names;
    for (const auto& channel : header.channels)
        names += (names.empty() ? "" : ", ") + printable(channel.name) + " (" + typeText(channel.type) + ")";
    line("channels", names);
    line("effects", given(listed(header.effects)));
    line("pixel filter", given(header.pixelFilter));
    if (header.samples) line("asked for", formatted("%g samples a pixel", *header.samples));
    if (header.averaged > 1)
        line("each is", "the mean of " + formatted("%g", header.averaged) + " samples of the renderer");
    if (header.seed) line("seed", std::to_string(*header.seed));
    if (header.renderSeconds) line("traced in", formatted("%.2f s", *header.renderSeconds));
    if (header.splatReplicates > 0)
        line("splats", "of " + std::to_string(header.splatReplicates) +
                           " replicates; reading adds them to the samples of their replicate");
    if (header.independentHalves)
        line("halves", "samples of even and odd number are independent randomisations");
    if (info.motion) {
        for (std::size_t k = 0; k < 2; ++k) {
            const MotionReport& motion = (*info.motion)[k];
            line(k == 0 ? "motion, before" : "motion, next", toText(motion));
            if (const std::string doubt = doubtOf(motion); !doubt.empty()) line("WARNING", doubt);
        }
    }
    if (info.missing.empty()) line("missing", "nothing");
    for (const auto& part : info.missing) line("missing", part.what + ": " + part.cost);
    return text;
}

std::string toJson(const DumpInfo& info) {
    using Json = nlohmann::ordered_json;
    const DumpHeader& header = info.header;
    const auto window = [](const Window& w) {
        return Json{{"x", w.x}, {"y", w.y}, {"width", w.width}, {"height", w.height}};
    };
    Json json = {{"path", info.path},
                 {"version", header.version},
                 {"renderer", header.renderer},
                 {"scene", header.scene},
                 {"dataWindow", window(header.data)},
                 {"displayWindow", window(header.display)},
                 {"samples",
                  {{"total", info.samples},
                   {"min", info.minSamples},
                   {"mean", info.meanSamples},
                   {"max", info.maxSamples},
                   {"emptyPixels", info.emptyPixels},
                   {"nonFinite", info.nonFiniteSamples},
                   {"replicates", info.replicates},
                   {"independentHalves", header.independentHalves}}},
                 {"layers", info.layers},
                 {"fileBytes", info.fileBytes},
                 {"rawBytes", info.rawBytes},
                 {"compression", compressionText(header.compression)},
                 {"effects", header.effects},
                 {"pixelFilter", header.pixelFilter}};
    json["channels"] = Json::array();
    for (const auto& channel : header.channels)
        json["channels"].push_back({{"name", channel.name}, {"type", typeText(channel.type)}});
    if (info.positions.samples > 0)
        json["positions"] = {{"notFinite", info.positions.notFinite},
                             {"outside", info.positions.outside},
                             {"warning", toText(info.positions)}};
    if (info.motion) {
        const auto report = [](const MotionReport& motion) {
            return Json{{"samples", motion.samples}, {"known", motion.known},   {"still", motion.still},
                        {"leaving", motion.leaving}, {"median", motion.median}, {"largest", motion.largest},
                        {"warning", doubtOf(motion)}};
        };
        json["motion"] = {{"before", report((*info.motion)[0])}, {"next", report((*info.motion)[1])}};
    }
    if (header.samples) json["samplesAskedFor"] = *header.samples;
    if (header.averaged > 1) json["averaged"] = header.averaged;
    if (header.splatReplicates > 0) json["splatReplicates"] = header.splatReplicates;
    if (header.seed) json["seed"] = *header.seed;
    if (header.renderSeconds) json["renderSeconds"] = *header.renderSeconds;
    if (header.worldToCamera) json["worldToCamera"] = *header.worldToCamera;
    if (header.worldToNDC) json["worldToNDC"] = *header.worldToNDC;
    json["attributes"] = header.extra;
    json["missing"] = Json::array();
    for (const auto& part : info.missing)
        json["missing"].push_back({{"what", part.what}, {"cost", part.cost}});
    // Names in a file need not be UTF-8, JSON must be.
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vlx
