#include <array>
#include <cmath>
#include <cstdio>
#include <thread>
#include <vector>

#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/compare/metrics.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/sample_buffer.h"
#include "variolux/dump/sample_writer.h"
#include "variolux/dump/writer.h"
#include "variolux/geostat/variogram_model.h"
#include "variolux/reconstruct/reconstruct.h"

namespace {

int failures = 0;

void expect(bool condition, const char* what) {
    if (condition) return;
    std::fprintf(stderr, "failed: %s\n", what);
    ++failures;
}

void useImages() {
    vlx::Image image(vlx::Window{0, 0, 16, 16}, {"R", "G", "B"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = i % 2 == 0 ? 0.25f : 0.75f;
    vlx::writeImage("consumer.exr", image);
    const vlx::Image back = vlx::readImage("consumer.exr");
    const vlx::Comparison comparison = vlx::compareColour(image, vlx::gaussianFilter(back, 1.0).image);
    expect(vlx::compareColour(image, back)[vlx::Metric::Mse] == 0, "an image reads back as it was written");
    expect(comparison[vlx::Metric::Mse] > 0, "a filter changes an image");
}

void useDumps() {
    vlx::DumpHeader header;
    header.data = header.display = vlx::Window{0, 0, 2, 1};
    header.channels = {{"R"}, {"G"}, {"B"}};
    vlx::SampleBand band;
    band.width = 2;
    band.height = 1;
    band.offsets = {0, 1, 3};
    band.channels = {"R", "G", "B"};
    band.values.assign(3, {0.5f, 1.0f, 2.0f});
    vlx::DumpWriter writer("consumer_dump.exr", header);
    writer.write(band);
    writer.close();
    expect(vlx::DumpReader("consumer_dump.exr").read(0, 1, {"G"}).values[0] == band.values[1],
           "samples read back as they were written");
}

// A renderer: tiles, one thread each, with samples at random places.
void renderTiles() {
    constexpr int kSize = 64, kTile = 16, kSamples = 4;
    vlx::DumpHeader header;
    header.data = header.display = vlx::Window{0, 0, kSize, kSize};
    header.channels = {{"R"}, {"G"}, {"B"}, {"sample.x"}, {"sample.y"}};
    header.renderer = "consumer";
    header.samples = kSamples;
    vlx::SampleWriter writer("consumer_tiles.exr", header);
    std::vector<std::thread> threads;
    for (int y = 0; y < kSize; y += kTile)
        threads.emplace_back([&writer, y] {
            for (int x = 0; x < kSize; x += kTile) {
                vlx::SampleTile tile = writer.tile({x, y, kTile, kTile});
                for (int py = y; py < y + kTile; ++py)
                    for (int px = x; px < x + kTile; ++px)
                        for (int i = 0; i < kSamples; ++i) {
                            const float u = static_cast<float>(px) + static_cast<float>(i) / kSamples;
                            const float v = static_cast<float>(py) + 0.5f;
                            tile.add(px, py, std::array{u, v, u * v, u, v});
                        }
                writer.add(std::move(tile));
            }
        });
    for (auto& thread : threads) thread.join();
    writer.close();
    const vlx::DumpReader dump("consumer_tiles.exr");
    const vlx::SampleBand band = dump.read(10, 1, {"R", "sample.x"});
    expect(band.samples() == kSize * kSamples && band.values[0] == band.values[1],
           "a renderer's tiles become a dump");

    // The same samples without a file, as a viewport would.
    const vlx::SampleBuffer buffer(dump.header(), dump.read(0, kSize));
    std::int64_t rows = 0;
    const vlx::Reconstruction shown = vlx::reconstruct(buffer, vlx::Drift{.quality = vlx::Quality::Draft},
                                                       [&](std::int64_t done, std::int64_t) { rows = done; });
    expect(rows == kSize, "a reconstruction tells its progress");
    expect(
        shown.image.pixels == vlx::reconstruct(dump, vlx::Drift{.quality = vlx::Quality::Draft}).image.pixels,
        "samples in memory give the image that a dump gives");
}

void useGeostatistics() {
    vlx::VariogramModel model;
    model.nugget = 0.25;
    model.structures = {{vlx::StructureType::Exponential, 1.0, 2.0}};
    expect(std::abs(vlx::semivariance(model, 2.0) - (1.25 - std::exp(-1.0))) < 1e-12,
           "an exponential variogram at its range");
}

}  // namespace

int main() {
    try {
        useImages();
        useDumps();
        renderTiles();
        useGeostatistics();
    } catch (const vlx::Error& error) {
        std::fprintf(stderr, "failed: %s\n", error.what());
        return 1;
    }
    if (failures == 0) std::puts("consumer: all well");
    return failures == 0 ? 0 : 1;
}
