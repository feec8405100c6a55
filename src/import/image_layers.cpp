#include "import/image_layers.h"

#include <Imath/half.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfCompression.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfStdIO.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfTileDescription.h>
#include <OpenEXR/ImfTiledInputPart.h>
#include <OpenEXR/ImfTiledOutputPart.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <set>

#include "dump/stored_values.h"
#include "exr/flat_header.h"
#include "exr/flat_images.h"
#include "exr/header_copy.h"
#include "import/channel_presets.h"
#include "variolux/base/channel_names.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr int kBandRows = 64;
constexpr float kMostHalf = 65504;

const char* lossyName(Imf::Compression compression) {
    switch (compression) {
        case Imf::B44_COMPRESSION:
            return "B44";
        case Imf::B44A_COMPRESSION:
            return "B44A";
        case Imf::DWAA_COMPRESSION:
            return "DWAA";
        case Imf::DWAB_COMPRESSION:
            return "DWAB";
        default:
            return nullptr;
    }
}

Window dataWindow(const Imf::Header& header) {
    const auto& box = header.dataWindow();
    return {box.min.x, box.min.y, box.max.x - box.min.x + 1, box.max.y - box.min.y + 1};
}

std::string partName(const Imf::Header& header) { return header.hasName() ? header.name() : std::string(); }

// A channel of a part that is written anew, and the rows of it at work.
struct Channel {
    std::string name;
    Imf::PixelType type = Imf::FLOAT;
    bool inFile = true;
    int source = -1;  // channel of the image; -1: the file's own values
    std::vector<char> rows;

    std::size_t bytes() const { return type == Imf::HALF ? 2 : 4; }
};

// What becomes of a part.
struct PartPlan {
    Imf::Header header;  // of the copy
    std::vector<Channel> channels;
    bool touched = false;
};

// A part with replaced channels, band by band.
class PartCopy {
  public:
    PartCopy(PartPlan& plan, const Image& image, LayerCopy& report)
        : channels_(plan.channels), image_(image), report_(report), window_(dataWindow(plan.header)) {}

    // Room for rows [y, y + rows), which `reading` ones of the file's own go to, or all are written from.
    Imf::FrameBuffer frame(int y, int rows, bool reading) {
        Imf::FrameBuffer frame;
        for (Channel& channel : channels_) {
            if (reading && channel.source >= 0) continue;
            const std::size_t row = channel.bytes() * static_cast<std::size_t>(window_.width);
            channel.rows.resize(row * static_cast<std::size_t>(rows));
            frame.insert(channel.name, Imf::Slice::Make(channel.type, channel.rows.data(), {window_.x, y},
                                                        window_.width, rows, channel.bytes(), row));
        }
        return frame;
    }

    // Puts the image's values into the rows at work.
    void replace(int y, int rows) {
        for (Channel& channel : channels_) {
            if (channel.source < 0) continue;
            channel.rows.resize(channel.bytes() * static_cast<std::size_t>(window_.width) *
                                static_cast<std::size_t>(rows));
            char* to = channel.rows.data();
            for (int row = y - window_.y; row < y - window_.y + rows; ++row)
                for (int col = 0; col < window_.width; ++col, to += channel.bytes())
                    store(image_.at(col, row)[channel.source], channel.type, to);
        }
    }

  private:
    void store(float value, Imf::PixelType type, char* to) {
        if (type == Imf::UINT) {
            const std::uint32_t bits = toUint(value);
            std::memcpy(to, &bits, sizeof bits);
        } else if (type == Imf::HALF) {
            half rounded(value);
            if (rounded.isInfinity() && std::isfinite(value)) {
                rounded = half(value > 0 ? kMostHalf : -kMostHalf);
                ++report_.overflows;
            }
            std::memcpy(to, &rounded, sizeof rounded);
        } else {
            std::memcpy(to, &value, sizeof value);
        }
    }

    std::vector<Channel>& channels_;
    const Image& image_;
    LayerCopy& report_;
    Window window_;
};

// Which channels of which part get what. Throws Error.
class Planner {
  public:
    Planner(const std::string& path, const Image& image, const ChannelMap& replace, LayerCopy& report)
        : path_(path), image_(image), replace_(replace), report_(report) {}

    std::vector<PartPlan> plan(const Imf::MultiPartInputFile& file) {
        std::vector<PartPlan> plans;
        for (int number = 0; number < file.parts(); ++number) {
            PartPlan& plan = plans.emplace_back(PartPlan{file.header(number), {}, false});
            const Imf::ChannelList& list = file.header(number).channels();
            for (auto it = list.begin(); it != list.end(); ++it) {
                Channel& channel = plan.channels.emplace_back();
                channel.name = it.name();
                channel.type = it.channel().type;
                std::string known = partChannel(number, partName(plan.header), channel.name);
                if (contains(names_, known)) continue;
                if (isFor(known, "R")) {
                    main_ = number;
                    prefix_ = layerPrefix(channel.name);
                }
                names_.push_back(known);
                places_.push_back({std::move(known), plans.size() - 1, plan.channels.size() - 1});
            }
        }
        for (const std::string& name : image_.channels)
            if (!replace_.contains(name)) targets_[targetOf(name)] = name;
        for (const Place& place : places_)
            takeFor(place.known, plans[place.part].channels[place.channel], plans[place.part]);
        for (const auto& [from, to] : replace_)
            if (image_.channel(from) >= 0 && !report_.replaced.contains(to))
                throw Error(
                    path_, "expected a channel " + to + " to put " + from + " into, found " + listed(names_));
        if (main_ < 0) throw Error(path_, "expected a channel for R, found " + listed(names_));
        addTo(plans[static_cast<std::size_t>(main_)]);
        for (PartPlan& plan : plans)
            if (plan.touched) check(plan);
        return plans;
    }

  private:
    struct Place {
        std::string known;
        std::size_t part, channel;
    };

    bool isFor(const std::string& known, const std::string& channel) const {
        const auto found = replace_.find(channel);
        return found != replace_.end() && found->second == known && image_.channel(channel) >= 0;
    }

    // Where a channel of the image goes that no entry says: beside R's layer, where the file has it or has
    // it nowhere.
    std::string targetOf(const std::string& name) const {
        // Blender takes no channel without a layer's name for a pass.
        const bool bare = !prefix_.empty() && layerOf(name).empty();
        const std::string beside = prefix_ + name + (bare ? ".V" : "");
        if (name.starts_with(prefix_) || image_.channel(beside) >= 0) return name;
        return contains(names_, beside) || !contains(names_, name) ? beside : name;
    }

    // The image's channel that replaces `known`, if any. Of luminance, which all colours are taken from, the
    // last in order, R: they are equal.
    void takeFor(const std::string& known, Channel& channel, PartPlan& plan) {
        const auto take = [&](const std::string& from) {
            channel.source = image_.channel(from);
            plan.touched = true;
            report_.replaced[known] = from;
        };
        for (const auto& [from, to] : replace_)
            if (to == known && image_.channel(from) >= 0) take(from);
        if (report_.replaced.contains(known)) return;
        if (const auto found = targets_.find(known); found != targets_.end()) take(found->second);
    }

    // Channels of the image that the file has not: to the part that has R.
    void addTo(PartPlan& plan) {
        for (const auto& [name, from] : targets_) {
            if (report_.replaced.contains(name)) continue;
            const int source = image_.channel(from);
            const auto same =
                std::find_if(plan.channels.begin(), plan.channels.end(),
                             [&, &own = name](const Channel& channel) { return channel.name == own; });
            if (same != plan.channels.end()) {
                same->source = source;
                report_.replaced[name] = from;
                continue;
            }
            plan.channels.push_back({name, Imf::FLOAT, false, source, {}});
            plan.header.channels().insert(name, Imf::Channel(Imf::FLOAT));
            report_.added.push_back(name);
        }
    }

    void check(PartPlan& plan) {
        const Window found = dataWindow(plan.header);
        if (found != image_.data)
            throw Error(path_, "expected the image's data window, " + windowText(image_.data) + ", found " +
                                   windowText(found));
        const Imf::ChannelList& list = plan.header.channels();
        for (auto it = list.begin(); it != list.end(); ++it)
            if (it.channel().xSampling != 1 || it.channel().ySampling != 1)
                throw Error(path_, std::string("expected channels with a value for each pixel, found ") +
                                       it.name() + " with fewer");
        if (plan.header.hasTileDescription() && plan.header.tileDescription().mode != Imf::ONE_LEVEL)
            throw Error(path_, "expected tiles of one resolution, found several");
        if (const char* lossy = lossyName(plan.header.compression())) {
            report_.recompressed = lossy;
            plan.header.compression() = Imf::ZIP_COMPRESSION;
        }
    }

    const std::string& path_;
    const Image& image_;
    const ChannelMap& replace_;
    LayerCopy& report_;
    std::vector<std::string> names_;              // of all channels, as partChannel() calls them
    std::vector<Place> places_;                   // of each name
    int main_ = -1;                               // number of the part that has R
    std::string prefix_;                          // of R's layer there
    std::map<std::string, std::string> targets_;  // channel of the file -> of the image, where no entry says
};

void copyRows(Imf::MultiPartInputFile& in, Imf::MultiPartOutputFile& out, int number, PartPlan& plan,
              PartCopy& copy) {
    Imf::InputPart from(in, number);
    const Window window = dataWindow(plan.header);
    const bool upwards = plan.header.lineOrder() == Imf::DECREASING_Y;
    const auto band = [&](int y, int rows) {
        if (const Imf::FrameBuffer own = copy.frame(y, rows, true); own.begin() != own.end()) {
            from.setFrameBuffer(own);
            from.readPixels(y, y + rows - 1);
        }
        copy.replace(y, rows);
        return copy.frame(y, rows, false);
    };
    if (plan.header.hasTileDescription()) {
        Imf::TiledOutputPart to(out, number);
        const int tile = static_cast<int>(plan.header.tileDescription().ySize);
        const int strips = to.numYTiles(0);
        for (int i = 0; i < strips; ++i) {
            const int strip = upwards ? strips - 1 - i : i;
            const int y = window.y + strip * tile;
            to.setFrameBuffer(band(y, std::min(tile, window.y + window.height - y)));
            to.writeTiles(0, to.numXTiles(0) - 1, strip, strip);
        }
        return;
    }
    Imf::OutputPart to(out, number);
    const int bands = (window.height + kBandRows - 1) / kBandRows;
    for (int i = 0; i < bands; ++i) {
        const int y = window.y + (upwards ? bands - 1 - i : i) * kBandRows;
        const int rows = std::min(kBandRows, window.y + window.height - y);
        to.setFrameBuffer(band(y, rows));
        to.writePixels(rows);
    }
}

template <class In, class Out>
void copyPacked(Imf::MultiPartInputFile& in, Imf::MultiPartOutputFile& out, int number) {
    In from(in, number);
    Out(out, number).copyPixels(from);
}

void copyPart(Imf::MultiPartInputFile& in, Imf::MultiPartOutputFile& out, int number, PartPlan& plan,
              const Image& image, LayerCopy& report) {
    if (plan.touched) {
        PartCopy copy(plan, image, report);
        copyRows(in, out, number, plan, copy);
    } else if (plan.header.hasTileDescription()) {
        copyPacked<Imf::TiledInputPart, Imf::TiledOutputPart>(in, out, number);
    } else {
        copyPacked<Imf::InputPart, Imf::OutputPart>(in, out, number);
    }
}

}  // namespace

LayerCopy copyWithLayers(const std::string& from, const std::string& to, const Image& image,
                         const ChannelMap& replace, const std::map<std::string, std::string>& attributes) {
    LayerCopy report;
    checkFlatHeader(from);
    OutputFile file(to);
    std::ofstream bytes(file.temporaryPath(), std::ios::binary);
    bool writing = false;
    try {
        Imf::MultiPartInputFile in(from.c_str(), 0);
        std::vector<PartPlan> plans = Planner(from, image, replace, report).plan(in);
        std::vector<Imf::Header> headers;
        for (const PartPlan& plan : plans) headers.push_back(plan.header);
        std::set<std::string> replaced;  // whatever their type
        for (const auto& attribute : attributes) replaced.insert(attribute.first);
        headers.front() = headerWithout(headers.front(), replaced);
        for (const auto& [name, text] : attributes) headers.front().insert(name, Imf::StringAttribute(text));
        writing = true;
        Imf::StdOFStream stream(bytes, file.temporaryPath().c_str());
        Imf::MultiPartOutputFile out(stream, headers.data(), static_cast<int>(headers.size()), false, 0);
        for (std::size_t i = 0; i < plans.size(); ++i)
            copyPart(in, out, static_cast<int>(i), plans[i], image, report);
    } catch (const Error&) {
        throw;
    } catch (const std::exception& error) {
        throw Error(
            bytes.good() ? from : to,
            std::string(writing ? "copying failed: " : "expected a flat OpenEXR file: ") + error.what());
    }
    bytes.close();
    if (!bytes) throw Error(to, "writing to disk failed");
    file.commit();
    return report;
}

ChannelMap findRadiance(const std::string& image, const ChannelMap& map, const std::string& layer) {
    const FlatImages file({image});
    StackOptions options;
    options.layer = layer;
    options.map = map;
    ChannelMap found;
    for (const auto& [channel, name] : chooseStackMap(image, file.channels(0), options).map)
        if (channel == "R" || channel == "G" || channel == "B" || channel == "A" || map.contains(channel))
            found[channel] = name;
    return found;
}

}  // namespace vlx
