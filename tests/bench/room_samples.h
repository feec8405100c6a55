#pragma once

#include <cmath>
#include <random>
#include <string>
#include <utility>

#include "../reconstruct/make_band.h"
#include "variolux/dump/sample_buffer.h"

namespace vlx {

/// Colour c of a made-up room: tiles of 24 pixels under light that varies slowly.
inline float roomTile(int x, int y, int c) { return (x / 24 + y / 24 + c) % 2 != 0 ? 0.3f : 1.f; }
inline float roomTruth(int x, int y, int c) {
    const float light =
        1 + 0.4f * std::sin(0.05f * static_cast<float>(x)) * std::cos(0.03f * static_cast<float>(y));
    return light * roomTile(x, y, c);
}

/// Samples of it; with features, as a tracer writes them: albedo and depth that vary within a pixel, normals
/// that do not.
inline SampleBuffer roomSamples(const Window& window, int count, bool features) {
    std::mt19937 random(1);
    std::gamma_distribution<float> noise(2, 0.5f);
    SampleBand band = makeBand(window, count, [&](int x, int y, int i) {
        const float n = noise(random);
        return MadeSample{roomTruth(x, y, 0) * n, roomTruth(x, y, 1) * n, roomTruth(x, y, 2) * n,
                          stratumX(x, i), stratumY(y, i)};
    });
    const auto add = [&](const std::string& name, auto value) {
        band.channels.push_back(name);
        auto& values = band.values.emplace_back();
        for (int y = window.y; y < window.y + window.height; ++y)
            for (int x = window.x; x < window.x + window.width; ++x)
                for (int i = 0; i < count; ++i) values.push_back(value(x, y));
    };
    if (features) {
        for (int c = 0; c < 3; ++c)
            add(std::string("albedo.") + "RGB"[c],
                [&](int x, int y) { return roomTile(x, y, c) * (0.9f + 0.1f * noise(random)); });
        for (int c = 0; c < 3; ++c)
            add(std::string("N.") + "XYZ"[c], [&](int x, int y) {
                const float tilt = 0.3f * std::sin(0.02f * static_cast<float>(x + y));
                return c < 2 ? tilt : std::sqrt(1 - 2 * tilt * tilt);
            });
        add("Z",
            [&](int x, int y) { return 3 + 0.005f * static_cast<float>(x + y) + 0.01f * noise(random); });
    }
    DumpHeader header;
    header.data = header.display = window;
    for (const std::string& name : band.channels) header.channels.push_back({name});
    return SampleBuffer(header, std::move(band));
}

}  // namespace vlx
