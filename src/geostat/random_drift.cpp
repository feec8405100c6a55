#include "variolux/geostat/random_drift.h"

#include <algorithm>
#include <cmath>

#include "base/simd.h"

namespace vlx {

namespace {

constexpr double kLeastPrecision = 1e-6;  // of the start: a prior this wide does not shrink
constexpr double kMostPrecision = 1e12;   // of the start: a group this tight is out

using Four = simd::Vectors<double, 32>::Type;

constexpr int kMostColumns = 2 * (kMaxRandomDrift + 3);  // of a matrix and its right sides, in whole vectors

/// Gauss and Jordan's elimination (the sweep of Goodnight 1979, A tutorial on the SWEEP operator): n rows [A
/// | R] of `vectors` vectors become [A^-1 | A^-1 R]. A is symmetric; false where it is not positive. Plain
/// loops along rows: these matrices are too small for blocks to pay. `Vectors`: their number where it is
/// known, or 0.
template <int Vectors>
[[gnu::always_inline]] inline bool sweep(double* rows, int n, int vectors) {
    const int width = Vectors > 0 ? Vectors : vectors;
    for (int k = 0; k < n; ++k) {
        double* const pivot = rows + k * width * 4;
        if (!(pivot[k] > 0)) return false;
        const double scale = 1 / pivot[k];
        Four scaled[Vectors > 0 ? Vectors : kMostColumns / 4];
        for (int v = 0; v < width; ++v) {
            scaled[v] = simd::load<Four>(pivot + 4 * v) * scale;
            simd::store(pivot + 4 * v, scaled[v]);
        }
        pivot[k] = scale;
        for (int i = 0; i < n; ++i) {
            if (i == k) continue;
            double* const row = rows + i * width * 4;
            const double factor = row[k];
            for (int v = 0; v < width; ++v)
                simd::store(row + 4 * v, simd::load<Four>(row + 4 * v) - factor * scaled[v]);
            row[k] = -factor * scale;
        }
    }
    return true;
}

VLX_WIDE bool sweep(double* rows, int n, int vectors) {
    switch (vectors) {
        case 2:
            return sweep<2>(rows, n, vectors);
        case 3:
            return sweep<3>(rows, n, vectors);
        case 4:
            return sweep<4>(rows, n, vectors);
        case 5:
            return sweep<5>(rows, n, vectors);
        default:
            return sweep<0>(rows, n, vectors);
    }
}

}  // namespace

RandomDrift fitRandomDrift(const DriftMoments& moments, const std::vector<int>& group, int groups,
                           int iterations) {
    const Eigen::Index p = moments.normal.rows();
    RandomDrift drift;
    drift.precision.assign(static_cast<std::size_t>(groups), moments.start);
    drift.coefficients.setZero(p, moments.right.cols());
    drift.variance.setZero(p);
    const double least = kLeastPrecision * moments.start, most = kMostPrecision * moments.start;
    const int n = static_cast<int>(p), columns = static_cast<int>(moments.right.cols());
    const int right = (n + 3) / 4 * 4, width = right + (columns + 3) / 4 * 4;  // in a row of [A | R]
    double rows[kMaxRandomDrift * kMostColumns];
    std::vector<double> explained(static_cast<std::size_t>(groups)), squares(explained.size());
    for (int iteration = 0;; ++iteration) {
        std::fill_n(rows, n * width, 0.0);
        for (int i = 0; i < n; ++i) {
            double* const row = rows + i * width;
            for (int j = 0; j < n; ++j) row[j] = moments.normal(j, i);
            row[i] += drift.precision[static_cast<std::size_t>(group[static_cast<std::size_t>(i)])];
            for (int c = 0; c < columns; ++c) row[right + c] = moments.right(i, c);
        }
        if (!sweep(rows, n, width / 4)) {
            drift.ok = false;
            drift.coefficients.setZero();
            return drift;
        }
        std::fill(explained.begin(), explained.end(), 0.0);
        std::fill(squares.begin(), squares.end(), 0.0);
        for (int j = 0; j < n; ++j) {
            const double* const row = rows + j * width;
            double square = 0;
            for (int c = 0; c < moments.fitted; ++c) square += row[right + c] * row[right + c];
            const auto g = static_cast<std::size_t>(group[static_cast<std::size_t>(j)]);
            explained[g] += std::max(0.0, 1 - drift.precision[g] * row[j]);
            squares[g] += square / moments.fitted;
        }
        drift.effective = 0;
        for (const double gamma : explained) drift.effective += gamma;
        if (iteration == iterations) {
            for (int j = 0; j < n; ++j) {
                drift.variance[j] = rows[j * width + j];
                for (int c = 0; c < columns; ++c) drift.coefficients(j, c) = rows[j * width + right + c];
            }
            break;
        }
        for (std::size_t g = 0; g < explained.size(); ++g)
            drift.precision[g] = std::clamp(explained[g] / std::max(squares[g], 1e-300), least, most);
    }
    if (!drift.coefficients.allFinite() || !drift.variance.allFinite()) {
        drift.ok = false;
        drift.coefficients.setZero();
        drift.variance.setZero();
    }
    return drift;
}

}  // namespace vlx
