// The default against its combination with another denoiser's image, with and without images of halves, on
// the same samples: "x default" is the ratio (at most 1.5 is asked).

#include <benchmark/benchmark.h>

#include <chrono>
#include <memory>

#include "room_samples.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

constexpr Window kRoom{0, 0, 960, 540};

const SampleBuffer& samplesOfRoom() {
    static const SampleBuffer samples = roomSamples(kRoom, 8, false);
    return samples;
}

Image denoisedRoom(int phase) {
    Image image(kRoom, {"R", "G", "B"});
    for (int y = 0; y < kRoom.height; ++y)
        for (int x = 0; x < kRoom.width; ++x)
            for (int c = 0; c < 3; ++c)
                image.at(x, y)[c] =
                    roomTruth(x, y, c) * (1 + 0.02f * static_cast<float>((x * 7 + y * 3 + phase) % 5 - 2));
    return image;
}

std::shared_ptr<const SecondOpinion> roomOpinion(bool halves) {
    SecondOpinion opinion{denoisedRoom(0), {}};
    if (halves) opinion.halves = {denoisedRoom(1), denoisedRoom(4)};
    return std::make_shared<SecondOpinion>(std::move(opinion));
}

double timed(const Drift& options) {
    const auto start = std::chrono::steady_clock::now();
    benchmark::DoNotOptimize(reconstruct(samplesOfRoom(), options).image.pixels.data());
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
