#include "edit/merge.h"

#include <algorithm>
#include <array>
#include <map>
#include <memory>
#include <numeric>
#include <set>

#include "dump/exr_header.h"
#include "edit/band_rows.h"
#include "edit/merge_flat.h"
#include "exr/part_layout.h"
#include "exr/raw_file.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/image_io.h"
#include "variolux/base/text.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

// Whether an OpenEXR file says that it has deep parts; other files are flat images or nothing at all.
bool isDeep(const std::string& path) {
    const RawFile file(path, path, RawFile::Mode::Read);
    std::array<unsigned char, 8> start{};
    if (file.size() < start.size()) return false;
    file.readAt(0, start);
    return start[0] == 0x76 && start[1] == 0x2f && start[2] == 0x31 && start[3] == 0x01 &&
           (start[5] & 0x08) != 0;
}

std::string text(const std::string& value) { return "'" + value + "'"; }
std::string text(int value) { return std::to_string(value); }
std::string text(const std::optional<std::int64_t>& value) { return value ? std::to_string(*value) : "none"; }
std::string text(const std::optional<double>& value) { return value ? std::to_string(*value) : "none"; }
std::string text(const std::vector<std::string>& values) { return "'" + listed(values) + "'"; }
std::string text(const std::optional<std::vector<float>>& value) { return value ? "another matrix" : "none"; }

std::vector<std::string> channelTexts(const DumpHeader& header) {
    std::vector<std::string> names;
    for (const auto& channel : header.channels)
        names.push_back(channel.name + (channel.type == ChannelType::Half    ? " half"
                                        : channel.type == ChannelType::Float ? ""
                                                                             : " uint"));
    return names;
}

void checkSamePicture(const DumpReader& first, const DumpReader& part) {
    const DumpHeader &a = first.header(), &b = part.header();
    const auto check = [&](const char* what, const auto& expected, const auto& found) {
        if (!(expected == found))
            throw Error(part.path(), std::string("expected ") + what + " " + text(expected) + " as in " +
                                         first.path() + ", found " + text(found) +
                                         ": not parts of one picture");
    };
    check("a picture of", windowText(a.display), windowText(b.display));
    check("channels", channelTexts(a), channelTexts(b));
    check("renderer", a.renderer, b.renderer);
    check("scene", a.scene, b.scene);
    check("seed", a.seed, b.seed);
    check("samples", a.samples, b.samples);
    check("replicates with splats", a.splatReplicates, b.splatReplicates);
    check("independent halves", a.independentHalves, b.independentHalves);
    check("pixel filter", a.pixelFilter, b.pixelFilter);
    check("effects", a.effects, b.effects);
    check("worldToCamera", a.worldToCamera, b.worldToCamera);
    check("worldToNDC", a.worldToNDC, b.worldToNDC);
}

// The parts of a band of the whole, put together.
SampleBand joined(const DumpHeader& header, int y, int rows, const std::vector<SampleBand>& pieces) {
    SampleBand band{header.data.x, y, header.data.width, rows, {}, {}, {}};
    band.offsets.assign(band.pixels() + 1, 0);
    const auto forEachRow = [&](const auto& body) {
        for (const SampleBand& piece : pieces)
            for (int row = 0; row < piece.height; ++row)
                body(piece, static_cast<std::size_t>(row) * static_cast<std::size_t>(piece.width),
                     static_cast<std::size_t>(piece.y + row - y) * static_cast<std::size_t>(band.width) +
                         static_cast<std::size_t>(piece.x - band.x));
    };
    forEachRow([&](const SampleBand& piece, std::size_t from, std::size_t to) {
        for (std::size_t i = 0; i < static_cast<std::size_t>(piece.width); ++i)
            band.offsets[to + i + 1] = piece.offsets[from + i + 1] - piece.offsets[from + i];
    });
    std::partial_sum(band.offsets.begin(), band.offsets.end(), band.offsets.begin());
    for (std::size_t c = 0; c < header.channels.size(); ++c) {
        band.channels.push_back(header.channels[c].name);
        auto& values = band.values.emplace_back(band.samples());
        forEachRow([&](const SampleBand& piece, std::size_t from, std::size_t to) {
            const auto begin = static_cast<std::ptrdiff_t>(piece.offsets[from]);
            const auto end =
                static_cast<std::ptrdiff_t>(piece.offsets[from + static_cast<std::size_t>(piece.width)]);
            std::copy(piece.values[c].begin() + begin, piece.values[c].begin() + end,
                      values.begin() + static_cast<std::ptrdiff_t>(band.offsets[to]));
        });
    }
    return band;
}

MergeReport mergeDumps(const std::vector<std::string>& paths, const std::string& output,
                       const MergeOptions& options, const Progress& progress) {
    const DumpReader first(paths.front());
    std::vector<PicturePart> parts;
    double seconds = 0;
    for (const auto& path : paths) {
        const DumpReader part(path);
        checkSamePicture(first, part);
        parts.push_back({path, part.header().data});
        seconds += part.header().renderSeconds.value_or(0);
    }
    DumpHeader header = first.header();
    header.splatReplicates = 0;  // the samples hold them
    header.data = options.crop ? boundsOf(parts) : header.display;
    header.renderSeconds.reset();  // close() records it
    setInputs(header, options.inputs);
    arrangeParts(parts, header.data, output);

    DumpWriter writer(output, header);
    std::map<std::string, std::unique_ptr<DumpReader>> open;  // only the files of the rows at work
    for (int row = 0; row < header.data.height;) {
        const int y = header.data.y + row;
        const int rows = std::min(kBandRows, header.data.height - row);
        std::vector<SampleBand> pieces;
        for (const PicturePart& part : parts) {
            const int begin = std::max(y, part.data.y);
            const int end = std::min(y + rows, part.data.y + part.data.height);
            if (begin >= end) {
                open.erase(part.path);
                continue;
            }
            auto& reader = open[part.path];
            if (!reader) reader = std::make_unique<DumpReader>(part.path);
            if (reader->header().data != part.data) throw Error(part.path, "changed while it was read");
            pieces.push_back(reader->read(begin, end - begin));
        }
        writer.write(joined(header, y, rows, pieces));
        row += rows;
        if (progress) progress(row, header.data.height);
    }
    writer.close(seconds);
    return {header.data, true};
}

std::string inputsOf(const std::string& part) {
    if (!isDeep(part)) return flatInputs(part);
    const DumpReader reader(part);
    const auto found = reader.header().extra.find(kInputsAttribute);
    return found == reader.header().extra.end() ? std::string() : found->second;
}

}  // namespace

std::string wholeInputs(const std::vector<std::string>& parts) {
    std::string run, runOf;  // of the bands, and the first of them
    bool allBands = true;
    std::set<std::string> bands;
    for (const std::string& part : parts) {
        const std::string inputs = inputsOf(part);
        bands.insert(inputs);
        const auto found = wholeOfBand(inputs);
        if (!found) {
            allBands = false;
            continue;
        }
        if (runOf.empty()) {
            run = *found;
            runOf = part;
        }
        if (*found != run)
            throw Error(part, "expected a band of the run " + run + " as " + runOf + " is, found one of " +
                                  *found + ": other inputs or parameters");
    }
    if (!allBands) return {};
    const int count = static_cast<int>(parts.size());
    for (int i = 0; i < count; ++i)
        if (!bands.contains(inputsOfBand(run, {i, count}))) return {};
    return run;
}

MergeReport mergeParts(const std::vector<std::string>& parts, const std::string& output,
                       const MergeOptions& asked, const Progress& progress) {
    if (parts.empty()) throw Error(output, "expected parts to merge, found none");
    const bool deep = isDeep(parts.front());
    for (const auto& part : parts)
        if (isDeep(part) != deep)
            throw Error(part, std::string("expected ") + (deep ? "a dump" : "a flat image") + " like " +
                                  parts.front() + ", found " + (deep ? "a flat image" : "a dump"));
    MergeOptions options = asked;
    const std::string whole = wholeInputs(parts);
    if (!options.crop && !whole.empty()) options.inputs = whole;
    return deep ? mergeDumps(parts, output, options, progress) : mergeFlat(parts, output, options, progress);
}

}  // namespace vlx
