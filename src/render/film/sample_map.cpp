#include "render/film/sample_map.h"

#include <algorithm>
#include <cmath>

#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/base/text.h"

namespace vlx::render {

SampleMap::SampleMap(const std::string& path, const Window& picture, const Window& window)
    : image_(readImage(path)), channel_(image_.channel("sampling.density")), pixels_(window.pixels()) {
    if (channel_ < 0) channel_ = image_.channel("Y");
    if (channel_ < 0 && image_.channelCount() == 1) channel_ = 0;
    if (channel_ < 0)
        throw Error(path, "expected a channel sampling.density or Y, found " + listed(image_.channels));
    if (image_.display != picture)
        throw Error(path, "expected densities of a picture with " + windowText(picture) +
                              ", found one with " + windowText(image_.display));
    const Window& held = image_.data;
    const bool covers = window.x >= held.x && window.y >= held.y &&
                        window.x + window.width <= held.x + held.width &&
                        window.y + window.height <= held.y + held.height;
    if (!covers) throw Error(path, "expected " + windowText(window) + ", found " + windowText(held));
    for (int y = window.y; y < window.y + window.height; ++y) {
        for (int x = window.x; x < window.x + window.width; ++x) {
            const float v = image_.at(x - held.x, y - held.y)[channel_];
            if (!std::isfinite(v) || v < 0)
                throw Error(path, "expected densities that are finite and >= 0, found " + std::to_string(v) +
                                      " at column " + std::to_string(x) + ", row " + std::to_string(y));
            total_ += v;
            greatest_ = std::max(greatest_, static_cast<double>(v));
        }
    }
    if (!(total_ > 0)) throw Error(path, "expected a density above 0 somewhere, found none");
}

int SampleMap::samplesAt(int x, int y, int mean, std::uint64_t seed) const {
    const double density = image_.at(x - image_.data.x, y - image_.data.y)[channel_];
    const double wanted = density / total_ * static_cast<double>(pixels_) * mean;
    const double u = static_cast<double>(hashOf(seed, x, y, 0x6d6170u) >> 11) * 0x1p-53;
    return static_cast<int>(std::min(std::floor(wanted + u), 16777216.0));
}

std::int64_t SampleMap::most(int mean) const {
    return static_cast<std::int64_t>(
        std::min(std::ceil(greatest_ / total_ * static_cast<double>(pixels_) * mean) + 1, 16777216.0));
}

}  // namespace vlx::render
