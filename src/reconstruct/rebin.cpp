#include "rebin.h"

#include <algorithm>
#include <cmath>

namespace vlx {

SampleBand rebin(const SampleBand& band, int scale, std::size_t xChannel, std::size_t yChannel) {
    SampleBand fine{
        band.x * scale, band.y * scale, band.width * scale, band.height * scale, {}, band.channels, {}};
    const auto part = [scale](float position, int pixel) {
        if (!std::isfinite(position)) return scale / 2;
        const double within = (static_cast<double>(position) - pixel) * scale;
        return static_cast<int>(std::clamp(within, 0.0, scale - 1.0));
    };
    std::vector<std::size_t> to(band.samples());
    fine.offsets.assign(fine.pixels() + 1, 0);
    for (int row = 0; row < band.height; ++row)
        for (int col = 0; col < band.width; ++col) {
            const std::size_t pixel = static_cast<std::size_t>(row) * static_cast<std::size_t>(band.width) +
                                      static_cast<std::size_t>(col);
            for (std::size_t s = band.offsets[pixel]; s < band.offsets[pixel + 1]; ++s) {
                const int x = col * scale + part(band.values[xChannel][s], band.x + col);
                const int y = row * scale + part(band.values[yChannel][s], band.y + row);
                to[s] = static_cast<std::size_t>(y) * static_cast<std::size_t>(fine.width) +
                        static_cast<std::size_t>(x);
                ++fine.offsets[to[s] + 1];
            }
        }
    for (std::size_t p = 1; p < fine.offsets.size(); ++p) fine.offsets[p] += fine.offsets[p - 1];
    std::vector<std::uint64_t> next(fine.offsets.begin(), fine.offsets.end() - 1);
    for (std::size_t& place : to) place = static_cast<std::size_t>(next[place]++);
    fine.values.resize(band.values.size());
    for (std::size_t c = 0; c < band.values.size(); ++c) {
        fine.values[c].resize(band.samples());
        for (std::size_t s = 0; s < to.size(); ++s) fine.values[c][to[s]] = band.values[c][s];
    }
    return fine;
}

}  // namespace vlx
