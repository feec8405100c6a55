#include "import/sbmc.h"

#include <algorithm>
#include <map>
#include <optional>

#include "dump/exr_header.h"
#include "import/channel_presets.h"
#include "import/sbmc_tile.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr int kBandRows = 32;

struct Tile {
    std::string path;
    SbmcTileHeader header;
};
using TileRow = std::vector<Tile>;

// The tiles by rows, which fill a rectangle. Throws Error when they do not.
std::map<int, TileRow> arrange(const std::vector<std::string>& paths) {
    std::map<int, TileRow> rows;
    std::optional<Tile> first;
    for (const auto& path : paths) {
        Tile tile{path, readSbmcHeader(path)};
        if (!first) first = tile;
        const SbmcTileHeader &h = tile.header, &f = first->header;
        if (h.width != f.width || h.height != f.height || h.tileSize != f.tileSize)
            throw Error(path, "expected a tile of the same picture as " + first->path + ", " +
                                  std::to_string(f.width) + " x " + std::to_string(f.height) +
                                  " pixels in tiles of " + std::to_string(f.tileSize) + ", found " +
                                  std::to_string(h.width) + " x " + std::to_string(h.height) +
                                  " in tiles of " + std::to_string(h.tileSize));
        rows[h.y].push_back(std::move(tile));
    }
    int nextY = rows.begin()->first;
    std::pair<int, int> columns{0, 0};
    for (auto& [y, row] : rows) {
        std::sort(row.begin(), row.end(),
                  [](const Tile& a, const Tile& b) { return a.header.x < b.header.x; });
        if (y != nextY)
            throw Error(row.front().path, "its tile starts in row " + std::to_string(y) + ", expected row " +
                                              std::to_string(nextY) + ": tiles overlap, or some are missing");
        int nextX = row.front().header.x;
        for (const Tile& tile : row) {
            if (tile.header.x != nextX)
                throw Error(tile.path, "its tile starts in column " + std::to_string(tile.header.x) +
                                           " of row " + std::to_string(y) + ", expected column " +
                                           std::to_string(nextX) + ": tiles overlap, or some are missing");
            nextX += tile.header.columns();
        }
        const std::pair<int, int> here{row.front().header.x, nextX};
        if (y == rows.begin()->first) columns = here;
        if (here != columns)
            throw Error(row.front().path, "the tiles of row " + std::to_string(y) + " cover columns " +
                                              std::to_string(here.first) + " to " +
                                              std::to_string(here.second - 1) + ", those above " +
                                              std::to_string(columns.first) + " to " +
                                              std::to_string(columns.second - 1) + ": some are missing");
        nextY += row.front().header.rows();
    }
    return rows;
}

// Features of the samples of one tile.
class TileSamples {
  public:
    explicit TileSamples(const Tile& tile)
        : header(tile.header), values_(readSbmcSamples(tile.path, tile.header)) {}

    float value(int sample, std::size_t feature, int row, int col) const {
        const auto size = static_cast<std::size_t>(header.tileSize);
        return values_[((static_cast<std::size_t>(sample) * kSbmcFeatures + feature) * size +
                        static_cast<std::size_t>(row)) *
                           size +
                       static_cast<std::size_t>(col)];
    }
    const SbmcTileHeader header;

  private:
    std::vector<float> values_;
};

const std::vector<std::string> kNames = {
    "R", "G", "B", "A", "Z", "sample.x", "sample.y", "albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z"};

void appendSample(const TileSamples& tile, int sample, int row, int col, SampleBand& band) {
    const auto value = [&](std::size_t feature) { return tile.value(sample, feature, row, col); };
    std::size_t next = 0;
    const auto put = [&](float v) { band.values[next++].push_back(v); };
    for (std::size_t c = 0; c < 3; ++c) put(value(kSbmcDiffuse + c) + value(kSbmcSpecular + c));
    const bool hit = value(kSbmcHasHit) > 0;
    put(hit ? 1.0f : 0.0f);
    float z = value(kSbmcDepthFirst);
    cleanDepth(z);
    put(hit ? z : 0.0f);
    put(static_cast<float>(tile.header.x + col) + value(kSbmcDx));
    put(static_cast<float>(tile.header.y + row) + value(kSbmcDy));
    for (std::size_t c = 0; c < 3; ++c) put(value(kSbmcAlbedo + c));
    for (std::size_t c = 0; c < 3; ++c) put(value(kSbmcNormal + c));
}

SampleBand bandOf(const std::vector<TileSamples>& tiles, const Window& window, int y, int rows) {
    SampleBand band{window.x, y, window.width, rows, {0}, kNames, {}};
    band.values.resize(kNames.size());
    for (int row = y; row < y + rows; ++row)
        for (const TileSamples& tile : tiles)
            for (int col = 0; col < tile.header.columns(); ++col) {
                for (int sample = 0; sample < tile.header.samples; ++sample)
                    appendSample(tile, sample, row - tile.header.y, col, band);
                band.offsets.push_back(band.values[0].size());
            }
    return band;
}

}  // namespace

ImportReport importSbmc(const std::vector<std::string>& tiles, const std::string& dump,
                        const SbmcOptions& options, const Progress& progress) {
    if (tiles.empty()) throw Error(dump, "expected sample files to make a dump of, found none");
    const std::map<int, TileRow> rows = arrange(tiles);
    const SbmcTileHeader& corner = rows.begin()->second.front().header;
    const SbmcTileHeader& end = rows.rbegin()->second.back().header;

    DumpHeader header;
    header.display = {0, 0, corner.width, corner.height};
    header.data = {corner.x, corner.y, end.x + end.columns() - corner.x, end.y + end.rows() - corner.y};
    for (const auto& standard : standardChannels())
        if (standard.name != "sample.replicate") header.channels.push_back(standard);
    header.compression = options.compression;
    header.renderer = options.renderer;
    header.samples = corner.samples;

    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);
    for (const auto& [y, row] : rows) {
        std::vector<TileSamples> samples;
        for (const Tile& tile : row) samples.emplace_back(tile);
        const int tileRows = row.front().header.rows();
        for (int done = 0; done < tileRows; done += kBandRows)
            writer.write(bandOf(samples, header.data, y + done, std::min(kBandRows, tileRows - done)));
        if (progress) progress(y + tileRows - header.data.y, header.data.height);
    }
    writer.close();

    ImportReport report;
    report.mapped = {{"R", "diffuse_r + specular_r"},
                     {"G", "diffuse_g + specular_g"},
                     {"B", "diffuse_b + specular_b"},
                     {"A", "hasHit"},
                     {"Z", "depth_first"},
                     {"sample.x", "the pixel + dx"},
                     {"sample.y", "the pixel + dy"},
                     {"albedo", "albedo (first diffuse hit)"},
                     {"N", "normal (first diffuse hit)"}};
    report.ignored = {"the reference", "lens_u, lens_v, t", "albedo_first, normal_first, depth", "visibility",
                      "probabilities, light directions and bounce types of paths"};
    report.notes.push_back(std::to_string(tiles.size()) + " tiles: " + windowText(header.data) + ".");
    report.notes.push_back(
        "Normals are taken as they are: SBMC's are in camera space unless told otherwise.");
    report.missing = missingChannels(header);
    return report;
}

}  // namespace vlx
