// Kriging of one region of 4 x 4 pixels (the paper's method) against the bare Cholesky factorisation of a
// matrix of the same size: what everything else costs.

#include <benchmark/benchmark.h>

#include <Eigen/Cholesky>
#include <random>

#include "../reconstruct/make_band.h"
#include "reconstruct/paper/krige_region.h"

namespace vlx {
namespace {

RegionData noisyRegion(int samples) {
    std::mt19937 random(1);
    std::gamma_distribution<float> noise(2, 0.5f);
    const SampleBand band = makeBand({0, 0, 4, 4}, samples, [&](int column, int row, int i) {
        const float x = stratumX(column, i), y = stratumY(row, i),
                    z = (1 + 0.3f * x + 0.1f * y) * noise(random);
        return MadeSample{z, 0.8f * z, 0.5f * z, x, y};
    });
    return gatherRegion(band, madeLayout(), {0, 0, 4, 4}, 4);
}

void bareCholesky(benchmark::State& state) {
    const RegionData data = noisyRegion(32);
    const Eigen::Index n = data.size();
    Eigen::MatrixXd matrix(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
        for (Eigen::Index j = 0; j < n; ++j)
            matrix(i, j) =
                std::exp(-(data.positions.row(i) - data.positions.row(j)).norm()) + (i == j ? 1 : 0);
    for (auto _ : state) benchmark::DoNotOptimize(Eigen::LLT<Eigen::MatrixXd>(matrix).matrixLLT().data());
    state.SetLabel("n = " + std::to_string(n));
}

void krigeOneRegion(benchmark::State& state) {
    const RegionData data = noisyRegion(32);
    for (auto _ : state) benchmark::DoNotOptimize(krigeRegion(data, {.colourDistance = state.range(0) != 0}));
    state.SetLabel(state.range(0) != 0 ? "colour distance" : "image plane only");
}

BENCHMARK(bareCholesky)->Unit(benchmark::kMicrosecond);
BENCHMARK(krigeOneRegion)->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace vlx

BENCHMARK_MAIN();
