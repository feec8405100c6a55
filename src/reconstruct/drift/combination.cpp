#include "reconstruct/drift/combination.h"

#include <algorithm>
#include <cmath>

namespace vlx {

namespace {

constexpr double kMeanSignificance = 1;  // standard errors by which the plain mean must improve

}  // namespace

Combination::Rows Combination::rowsOf(int y) const {
    Rows rows;
    for (const RowRing& of : estimates_) {
        auto& estimate = rows.estimate.emplace_back();
        for (int half = 0; half < 2; ++half)
            for (int c = 0; c < planes_.radiance; ++c)
                estimate[static_cast<std::size_t>(half)].push_back(of.row(models_.half(half) + c, y));
        rows.leverage.push_back(of.row(models_.leverage(), y));
        for (int c = 0; c < 3; ++c) rows.modelVariance[c].push_back(of.row(models_.variance() + c, y));
    }
    auto& means = rows.estimate.emplace_back();
    for (int half = 0; half < 2; ++half) {
        for (int c = 0; c < planes_.radiance; ++c)
            means[static_cast<std::size_t>(half)].push_back(data_.row(planes_.mean(half) + c, y));
        rows.halfCount[half] = data_.row(planes_.halfCount(half), y);
    }
    rows.count = data_.row(planes_.count(), y);
    for (int c = 0; c < 3; ++c) rows.variance[c] = variances_.row(c, y);
    return rows;
}

/// One over the variance of the mean of half of a pixel's samples, averaged over colours; what it is divided
/// by is never 0, nor so small beside the candidates that their squares in units of it are no floats.
double Combination::unit(const Rows& rows, int x) const {
    double variance = 0, level = 0;
    const float n = rows.count[x];
    for (std::size_t c = 0; c < 3; ++c) {
        variance += 2 * rows.variance[c][x] / samplesIn(n) / 3;
        for (const auto& of : rows.estimate)
            for (const auto& half : of) {
                const double value = half[c][x];
                level = std::max(level, value * value);
            }
    }
    return 1 / (variance + 1e-8 * level + 1e-300);
}

void Combination::momentsRow(int y) {
    const auto m = static_cast<std::size_t>(candidates());
    const MomentPlanes planes{candidates()};
    const Rows rows = rowsOf(y);
    std::vector<double> sums(static_cast<std::size_t>(planes.channels())), e(m + 1), squares(m);
    std::vector<float*> out;
    for (int k = 0; k < planes.channels(); ++k) out.push_back(moments_.row(k, y));
    for (int x = 0; x < width_; ++x) {
        std::fill(sums.begin(), sums.end(), 0.0);
        std::fill(squares.begin(), squares.end(), 0.0);
        const double perVariance = unit(rows, x);
        for (std::size_t c = 0; c < 3; ++c)
            for (std::size_t half = 0; half < 2; ++half) {
                // What is predicted is the other half's mean; one's own may be missing (a single sample).
                if (rows.halfCount[1 - half][x] == 0) continue;
                const double base = rows.estimate[0][half][c][x];
                const double other = rows.estimate[m][1 - half][c][x] - base;
                for (std::size_t j = 1; j <= m; ++j) e[j] = rows.estimate[j][half][c][x] - base;
                if (rows.halfCount[half][x] == 0) e.back() = 0;
                std::size_t at = 0;
                for (std::size_t i = 1; i <= m; ++i)
                    for (std::size_t j = 1; j <= i; ++j) sums[at++] += e[i] * e[j] * perVariance;
                for (std::size_t j = 1; j <= m; ++j) {
                    const double product = e[j] * other * perVariance;
                    sums[at++] += product;
                    squares[j - 1] += product;
                }
            }
        for (std::size_t j = 0; j < m; ++j)
            sums[static_cast<std::size_t>(planes.variance()) + j] = squares[j] * squares[j];
        for (std::size_t k = 0; k < sums.size(); ++k) out[k][x] = static_cast<float>(sums[k]);
    }
}

void Combination::combineRow(int y, bool stacking) {
    const int m = candidates(), planes = MomentPlanes{m}.channels();
    const auto w = static_cast<std::size_t>(width_);
    // Moments averaged under a triangular window, first over rows. Pixel by pixel, as they are summed next.
    const auto count = static_cast<std::size_t>(planes);
    std::vector<double> columns(w * count);
    for (int row = std::max(0, y - kStackReach); row <= std::min(height_ - 1, y + kStackReach); ++row)
        for (std::size_t k = 0; k < count; ++k) {
            const double weight = kStackReach + 1 - std::abs(row - y);
            const float* in = moments_.row(static_cast<int>(k), row);
            for (std::size_t i = 0; i < w; ++i) columns[i * count + k] += weight * in[i];
        }
    StackingMoments moments{StackingMatrix(m, m), StackingVector(m), StackingVector(m)};
    StackingVector significance = StackingVector::Zero(m);
    significance[m - 1] = kMeanSignificance;
    const Rows rows = rowsOf(y);
    std::vector<float*> out;
    for (int k = 0; k < combinedPlanes_.channels(); ++k) out.push_back(combined_.row(k, y));
    std::vector<double> sums(count);
    constexpr double kUnit = 1.0 / ((kStackReach + 1) * (kStackReach + 1));  // centre weight 1
    for (int x = 0; x < width_; ++x) {
        std::fill(sums.begin(), sums.end(), 0.0);
        for (int col = std::max(0, x - kStackReach); col <= std::min(width_ - 1, x + kStackReach); ++col) {
            const double weight = (kStackReach + 1 - std::abs(col - x)) * kUnit;
            const double* const of = columns.data() + static_cast<std::size_t>(col) * count;
            for (std::size_t k = 0; k < count; ++k) sums[k] += weight * of[k];
        }
        std::size_t at = 0;
        for (int i = 0; i < m; ++i)
            for (int j = 0; j <= i; ++j) moments.products(i, j) = moments.products(j, i) = sums[at++];
        for (int j = 0; j < m; ++j) moments.agreement[j] = sums[at++];
        for (int j = 0; j < m; ++j) moments.standardError[j] = std::sqrt(sums[at++]);
        store(rows, x,
              stacking ? stackingWeights(moments, significance) : StackingVector(StackingVector::Zero(m)),
              out.data());
    }
}

/// `weights`: of candidates 1 to m; candidate 0 has the rest.
void Combination::store(const Rows& rows, int x, const StackingVector& weights, float* const* out) const {
    const auto m = static_cast<std::size_t>(candidates());
    const float n = rows.count[x];
    const double rest = 1 - weights.sum();
    const auto share = [&](std::size_t j) {
        return j == 0 ? rest : weights[static_cast<Eigen::Index>(j) - 1];
    };
    const auto put = [&](int plane, double value) { out[plane][x] = static_cast<float>(value); };
    double leverage = share(m);
    for (std::size_t j = 0; j < m; ++j) leverage += share(j) * static_cast<double>(rows.leverage[j][x]);
    put(combinedPlanes_.leverage(), leverage);
    const double counts[2] = {rows.halfCount[0][x], rows.halfCount[1][x]};
    for (std::size_t c = 0; c < static_cast<std::size_t>(planes_.radiance); ++c) {
        const auto of = [&](std::size_t j, std::size_t half) {
            return static_cast<double>(rows.estimate[j][half][c][x]);
        };
        const auto both = [&](std::size_t j) {
            return j == m && n > 0 ? (counts[0] * of(m, 0) + counts[1] * of(m, 1)) / (counts[0] + counts[1])
                                   : 0.5 * (of(j, 0) + of(j, 1));
        };
        double value = 0;
        for (std::size_t j = 0; j <= m; ++j) value += share(j) * both(j);
        put(combinedPlanes_.value() + static_cast<int>(c), value);
        if (c >= 3) continue;
        for (std::size_t half = 0; half < 2; ++half) {
            double sum = 0;
            for (std::size_t j = 0; j <= m; ++j) sum += share(j) * of(j, half);
            put(combinedPlanes_.half(static_cast<int>(half)) + static_cast<int>(c), sum);
        }
        // What a model's own noise does not explain of its difference from the combination is error of one
        // or the other.
        double variance = 0;
        for (std::size_t j = 0; j <= m; ++j) {
            const double within = j == m ? rows.variance[c][x] / samplesIn(n) : rows.modelVariance[c][j][x];
            const double d = both(j) - value;
            variance += share(j) * std::max(within, d * d);
        }
        put(combinedPlanes_.variance() + static_cast<int>(c), variance);
    }
}

}  // namespace vlx
