#include "combination.h"

#include <algorithm>
#include <cmath>

#include "stacking.h"
#include "wide.h"

namespace vlx {

namespace {

constexpr float kFeatureWidth2 = 0.01f;  // (a tenth of a feature's scale)^2
constexpr double kMeanSignificance = 1;  // standard errors by which the plain mean must improve

/// Alpha as compositing needs it: within 0 to 1, and what differs from either by rounding is that.
double coverage(double alpha) {
    constexpr double kRounding = 1e-5;
    if (alpha < kRounding) return 0;
    return alpha > 1 - kRounding ? 1 : alpha;
}

}  // namespace

/// Estimate of a half by model `j`; the last candidate is the half's plain mean.
float Combination::estimate(int j, int half, int c, int x, int y) const {
    return j == candidates() ? data_.row(half * radiance_ + c, y)[x]
                             : estimates_[static_cast<std::size_t>(j)].row(half * radiance_ + c, y)[x];
}

/// Variance of the mean of half of a pixel's samples, averaged over colours; never 0, nor so small beside
/// the candidates that their squares in units of it are no floats.
double Combination::halfVariance(int x, int y) const {
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
    return variance + 1e-8 * level + 1e-300;
}

void Combination::momentsRow(int y) {
    const int m = candidates(), planes = momentPlanes(m);
    std::vector<double> sums(static_cast<std::size_t>(planes)), e(static_cast<std::size_t>(m + 1)),
        squares(static_cast<std::size_t>(m));
    for (int x = 0; x < width_; ++x) {
        std::fill(sums.begin(), sums.end(), 0.0);
        std::fill(squares.begin(), squares.end(), 0.0);
        const double unit = 1 / halfVariance(x, y);
        for (int c = 0; c < 3; ++c)
            for (int half = 0; half < 2; ++half) {
                // What is predicted is the other half's mean; one's own may be missing (a single sample).
                if (data_.row(planes_.halfCount(1 - half), y)[x] == 0) continue;
                const double base = estimate(0, half, c, x, y);
                const double other = data_.row((1 - half) * radiance_ + c, y)[x] - base;
                for (int j = 1; j <= m; ++j)
                    e[static_cast<std::size_t>(j)] = estimate(j, half, c, x, y) - base;
                if (data_.row(planes_.halfCount(half), y)[x] == 0) e.back() = 0;
                std::size_t at = 0;
                for (int i = 1; i <= m; ++i)
                    for (int j = 1; j <= i; ++j)
                        sums[at++] += e[static_cast<std::size_t>(i)] * e[static_cast<std::size_t>(j)] * unit;
                for (int j = 1; j <= m; ++j) {
                    const double product = e[static_cast<std::size_t>(j)] * other * unit;
                    sums[at++] += product;
                    squares[static_cast<std::size_t>(j - 1)] += product;
                }
            }
        for (int j = 0; j < m; ++j)
            sums[sums.size() - static_cast<std::size_t>(m - j)] =
                squares[static_cast<std::size_t>(j)] * squares[static_cast<std::size_t>(j)];
        for (int k = 0; k < planes; ++k)
            moments_.row(k, y)[x] = static_cast<float>(sums[static_cast<std::size_t>(k)]);
    }
}

std::int64_t Combination::combineRow(int y, float* out) const {
    const int m = candidates(), planes = momentPlanes(m);
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
    std::int64_t exact = 0;
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
        exact += store(x, y, stackingWeights(moments, significance), out + x * (radiance_ + 3));
    }
    return exact;
}

bool Combination::store(int x, int y, const Eigen::VectorXd& weights, float* out) const {
    const int m = candidates();
    const float nA = data_.row(planes_.countA(), y)[x], nB = data_.row(planes_.countB(), y)[x];
    const float n = data_.row(planes_.count(), y)[x];
    const bool exact = isExact(x, y);
    const std::array<double, 3> shared = sharedVariance(weights, x, y);
    const double gap = static_cast<double>(data_.row(planes_.gap(), y)[x]);
    for (int c = 0; c < radiance_; ++c) {
        const double mean =
            n > 0 ? (nA * data_.row(c, y)[x] + nB * data_.row(radiance_ + c, y)[x]) / (nA + nB) : 0;
        const auto both = [&](int j) {
            return j == m && n > 0 ? mean : 0.5 * (estimate(j, 0, c, x, y) + estimate(j, 1, c, x, y));
        };
        const double rest = 1 - weights.sum();
        double value = rest * both(0);
        for (int j = 1; j <= m; ++j) value += weights[j - 1] * both(j);
        const double strength = n > 0 ? strength_ : 1;
        // Light is not negative. Parts of light must add up: they are left as they come.
        if (c == alpha_)
            value = coverage(value);
        else if (radiance_ == 3 + (alpha_ >= 0) && mean >= 0)
            value = std::max(0.0, value);
        const double chosen = exact ? mean : value;
        out[c] = static_cast<float>(mean + strength * (chosen - mean));
        if (c >= 3) continue;
        // The noise of the halves' common data is estimated twice, by what the halves differ in and by the
        // kriging variance (within): half of each. What a model's own noise does not explain of its
        // difference from the combination is error of one or the other.
        const double meanVariance = variances_.row(c, y)[x] / std::max(1.f, n);
        double variance = shared[static_cast<std::size_t>(c)] / 2;
        if (gap > 0) variance += picture_.semivarianceAt(c, gap / scale_);
        for (int j = 0; j <= m; ++j) {
            const double share = j == 0 ? rest : weights[j - 1];
            const double within =
                j == m ? meanVariance : estimates_[static_cast<std::size_t>(j)].row(2 * radiance_ + c, y)[x];
            const double d = both(j) - value;
            variance += share * std::max(within, d * d);
        }
        const double s = strength;
        out[radiance_ + c] = static_cast<float>(exact ? 0 : std::sqrt(s * variance + (1 - s) * meanVariance));
    }
    return exact;
}

/// Whether the dump states that the pixel, and every one that its error variance was pooled over, has none.
bool Combination::isExact(int x, int y) const {
    if (data_.row(planes_.stated(), y)[x] == 0) return false;
    for (int c = 0; c < 3; ++c)
        if (variances_.row(c, y)[x] > 0) return false;
    return true;
}

/// How alike the features of two pixels are, 0 to 1.
float Combination::likeness(int x, int y, int col, int row) const {
    float d = 0;
    for (int f = 0; f < featureCount_; ++f) {
        const float apart = features_.row(f, row)[col] - features_.row(f, y)[x];
        d += apart * apart / (kFeatureWidth2 + 2 * features_.row(featureCount_ + f, y)[x]);
    }
    return nearExp(d);
}

/// Variance of the mean of the two halves' combinations, from their difference, over 5 x 5 pixels of alike
/// features.
std::array<double, 3> Combination::sharedVariance(const Eigen::VectorXd& weights, int x, int y) const {
    constexpr int kReach = 2;
    std::array<double, 3> sums{};
    double total = 0;
    for (int row = std::max(0, y - kReach); row <= std::min(height_ - 1, y + kReach); ++row)
        for (int col = std::max(0, x - kReach); col <= std::min(width_ - 1, x + kReach); ++col) {
            const auto alike = static_cast<double>(likeness(x, y, col, row));
            if (alike == 0) continue;
            total += alike;
            for (int c = 0; c < 3; ++c) {
                const auto difference = [&](int j) {
                    return static_cast<double>(estimate(j, 0, c, col, row)) - estimate(j, 1, c, col, row);
                };
                double d = (1 - weights.sum()) * difference(0);
                for (int j = 1; j <= candidates(); ++j) d += weights[j - 1] * difference(j);
                sums[static_cast<std::size_t>(c)] += alike * d * d / 4;
            }
        }
    for (double& sum : sums) sum /= total;
    return sums;
}

}  // namespace vlx
