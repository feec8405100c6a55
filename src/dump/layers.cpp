#include "variolux/dump/layers.h"

#include <algorithm>

namespace vlx {

namespace {

constexpr int kRows = 64;
constexpr std::size_t kLeastPixels = 8;  // whose order says something: by chance 1 in 256 at most
constexpr double kMostOrdered = 0.95;    // of them
constexpr double kLeastPartial = 0.02;   // of the samples

}  // namespace

std::string layersFoundBy(const SampleSource& source) {
    const DumpHeader& header = source.header();
    const auto has = [&](const char* name) { return findChannel(header, name) >= 0; };
    if ((has("sample.x") && has("sample.y")) || has("sample.replicate") || has("variance.R")) return {};
    if (has("ZBack")) return "channel ZBack, where a layer ends";
    // Coverage may differ by colour.
    const char* alpha = nullptr;
    for (const char* name : {"BA", "AB", "GA", "AG", "RA", "AR", "A"})
        if (has(name)) alpha = name;
    if (alpha == nullptr || !has("Z")) return {};
    std::size_t ordered = 0, unordered = 0, samples = 0, partial = 0;
    const Window& window = header.data;
    const int rows = std::min(kRows, window.height);
    for (int i = 0; i < rows; ++i) {
        const auto row = static_cast<int>((2 * i + 1) * std::int64_t{window.height} / (2 * rows));
        const SampleBand band = source.read(window.y + row, 1, {alpha, "Z"});
        samples += band.samples();
        for (const float a : band.values[0]) partial += a > 0 && a < 1;
        for (std::size_t p = 0; p < band.pixels(); ++p) {
            const auto first = band.values[1].begin() + static_cast<std::ptrdiff_t>(band.offsets[p]);
            const auto end = band.values[1].begin() + static_cast<std::ptrdiff_t>(band.offsets[p + 1]);
            if (!std::is_sorted(first, end))
                ++unordered;
            else if (first != end && *first < *(end - 1))
                ++ordered;
        }
    }
    const auto pixels = static_cast<double>(ordered + unordered);
    if (ordered < kLeastPixels || static_cast<double>(ordered) < kMostOrdered * pixels ||
        static_cast<double>(partial) < kLeastPartial * static_cast<double>(samples))
        return {};
    return std::string("Z that grows from sample to sample, each with a coverage ") + alpha;
}

}  // namespace vlx
