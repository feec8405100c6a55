#include "variolux/geostat/random_drift.h"

#include <algorithm>
#include <cmath>

#include "base/simd.h"

namespace vlx {

namespace {

constexpr double kLeastPrecision = 1e-6;  // of the start: a prior this wide does not shrink
constexpr double kMostPrecision = 1e12;   // of the start: a group this tight is out

constexpr int kRow = kMaxRandomDrift;  // length of a row of the matrices below

/// y += a x.
[[gnu::always_inline]] inline void addRow(double a, const double* __restrict x, int n, double* __restrict y) {
    for (int i = 0; i < n; ++i) y[i] += a * x[i];
}

// Plain loops along rows: these matrices are too small for blocks to pay.

/// The upper triangle of a symmetric matrix of p rows becomes that of its factor: A = U' U. False where the
/// matrix is not positive.
VLX_WIDE bool factorise(double* upper, int p) {
    for (int i = 0; i < p; ++i) {
        double* const row = upper + i * kRow;
        for (int k = 0; k < i; ++k) addRow(-upper[k * kRow + i], upper + k * kRow + i, p - i, row + i);
        if (!(row[i] > 0)) return false;
        const double scale = 1 / std::sqrt(row[i]);
        for (int j = i; j < p; ++j) row[j] *= scale;
    }
    return true;
}

/// W = U^-1, so that A^-1 = W W'.
VLX_WIDE void invert(const double* upper, int p, double* inverse) {
    for (int i = p - 1; i >= 0; --i) {
        double* const row = inverse + i * kRow;
        std::fill(row + i, row + p, 0.0);
        for (int k = i + 1; k < p; ++k) addRow(-upper[i * kRow + k], inverse + k * kRow + k, p - k, row + k);
        const double scale = 1 / upper[i * kRow + i];
        row[i] = 1;
        for (int j = i; j < p; ++j) row[j] *= scale;
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
    double upper[kRow * kRow], inverse[kRow * kRow];
    std::vector<double> explained(static_cast<std::size_t>(groups)), squares(explained.size()),
        halfway(static_cast<std::size_t>(columns) * kRow);
    for (int iteration = 0;; ++iteration) {
        for (int i = 0; i < n; ++i) {
            for (int j = i; j < n; ++j) upper[i * kRow + j] = moments.normal(j, i);
            upper[i * kRow + i] +=
                drift.precision[static_cast<std::size_t>(group[static_cast<std::size_t>(i)])];
        }
        if (!factorise(upper, n)) {
            drift.ok = false;
            return drift;
        }
        invert(upper, n, inverse);
        std::fill(halfway.begin(), halfway.end(), 0.0);
        for (int c = 0; c < columns; ++c)
            for (int i = 0; i < n; ++i)
                addRow(moments.right(i, c), inverse + i * kRow + i, n - i, halfway.data() + c * kRow + i);
        std::fill(explained.begin(), explained.end(), 0.0);
        std::fill(squares.begin(), squares.end(), 0.0);
        for (int j = 0; j < n; ++j) {
            const double* const row = inverse + j * kRow;
            double variance = 0;
            for (int i = j; i < n; ++i) variance += row[i] * row[i];
            drift.variance[j] = variance;
            double square = 0;
            for (int c = 0; c < columns; ++c) {
                const double* const half = halfway.data() + c * kRow;
                double b = 0;
                for (int i = j; i < n; ++i) b += row[i] * half[i];
                drift.coefficients(j, c) = b;
                if (c < moments.fitted) square += b * b;
            }
            const auto g = static_cast<std::size_t>(group[static_cast<std::size_t>(j)]);
            explained[g] += std::max(0.0, 1 - drift.precision[g] * variance);
            squares[g] += square / moments.fitted;
        }
        drift.effective = 0;
        for (const double gamma : explained) drift.effective += gamma;
        if (iteration == iterations) break;
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
