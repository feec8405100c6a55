#include "reconstruct/common/rebin.h"

#include <algorithm>
#include <cmath>
#include <numeric>

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

SampleBand averageReplicates(const SampleBand& band, std::size_t replicateChannel) {
    SampleBand means{band.x, band.y, band.width, band.height, {0}, band.channels, {}};
    means.values.resize(band.values.size());
    const std::vector<float>& replicate = band.values[replicateChannel];
    std::vector<std::size_t> order;
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        order.resize(static_cast<std::size_t>(band.offsets[p + 1] - band.offsets[p]));
        std::iota(order.begin(), order.end(), static_cast<std::size_t>(band.offsets[p]));
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return replicate[a] < replicate[b]; });
        for (std::size_t first = 0, end = 0; first < order.size(); first = end) {
            do ++end;
            while (end < order.size() && replicate[order[end]] == replicate[order[first]]);
            for (std::size_t c = 0; c < band.values.size(); ++c) {
                double sum = 0;
                for (std::size_t i = first; i < end; ++i)
                    sum += static_cast<double>(band.values[c][order[i]]);
                means.values[c].push_back(static_cast<float>(sum / static_cast<double>(end - first)));
            }
        }
        means.offsets.push_back(means.values[0].size());
    }
    return means;
}

SampleBand readRows(const SampleSource& dump, const SampleLayout& layout, int scale, int y, int rows) {
    SampleBand band = dump.read(dump.header().data.y + y, rows, layout.names);
    if (scale > 1) {
        const auto position = static_cast<std::size_t>(layout.position);
        band = rebin(band, scale, position, position + 1);
    }
    if (dump.header().replicatesShare && layout.replicate >= 0)
        band = averageReplicates(band, static_cast<std::size_t>(layout.replicate));
    return band;
}

}  // namespace vlx
