#include <benchmark/benchmark.h>

#include <random>

#include "variolux/geostat/empirical_variogram.h"
#include "variolux/geostat/variogram_fit.h"

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// A square region of side x side pixels: three noisy channels on a gradient, positions in the plane.
struct Region {
    MatrixXd positions, values;
    VectorXd noise;
    vlx::EmpiricalVariogramOptions options;

    explicit Region(int side) : positions(side * side, 2), values(side * side, 3) {
        std::mt19937_64 random(1);
        std::normal_distribution<double> normal;
        for (int i = 0; i < side * side; ++i) {
            positions.row(i) << i % side + 0.5, i / side + 0.5;
            for (int c = 0; c < 3; ++c) values(i, c) = 0.1 * positions(i, 0) + normal(random);
        }
        noise = VectorXd::Constant(side * side, 3);
        options.edges = vlx::uniformEdges(0.75 * side, 12);
    }
    vlx::EmpiricalVariogram variogram() const {
        return vlx::empiricalVariogram(positions, values, options, noise);
    }
};

void empiricalVariogram(benchmark::State& state) {
    const Region region(static_cast<int>(state.range(0)));
    for (auto _ : state) benchmark::DoNotOptimize(region.variogram().bins.data());
    const auto n = region.positions.rows();
    state.SetItemsProcessed(state.iterations() * n * (n - 1) / 2);
}
BENCHMARK(empiricalVariogram)->Arg(4)->Arg(8)->Arg(16);

void sillTest(benchmark::State& state) {
    const auto variogram = Region(16).variogram();
    for (auto _ : state) benchmark::DoNotOptimize(vlx::sillTest(variogram).pValue);
}
BENCHMARK(sillTest);

/// Arguments: FitSearch, whether alpha is free.
void fitVariogram(benchmark::State& state) {
    const auto variogram = Region(16).variogram();
    vlx::FitOptions options;
    options.search = static_cast<vlx::FitSearch>(state.range(0));
    if (state.range(1)) options.structures = {{vlx::StructureType::Stable, 0, 0, 0.1, 2}};
    for (auto _ : state) benchmark::DoNotOptimize(vlx::fitVariogram(variogram, options).sse);
}
BENCHMARK(fitVariogram)
    ->ArgNames({"fast", "freeAlpha"})
    ->Args({static_cast<int>(vlx::FitSearch::Fast), 0})
    ->Args({static_cast<int>(vlx::FitSearch::Fast), 1})
    ->Args({static_cast<int>(vlx::FitSearch::Global), 0})
    ->Args({static_cast<int>(vlx::FitSearch::Global), 1});

/// One evaluation; arguments: structure type, shape in tenths.
void semivariance(benchmark::State& state) {
    const vlx::VariogramModel model{
        0.1,
        {{static_cast<vlx::StructureType>(state.range(0)), 1, 5, 0.1 * static_cast<double>(state.range(1))}}};
    double h = 0.5;
    for (auto _ : state) {
        benchmark::DoNotOptimize(vlx::semivariance(model, h));
        h = h < 15 ? h + 0.01 : 0.5;
    }
}
BENCHMARK(semivariance)
    ->ArgNames({"type", "shape10"})
    ->Args({static_cast<int>(vlx::StructureType::Exponential), 10})
    ->Args({static_cast<int>(vlx::StructureType::Stable), 13})
    ->Args({static_cast<int>(vlx::StructureType::Matern), 15})
    ->Args({static_cast<int>(vlx::StructureType::Matern), 13});

}  // namespace

BENCHMARK_MAIN();
