#include "variolux/geostat/lattice_variogram.h"

#include <array>
#include <cassert>
#include <cmath>

#include "base/simd.h"
#include "geostat/lag_classes.h"

namespace vlx {
namespace {

using Eigen::Index;
using FourDoubles = simd::Vectors<double, 32>::Type;  // on every instruction set: sums of one order
constexpr Index kWide = simd::kLanes<FourDoubles>;

/// Planes of the lattice's size, zero where there is no datum, rows padded so that whole vectors may be read:
/// 1 where there is one, its error variance, its values.
struct LatticePlanes {
    Index width, height, stride, channels;
    std::vector<double> numbers;

    LatticePlanes(const Lattice& lattice, Index valueColumns)
        : width(lattice.width),
          height(lattice.height),
          stride((width + kWide - 1) / kWide * kWide + kWide),
          channels(valueColumns),
          numbers(static_cast<std::size_t>((channels + 2) * size())) {}

    Index size() const { return stride * height; }
    double* plane(Index k) { return numbers.data() + k * size(); }
    const double* plane(Index k) const { return numbers.data() + k * size(); }
};

/// Sums over pairs, by lane.
struct LatticeSums {
    using Lanes = std::array<double, kWide>;
    Lanes pairs{}, distance{}, squares{}, noise{};
};

double acrossLanes(const LatticeSums::Lanes& x) { return (x[0] + x[1]) + (x[2] + x[3]); }

/// Adds the pairs of cells (u, v) and (u + right, v + down), right >= 0. `count`: of the planes of values,
/// where the compiler knows it.
template <Index count>
[[gnu::always_inline]] inline void addPairs(const LatticePlanes& of, Index right, Index down, double distance,
                                            LatticeSums& sums) {
    const Index first = down < 0 ? -down : 0, last = down < 0 ? of.height : of.height - down;
    const Index plane = of.size(), apart = down * of.stride + right;
    const Index channels = count > 0 ? count : of.channels;
    FourDoubles pairs{}, squares{}, noise{};
    for (Index v = first; v < last; ++v) {
        const double* row = of.numbers.data() + v * of.stride;
        for (const double *cell = row, *end = row + of.width - right; cell < end; cell += kWide) {
            const FourDoubles both = simd::load<FourDoubles>(cell) * simd::load<FourDoubles>(cell + apart);
            const FourDoubles errors =
                simd::load<FourDoubles>(cell + plane) + simd::load<FourDoubles>(cell + plane + apart);
            FourDoubles squared{};
            for (Index c = 0; c < channels; ++c) {
                const double* value = cell + (2 + c) * plane;
                const FourDoubles difference =
                    simd::load<FourDoubles>(value) - simd::load<FourDoubles>(value + apart);
                squared += difference * difference;
            }
            pairs += both;
            squares += both * squared;
            noise += both * errors;
        }
    }
    for (std::size_t lane = 0; lane < sums.pairs.size(); ++lane) {
        sums.pairs[lane] += pairs[lane];
        sums.distance[lane] += distance * pairs[lane];
        sums.squares[lane] += squares[lane];
        sums.noise[lane] += noise[lane];
    }
}

VLX_WIDE void addOffset(const LatticePlanes& of, Index right, Index down, double distance,
                        LatticeSums& sums) {
    if (of.channels == 3)
        addPairs<3>(of, right, down, distance, sums);
    else
        addPairs<0>(of, right, down, distance, sums);
}

}  // namespace

EmpiricalVariogram latticeVariogram(const Lattice& lattice, const std::vector<Index>& cells,
                                    const Eigen::Ref<const Eigen::MatrixXd>& values,
                                    const std::vector<double>& edges,
                                    const Eigen::Ref<const Eigen::VectorXd>& errorVariances) {
    const auto n = static_cast<Index>(cells.size());
    assert(values.rows() == n && errorVariances.size() == n);
    LatticePlanes planes(lattice, values.cols());
    EmpiricalVariogram result;
    result.bins = emptyBins(edges);
    for (Index i = 0; i < n; ++i) {
        const double noise = errorVariances[i];
        if (!values.row(i).allFinite() || !(noise >= 0 && std::isfinite(noise))) {
            ++result.skipped;
            continue;
        }
        const Index cell = cells[static_cast<std::size_t>(i)];
        const Index at = cell / lattice.width * planes.stride + cell % lattice.width;
        assert(cell >= 0 && cell < lattice.width * lattice.height && planes.plane(0)[at] == 0);
        planes.plane(0)[at] = 1;
        planes.plane(1)[at] = noise;
        for (Index c = 0; c < planes.channels; ++c) planes.plane(2 + c)[at] = values(i, c);
        result.meanNoise += noise;
    }
    result.data = n - result.skipped;
    if (result.data < 2) {
        result.status = VariogramStatus::TooFewData;
        return result;
    }
    result.meanNoise /= static_cast<double>(result.data);

    const LagClasses classes(edges);
    std::vector<LatticeSums> sums(result.bins.size());
    for (Index right = 0; right < lattice.width; ++right)
        for (Index down = 0; down < lattice.height; ++down) {
            if (right == 0 && down == 0) continue;
            const double dx = static_cast<double>(right) * lattice.spacing;
            const double dy = static_cast<double>(down) * lattice.spacing;
            const double distance = std::sqrt(dx * dx + dy * dy);
            const int b = classes.find(distance);
            if (b < 0) continue;
            LatticeSums& s = sums[static_cast<std::size_t>(b)];
            addOffset(planes, right, down, distance, s);
            if (right > 0 && down > 0) addOffset(planes, right, -down, distance, s);
        }

    bool any = false;
    for (std::size_t b = 0; b < sums.size(); ++b) {
        VariogramBin& bin = result.bins[b];
        const double pairs = acrossLanes(sums[b].pairs);
        if (pairs == 0) continue;
        any = true;
        bin.pairs = pairs;
        bin.distance = acrossLanes(sums[b].distance) / pairs;
        bin.noise = 0.5 * acrossLanes(sums[b].noise) / pairs;
        bin.semivariance = 0.5 * acrossLanes(sums[b].squares) / pairs - bin.noise;
    }
    if (!any) result.status = VariogramStatus::NoPairs;
    return result;
}

}  // namespace vlx
