#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <random>

#include "variolux/geostat/variogram_model.h"

/// Gaussian random fields with a known covariance, for statistical tests.
namespace vlx::testing {

#ifdef VARIOLUX_SANITIZED
inline constexpr int kRepeat =
    1;  ///< statistics are repeated kRepeat times as often as the least that is useful
#else
inline constexpr int kRepeat = 4;
#endif

/// Centres of width x height pixels.
inline Eigen::MatrixXd pixelCentres(int width, int height) {
    Eigen::MatrixXd x(width * height, 2);
    for (int i = 0; i < width * height; ++i) x.row(i) << i % width + 0.5, i / width + 0.5;
    return x;
}

inline Eigen::MatrixXd covarianceMatrix(const VariogramModel& model, const Eigen::MatrixXd& x) {
    Eigen::MatrixXd k(x.rows(), x.rows());
    for (Eigen::Index i = 0; i < x.rows(); ++i)
        for (Eigen::Index j = 0; j < x.rows(); ++j) k(i, j) = covariance(model, (x.row(i) - x.row(j)).norm());
    return k;
}

/// Draws independent realisations of a model at fixed positions.
class FieldSampler {
  public:
    FieldSampler(const VariogramModel& model, const Eigen::MatrixXd& x, std::uint64_t seed)
        : factor_(covarianceMatrix(model, x).llt().matrixL()), random_(seed) {}

    Eigen::VectorXd draw() { return factor_ * noise(factor_.rows()); }
    Eigen::VectorXd noise(Eigen::Index n) {
        return Eigen::VectorXd::NullaryExpr(n, [this] { return normal_(random_); });
    }
    std::mt19937_64& random() { return random_; }

  private:
    Eigen::MatrixXd factor_;
    std::mt19937_64 random_;
    std::normal_distribution<double> normal_;
};

/// Mean and its standard error.
struct Sample {
    double n = 0, sum = 0, squares = 0;
    void add(double x) {
        n += 1;
        sum += x;
        squares += x * x;
    }
    double mean() const { return sum / n; }
    double variance() const { return (squares - sum * sum / n) / (n - 1); }
    double error() const { return std::sqrt(variance() / n); }
};

}  // namespace vlx::testing
