#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "variolux/base/window.h"

namespace vlx {

/// A flat raster image of named float channels, scene-linear, interleaved, rows from the top.
/// A value type: copying copies the pixels.
struct Image {
    Window data;                        ///< pixels held
    Window display;                     ///< the picture they belong to (a crop has data inside display)
    std::vector<std::string> channels;  ///< for example R, G, B, stddev.R
    std::vector<float> pixels;          ///< data.height * data.width * channels.size() values

    Image() = default;
    /// An image of zeros whose display window is its data window.
    Image(Window window, std::vector<std::string> channelNames)
        : data(window),
          display(window),
          channels(std::move(channelNames)),
          pixels(static_cast<std::size_t>(window.pixels()) * channels.size()) {}

    int channelCount() const { return static_cast<int>(channels.size()); }

    /// Index of the channel of this name, or -1.
    int channel(std::string_view name) const {
        for (std::size_t i = 0; i < channels.size(); ++i)
            if (channels[i] == name) return static_cast<int>(i);
        return -1;
    }

    /// The image of some of its channels, in the order of `names`, all of which it has.
    Image select(const std::vector<std::string>& names) const {
        Image result(data, names);
        result.display = display;
        std::vector<int> from;
        from.reserve(names.size());
        for (const std::string& name : names) from.push_back(channel(name));
        const std::size_t count = channels.size();
        auto out = result.pixels.begin();
        for (std::size_t p = 0; p < pixels.size(); p += count)
            for (const int c : from) *out++ = pixels[p + static_cast<std::size_t>(c)];
        return result;
    }

    /// The channels of column `col`, row `row`, counted from the data window's corner.
    float* at(int col, int row) { return pixels.data() + offset(col, row); }
    const float* at(int col, int row) const { return pixels.data() + offset(col, row); }

  private:
    std::size_t offset(int col, int row) const {
        return (static_cast<std::size_t>(row) * static_cast<std::size_t>(data.width) +
                static_cast<std::size_t>(col)) *
               channels.size();
    }
};

}  // namespace vlx
