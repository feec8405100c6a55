#include "variolux/geostat/empirical_variogram.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

#include "geostat/lag_classes.h"

namespace vlx {
namespace {

using Eigen::Index;

/// The data that can be used, and where they came from.
struct CleanData {
    Eigen::MatrixXd positions, values;
    Eigen::VectorXd noise, weights;
    std::vector<Index> rows;
    Index skipped = 0;
    int exponent = 0;  ///< values are those given divided by 2^exponent, noise by its square
};

CleanData clean(const Eigen::Ref<const Eigen::MatrixXd>& positions,
                const Eigen::Ref<const Eigen::MatrixXd>& values,
                const Eigen::Ref<const Eigen::VectorXd>& errorVariances,
                const Eigen::Ref<const Eigen::VectorXd>& dataWeights) {
    const Index n = positions.rows();
    assert(values.rows() == n);
    assert(errorVariances.size() == 0 || errorVariances.size() == n);
    assert(dataWeights.size() == 0 || dataWeights.size() == n);
    const auto usable = [](const Eigen::Ref<const Eigen::VectorXd>& v, Index i) {
        return v.size() == 0 || (v[i] >= 0 && std::isfinite(v[i]));
    };
    CleanData data;
    data.rows.reserve(static_cast<std::size_t>(n));
    for (Index i = 0; i < n; ++i) {
        if (positions.row(i).allFinite() && values.row(i).allFinite() && usable(errorVariances, i) &&
            usable(dataWeights, i))
            data.rows.push_back(i);
    }
    data.skipped = n - static_cast<Index>(data.rows.size());
    data.positions = positions(data.rows, Eigen::all);
    data.values = values(data.rows, Eigen::all);
    if (errorVariances.size() > 0) data.noise = errorVariances(data.rows);
    if (dataWeights.size() > 0) data.weights = dataWeights(data.rows);
    return data;
}

/// Divides by a power of two, which rounds nothing, so that fourth powers of the values neither overflow nor
/// underflow.
void scale(CleanData& data) {
    if (data.values.size() == 0) return;
    double size = (data.values.colwise().maxCoeff() - data.values.colwise().minCoeff()).maxCoeff();
    if (data.noise.size() > 0) size = std::max(size, std::sqrt(data.noise.maxCoeff()));
    if (!(size > 0) || !std::isfinite(size)) return;
    data.exponent = std::ilogb(size);
    const auto shift = [](int exponent) { return [exponent](double v) { return std::ldexp(v, exponent); }; };
    data.values = data.values.unaryExpr(shift(-data.exponent)).eval();
    if (data.noise.size() > 0) data.noise = data.noise.unaryExpr(shift(-2 * data.exponent)).eval();
}

/// Distances and squared norms of the value differences from datum i to all later data, vectorised.
struct PairRow {
    Eigen::ArrayXd distance, squaredNorm;

    explicit PairRow(Index n) : distance(n), squaredNorm(n) {}

    void compute(const CleanData& data, Index i) {
        const Index m = data.positions.rows() - i - 1;
        squares(data.positions, i, m, distance);
        squares(data.values, i, m, squaredNorm);
        distance.head(m) = distance.head(m).sqrt();
    }

  private:
    static void squares(const Eigen::MatrixXd& x, Index i, Index m, Eigen::ArrayXd& sum) {
        sum.head(m).setZero();
        for (Index k = 0; k < x.cols(); ++k)
            sum.head(m) += (x.col(k).segment(i + 1, m).array() - x(i, k)).square();
    }
};

class DirectionFilter {
  public:
    DirectionFilter(const std::optional<VariogramDirection>& direction, const Eigen::MatrixXd& positions)
        : positions_(positions), active_(direction && positions.cols() >= 2) {
        if (!active_) return;
        cosine_ = std::cos(direction->angle);
        sine_ = std::sin(direction->angle);
        // A hair of slack: a tolerance of 0 must keep pairs that lie on the axis up to rounding.
        minimumCosine_ = std::cos(std::min(direction->tolerance + 1e-9, 1.5707963267948966));
        bandwidth_ = direction->bandwidth;
    }

    bool keeps(Index i, Index j) const {
        if (!active_) return true;
        const double dx = positions_(j, 0) - positions_(i, 0), dy = positions_(j, 1) - positions_(i, 1);
        const double length = std::hypot(dx, dy);
        return std::abs(dx * cosine_ + dy * sine_) >= length * minimumCosine_ &&
               std::abs(dy * cosine_ - dx * sine_) <= bandwidth_;
    }

  private:
    const Eigen::MatrixXd& positions_;
    bool active_;
    double cosine_ = 1, sine_ = 0, minimumCosine_ = 0, bandwidth_ = 0;
};

/// Sums over the pairs of one class.
struct ClassSums {
    double count = 0, weight = 0, distance = 0, statistic = 0;
    double noise = 0;                                   // sum w (v_i + v_j) / 2
    double w2 = 0, w2NoiseSum = 0, w2NoiseProduct = 0;  // sums of w^2 {1, v_i + v_j, v_i v_j}
};

double medianOf(std::vector<double>& x) {
    const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
    std::nth_element(x.begin(), middle, x.end());
    if (x.size() % 2 == 1) return *middle;
    return 0.5 * (*middle + *std::max_element(x.begin(), middle));
}

/// V and t of the header: the spread of |e|^2, and how far the channels are one.
struct NoiseShape {
    double spread = 2;
    double concentration = 1;
};

NoiseShape noiseShape(const CleanData& data, const Eigen::MatrixXd& centred,
                      const Eigen::VectorXd& variances) {
    NoiseShape shape;
    const double n = static_cast<double>(data.values.rows());
    double second = 0, fourth = 0;
    Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(centred.cols(), centred.cols());
    for (Index i = 0; i < centred.rows(); ++i) {
        if (!(variances[i] > 0)) continue;
        const double r = centred.row(i).squaredNorm() / variances[i];
        second += r;
        fourth += r * r;
        covariance.noalias() += centred.row(i).transpose() * (centred.row(i) / variances[i]);
    }
    if (!(second > 0) || !std::isfinite(fourth)) return shape;
    const double trace = covariance.trace();
    shape.concentration = covariance.squaredNorm() / (trace * trace);
    // (n + 1) / (n - 1): the sample kurtosis of n Gaussian values is too small by that in the mean.
    const double kurtosis = n * fourth / (second * second) * (n + 1) / (n - 1);
    shape.spread = std::max(kurtosis - 1, shape.concentration);
    return shape;
}

/// Fills standard errors and the null distribution; semivariances are still scaled. `rowWeights`: n x k, m_ia
/// of the header.
void addErrors(EmpiricalVariogram& result, const CleanData& data, const std::vector<ClassSums>& sums,
               const Eigen::MatrixXd& rowWeights, double relativeVariance) {
    const Index n = data.values.rows(), k = rowWeights.cols();
    const Eigen::MatrixXd centred = data.values.rowwise() - data.values.colwise().mean();
    result.variance = centred.squaredNorm() / static_cast<double>(n - 1);
    result.meanNoise = data.noise.size() > 0 ? data.noise.mean() : 0;
    const Eigen::VectorXd noise = data.noise.size() > 0 ? data.noise : Eigen::VectorXd::Zero(n);
    const double nugget = std::max(0.0, result.variance - result.meanNoise);
    const Eigen::VectorXd variances = noise.array() + nugget;
    const NoiseShape shape = noiseShape(data, centred, variances);

    Eigen::MatrixXd scaled = rowWeights;
    for (Index b = 0; b < k; ++b) {
        const ClassSums& s = sums[static_cast<std::size_t>(b)];
        if (s.weight > 0) scaled.col(b) /= s.weight;
    }
    const auto pairTerm = [&](const ClassSums& s, double g) {
        return shape.concentration * (s.w2 * g * g + s.w2NoiseSum * g + s.w2NoiseProduct) /
               (s.weight * s.weight);
    };
    const Eigen::MatrixXd weighted = variances.asDiagonal() * scaled;
    Eigen::MatrixXd covariance = 0.25 * shape.spread * relativeVariance * weighted.transpose() * weighted;
    for (Index b = 0; b < k; ++b) {
        const ClassSums& s = sums[static_cast<std::size_t>(b)];
        if (!(s.weight > 0)) continue;
        covariance(b, b) += relativeVariance * pairTerm(s, nugget);
        VariogramBin& bin = result.bins[static_cast<std::size_t>(b)];
        const double g = std::max(0.0, bin.semivariance);
        const double shared = ((noise.array() + g) * scaled.col(b).array()).square().sum();
        bin.standardError = std::sqrt(relativeVariance * (0.25 * shape.spread * shared + pairTerm(s, g)));
    }
    result.nullError = covariance.diagonal().cwiseSqrt();
    const Eigen::VectorXd inverse =
        result.nullError.unaryExpr([](double deviation) { return deviation > 0 ? 1 / deviation : 0.0; });
    result.nullCorrelation = inverse.asDiagonal() * covariance * inverse.asDiagonal();
}

/// Back to the unit of the caller's values.
void unscale(EmpiricalVariogram& result, int exponent) {
    const auto back = [exponent](double v) { return std::ldexp(v, 2 * exponent); };
    for (VariogramBin& bin : result.bins) {
        bin.semivariance = back(bin.semivariance);
        bin.noise = back(bin.noise);
        bin.standardError = back(bin.standardError);
    }
    result.variance = back(result.variance);
    result.meanNoise = back(result.meanNoise);
    result.nullError = result.nullError.unaryExpr(back).eval();
}

}  // namespace

std::optional<std::string> EmpiricalVariogramOptions::validate() const {
    if (edges.size() < 2) return "edges must hold at least 2 bounds, found " + std::to_string(edges.size());
    if (!(edges.front() >= 0)) return "the first edge must be >= 0, found " + std::to_string(edges.front());
    for (std::size_t b = 1; b < edges.size(); ++b)
        if (!(edges[b] > edges[b - 1]) || !std::isfinite(edges[b]))
            return "edges must be increasing and finite, found " + std::to_string(edges[b]) + " after " +
                   std::to_string(edges[b - 1]);
    if (direction) {
        if (!std::isfinite(direction->angle)) return "the direction's angle must be finite";
        if (!(direction->tolerance >= 0 && direction->tolerance <= 1.5707963267948968))
            return "the direction's tolerance must be in [0, pi/2], found " +
                   std::to_string(direction->tolerance);
        if (!(direction->bandwidth > 0))
            return "the direction's bandwidth must be positive, found " +
                   std::to_string(direction->bandwidth);
    }
    return std::nullopt;
}

std::vector<double> uniformEdges(double maxDistance, int count) {
    assert(count >= 1);
    std::vector<double> edges;
    for (int b = 0; b <= count; ++b) edges.push_back(maxDistance * b / count);
    return edges;
}

std::string EmpiricalVariogram::message() const {
    std::ostringstream text;
    switch (status) {
        case VariogramStatus::Ok:
            text << "variogram of " << data << " data in " << bins.size() << " classes";
            break;
        case VariogramStatus::TooFewData:
            text << "a variogram needs 2 data, found " << data;
            break;
        case VariogramStatus::NoPairs:
            text << "none of the pairs of " << data << " data falls into a lag class";
            break;
    }
    if (skipped > 0) text << " (" << skipped << " unusable data left out)";
    return text.str();
}

EmpiricalVariogram empiricalVariogram(const Eigen::Ref<const Eigen::MatrixXd>& positions,
                                      const Eigen::Ref<const Eigen::MatrixXd>& values,
                                      const EmpiricalVariogramOptions& options,
                                      const Eigen::Ref<const Eigen::VectorXd>& errorVariances,
                                      const Eigen::Ref<const Eigen::VectorXd>& dataWeights) {
    assert(!options.validate());
    const bool matheron = options.estimator == VariogramEstimator::Matheron;
    const bool dowd = options.estimator == VariogramEstimator::Dowd;
    assert(matheron || dataWeights.size() == 0);
    CleanData data = clean(positions, values, errorVariances, dataWeights);
    scale(data);
    const Index n = data.positions.rows();
    const LagClasses classes(options.edges);
    const Index k = classes.count();

    EmpiricalVariogram result;
    result.data = n;
    result.skipped = data.skipped;
    result.nullError = Eigen::VectorXd::Zero(k);
    result.nullCorrelation = Eigen::MatrixXd::Zero(k, k);
    result.bins = emptyBins(options.edges);
    if (n < 2) {
        result.status = VariogramStatus::TooFewData;
        return result;
    }

    std::vector<ClassSums> sums(static_cast<std::size_t>(k));
    std::vector<std::vector<double>> differences(dowd ? static_cast<std::size_t>(k) : 0);
    Eigen::MatrixXd rowWeights = Eigen::MatrixXd::Zero(n, k);
    const DirectionFilter direction(options.direction, data.positions);
    const bool noisy = data.noise.size() > 0, weighted = data.weights.size() > 0;
    PairRow row(n);
    for (Index i = 0; i + 1 < n; ++i) {
        row.compute(data, i);
        for (Index j = i + 1; j < n; ++j) {
            const double distance = row.distance[j - i - 1];
            const int b = classes.find(distance);
            if (b < 0 || !direction.keeps(i, j)) continue;
            const double squared = row.squaredNorm[j - i - 1];
            ClassSums& s = sums[static_cast<std::size_t>(b)];
            const double w = weighted ? data.weights[i] * data.weights[j] : 1;
            s.count += 1;
            s.weight += w;
            s.distance += w * distance;
            s.w2 += w * w;
            rowWeights(i, b) += w;
            rowWeights(j, b) += w;
            if (matheron)
                s.statistic += w * squared;
            else if (dowd)
                differences[static_cast<std::size_t>(b)].push_back(std::sqrt(squared));
            else
                s.statistic += std::sqrt(std::sqrt(squared));
            if (noisy) {
                const double vi = data.noise[i], vj = data.noise[j];
                s.noise += w * 0.5 * (vi + vj);
                s.w2NoiseSum += w * w * (vi + vj);
                s.w2NoiseProduct += w * w * vi * vj;
            }
        }
    }

    bool any = false;
    for (Index b = 0; b < k; ++b) {
        const ClassSums& s = sums[static_cast<std::size_t>(b)];
        VariogramBin& bin = result.bins[static_cast<std::size_t>(b)];
        if (!(s.weight > 0)) continue;
        any = true;
        bin.pairs = weighted ? s.weight * s.weight / s.w2 : s.count;
        bin.distance = s.distance / s.weight;
        bin.noise = s.noise / s.weight;
        if (matheron) {
            bin.semivariance = 0.5 * s.statistic / s.weight;
        } else if (dowd) {
            const double median = medianOf(differences[static_cast<std::size_t>(b)]);
            bin.semivariance = 0.5 * 2.198 * median * median;
        } else {
            const double mean = s.statistic / s.weight, m2 = mean * mean;
            bin.semivariance = 0.5 * m2 * m2 / (0.457 + 0.494 / s.count + 0.045 / (s.count * s.count));
        }
        bin.semivariance -= bin.noise;
    }
    if (!any) result.status = VariogramStatus::NoPairs;
    const double relativeVariance = matheron ? 1 : dowd ? 5.44 / 2 : 2.885 / 2;
    addErrors(result, data, sums, rowWeights, relativeVariance);
    unscale(result, data.exponent);
    return result;
}

std::vector<VariogramCloudPoint> variogramCloud(const Eigen::Ref<const Eigen::MatrixXd>& positions,
                                                const Eigen::Ref<const Eigen::MatrixXd>& values,
                                                double maxDistance,
                                                const Eigen::Ref<const Eigen::VectorXd>& errorVariances) {
    const CleanData data = clean(positions, values, errorVariances, Eigen::VectorXd());
    const Index n = data.positions.rows();
    std::vector<VariogramCloudPoint> cloud;
    PairRow row(n);
    for (Index i = 0; i + 1 < n; ++i) {
        row.compute(data, i);
        for (Index j = i + 1; j < n; ++j) {
            const double distance = row.distance[j - i - 1];
            if (!(distance <= maxDistance)) continue;
            const double noise = data.noise.size() > 0 ? 0.5 * (data.noise[i] + data.noise[j]) : 0;
            cloud.push_back({data.rows[static_cast<std::size_t>(i)], data.rows[static_cast<std::size_t>(j)],
                             distance, 0.5 * row.squaredNorm[j - i - 1] - noise});
        }
    }
    return cloud;
}

}  // namespace vlx
