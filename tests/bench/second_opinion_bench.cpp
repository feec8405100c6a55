// The default against its combination with another denoiser's image, with and without images of halves, on
// the same samples: "x default" is the ratio (at most 1.5 is asked).

#include <benchmark/benchmark.h>

#include <chrono>
#include <memory>

#include "../reconstruct/make_band.h"
#include "variolux/dump/sample_buffer.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

constexpr Window kRoom{0, 0, 960, 540};

float truth(int x, int y, int c) {
    const float shade =
        1 + 0.4f * std::sin(0.05f * static_cast<float>(x)) * std::cos(0.03f * static_cast<float>(y));
    return shade * ((x / 24 + y / 24 + c) % 2 != 0 ? 0.3f : 1.f);
}

const SampleBuffer& roomSamples() {
    static const SampleBuffer samples = [] {
        std::mt19937 random(1);
        std::gamma_distribution<float> noise(2, 0.5f);
        DumpHeader header;
        header.data = header.display = kRoom;
        header.channels = {{"R"}, {"G"}, {"B"}, {"sample.x"}, {"sample.y"}};
        return SampleBuffer(header, makeBand(kRoom, 8, [&](int x, int y, int i) {
                                const float n = noise(random);
                                return MadeSample{truth(x, y, 0) * n, truth(x, y, 1) * n, truth(x, y, 2) * n,
                                                  stratumX(x, i), stratumY(y, i)};
                            }));
    }();
    return samples;
}

Image denoisedRoom(int phase) {
    Image image(kRoom, {"R", "G", "B"});
    for (int y = 0; y < kRoom.height; ++y)
        for (int x = 0; x < kRoom.width; ++x)
            for (int c = 0; c < 3; ++c)
                image.at(x, y)[c] =
                    truth(x, y, c) * (1 + 0.02f * static_cast<float>((x * 7 + y * 3 + phase) % 5 - 2));
    return image;
}

std::shared_ptr<const SecondOpinion> roomOpinion(bool halves) {
    SecondOpinion opinion{denoisedRoom(0), {}};
    if (halves) opinion.halves = {denoisedRoom(1), denoisedRoom(4)};
    return std::make_shared<SecondOpinion>(std::move(opinion));
}

double timed(const Drift& options) {
    const auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(reconstruct(roomSamples(), options).image.pixels.data());
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void withOpinion(benchmark::State& state) {
    const Drift both{.secondOpinion = roomOpinion(state.range(0) != 0)};
    double alone = 0, combined = 0;
    for (auto _ : state) {
        alone += timed(Drift{});
        combined += timed(both);
    }
    state.counters["x default"] = combined / alone;
    state.SetLabel(state.range(0) != 0 ? "images of halves" : "one image");
}

BENCHMARK(withOpinion)->Arg(1)->Arg(0)->Unit(benchmark::kSecond)->Iterations(3);

}  // namespace
}  // namespace vlx

BENCHMARK_MAIN();
