#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vlx {

/// One file of SBMC: a square tile of a picture. The layout is little-endian:
///
///     int32[9]    version, tile size, picture's width and height, samples a pixel, samples of the reference,
///                 features of a sample, features of a pixel, path depth
///     float[4]    focus distance, aperture radius, field of view, scene radius
///     int32[2]    the tile's corner: column, row
///     block       the reference: float[features of a pixel][rows][columns]
///     block ...   each sample: float[features of a sample][rows][columns], then what belongs to the path:
///                 float[4 depth], float[2 depth], int16[depth], of each row and column too
///
/// where a block is an int32 number of bytes and an LZ4 frame of so many bytes.
struct SbmcTileHeader {
    std::int32_t version = 0;
    std::int32_t tileSize = 0;
    std::int32_t width = 0;
    std::int32_t height = 0;
    std::int32_t samples = 0;
    std::int32_t referenceSamples = 0;
    std::int32_t sampleFeatures = 0;
    std::int32_t pixelFeatures = 0;
    std::int32_t pathDepth = 0;
    std::int32_t x = 0;
    std::int32_t y = 0;

    /// Rows and columns within the picture.
    int columns() const { return tileSize < width - x ? tileSize : width - x; }
    int rows() const { return tileSize < height - y ? tileSize : height - y; }
};

/// Numbers of features of a sample, in their order.
enum SbmcFeature : std::size_t {
    kSbmcDx = 0,
    kSbmcDy = 1,
    kSbmcDiffuse = 5,
    kSbmcSpecular = 8,
    kSbmcNormal = 14,
    kSbmcDepthFirst = 17,
    kSbmcHasHit = 20,
    kSbmcAlbedo = 24,
    kSbmcFeatures = 27
};

/// Throws Error when the file does not start as a tile does.
SbmcTileHeader readSbmcHeader(const std::string& path);

/// The kSbmcFeatures first features of all samples: [sample][feature][row][column] of the whole tile. Nothing
/// is allocated that the blocks cannot unpack to. Throws Error.
std::vector<float> readSbmcSamples(const std::string& path, const SbmcTileHeader& header);

}  // namespace vlx
