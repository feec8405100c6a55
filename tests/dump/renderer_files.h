#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "variolux/base/image.h"

namespace vlx {

/// Files as other renderers and denoisers write them, byte for byte where the format is not OpenEXR. Bytes,
/// not files, so that tests can damage them.
using FileBytes = std::vector<unsigned char>;

/// BCD's raw samples. `value(x, y, sample, channel)`.
struct BcdRaw {
    std::int32_t version = 1, width = 5, height = 4, samples = 3, channels = 3;
    std::function<float(int x, int y, int sample, int channel)> value;
};
FileBytes bcdRawBytes(const BcdRaw& raw);

/// A tile of SBMC with LZ4 frames. `value(sample, feature, x, y)`, x and y counted in the picture.
struct SbmcTileFile {
    std::int32_t version = 20190401, tileSize = 4, width = 8, height = 8, samples = 2, referenceSamples = 64,
                 sampleFeatures = 27, pixelFeatures = 30, pathDepth = 6, x = 0, y = 0;
    std::function<float(int sample, int feature, int x, int y)> value;
};
FileBytes sbmcTileBytes(const SbmcTileFile& tile);

/// An image whose channel c of pixel (x, y) is value(c, x, y).
Image imageOf(const Window& window, const std::vector<std::string>& channels,
              const std::function<float(int channel, int x, int y)>& value);

/// Channels in pbrt-v4's gbuffer film's order.
std::vector<std::string> pbrtChannels();

/// Channels of Mitsuba's moment integrator around an aov integrator `img` with albedo, normals nn and depth
/// dd.
std::vector<std::string> mitsubaMomentChannels();

}  // namespace vlx
