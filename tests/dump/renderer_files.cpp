#include "renderer_files.h"

#include <lz4frame.h>

#include <cstring>

namespace vlx {

namespace {

template <class T>
void put(FileBytes& bytes, T value) {
    const std::size_t at = bytes.size();
    bytes.resize(at + sizeof value);
    std::memcpy(bytes.data() + at, &value, sizeof value);
}

void putBlock(FileBytes& bytes, const FileBytes& content) {
    FileBytes packed(LZ4F_compressFrameBound(content.size(), nullptr));
    packed.resize(LZ4F_compressFrame(packed.data(), packed.size(), content.data(), content.size(), nullptr));
    put(bytes, static_cast<std::int32_t>(packed.size()));
    bytes.insert(bytes.end(), packed.begin(), packed.end());
}

}  // namespace

FileBytes bcdRawBytes(const BcdRaw& raw) {
    FileBytes bytes;
    for (const std::int32_t word : {raw.version, raw.width, raw.height, raw.samples, raw.channels})
        put(bytes, word);
    for (int y = 0; y < raw.height; ++y)
        for (int x = 0; x < raw.width; ++x)
            for (int s = 0; s < raw.samples; ++s)
                for (int c = 0; c < raw.channels; ++c) put(bytes, raw.value ? raw.value(x, y, s, c) : 0.5f);
    return bytes;
}

FileBytes sbmcTileBytes(const SbmcTileFile& tile) {
    FileBytes bytes;
    for (const std::int32_t word :
         {tile.version, tile.tileSize, tile.width, tile.height, tile.samples, tile.referenceSamples,
          tile.sampleFeatures, tile.pixelFeatures, tile.pathDepth})
        put(bytes, word);
    for (const float number : {2.5f, 0.0f, 45.0f, 10.0f}) put(bytes, number);
    put(bytes, tile.x);
    put(bytes, tile.y);
    FileBytes reference;
    for (int i = 0; i < tile.pixelFeatures * tile.tileSize * tile.tileSize; ++i) put(reference, 0.25f);
    putBlock(bytes, reference);
    for (int s = 0; s < tile.samples; ++s) {
        FileBytes block;
        for (int f = 0; f < tile.sampleFeatures; ++f)
            for (int y = 0; y < tile.tileSize; ++y)
                for (int x = 0; x < tile.tileSize; ++x)
                    put(block, tile.value ? tile.value(s, f, tile.x + x, tile.y + y) : 0.5f);
        const int pixels = tile.tileSize * tile.tileSize;
        for (int i = 0; i < 6 * tile.pathDepth * pixels; ++i) put(block, 0.125f);
        for (int i = 0; i < tile.pathDepth * pixels; ++i) put(block, std::int16_t{5});
        putBlock(bytes, block);
    }
    return bytes;
}

Image imageOf(const Window& window, const std::vector<std::string>& channels,
              const std::function<float(int channel, int x, int y)>& value) {
    Image image(window, channels);
    for (int row = 0; row < window.height; ++row)
        for (int col = 0; col < window.width; ++col)
            for (int c = 0; c < image.channelCount(); ++c)
                image.at(col, row)[c] = value(c, window.x + col, window.y + row);
    return image;
}

std::vector<std::string> pbrtChannels() {
    return {"R",
            "G",
            "B",
            "Albedo.R",
            "Albedo.G",
            "Albedo.B",
            "P.X",
            "P.Y",
            "P.Z",
            "dzdx",
            "dzdy",
            "N.X",
            "N.Y",
            "N.Z",
            "Ns.X",
            "Ns.Y",
            "Ns.Z",
            "u",
            "v",
            "Variance.R",
            "Variance.G",
            "Variance.B",
            "RelativeVariance.R",
            "RelativeVariance.G",
            "RelativeVariance.B"};
}

std::vector<std::string> mitsubaMomentChannels() {
    std::vector<std::string> own = {"img.albedo.R", "img.albedo.G", "img.albedo.B", "img.nn.X", "img.nn.Y",
                                    "img.nn.Z",     "img.dd.y.T",   "img.X",        "img.Y",    "img.Z"};
    std::vector<std::string> channels = {"R", "G", "B", "A"};
    channels.insert(channels.end(), own.begin(), own.end());
    for (const auto& name : own) channels.push_back("m2_" + name);
    return channels;
}

}  // namespace vlx
