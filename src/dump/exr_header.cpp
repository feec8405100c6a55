#include "dump/exr_header.h"

#include <ImfChannelList.h>
#include <ImfCompressionAttribute.h>
#include <ImfDeepImageState.h>
#include <ImfDoubleAttribute.h>
#include <ImfFloatAttribute.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfIntAttribute.h>
#include <ImfMatrixAttribute.h>
#include <ImfPartType.h>
#include <ImfStandardAttributes.h>
#include <ImfStringAttribute.h>
#include <ImfVersion.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstring>
#include <set>

#include "dump/exr_attributes.h"
#include "exr/header_walker.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"
#include "variolux/dump/splats.h"

namespace vlx {

namespace {

class MemoryInput : public Imf::IStream {
  public:
    explicit MemoryInput(const Bytes& bytes) : Imf::IStream("header"), bytes_(bytes) {}
    bool read(char to[], int count) override {
        if (count < 0 || static_cast<std::size_t>(count) > bytes_.size() - at_)
            throw std::runtime_error("it ends within an attribute");
        if (count > 0) std::memcpy(to, bytes_.data() + at_, static_cast<std::size_t>(count));
        at_ += static_cast<std::size_t>(count);
        return at_ < bytes_.size();
    }
    std::uint64_t tellg() override { return at_; }
    void seekg(std::uint64_t to) override { at_ = std::min<std::size_t>(to, bytes_.size()); }

  private:
    const Bytes& bytes_;
    std::size_t at_ = 0;
};

// OpenEXR's own header, of the attributes whose readers trust no size within their value.
Imf::Header parse(const std::string& path, const Bytes& bytes, const std::vector<RawAttribute>& attributes,
                  int version) {
    static const std::set<std::string> types = {"box2i",  "chlist", "compression", "lineOrder", "float",
                                                "double", "int",    "string",      "m44f"};
    Bytes known;
    for (const auto& attribute : attributes)
        if (types.contains(attribute.type))
            known.insert(known.end(), bytes.begin() + static_cast<std::ptrdiff_t>(attribute.begin),
                         bytes.begin() + static_cast<std::ptrdiff_t>(attribute.end));
    known.push_back(0);
    MemoryInput stream(known);
    Imf::Header header;
    try {
        header.readFrom(stream, version);
    } catch (const std::exception& error) {
        throw Error(path, std::string("damaged header: ") + error.what());
    }
    if (stream.tellg() != known.size())
        throw Error(path, "damaged header: an attribute is longer or shorter than it claims");
    return header;
}

Window toWindow(const std::string& path, const char* what, const Imath::Box2i& box) {
    return checkedWindow(path, what, box.min.x, box.min.y, box.max.x, box.max.y);
}

DumpCompression toCompression(const std::string& path, Imf::Compression compression) {
    switch (compression) {
        case Imf::NO_COMPRESSION:
            return DumpCompression::None;
        case Imf::RLE_COMPRESSION:
            return DumpCompression::Rle;
        case Imf::ZIPS_COMPRESSION:
            return DumpCompression::Zips;
        default:
            throw Error(path,
                        "expected compression none, RLE or ZIPS (deep files have no other), found type " +
                            std::to_string(static_cast<int>(compression)));
    }
}

std::vector<DumpChannel> toChannels(const std::string& path, const Imf::ChannelList& list) {
    std::vector<DumpChannel> channels;
    for (auto it = list.begin(); it != list.end(); ++it) {
        const Imf::Channel& channel = it.channel();
        const std::string name = it.name();
        if (channel.xSampling != 1 || channel.ySampling != 1)
            throw Error(path, "channel " + name + " is subsampled; deep files have no such channels");
        DumpChannel& added = channels.emplace_back(DumpChannel{name, ChannelType::Float});
        switch (channel.type) {
            case Imf::HALF:
                added.type = ChannelType::Half;
                break;
            case Imf::FLOAT:
                break;
            case Imf::UINT:
                added.type = ChannelType::Uint;
                break;
            default:
                throw Error(path, "channel " + name + " is of an unknown type");
        }
    }
    return channels;
}

template <class T>
std::optional<T> value(const Imf::Header& header, const std::string& name) {
    if (const auto* found = header.findTypedAttribute<Imf::TypedAttribute<T>>(name)) return found->value();
    return std::nullopt;
}

// Numbers of any attribute type: other programs choose other ones.
std::optional<double> number(const Imf::Header& header, const std::string& name) {
    if (const auto found = value<double>(header, name)) return *found;
    if (const auto found = value<float>(header, name)) return *found;
    if (const auto found = value<int>(header, name)) return *found;
    return std::nullopt;
}

std::optional<std::vector<float>> matrix(const Imf::Header& header, const std::string& name) {
    const auto found = value<Imath::M44f>(header, name);
    if (!found) return std::nullopt;
    return std::vector<float>(&found->x[0][0], &found->x[0][0] + 16);
}

DumpHeader toDumpHeader(const std::string& path, const Imf::Header& header) {
    DumpHeader dump;
    dump.data = toWindow(path, "data window", header.dataWindow());
    dump.display = toWindow(path, "display window", header.displayWindow());
    dump.channels = toChannels(path, header.channels());
    dump.compression = toCompression(path, header.compression());
    dump.version = value<int>(header, kVersion).value_or(kDumpVersion);
    // Renderers that know nothing of Variolux name themselves here.
    dump.renderer = value<std::string>(header, kRenderer)
                        .value_or(value<std::string>(header, "Software").value_or(std::string()));
    dump.scene = value<std::string>(header, kScene).value_or(std::string());
    dump.pixelFilter = value<std::string>(header, kPixelFilter).value_or(std::string());
    dump.effects = split(value<std::string>(header, kEffects).value_or(std::string()), ',');
    std::erase(dump.effects, "");
    if (const auto text = value<std::string>(header, kSeed)) {
        std::int64_t seed = 0;
        const auto [end, status] = std::from_chars(text->data(), text->data() + text->size(), seed);
        if (status == std::errc() && end == text->data() + text->size()) dump.seed = seed;
    }
    dump.replicatesShare = value<int>(header, kReplicatesShare).value_or(0) != 0;
    dump.independentHalves = value<int>(header, kIndependentHalves).value_or(0) != 0;
    dump.samples = number(header, kSamples);
    if (const auto averaged = number(header, kAveraged); averaged && *averaged > 1) dump.averaged = *averaged;
    dump.renderSeconds = number(header, kRenderSeconds);
    if (dump.renderSeconds && !(*dump.renderSeconds > 0)) dump.renderSeconds.reset();  // 0: not recorded
    dump.worldToCamera = matrix(header, kWorldToCamera);
    dump.worldToNDC = matrix(header, kWorldToNDC);
    for (auto it = header.begin(); it != header.end(); ++it) {
        const auto* text = dynamic_cast<const Imf::StringAttribute*>(&it.attribute());
        if (text != nullptr && !isReserved(it.name())) dump.extra[it.name()] = text->value();
    }
    return dump;
}

// What the part `splats` must be for its samples.
void checkSplats(const std::string& path, const Imf::Header& splats, const DumpHeader& dump) {
    const auto fail = [&](const std::string& what) { throw Error(path, "damaged part splats: " + what); };
    const int replicates = dump.splatReplicates;
    if (replicates < 1 || replicates > kMostSplatReplicates)
        fail("expected 1 to " + std::to_string(kMostSplatReplicates) + " replicates, found " +
             std::to_string(replicates));
    if (toWindow(path, "data window", splats.dataWindow()) != dump.data)
        fail("expected the data window of the samples, found another one");
    if (toCompression(path, splats.compression()) != dump.compression)
        fail("expected the compression of the samples, found another one");
    std::vector<std::string> found;
    for (const DumpChannel& channel : toChannels(path, splats.channels())) {
        if (channel.type != ChannelType::Float) fail("expected float channels, found " + channel.name);
        found.push_back(channel.name);
    }
    if (found != splatChannels(replicates))
        fail("expected channels r00.B, r00.G, r00.R and so on for " + std::to_string(replicates) +
             " replicates, found others");
    if (replicates > 1 && findChannel(dump, "sample.replicate") < 0)
        fail("the samples lack the channel sample.replicate");
}

// Every row takes a table entry, a chunk head, and its packed sample counts: a small file cannot hold a huge
// image, whatever its header says.
void checkClaims(const std::string& path, const FileHeader& header, std::uint64_t fileBytes) {
    const Window& window = header.dump.data;
    const auto rows = static_cast<std::uint64_t>(window.height);
    const std::uint64_t counts = std::uint64_t{4} * static_cast<std::uint64_t>(window.width);
    const std::uint64_t row = 8 + kDeepChunkHead + counts / maxRawBytes(header.dump.compression, 1);
    if (header.chunkTable > fileBytes || row > (fileBytes - header.chunkTable) / rows)
        throw Error(path, "truncated or damaged: the header claims " + windowText(window) +
                              ", more than the file's " + std::to_string(fileBytes) + " bytes can hold");
}

}  // namespace

std::vector<std::string> splatChannels(int replicates) {
    std::vector<std::string> names;
    for (int r = 0; r < replicates; ++r)
        for (const char channel : {'B', 'G', 'R'})
            names.push_back(
                {'r', static_cast<char>('0' + r / 10), static_cast<char>('0' + r % 10), '.', channel});
    return names;
}

std::optional<FileHeader> decodeHeader(const std::string& path, const Bytes& start, std::uint64_t fileBytes) {
    HeaderWalker walker(path, start, fileBytes);
    if (fileBytes < 8 || walker.word() != static_cast<std::uint32_t>(Imf::MAGIC))
        throw Error(path, "expected an OpenEXR file, found something else");
    const int version = static_cast<int>(walker.word());
    if (Imf::getVersion(version) != Imf::EXR_VERSION || !Imf::supportsFlags(Imf::getFlags(version)))
        throw Error(path, "expected OpenEXR file version 2, found version field " + std::to_string(version));

    FileHeader header;
    header.multiPart = Imf::isMultiPart(version);
    std::vector<std::vector<RawAttribute>> parts;
    do {
        auto attributes = walker.header();
        if (walker.ranOut()) return std::nullopt;
        if (attributes.empty() && header.multiPart) break;
        parts.push_back(std::move(attributes));
    } while (header.multiPart);

    bool deepTiles = false;
    std::size_t part = 0;
    for (; part < parts.size(); ++part) {
        const std::string type = rawText(start, findAttribute(parts[part], "type"));
        if (type == "deepscanline") break;
        deepTiles = deepTiles || type == "deeptile";
    }
    if (part == parts.size())
        throw Error(
            path, deepTiles ? "expected deep scanlines, found deep tiles, which Variolux does not read"
                            : "expected deep samples, found only flat pixels (of an image with variances "
                              "vlx-pack moments makes a dump, and vlx-krige takes it as it is; of images of "
                              "different seeds vlx-pack stack)");
    for (const char* required : {"channels", "compression", "dataWindow"})
        if (findAttribute(parts[part], required) == nullptr)
            throw Error(path, std::string("damaged header: attribute '") + required + "' is missing");

    if (const int layout = rawInt(start, findAttribute(parts[part], "version")).value_or(1); layout != 1)
        throw Error(path, "expected deep data of version 1, found version " + std::to_string(layout));

    const Imf::Header parsed = parse(path, start, parts[part], version);
    header.dump = toDumpHeader(path, parsed);
    if (findAttribute(parts[part], "displayWindow") == nullptr) header.dump.display = header.dump.data;
    header.part = static_cast<int>(part);

    std::size_t splats = 0;
    for (; splats < parts.size(); ++splats)
        if (rawText(start, findAttribute(parts[splats], "name")) == "splats" &&
            findAttribute(parts[splats], kSplatReplicates) != nullptr)
            break;
    if (splats < parts.size()) {
        for (const char* required : {"channels", "compression", "dataWindow"})
            if (findAttribute(parts[splats], required) == nullptr)
                throw Error(path,
                            std::string("damaged part splats: attribute '") + required + "' is missing");
        const Imf::Header parsedSplats = parse(path, start, parts[splats], version);
        header.dump.splatReplicates = value<int>(parsedSplats, kSplatReplicates).value_or(0);
        header.dump.replicatesShare = true;
        checkSplats(path, parsedSplats, header.dump);
        header.splatPart = static_cast<int>(splats);
    }

    // The tables of the parts follow the headers, in the order of the parts.
    std::uint64_t table = walker.position();
    const std::size_t last = splats < parts.size() ? std::max(part, splats) : part;
    for (std::size_t i = 0; i <= last; ++i) {
        const auto chunks = rawInt(start, findAttribute(parts[i], "chunkCount"));
        if (i == part) header.chunkTable = table;
        if (i == splats) header.splatTable = table;
        if (i == part || i == splats) {
            if (chunks.value_or(header.dump.data.height) != header.dump.data.height)
                throw Error(path, "expected a chunk for each of " + std::to_string(header.dump.data.height) +
                                      " rows, found chunkCount " + std::to_string(*chunks));
            table += std::uint64_t{8} * static_cast<std::uint64_t>(header.dump.data.height);
            continue;
        }
        if (!chunks || *chunks < 0)
            throw Error(path, "damaged header: part " + std::to_string(i) + " lacks a valid chunkCount");
        table += std::uint64_t{8} * static_cast<std::uint64_t>(*chunks);
    }
    checkClaims(path, header, fileBytes);

    for (const char* name : {"R", "G", "B"})
        if (findChannel(header.dump, name) < 0) {
            std::string found;
            for (const auto& channel : header.dump.channels)
                found += (found.empty() ? " " : ", ") + channel.name;
            throw Error(path, "expected deep samples with channels R, G and B, found" + found +
                                  ". No option renames a dump's channels: write them so, luminance as all "
                                  "three; or give flat images, of which luminance is taken as it is and "
                                  "--map R=CHANNEL names others (several seeds: vlx-pack stack; with "
                                  "variances: vlx-krige or vlx-pack moments)");
        }
    for (const auto& channel : header.dump.channels) header.bytesPerSample += valueBytes(channel.type);
    return header;
}

}  // namespace vlx
