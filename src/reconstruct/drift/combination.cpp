#include "reconstruct/drift/combination.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/drift/stacking.h"

namespace vlx {

namespace {

constexpr double kMeanSignificance = 1;  // standard errors by which the plain mean must improve

}  // namespace

/// Estimate of a half by model `j`; the last candidate is the half's plain mean.
float Combination::estimate(int j, int half, int c, int x, int y) const {
    return j == candidates() ? data_.row(planes_.mean(half) + c, y)[x]
                             : estimates_[static_cast<std::size_t>(j)].row(models_.half(half) + c, y)[x];
}

/// One over the variance of the mean of half of a pixel's samples, averaged over colours; what it is divided
/// by is never 0, nor so small beside the candidates that their squares in units of it are no floats.
double Combination::unit(int x, int y) const {
    double variance = 0, level = 0;
    const float n = data_.row(planes_.count(), y)[x];
    for (int c = 0; c < 3; ++c) {
        variance += 2 * variances_.row(c, y)[x] / std::max(1.f, n) / 3;
        for (int j = 0; j <= candidates(); ++j)
            for (int half = 0; half < 2; ++half) {
                const double value = estimate(j, half, c, x, y);
                level = std::max(level, value * value);
            }
    }
    return 1 / (variance + 1e-8 * level + 1e-300);
}

void Combination::momentsRow(int y) {
    const int m = candidates(), planes = MomentPlanes{m}.channels();
    std::vector<double> sums(static_cast<std::size_t>(planes)), e(static_cast<std::size_t>(m + 1)),
        squares(static_cast<std::size_t>(m));
    for (int x = 0; x < width_; ++x) {
        std::fill(sums.begin(), sums.end(), 0.0);
        std::fill(squares.begin(), squares.end(), 0.0);
        const double perVariance = unit(x, y);
        for (int c = 0; c < 3; ++c)
            for (int half = 0; half < 2; ++half) {
                // What is predicted is the other half's mean; one's own may be missing (a single sample).
                if (data_.row(planes_.halfCount(1 - half), y)[x] == 0) continue;
                const double base = estimate(0, half, c, x, y);
                const double other = data_.row(planes_.mean(1 - half) + c, y)[x] - base;
                for (int j = 1; j <= m; ++j)
                    e[static_cast<std::size_t>(j)] = estimate(j, half, c, x, y) - base;
                if (data_.row(planes_.halfCount(half), y)[x] == 0) e.back() = 0;
                std::size_t at = 0;
                for (int i = 1; i <= m; ++i)
                    for (int j = 1; j <= i; ++j)
                        sums[at++] +=
                            e[static_cast<std::size_t>(i)] * e[static_cast<std::size_t>(j)] * perVariance;
                for (int j = 1; j <= m; ++j) {
                    const double product = e[static_cast<std::size_t>(j)] * other * perVariance;
                    sums[at++] += product;
                    squares[static_cast<std::size_t>(j - 1)] += product;
                }
            }
        for (int j = 0; j < m; ++j)
            sums[static_cast<std::size_t>(MomentPlanes{m}.variance() + j)] =
                squares[static_cast<std::size_t>(j)] * squares[static_cast<std::size_t>(j)];
        for (int k = 0; k < planes; ++k)
            moments_.row(k, y)[x] = static_cast<float>(sums[static_cast<std::size_t>(k)]);
    }
}

void Combination::combineRow(int y, bool stacking) {
    const int m = candidates(), planes = MomentPlanes{m}.channels();
    const auto w = static_cast<std::size_t>(width_);
    // Moments averaged under a triangular window, first over rows.
    std::vector<double> columns(w * static_cast<std::size_t>(planes));
    for (int row = std::max(0, y - kStackReach); row <= std::min(height_ - 1, y + kStackReach); ++row)
        for (int k = 0; k < planes; ++k) {
            const double weight = kStackReach + 1 - std::abs(row - y);
            const float* in = moments_.row(k, row);
            double* sum = columns.data() + static_cast<std::size_t>(k) * w;
            for (std::size_t i = 0; i < w; ++i) sum[i] += weight * in[i];
        }
    StackingMoments moments{Eigen::MatrixXd(m, m), Eigen::VectorXd(m), Eigen::VectorXd(m)};
    Eigen::VectorXd significance = Eigen::VectorXd::Zero(m);
    significance[m - 1] = kMeanSignificance;
    std::vector<double> sums(static_cast<std::size_t>(planes));
    constexpr double kUnit = 1.0 / ((kStackReach + 1) * (kStackReach + 1));  // centre weight 1
    for (int x = 0; x < width_; ++x) {
        std::fill(sums.begin(), sums.end(), 0.0);
        for (int col = std::max(0, x - kStackReach); col <= std::min(width_ - 1, x + kStackReach); ++col) {
            const double weight = (kStackReach + 1 - std::abs(col - x)) * kUnit;
            for (int k = 0; k < planes; ++k)
                sums[static_cast<std::size_t>(k)] +=
                    weight * columns[static_cast<std::size_t>(k) * w + static_cast<std::size_t>(col)];
        }
        std::size_t at = 0;
        for (int i = 0; i < m; ++i)
            for (int j = 0; j <= i; ++j) moments.products(i, j) = moments.products(j, i) = sums[at++];
        for (int j = 0; j < m; ++j) moments.agreement[j] = sums[at++];
        for (int j = 0; j < m; ++j) moments.standardError[j] = std::sqrt(sums[at++]);
        store(x, y, stacking ? stackingWeights(moments, significance) : Eigen::VectorXd::Zero(m));
    }
}

/// `weights`: of candidates 1 to m; candidate 0 has the rest.
void Combination::store(int x, int y, const Eigen::VectorXd& weights) {
    const int m = candidates();
    const float n = data_.row(planes_.count(), y)[x];
    const double rest = 1 - weights.sum();
    const auto share = [&](int j) { return j == 0 ? rest : weights[j - 1]; };
    const auto put = [&](int plane, double value) { combined_.row(plane, y)[x] = static_cast<float>(value); };
    double leverage = share(m);
    for (int j = 0; j < m; ++j)
        leverage += share(j) * static_cast<double>(
                                   estimates_[static_cast<std::size_t>(j)].row(models_.leverage(), y)[x]);
    put(combinedPlanes_.leverage(), leverage);
    for (int c = 0; c < planes_.radiance; ++c) {
        const auto both = [&](int j) {
            return j == m && n > 0 ? plainMean(data_, planes_, c, x, y)
                                   : 0.5 * (static_cast<double>(estimate(j, 0, c, x, y)) +
                                            static_cast<double>(estimate(j, 1, c, x, y)));
        };
        double value = 0;
        for (int j = 0; j <= m; ++j) value += share(j) * both(j);
        put(combinedPlanes_.value() + c, value);
        if (c >= 3) continue;
        for (int half = 0; half < 2; ++half) {
            double of = 0;
            for (int j = 0; j <= m; ++j) of += share(j) * static_cast<double>(estimate(j, half, c, x, y));
            put(combinedPlanes_.half(half) + c, of);
        }
        // What a model's own noise does not explain of its difference from the combination is error of one
        // or the other.
        double variance = 0;
        for (int j = 0; j <= m; ++j) {
            const double within =
                j == m ? variances_.row(c, y)[x] / std::max(1.f, n)
                       : estimates_[static_cast<std::size_t>(j)].row(models_.variance() + c, y)[x];
            const double d = both(j) - value;
            variance += share(j) * std::max(within, d * d);
        }
        put(combinedPlanes_.variance() + c, variance);
    }
}

}  // namespace vlx
