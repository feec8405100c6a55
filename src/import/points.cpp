#include "import/points.h"

#include <algorithm>
#include <array>
#include <vector>

#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/sobol.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr std::uint32_t kMaxPoints = 1u << 20;

struct Place {
    int col, row;
    float x, y;
};

std::vector<Place> sobolPlaces(const Window& window, const PointOptions& options) {
    // Two odd constants tell the coordinates' seeds apart, whatever the seed's upper half is.
    const SobolSeeds seeds = SobolSeeds::from((options.seed + 1) * 0x9e3779b97f4a7c15u ^ 0xd1b54a32d192ed03u);
    std::vector<Place> places;
    for (std::uint32_t i = 0; i < options.points; ++i) {
        const SobolPoint p = options.scramble ? scrambledSobolPoint(i, seeds) : sobolPoint(i);
        const float x = unitFloat(p.x) * static_cast<float>(window.width);
        const float y = unitFloat(p.y) * static_cast<float>(window.height);
        places.push_back({std::min(static_cast<int>(x), window.width - 1),
                          std::min(static_cast<int>(y), window.height - 1), x + static_cast<float>(window.x),
                          y + static_cast<float>(window.y)});
    }
    std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return std::pair(a.row, a.col) < std::pair(b.row, b.col);
    });
    return places;
}

}  // namespace

void sampleAtPoints(const std::string& path, const std::string& dump, const PointOptions& options) {
    if (options.points < 1 || options.points > kMaxPoints)
        throw Error("", "expected 1 to " + std::to_string(kMaxPoints) + " points, found " +
                            std::to_string(options.points));
    const Image image = readImage(path);
    std::array<int, 3> colours{};
    for (int c = 0; c < 3; ++c) {
        colours[static_cast<std::size_t>(c)] = image.channel(std::string(1, "RGB"[c]));
        if (colours[static_cast<std::size_t>(c)] < 0)
            throw Error(path, std::string("expected channels R, G and B, found no ") + "RGB"[c]);
    }

    DumpHeader header;
    header.data = image.data;
    header.display = image.display;
    for (const char* name : {"R", "G", "B", "sample.x", "sample.y"})
        header.channels.push_back({name, ChannelType::Float});
    header.compression = options.compression;
    header.renderer = "vlx-pack sample";
    header.scene = path;
    header.samples = static_cast<double>(options.points) / static_cast<double>(image.data.pixels());
    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);

    const std::vector<Place> places = sobolPlaces(image.data, options);
    auto place = places.begin();
    for (int row = 0; row < image.data.height; ++row) {
        SampleBand band{image.data.x,
                        image.data.y + row,
                        image.data.width,
                        1,
                        {0},
                        {"R", "G", "B", "sample.x", "sample.y"},
                        {}};
        band.values.resize(5);
        for (int col = 0; col < image.data.width; ++col) {
            for (; place != places.end() && place->row == row && place->col == col; ++place) {
                for (std::size_t c = 0; c < 3; ++c) band.values[c].push_back(image.at(col, row)[colours[c]]);
                band.values[3].push_back(place->x);
                band.values[4].push_back(place->y);
            }
            band.offsets.push_back(band.values[0].size());
        }
        writer.write(std::move(band));
    }
    writer.close();
}

}  // namespace vlx
