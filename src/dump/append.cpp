#include "dump/append.h"

#include <algorithm>

namespace vlx {

SampleBand joined(const SampleBand& first, const SampleBand& second) {
    SampleBand both;
    both.x = second.x;
    both.y = second.y;
    both.width = second.width;
    both.height = second.height;
    both.channels = second.channels;
    both.offsets.assign(second.pixels() + 1, 0);
    for (std::size_t p = 0; p <= second.pixels(); ++p) both.offsets[p] = first.offsets[p] + second.offsets[p];
    for (std::size_t c = 0; c < second.values.size(); ++c) {
        std::vector<float>& out = both.values.emplace_back();
        out.reserve(both.samples());
        const auto take = [&](const SampleBand& from, std::size_t p) {
            const auto begin = from.values[c].begin();
            out.insert(out.end(), begin + static_cast<std::ptrdiff_t>(from.offsets[p]),
                       begin + static_cast<std::ptrdiff_t>(from.offsets[p + 1]));
        };
        for (std::size_t p = 0; p < second.pixels(); ++p) {
            take(first, p);
            take(second, p);
        }
    }
    return both;
}

std::uint32_t freeReplicate(const SampleSource& dump) {
    constexpr int kRows = 16;
    std::uint32_t next = 0;
    const Window& w = dump.header().data;
    for (int y = w.y; y < w.y + w.height; y += kRows) {
        const SampleBand band = dump.read(y, std::min(kRows, w.y + w.height - y), {"sample.replicate"});
        for (const float v : band.values[0]) next = std::max(next, replicateNumber(v).value() + 1);
    }
    return next;
}

std::uint64_t samplesOf(const SampleSource& dump) {
    std::uint64_t total = 0;
    const Window& w = dump.header().data;
    for (int y = w.y; y < w.y + w.height; ++y)
        for (const std::uint32_t n : dump.counts(y, 1)) total += n;
    return total;
}

}  // namespace vlx
