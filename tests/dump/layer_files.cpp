#include "layer_files.h"

#include <Imath/half.h>
#include <ImfAttribute.h>
#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfInputPart.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>
#include <ImfStdIO.h>
#include <ImfStringAttribute.h>
#include <ImfTileDescription.h>
#include <ImfTiledOutputPart.h>

#include <cmath>
#include <cstring>

#include "openexr_files.h"

namespace vlx {

/// What an attribute of a type of somebody's own holds.
struct Strange {
    char bytes[5] = {1, 2, 3, 4, 5};
};

}  // namespace vlx

OPENEXR_IMF_INTERNAL_NAMESPACE_SOURCE_ENTER
template <>
const char* TypedAttribute<vlx::Strange>::staticTypeName() {
    return "strange";
}
template <>
void TypedAttribute<vlx::Strange>::writeValueTo(OStream& os, int) const {
    os.write(_value.bytes, sizeof _value.bytes);
}
template <>
void TypedAttribute<vlx::Strange>::readValueFrom(IStream& is, int, int) {
    is.read(_value.bytes, sizeof _value.bytes);
}
OPENEXR_IMF_INTERNAL_NAMESPACE_SOURCE_EXIT

namespace vlx {

namespace {

Imf::Slice slice(Imf::PixelType type, const std::string& bytes, const Window& w) {
    const std::size_t size = type == Imf::HALF ? 2 : 4;
    return Imf::Slice::Make(type, bytes.data(), {w.x, w.y}, w.width, w.height, size,
                            size * static_cast<std::size_t>(w.width));
}

}  // namespace

std::string layerBytes(ChannelType type, const std::vector<float>& values) {
    std::string bytes;
    for (const float value : values) {
        char word[4];
        const std::uint16_t rounded = imath_float_to_half(value);
        const auto integer = static_cast<std::uint32_t>(value);
        if (type == ChannelType::Half) std::memcpy(word, &rounded, 2);
        if (type == ChannelType::Float) std::memcpy(word, &value, 4);
        if (type == ChannelType::Uint) std::memcpy(word, &integer, 4);
        bytes.append(word, type == ChannelType::Half ? 2 : 4);
    }
    return bytes;
}

float layerValue(const std::string& channel, int x, int y) {
    int salt = 0;
    for (const char c : channel) salt = (salt * 31 + c) % 101;
    return 0.5f + 0.37f * static_cast<float>((salt + 7 * x + 3 * y * y) % 29);
}

void writeLayers(const std::string& path, const std::vector<LayerPart>& parts,
                 const std::map<std::string, float>& constants) {
    std::vector<Imf::Header> headers;
    for (const LayerPart& part : parts) {
        const auto box = [](const Window& w) {
            return Imath::Box2i({w.x, w.y}, {w.x + w.width - 1, w.y + w.height - 1});
        };
        Imf::Header& header = headers.emplace_back(box(part.display), box(part.data));
        header.setName(part.name);
        header.setType(part.tiled ? Imf::TILEDIMAGE : Imf::SCANLINEIMAGE);
        header.compression() = part.compression;
        header.lineOrder() = part.order;
        if (part.tiled) header.setTileDescription({8, 16, part.mipmap ? Imf::MIPMAP_LEVELS : Imf::ONE_LEVEL});
        header.insert("comment", Imf::StringAttribute("of " + part.name));
        header.insert("strange", Imf::TypedAttribute<Strange>(Strange{}));
        for (const DumpChannel& channel : part.channels)
            header.channels().insert(channel.name, Imf::Channel(pixelType(channel.type)));
    }
    Imf::MultiPartOutputFile file(path.c_str(), headers.data(), static_cast<int>(headers.size()));
    for (std::size_t i = 0; i < parts.size(); ++i) {
        const LayerPart& part = parts[i];
        std::vector<std::string> planes;
        Imf::FrameBuffer frame;
        planes.reserve(part.channels.size());
        for (const DumpChannel& channel : part.channels) {
            std::vector<float> values;
            const auto constant = constants.find(channel.name);
            for (int y = part.data.y; y < part.data.y + part.data.height; ++y)
                for (int x = part.data.x; x < part.data.x + part.data.width; ++x)
                    values.push_back(constant == constants.end() ? layerValue(channel.name, x, y)
                                                                 : constant->second);
            planes.push_back(layerBytes(channel.type, values));
            frame.insert(channel.name, slice(pixelType(channel.type), planes.back(), part.data));
        }
        if (part.tiled) {
            Imf::TiledOutputPart to(file, static_cast<int>(i));
            to.setFrameBuffer(frame);
            to.writeTiles(0, to.numXTiles(0) - 1, 0, to.numYTiles(0) - 1);
        } else {
            Imf::OutputPart to(file, static_cast<int>(i));
            to.setFrameBuffer(frame);
            to.writePixels(part.data.height);
        }
    }
}

std::vector<LayerPart> rendererParts() {
    using enum ChannelType;
    const Window data{3, -2, 13, 150}, display{0, 0, 40, 200};
    LayerPart beauty{"beauty", data, display, {{"R", Half}, {"G", Half}, {"B", Half}, {"A", Half}}};
    beauty.channels.insert(beauty.channels.end(), {{"Z", Float}, {"id", Uint}});
    for (const char* c : {"key.R", "key.G", "key.B"}) beauty.channels.push_back({c, Half});
    beauty.order = Imf::DECREASING_Y;
    LayerPart variance{"variance", data, display, {{"R", Float}, {"G", Float}, {"B", Float}}};
    variance.tiled = true;
    variance.compression = Imf::PIZ_COMPRESSION;
    LayerPart mask{"mask", {5, 5, 9, 40}, display, {{"x", Half}}};
    mask.compression = Imf::B44_COMPRESSION;
    return {beauty, variance, mask};
}

std::vector<ReadPart> readLayers(const std::string& path) {
    Imf::MultiPartInputFile file(path.c_str());
    std::vector<ReadPart> parts;
    for (int i = 0; i < file.parts(); ++i) {
        ReadPart& part = parts.emplace_back();
        const Imf::Header& header = file.header(i);
        for (auto it = header.begin(); it != header.end(); ++it) {
            if (std::string(it.name()) == "channels") continue;
            Imf::StdOSStream stream;
            it.attribute().writeValueTo(stream, 2);
            part.attributes[it.name()] = it.attribute().typeName() + (":" + stream.str());
        }
        const auto& box = header.dataWindow();
        const Window window{box.min.x, box.min.y, box.max.x - box.min.x + 1, box.max.y - box.min.y + 1};
        Imf::FrameBuffer frame;
        std::map<std::string, std::string> planes;
        for (auto it = header.channels().begin(); it != header.channels().end(); ++it) {
            std::string& bytes = planes[it.name()];
            const std::size_t size = it.channel().type == Imf::HALF ? 2 : 4;
            bytes.resize(size * static_cast<std::size_t>(window.pixels()));
            frame.insert(it.name(), slice(it.channel().type, bytes, window));
        }
        Imf::InputPart from(file, i);
        from.setFrameBuffer(frame);
        from.readPixels(box.min.y, box.max.y);
        for (auto it = header.channels().begin(); it != header.channels().end(); ++it)
            part.channels[it.name()] = std::to_string(it.channel().type) + ":" + planes[it.name()];
    }
    return parts;
}

}  // namespace vlx
