// The default reconstruction against what the machine can do, on one thread. Two yardsticks, measured in the
// same run: `peak`, a Gram product's innermost loop on data in the nearest cache, to whose operations a
// second those of the kernels are stated ("of peak"); `stream`, reading the bytes of the samples once through
// memory, of whose time the whole takes so many times ("x stream"). Processor time throughout; that of a
// stage is its share of the whole, by the report's wall times.

#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>
#include <limits>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "base/simd.h"
#include "reconstruct/drift/gram.h"
#include "reconstruct/drift/patch_similarity.h"
#include "room_samples.h"
#include "variolux/base/parallel.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

constexpr int kSamples = 8;
constexpr int kChannels = 12;  // of roomSamples() with features

double processorSeconds() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

/// The least processor time of an action, over some seconds: nothing else had a part in that.
template <class Action>
double fastest(double over, const Action& action) {
    double least = std::numeric_limits<double>::max();
    for (const double start = processorSeconds(); processorSeconds() < start + over;) {
        const double before = processorSeconds();
        action();
        least = std::min(least, processorSeconds() - before);
    }
    return least;
}

using Lanes = simd::Vectors<float, 32>::Type;

float sumOf(const Lanes& x) { return x[0] + x[1] + x[2] + x[3] + x[4] + x[5] + x[6] + x[7]; }

constexpr int kPeakData = 512, kPeakRepeats = 1000;
constexpr int kPeakRows = 4, kPeakColumns = 3;  // as many sums as registers hold beside their factors

/// Products of rows with others, summed in registers, over and over.
VLX_WIDE float multiplyAndAdd(const float* rows, const float* columns) {
    Lanes sum[kPeakRows * kPeakColumns] = {};
    for (int repeat = 0; repeat < kPeakRepeats; ++repeat)
        for (int i = 0; i < kPeakData; i += 8)
#pragma GCC unroll 16
            for (int k = 0; k < kPeakRows * kPeakColumns; ++k)
                sum[k] += simd::load<Lanes>(rows + k / kPeakColumns * kPeakData + i) *
                          simd::load<Lanes>(columns + k % kPeakColumns * kPeakData + i);
    Lanes all = {};
#pragma GCC unroll 16
    for (const Lanes& s : sum) all += s;
    return sumOf(all);
}

/// Operations a second. Measured anew beside each kernel, since a busy machine slows both.
double peak() {
    const std::vector<float> rows(kPeakRows * kPeakData, 1.f), columns(kPeakColumns * kPeakData, 1.f);
    return 2. * kPeakRows * kPeakColumns * kPeakData * kPeakRepeats /
           fastest(0.1, [&] { benchmark::DoNotOptimize(multiplyAndAdd(rows.data(), columns.data())); });
}

VLX_WIDE float readOnce(const float* values, std::size_t n) {
    Lanes sums[8] = {};
    for (std::size_t i = 0; i + 64 <= n; i += 64)
#pragma GCC unroll 8
        for (std::size_t k = 0; k < 8; ++k) sums[k] += simd::load<Lanes>(values + i + 8 * k);
    Lanes all = {};
#pragma GCC unroll 8
    for (const Lanes& s : sums) all += s;
    return sumOf(all);
}

/// Seconds a byte, of more bytes than caches hold.
double stream() {
    static const double measured = [] {
        const std::vector<float> values(std::size_t{64} << 20, 1.f);
        return fastest(0.5, [&] { benchmark::DoNotOptimize(readOnce(values.data(), values.size())); }) /
               static_cast<double>(values.size() * sizeof(float));
    }();
    return measured;
}

void yardsticks(benchmark::State& state) {
    for ([[maybe_unused]] auto _ : state) state.counters["peak_FLOPs"] = peak();
    state.counters["stream_bytes/s"] = 1 / stream();
}

/// Runs a kernel that writes `out`, and states its operations a second and their share of the peak.
/// `operations`: by definition of what is computed, however it is computed. Returns seconds a run.
template <class Kernel>
double run(benchmark::State& state, double operations, const void* out, const Kernel& kernel) {
    const double most = peak();
    const double before = processorSeconds();
    for ([[maybe_unused]] auto _ : state) {
        kernel();
        benchmark::DoNotOptimize(out);
        benchmark::ClobberMemory();
    }
    const double seconds = (processorSeconds() - before) / static_cast<double>(state.iterations());
    state.counters["FLOPs"] = operations / seconds;
    state.counters["of peak"] = operations / seconds / most;
    return seconds;
}

/// Of a neighbourhood: a weight to each datum, and the lower triangle of the sums of products.
void gram(benchmark::State& state) {
    constexpr int kRows = 16;
    const int data = static_cast<int>(state.range(0)), padded = (data + 7) / 8 * 8;
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform;
    std::vector<float> x(static_cast<std::size_t>(kRows * padded)), w(static_cast<std::size_t>(padded)),
        weighted(x.size());
    for (int i = 0; i < data; ++i) {
        w[static_cast<std::size_t>(i)] = uniform(random);
        for (int r = 0; r < kRows; ++r) x[static_cast<std::size_t>(r * padded + i)] = uniform(random);
    }
    std::vector<double> sums(kRows * kRows);
    run(state, data * (kRows + kRows * (kRows + 1.)), sums.data(),
        [&] { weightedGram(x.data(), w.data(), kRows, padded, padded, weighted.data(), sums.data()); });
}

PatchTile noisyTile() {
    PatchTile tile;
    tile.resize(3);
    std::mt19937 random(1);
    std::uniform_real_distribution<float> uniform(0.5f, 1.5f);
    for (float& z : tile.value) z = uniform(random);
    for (float& v : tile.variance) v = 0.1f * uniform(random);
    tile.setScale(0.01f);
    return tile;
}

/// Two pixels' difference: -, * and + of each colour; min, + and - of variances, + of scales, /, + to the
/// sum.
constexpr double kDifference = 15;
/// A patch's sum by columns, then rows, and its mean.
constexpr double kPatchSum = 4 * kPatchRadius + 1;

void distancesOfTile(benchmark::State& state) {
    const PatchTile tile = noisyTile();
    std::vector<float> scratch, out(kTile * kTile);
    constexpr double kSide = kTile + 2 * kPatchRadius, kDistances = kTile * kTile;
    const double seconds = run(state, kSide * kSide * kDifference + kDistances * kPatchSum, out.data(),
                               [&] { patchDistances(tile, 3, -5, scratch, out.data()); });
    state.counters["ns_per_distance"] = 1e9 * seconds / kDistances;
}

void distancesOfPixel(benchmark::State& state) {
    const PatchTile tile = noisyTile();
    const Surroundings around{static_cast<int>(state.range(0))};
    const int side = 2 * around.reach + 1;
    constexpr int kPatch = 2 * kPatchRadius + 1;
    std::vector<float> out(static_cast<std::size_t>(around.size()));
    const double distances = side * side;
    const double seconds = run(state, distances * (kPatch * kPatch * kDifference + 1), out.data(),
                               [&] { patchDistancesFrom(tile, 7, 21, around, out.data()); });
    state.counters["ns_per_distance"] = 1e9 * seconds / distances;
}

/// Of regular centres, so many pixels apart.
void distancesOfLattice(benchmark::State& state) {
    const PatchTile tile = noisyTile();
    PatchLattice lattice;
    lattice.around = {8};
    for (int i = 0; i < kTile; i += static_cast<int>(state.range(0))) lattice.columns.push_back(i);
    lattice.rows = lattice.columns;
    const std::vector<PatchLattice*> lattices{&lattice};
    std::vector<float> scratch;
    latticeDistances(tile, lattices, scratch);
    const double offsets = 17 * 17, centres = static_cast<double>(lattice.rows.size() * lattice.rows.size());
    constexpr double kSide = kTile + 2 * kPatchRadius;
    const double seconds = run(state, offsets * (kSide * kSide * kDifference + centres * kPatchSum),
                               lattice.distances.data(), [&] { latticeDistances(tile, lattices, scratch); });
    state.counters["ns_per_distance"] = 1e9 * seconds / (offsets * centres);
}

void whole(benchmark::State& state) {
    const Window room{0, 0, static_cast<int>(state.range(0)), static_cast<int>(state.range(1))};
    Drift options{.quality = static_cast<Quality>(state.range(2))};
    options.steps.halfResolution = state.range(3) != 0;
    const SampleBuffer samples = roomSamples(room, kSamples, true);
    double seconds = 0, clocked = 0;
    std::map<std::string, double> stages;
    for (auto _ : state) {
        const double before = processorSeconds();
        const ReconstructionReport report = reconstruct(samples, options).report;
        seconds += processorSeconds() - before;
        for (const auto& [stage, wall] : report.drift().seconds) {
            stages[stage] += wall;
            clocked += wall;
        }
    }
    const double pixels = static_cast<double>(room.width) * room.height;
    const double runs = static_cast<double>(state.iterations());
    const double perPixel = 1e9 * seconds / (runs * pixels);
    state.counters["ns_per_pixel"] = perPixel;
    state.counters["x stream"] = seconds / (runs * pixels * kSamples * kChannels * sizeof(float) * stream());
    for (const auto& [stage, wall] : stages) state.counters["ns_" + stage] = perPixel * wall / clocked;
    const char* const names[] = {"draft", "standard", "high"};
    state.SetLabel(names[state.range(2)]);
}

constexpr auto kDraft = static_cast<int>(Quality::Draft), kStandard = static_cast<int>(Quality::Standard),
               kHigh = static_cast<int>(Quality::High);

BENCHMARK(yardsticks)->Iterations(1);
BENCHMARK(gram)->ArgName("data")->Arg(9 * 9)->Arg(17 * 17)->Arg(31 * 31);
BENCHMARK(distancesOfTile);
BENCHMARK(distancesOfLattice)->Arg(4)->Arg(6);
BENCHMARK(distancesOfPixel)->Arg(8)->Arg(15);
BENCHMARK(whole)
    ->ArgNames({"width", "height", "quality", "half"})
    ->Args({480, 270, kDraft, 1})
    ->Args({480, 270, kStandard, 1})
    ->Args({480, 270, kHigh, 1})
    ->Args({480, 270, kDraft, 0})
    ->Args({480, 270, kStandard, 0})
    ->Args({960, 540, kDraft, 1})
    ->Args({960, 540, kStandard, 1})
    ->Unit(benchmark::kSecond)
    ->Iterations(1);

}  // namespace
}  // namespace vlx

int main(int argc, char** argv) {
    const vlx::ThreadLimit one(1);
    benchmark::Initialize(&argc, argv);
    if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
    benchmark::RunSpecifiedBenchmarks();
    return 0;
}
