#include "openexr_files.h"

#include <Imath/half.h>
#include <ImfChannelList.h>
#include <ImfDeepFrameBuffer.h>
#include <ImfDeepScanLineInputPart.h>
#include <ImfDeepScanLineOutputFile.h>
#include <ImfDeepScanLineOutputPart.h>
#include <ImfDeepTiledOutputFile.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfMultiPartInputFile.h>
#include <ImfMultiPartOutputFile.h>
#include <ImfOutputPart.h>
#include <ImfPartType.h>

#include <cstring>

namespace vlx {

Imf::PixelType pixelType(ChannelType type) {
    if (type == ChannelType::Half) return Imf::HALF;
    return type == ChannelType::Uint ? Imf::UINT : Imf::FLOAT;
}

namespace {

std::size_t typeBytes(Imf::PixelType type) { return type == Imf::HALF ? 2 : 4; }

// A channel in the types and through the pointers that OpenEXR wants.
struct Plane {
    std::vector<unsigned char> bytes;
    std::vector<char*> pointers;
};

Plane toPlane(const SampleBand& all, std::size_t channel, ChannelType type) {
    Plane plane;
    const std::size_t size = typeBytes(pixelType(type));
    plane.bytes.resize(all.samples() * size + 1);
    for (std::size_t i = 0; i < all.samples(); ++i) {
        const float value = all.values[channel][i];
        unsigned char* to = plane.bytes.data() + i * size;
        const std::uint16_t half = imath_float_to_half(value);
        if (type == ChannelType::Half) std::memcpy(to, &half, 2);
        if (type == ChannelType::Float) std::memcpy(to, &value, 4);
        if (type == ChannelType::Uint) {
            const auto integer = static_cast<std::uint32_t>(value);
            std::memcpy(to, &integer, 4);
        }
    }
    for (std::size_t p = 0; p < all.pixels(); ++p)
        plane.pointers.push_back(reinterpret_cast<char*>(plane.bytes.data() + all.offsets[p] * size));
    return plane;
}

// Where pixel (0, 0) would be: OpenEXR adds x and y strides to it.
char* origin(void* first, const Window& data, std::size_t size) {
    const std::ptrdiff_t pixels =
        static_cast<std::ptrdiff_t>(data.x) + static_cast<std::ptrdiff_t>(data.y) * data.width;
    return reinterpret_cast<char*>(reinterpret_cast<std::intptr_t>(first) -
                                   pixels * static_cast<std::ptrdiff_t>(size));
}

struct DeepPlanes {
    std::vector<unsigned int> counts;
    std::vector<Plane> planes;
    Imf::DeepFrameBuffer buffer;
};

DeepPlanes toPlanes(const TestDump& dump) {
    DeepPlanes deep;
    const SampleBand& all = dump.all;
    const Window& data = dump.header.data;
    for (std::size_t p = 0; p < all.pixels(); ++p)
        deep.counts.push_back(static_cast<unsigned int>(all.offsets[p + 1] - all.offsets[p]));
    const auto width = static_cast<std::size_t>(data.width);
    deep.buffer.insertSampleCountSlice(
        Imf::Slice(Imf::UINT, origin(deep.counts.data(), data, 4), 4, 4 * width));
    for (std::size_t c = 0; c < dump.header.channels.size(); ++c)
        deep.planes.push_back(toPlane(all, c, dump.header.channels[c].type));
    for (std::size_t c = 0; c < dump.header.channels.size(); ++c) {
        const Imf::PixelType type = pixelType(dump.header.channels[c].type);
        deep.buffer.insert(dump.header.channels[c].name,
                           Imf::DeepSlice(type, origin(deep.planes[c].pointers.data(), data, sizeof(char*)),
                                          sizeof(char*), sizeof(char*) * width, typeBytes(type)));
    }
    return deep;
}

Imf::Header toHeader(const DumpHeader& dump, const char* name, const std::string& type) {
    const auto box = [](const Window& w) {
        return Imath::Box2i({w.x, w.y}, {w.x + w.width - 1, w.y + w.height - 1});
    };
    Imf::Header header(box(dump.display), box(dump.data));
    header.setName(name);
    header.setType(type);
    const Imf::Compression compressions[] = {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION,
                                             Imf::ZIPS_COMPRESSION};
    header.compression() = compressions[static_cast<int>(dump.compression)];
    for (const auto& channel : dump.channels)
        header.channels().insert(channel.name, Imf::Channel(pixelType(channel.type)));
    return header;
}

TestDump upsideDown(const TestDump& dump) {
    TestDump other = dump;
    other.all.offsets = {0};
    for (auto& values : other.all.values) values.clear();
    for (int row = dump.all.height - 1; row >= 0; --row) {
        const SampleBand band = rowsOf(dump.all, row, 1);
        const std::uint64_t before = other.all.offsets.back();
        for (std::size_t p = 1; p < band.offsets.size(); ++p)
            other.all.offsets.push_back(before + band.offsets[p]);
        for (std::size_t c = 0; c < band.values.size(); ++c)
            other.all.values[c].insert(other.all.values[c].end(), band.values[c].begin(),
                                       band.values[c].end());
    }
    return other;
}

}  // namespace

void writeWithOpenExr(const std::string& path, const TestDump& dump, const OpenExrFile& how) {
    const int rows = how.rowsWritten < 0 ? dump.header.data.height : how.rowsWritten;
    DeepPlanes deep = toPlanes(dump);
    Imf::Header header = toHeader(dump.header, "deep", Imf::DEEPSCANLINE);
    if (how.decreasingY) header.lineOrder() = Imf::DECREASING_Y;
    if (!how.severalParts) {
        Imf::DeepScanLineOutputFile file(path.c_str(), header);
        file.setFrameBuffer(deep.buffer);
        file.writePixels(rows);
        return;
    }
    Imf::Header flat = toHeader(dump.header, "flat", Imf::SCANLINEIMAGE);
    flat.channels() = Imf::ChannelList();
    flat.channels().insert("R", Imf::Channel(Imf::FLOAT));
    flat.compression() = Imf::ZIP_COMPRESSION;
    const TestDump other = upsideDown(dump);
    DeepPlanes otherDeep = toPlanes(other);
    const Imf::Header headers[] = {flat, header, toHeader(dump.header, "other", Imf::DEEPSCANLINE)};
    Imf::MultiPartOutputFile file(path.c_str(), headers, 3);

    std::vector<float> grey(dump.all.pixels(), 0.5f);
    const auto width = static_cast<std::size_t>(dump.header.data.width);
    Imf::FrameBuffer buffer;
    buffer.insert("R", Imf::Slice(Imf::FLOAT, origin(grey.data(), dump.header.data, 4), 4, 4 * width));
    Imf::OutputPart flatPart(file, 0);
    flatPart.setFrameBuffer(buffer);
    flatPart.writePixels(dump.header.data.height);
    Imf::DeepScanLineOutputPart deepPart(file, 1);
    deepPart.setFrameBuffer(deep.buffer);
    deepPart.writePixels(rows);
    Imf::DeepScanLineOutputPart otherPart(file, 2);
    otherPart.setFrameBuffer(otherDeep.buffer);
    otherPart.writePixels(dump.header.data.height);
}

void writeDeepTiles(const std::string& path, const TestDump& dump) {
    DeepPlanes deep = toPlanes(dump);
    Imf::Header header = toHeader(dump.header, "tiles", Imf::DEEPTILE);
    header.setTileDescription(Imf::TileDescription(8, 8));
    Imf::DeepTiledOutputFile file(path.c_str(), header);
    file.setFrameBuffer(deep.buffer);
    file.writeTiles(0, file.numXTiles() - 1, 0, file.numYTiles() - 1);
}

SampleBand readWithOpenExr(const std::string& path, int part) {
    Imf::MultiPartInputFile file(path.c_str());
    Imf::DeepScanLineInputPart input(file, part);
    const Imath::Box2i box = input.header().dataWindow();
    SampleBand band;
    band.x = box.min.x;
    band.y = box.min.y;
    band.width = box.max.x - box.min.x + 1;
    band.height = box.max.y - box.min.y + 1;
    const Window data{band.x, band.y, band.width, band.height};
    const auto width = static_cast<std::size_t>(band.width);

    std::vector<unsigned int> counts(band.pixels());
    std::vector<std::vector<char*>> pointers;
    Imf::DeepFrameBuffer buffer;
    buffer.insertSampleCountSlice(Imf::Slice(Imf::UINT, origin(counts.data(), data, 4), 4, 4 * width));
    // OpenEXR converts to the type asked for; UINT that fits into float stays exact.
    const Imf::ChannelList& channels = input.header().channels();
    for (auto it = channels.begin(); it != channels.end(); ++it) {
        band.channels.emplace_back(it.name());
        pointers.emplace_back(band.pixels());
    }
    for (std::size_t c = 0; c < pointers.size(); ++c)
        buffer.insert(band.channels[c],
                      Imf::DeepSlice(Imf::FLOAT, origin(pointers[c].data(), data, sizeof(char*)),
                                     sizeof(char*), sizeof(char*) * width, sizeof(float)));
    input.setFrameBuffer(buffer);
    input.readPixelSampleCounts(box.min.y, box.max.y);
    band.offsets.push_back(0);
    for (const unsigned int count : counts) band.offsets.push_back(band.offsets.back() + count);
    for (auto& planePointers : pointers) {
        auto& values = band.values.emplace_back(band.samples() + 1);
        for (std::size_t p = 0; p < counts.size(); ++p)
            planePointers[p] = reinterpret_cast<char*>(values.data() + band.offsets[p]);
    }
    input.readPixels(box.min.y, box.max.y);
    for (auto& values : band.values) values.pop_back();
    return band;
}

}  // namespace vlx
