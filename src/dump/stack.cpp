#include "variolux/dump/stack.h"

#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>

#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

// More files than this are opened anew for every band: systems allow 1024 open files, often fewer.
constexpr std::size_t kOpenImages = 200;
// Values of all images together in a band, at four bytes, twice.
constexpr std::size_t kBandValues = std::size_t{8} << 20;
constexpr int kMaxBandRows = 32;
// Cycles and others write 1e10 for the depth of what no surface stopped.
constexpr float kFarAway = 1e9f;

constexpr char kReplicate[] = "sample.replicate";

std::string reason(std::string own) {
    if (own.empty()) own = OIIO::geterror();
    while (!own.empty() && own.back() == '\n') own.pop_back();
    return own.empty() ? "unknown reason" : own;
}

std::unique_ptr<OIIO::ImageInput> open(const std::string& path) {
    std::error_code status;
    if (!std::filesystem::is_regular_file(path, status))
        throw Error(path, "expected an image, found no such file");
    auto input = OIIO::ImageInput::open(path);
    if (!input) throw Error(path, "expected an image: " + reason({}));
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.deep) throw Error(path, "expected a flat image, found deep samples: this is a dump already");
    if (spec.tile_width > 0 || spec.depth > 1)
        throw Error(path, "expected an image of scanlines, found tiles");
    return input;
}

Window dataWindow(const OIIO::ImageSpec& spec) { return {spec.x, spec.y, spec.width, spec.height}; }
Window displayWindow(const OIIO::ImageSpec& spec) {
    return {spec.full_x, spec.full_y, spec.full_width, spec.full_height};
}

using Names = std::vector<std::string>;

bool contains(const Names& names, const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
}

std::string listed(const Names& names) {
    std::string text;
    for (const auto& name : names) text += (text.empty() ? "" : ", ") + name;
    return text;
}

// "L." of the first layer L that has a pass Combined; empty names of layers count. Nothing if none has.
std::optional<std::string> cyclesLayer(const Names& names) {
    const std::string pass = "Combined.R";
    for (const auto& name : names) {
        if (!name.ends_with(pass)) continue;
        const std::string layer = name.substr(0, name.size() - pass.size());
        if (layer.empty() || layer.back() == '.') return layer;
    }
    return std::nullopt;
}

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
    return map;
}

ChannelMap plainMap(const Names& names) {
    ChannelMap map;
    for (const auto& channel : standardChannels())
        if (channel.name != kReplicate && contains(names, channel.name)) map[channel.name] = channel.name;
    return map;
}

ChannelMap chooseMap(const std::string& path, const Names& names, const StackOptions& options) {
    ChannelMap map;
    const auto layer = cyclesLayer(names);
    if (options.preset == StackPreset::Cycles && !layer)
        throw Error(path, "expected a channel L.Combined.R of some layer L, found " + listed(names));
    map = options.preset != StackPreset::Plain && layer ? cyclesMap(names, *layer) : plainMap(names);
    for (const auto& [channel, source] : options.map) {
        if (channel == kReplicate)
            throw Error(path, "sample.replicate cannot be mapped: it is the image's number");
        map[channel] = source;
    }
    for (const char* needed : {"R", "G", "B"})
        if (!map.contains(needed))
            throw Error(path, std::string("found nothing to take as ") + needed +
                                  " (say it with a mapping); the image has " + listed(names));
    return map;
}

// What is taken from one image, in rows of interleaved values.
class Source {
  public:
    Source(std::string path, bool keepOpen) : path_(std::move(path)), keepOpen_(keepOpen) {}

    // Checks that the image is like the first and has the channels `names`.
    void prepare(const OIIO::ImageSpec& first, const Names& names) {
        auto input = vlx::open(path_);
        const OIIO::ImageSpec& spec = input->spec();
        if (dataWindow(spec) != dataWindow(first) || displayWindow(spec) != displayWindow(first))
            throw Error(path_, "expected the windows of the first image, " + std::to_string(first.width) +
                                   " x " + std::to_string(first.height) + " at (" + std::to_string(first.x) +
                                   ", " + std::to_string(first.y) + "), found " + std::to_string(spec.width) +
                                   " x " + std::to_string(spec.height) + " at (" + std::to_string(spec.x) +
                                   ", " + std::to_string(spec.y) + ") or another picture around it");
        for (const auto& name : names) {
            const auto found = std::find(spec.channelnames.begin(), spec.channelnames.end(), name);
            if (found == spec.channelnames.end())
                throw Error(path_, "expected a channel " + name + ", found " + listed(spec.channelnames));
            channels_.push_back(static_cast<int>(found - spec.channelnames.begin()));
        }
        begin_ = *std::min_element(channels_.begin(), channels_.end());
        end_ = *std::max_element(channels_.begin(), channels_.end()) + 1;
        if (keepOpen_) input_ = std::move(input);
    }

    void read(int y, int rows, int width) {
        auto input = keepOpen_ ? std::move(input_) : vlx::open(path_);
        values_.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(rows) *
                       static_cast<std::size_t>(end_ - begin_));
        if (!input->read_scanlines(0, 0, y, y + rows, 0, begin_, end_, OIIO::TypeDesc::FLOAT, values_.data()))
            throw Error(path_, "rows " + std::to_string(y) + " to " + std::to_string(y + rows - 1) + ": " +
                                   reason(input->geterror()));
        for (const float value : values_)
            hash_ = (hash_ ^ std::bit_cast<std::uint32_t>(value)) * 1099511628211u;
        if (keepOpen_) input_ = std::move(input);
    }

    // The value of the channel `index` of `names` in pixel `pixel` of the rows read last.
    float value(std::size_t pixel, std::size_t index) const {
        return values_[pixel * static_cast<std::size_t>(end_ - begin_) +
                       static_cast<std::size_t>(channels_[index] - begin_)];
    }
    const std::string& path() const { return path_; }
    std::uint64_t hash() const { return hash_; }

  private:
    std::string path_;
    bool keepOpen_;
    std::unique_ptr<OIIO::ImageInput> input_;
    std::vector<int> channels_;
    int begin_ = 0;
    int end_ = 0;
    std::vector<float> values_;
    std::uint64_t hash_ = 14695981039346656037u;  // of all values read, FNV-1a
};

std::vector<DumpChannel> dumpChannels(const ChannelMap& map) {
    std::vector<DumpChannel> channels;
    for (const auto& standard : standardChannels())
        if (map.contains(standard.name) || standard.name == kReplicate) channels.push_back(standard);
    for (const auto& [name, source] : map) {
        const auto known = [&](const DumpChannel& channel) { return channel.name == name; };
        if (std::none_of(channels.begin(), channels.end(), known))
            channels.push_back({name, ChannelType::Float});
    }
    return channels;
}

}  // namespace

StackReport stackImages(const std::vector<std::string>& images, const std::string& dump,
                        const StackOptions& options, const Progress& progress) {
    if (images.empty()) throw Error(dump, "expected images to make a dump of, found none");
    const OIIO::ImageSpec first = vlx::open(images.front())->spec();
    StackReport report;
    report.mapped = chooseMap(images.front(), first.channelnames, options);

    DumpHeader header;
    header.data = dataWindow(first);
    header.display = displayWindow(first);
    header.channels = dumpChannels(report.mapped);
    header.compression = options.compression;
    header.renderer =
        options.renderer.empty() ? std::string(first.get_string_attribute("Software")) : options.renderer;
    header.samples = static_cast<double>(images.size());

    Names taken;  // image channel of each dump channel but the last resort, sample.replicate
    std::vector<bool> isDepth;
    for (const auto& channel : header.channels)
        if (channel.name != kReplicate) {
            taken.push_back(report.mapped.at(channel.name));
            isDepth.push_back(channel.name == "Z");
        }
    for (const auto& name : first.channelnames)
        if (!contains(taken, name)) report.ignored.push_back(name);

    std::vector<std::unique_ptr<Source>> sources;
    for (const auto& path : images) {
        sources.push_back(std::make_unique<Source>(path, images.size() <= kOpenImages));
        sources.back()->prepare(first, taken);
    }

    DumpWriter writer(dump, header);
    const auto width = static_cast<std::size_t>(header.data.width);
    const std::size_t rowValues = width * header.channels.size() * images.size();
    const int bandRows = static_cast<int>(
        std::clamp<std::size_t>(kBandValues / rowValues, 1, static_cast<std::size_t>(kMaxBandRows)));
    std::int64_t misses = 0;
    for (int row = 0; row < header.data.height;) {
        const int rows = std::min(bandRows, header.data.height - row);
        parallelFor(0, static_cast<std::int64_t>(sources.size()), [&](std::int64_t i) {
            sources[static_cast<std::size_t>(i)]->read(header.data.y + row, rows, header.data.width);
        });
        SampleBand band;
        band.x = header.data.x;
        band.y = header.data.y + row;
        band.width = header.data.width;
        band.height = rows;
        for (std::size_t p = 0; p <= band.pixels(); ++p) band.offsets.push_back(p * sources.size());
        std::size_t next = 0;
        for (const auto& channel : header.channels) {
            band.channels.push_back(channel.name);
            auto& values = band.values.emplace_back();
            values.reserve(band.samples());
            const bool replicate = channel.name == kReplicate;
            for (std::size_t p = 0; p < band.pixels(); ++p)
                for (std::size_t i = 0; i < sources.size(); ++i)
                    values.push_back(replicate ? static_cast<float>(i) : sources[i]->value(p, next));
            if (replicate) continue;
            if (isDepth[next])
                for (float& z : values)
                    if (!(z >= 0 && z < kFarAway)) {
                        z = 0;
                        ++misses;
                    }
            ++next;
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
    if (cyclesLayer(first.channelnames) && report.mapped.contains("N.X"))
        notes.push_back(
            "Normals are taken as they are: Cycles' denoising normals are in camera space and "
            "may be shorter than 1.");
    std::map<std::uint64_t, std::string> seen;
    for (const auto& source : sources) {
        const auto [same, isNew] = seen.emplace(source->hash(), source->path());
        if (!isNew)
            notes.push_back("WARNING: " + source->path() + " is identical to " + same->second +
                            ": rendered with the same seed? Errors will be underestimated.");
    }
    return report;
}

}  // namespace vlx
