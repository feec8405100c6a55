#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace vlx {

/// The samples of a band of consecutive image rows, one array a channel (structure of arrays).
/// Pixel (col, row), counted from the band's corner, owns the samples
/// [offsets[p], offsets[p + 1]) with p = row * width + col, in every channel; there may be none.
struct SampleBand {
    int x = 0;                               ///< first column (data window)
    int y = 0;                               ///< first row (raster coordinates)
    int width = 0;                           ///< columns
    int height = 0;                          ///< rows
    std::vector<std::uint64_t> offsets;      ///< width * height + 1 values, offsets[0] = 0, never decreasing
    std::vector<std::string> channels;       ///< names, as in the file
    std::vector<std::vector<float>> values;  ///< one array of offsets.back() values a channel

    std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }
    std::size_t samples() const { return offsets.empty() ? 0 : static_cast<std::size_t>(offsets.back()); }

    /// Index of the channel of this name, or -1.
    int channel(std::string_view name) const {
        for (std::size_t i = 0; i < channels.size(); ++i)
            if (channels[i] == name) return static_cast<int>(i);
        return -1;
    }
};

}  // namespace vlx
