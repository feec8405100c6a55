#include "reconstruct/drift/neighbourhoods.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/simd.h"
#include "reconstruct/drift/gram.h"
#include "reconstruct/drift/wild_values.h"
#include "variolux/geostat/random_drift.h"

namespace vlx {

namespace {

constexpr int kOffsets = 2 * kMaxReach + 1;
constexpr int kPositionFunctions = 5;         // x, y, x^2, y^2, xy
constexpr float kLeastWeight = 0.01f;         // of a datum
constexpr float kFarthest = 3.6f;             // nearExp is below kLeastWeight from here on
constexpr double kLeastFeatureSpread = 1e-8;  // squared: less is a constant
constexpr double kLeastPositionSpread = 1e-12;
constexpr float kCoveringWeight = 0.2f;    // a pixel less like its regular centres gets its own
constexpr float kCoveringVariance = 0.5f;  // likewise when they are noisier than it by more than this
constexpr float kFeatureWidth2 = 0.04f;    // (a fifth of a feature's scale)^2: as unlike as noise of one
constexpr float kMostCountRatio = 4;       // a datum counts at most as many samples as four of the centre's
constexpr float kLeastCountRatio = 1e-3f;  // and as many to predict as this many: no datum, but a place
// Selecting alike values makes their variance look smaller than it is: prefiltered features have more error
// than their prefilter says. Twice the standard deviation.
constexpr double kFeatureErrorFactor = 4;
constexpr float kLeastSquare = 1e-30f;  // of radiance, or of its noise
constexpr int kPriorIterations = 4;

int lanesUp(int n) { return (n + 7) & ~7; }

/// One tile's data with their margin, in local planes of kTileSide x kTileSide.
class Tile {
  public:
    /// Takes a tile up; what it needs of memory is kept for the next.
    void load(const TileInput& input, int x, int y, int reach) {
        in_ = input;
        x_ = x;
        y_ = y;
        reach_ = reach;
        const int c = input.planes.radiance;
        for (int half = 0; half < 2; ++half) {
            means_[half].resize(planes(c));
            counts_[half].resize(planes(1));
            errors_[half].assign(planes(1), 0.f);
            PatchTile& guide = guides_[half];
            guide.x = x;
            guide.y = y;
            guide.channels = 3;
            guide.value.resize(planes(3));
            guide.variance.resize(planes(3));
            for (int k = 0; k < c; ++k)
                copy(*input.data, input.planes.mean(half) + k, means_[half].data() + plane(k));
            copy(*input.data, input.planes.halfCount(half), counts_[half].data());
            std::copy_n(means_[half].data(), planes(3), guide.value.data());
            for (int k = 0; k < 3; ++k) {
                copy(*input.variances, k, guide.variances(k));
                for (std::size_t i = 0; i < plane(1); ++i) {
                    const float n = std::max(1.f, counts_[half][i]);
                    errors_[half][i] += guide.variances(k)[i] / (3 * n);
                    guide.variances(k)[i] /= n;
                }
            }
        }
        references_.resize(planes(c));
        for (std::size_t i = 0; i < references_.size(); ++i)
            references_[i] = std::min(means_[0][i], means_[1][i]);
        features_.resize(planes(2 * input.featureCount));
        for (int f = 0; f < 2 * input.featureCount; ++f)
            copy(*input.features, f, features_.data() + plane(f));

        for (int half = 0; half < 2; ++half) {
            distances_[half].resize(offsets() * kTile * kTile);
            for (int dy = -reach; dy <= reach; ++dy)
                for (int dx = -reach; dx <= reach; ++dx)
                    patchDistances(guides_[half], dx, dy, kLeastSquare, scratch_,
                                   distances_[half].data() + offset(dx, dy) * kTile, offsets() * kTile);
        }
    }

    NeighbourhoodCounts krige(const NeighbourhoodModel& model, RowRing& estimates) {
        const EstimatePlanes out{in_.planes.radiance};
        NeighbourhoodCounts counts;
        const int right = std::min(kTile, in_.width - x_), bottom = std::min(kTile, in_.height - y_);
        for (int half = 0; half < 2; ++half) {
            sums_.assign(planes(out.perHalf()), 0.f);
            for (int row = 0; row < bottom; ++row)
                for (int col = 0; col < right; ++col) {
                    const bool regular = (x_ + col) % model.stride == 0 && (y_ + row) % model.stride == 0;
                    if (!regular && covered(model, half, col, row)) continue;
                    counts.own += !regular;
                    krigeCentre(model, half, col, row, counts);
                }
            flush(half, model.reach, out, estimates);
        }
        return counts;
    }

  private:
    static std::size_t plane(int k) { return static_cast<std::size_t>(k) * kTileSide * kTileSide; }
    static std::size_t planes(int k) { return plane(k); }
    static int inner(int col, int row) { return (row + kTileMargin) * kTileSide + col + kTileMargin; }
    std::size_t offsets() const { return static_cast<std::size_t>((2 * reach_ + 1) * (2 * reach_ + 1)); }
    std::size_t offset(int dx, int dy) const {
        return static_cast<std::size_t>((dy + reach_) * (2 * reach_ + 1) + dx + reach_);
    }
    void copy(const RowRing& ring, int k, float* out) const {
        copyTile(ring, k, x_, y_, in_.width, in_.height, out);
    }
    float distance(int guide, int col, int row, int dx, int dy) const {
        return distances_[guide][(static_cast<std::size_t>(row) * offsets() + offset(dx, dy)) * kTile +
                                 static_cast<std::size_t>(col)];
    }

    /// The composite distance of a datum from a centre at (col, row): colour patches of the other half and,
    /// where the model has them, features with their error variances.
    float compositeDistance(const NeighbourhoodModel& model, int half, int col, int row, int dx,
                            int dy) const {
        const float patches = distance(1 - half, col, row, dx, dy) / (model.tolerance * model.tolerance);
        float d = std::max(0.f, patches);
        if (!model.features || d > kFarthest) return d;
        const auto here = static_cast<std::size_t>(inner(col, row));
        const auto there = static_cast<std::size_t>(inner(col + dx, row + dy));
        for (int f = 0; f < in_.featureCount; ++f) {
            const float* values = features_.data() + plane(f);
            const float* errors = features_.data() + plane(in_.featureCount + f);
            const float difference = values[there] - values[here];
            d += difference * difference / (kFeatureWidth2 + 2 * (errors[here] + errors[there]));
        }
        return d;
    }

    /// Is the pixel like one of the regular centres around it, and not much less noisy?
    bool covered(const NeighbourhoodModel& model, int half, int col, int row) const {
        const int left = (x_ + col) % model.stride, up = (y_ + row) % model.stride;
        const auto here = static_cast<std::size_t>(inner(col, row));
        for (const int dy : {-up, model.stride - up})
            for (const int dx : {-left, model.stride - left}) {
                if (x_ + col + dx >= in_.width || y_ + row + dy >= in_.height) continue;
                const auto there = static_cast<std::size_t>(inner(col + dx, row + dy));
                if (simd::nearExp(compositeDistance(model, half, col, row, dx, dy)) > kCoveringWeight &&
                    errors_[half][here] >= kCoveringVariance * errors_[half][there])
                    return true;
            }
        return false;
    }

    void krigeCentre(const NeighbourhoodModel& model, int half, int col, int row,
                     NeighbourhoodCounts& counts) {
        const int reach = model.reach, channels = in_.planes.radiance;
        const int stride = lanesUp((2 * reach + 1) * (2 * reach + 1));
        const auto centre = static_cast<std::size_t>(inner(col, row));

        index_.clear();
        weights_.clear();
        predicted_.clear();
        const int most = 1 + kPositionFunctions + in_.featureCount + channels + kBlockRows;
        x_values_.resize(static_cast<std::size_t>(most * stride));
        float* const places = x_values_.data() + stride;
        const float perReach = 1.f / static_cast<float>(reach);
        const float own = std::max(1.f, counts_[half][centre]);
        double noise = 0, total = 0;
        for (int dy = std::max(-reach, -(y_ + row)); dy <= std::min(reach, in_.height - 1 - y_ - row); ++dy)
            for (int dx = std::max(-reach, -(x_ + col)); dx <= std::min(reach, in_.width - 1 - x_ - col);
                 ++dx) {
                const float alike = simd::nearExp(compositeDistance(model, half, col, row, dx, dy));
                if (alike < kLeastWeight) continue;
                const int at = inner(col + dx, row + dy);
                const float ratio = std::clamp(counts_[half][static_cast<std::size_t>(at)] / own,
                                               kLeastCountRatio, kMostCountRatio);
                const std::size_t i = index_.size();
                const bool datum = counts_[half][static_cast<std::size_t>(at)] > 0;
                index_.push_back(at);
                weights_.push_back(datum ? alike * ratio : 0.f);
                predicted_.push_back(alike * ratio);
                const float px = static_cast<float>(dx) * perReach, py = static_cast<float>(dy) * perReach;
                float* p = places + i;
                p[0] = px;
                p[stride] = py;
                p[2 * stride] = px * px;
                p[3 * stride] = py * py;
                p[4 * stride] = px * py;
                if (!datum) continue;
                noise +=
                    static_cast<double>(alike * ratio) * errors_[half][static_cast<std::size_t>(at)] * ratio;
                total += static_cast<double>(alike * ratio);
            }
        if (total <= 0) return;
        ++counts.neighbourhoods;
        const auto n = static_cast<int>(index_.size());
        const int padded = lanesUp(n);
        weights_.resize(static_cast<std::size_t>(padded), 0.f);

        // Rows of the data: 1, position and features about the centre, radiance about the centre's. Features
        // that are constant here explain nothing: they have no row.
        float* const constant = x_values_.data();
        std::fill_n(constant, n, 1.f);
        std::array<double, kMaxRandomDrift> featureNoise{};
        varying_.clear();
        for (int f = 0; f < in_.featureCount; ++f) {
            const float* values = features_.data() + plane(f);
            const float about = values[centre];
            float* x = constant + (1 + kPositionFunctions + static_cast<int>(varying_.size())) * stride;
            for (int i = 0; i < n; ++i) x[i] = values[index_[static_cast<std::size_t>(i)]] - about;
            std::fill(x + n, x + padded, 0.f);
            if (forgetWild({x, weights_.data(), n, padded, total}, kFarthest * kFeatureWidth2, sorted_) <
                kLeastFeatureSpread)
                continue;
            const float* errors = features_.data() + plane(in_.featureCount + f);
            double sum = 0;
            for (int i = 0; i < n; ++i) {
                const auto k = static_cast<std::size_t>(i);
                sum += static_cast<double>(weights_[k] * errors[index_[k]]);
            }
            featureNoise[varying_.size()] = sum;
            varying_.push_back(f);
        }
        counts.features += static_cast<std::int64_t>(varying_.size());
        const int functions = kPositionFunctions + static_cast<int>(varying_.size());
        const int used = 1 + functions + channels;
        const int rows = (used + kBlockRows - 1) / kBlockRows * kBlockRows;
        for (int c = 0; c < channels; ++c) {
            const float* values = means_[half].data() + plane(c);
            float* x = constant + (1 + functions + c) * stride;
            for (int i = 0; i < n; ++i) x[i] = values[index_[static_cast<std::size_t>(i)]] - values[centre];
        }
        for (int r = 0; r < rows; ++r)
            std::fill(constant + r * stride + (r < used ? n : 0), constant + r * stride + padded, 0.f);
        weighted_.resize(x_values_.size());
        gram_.resize(static_cast<std::size_t>(rows * rows));
        weightedGram(x_values_.data(), weights_.data(), rows, stride, padded, weighted_.data(), gram_.data());

        // Normal equations about the weighted means, functions standardised; constant ones are left out.
        const auto gram = [&](int a, int b) {
            return a >= b ? gram_[static_cast<std::size_t>(a * rows + b)]
                          : gram_[static_cast<std::size_t>(b * rows + a)];
        };
        const auto centred = [&](int a, int b) { return gram(a, b) - gram(a, 0) * gram(b, 0) / total; };
        double spread = 0, level = 0;
        for (int c = 0; c < 3; ++c) {
            const double value = means_[half][plane(c) + centre] + gram(1 + functions + c, 0) / total;
            spread += std::max(0.0, centred(1 + functions + c, 1 + functions + c)) / total / 3;
            level += value * value;
        }
        const double variance = std::max(noise / total, 1e-10 * level + kLeastSquare);
        used_.clear();
        group_.clear();
        std::array<double, kMaxRandomDrift> unit{};
        for (int j = 0; j < functions; ++j) {
            const double square = centred(1 + j, 1 + j) / total;
            const int f = j - kPositionFunctions;  // which of varying_
            if (!(square > (f < 0 ? kLeastPositionSpread : kLeastFeatureSpread))) continue;
            unit[used_.size()] = 1 / std::sqrt(square);
            used_.push_back(1 + j);
            group_.push_back(
                f < 0 ? in_.groups + (j >= 2)
                      : in_.group[static_cast<std::size_t>(varying_[static_cast<std::size_t>(f)])]);
        }
        const auto p = static_cast<Eigen::Index>(used_.size());
        DriftMoments moments;
        moments.normal.resize(p, p);
        moments.right.resize(p, channels);
        moments.fitted = 3;
        moments.start = 1 / std::max(spread, variance);
        for (Eigen::Index a = 0; a < p; ++a) {
            const auto i = static_cast<std::size_t>(a);
            for (Eigen::Index b = 0; b <= a; ++b) {
                const auto j = static_cast<std::size_t>(b);
                moments.normal(a, b) = moments.normal(b, a) =
                    centred(used_[i], used_[j]) * unit[i] * unit[j] / variance;
            }
            if (used_[i] > kPositionFunctions)
                moments.normal(a, a) +=
                    kFeatureErrorFactor *
                    featureNoise[static_cast<std::size_t>(used_[i] - 1 - kPositionFunctions)] * unit[i] *
                    unit[i] / variance;
            for (int c = 0; c < channels; ++c)
                moments.right(a, c) = centred(used_[i], 1 + functions + c) * unit[i] / variance;
        }
        const RandomDrift drift = fitRandomDrift(moments, group_, in_.groups + 2, kPriorIterations);
        counts.failed += !drift.ok;
        counts.effective += drift.effective;

        // Predict every pixel of the neighbourhood.
        const EstimatePlanes out{channels};
        // Towards its border a neighbourhood counts less, else its border shows.
        const auto perNoise = static_cast<float>(1 / variance);
        const float edge = static_cast<float>(reach) / static_cast<float>(reach + 1);
        const auto taper = [&](float u) {
            const float v = 1 - edge * edge * u * u;
            return v * v;
        };
        for (int i = 0; i < n; ++i)
            predicted_[static_cast<std::size_t>(i)] *=
                perNoise * taper(places[i]) * taper(places[stride + i]);
        scatter(predicted_.data(), n, sums_.data() + plane(out.weight()));
        // Kriging variance, on average over the data: the constant and each effective function cost one part
        // in as many as there are.
        const auto part = static_cast<float>((1 + drift.effective) / total);
        const float krigingVariance = static_cast<float>(variance) * part;
        for (int i = 0; i < n; ++i) {
            const auto k = static_cast<std::size_t>(i);
            float* const sum = sums_.data() + index_[k];
            sum[plane(out.variance())] += predicted_[k] * krigingVariance;
            sum[plane(out.leverage())] += predicted_[k] * std::min(1.f, weights_[k] * part);
        }
        estimates_.resize(static_cast<std::size_t>(4 * padded));
        float* const estimate = estimates_.data();
        float *const about = estimate + padded, *const sum = about + padded, *const square = sum + padded;
        std::array<float, kMaxRandomDrift> coefficients;
        for (int c = 0; c < channels; ++c) {
            double offset = means_[half][plane(c) + centre] + gram(1 + functions + c, 0) / total;
            coefficients.fill(0);
            for (Eigen::Index j = 0; j < p; ++j) {
                const auto i = static_cast<std::size_t>(j);
                const double b = drift.coefficients(j, c) * unit[i];
                coefficients[static_cast<std::size_t>(used_[i] - 1)] = static_cast<float>(b);
                offset -= b * gram(used_[i], 0) / total;
            }
            predictRow(constant + stride, coefficients.data(), functions, stride, n,
                       static_cast<float>(offset), estimate);
            const float* references = references_.data() + plane(c);
            for (int i = 0; i < n; ++i) about[i] = references[index_[static_cast<std::size_t>(i)]];
            addEstimates(estimate, about, predicted_.data(), n, sum, square);
            scatter(sum, n, sums_.data() + plane(out.sum(c)));
            if (c < 3) scatter(square, n, sums_.data() + plane(out.square(c)));
        }
    }

    void scatter(const float* values, int n, float* to) const {
        for (int i = 0; i < n; ++i) to[index_[static_cast<std::size_t>(i)]] += values[i];
    }

    void flush(int half, int reach, const EstimatePlanes& out, RowRing& estimates) const {
        const int left = std::max(0, x_ - reach), right = std::min(in_.width, x_ + kTile + reach);
        for (int row = std::max(0, y_ - reach); row < std::min(in_.height, y_ + kTile + reach); ++row)
            for (int k = 0; k < out.perHalf(); ++k) {
                const float* from = sums_.data() + plane(k) + inner(-x_, row - y_);
                float* to = estimates.row(half * out.perHalf() + k, row);
                for (int i = left; i < right; ++i) to[i] += from[i];
            }
    }

    TileInput in_;
    int x_ = 0, y_ = 0, reach_ = 0;
    PatchTile guides_[2];
    std::vector<float> means_[2], counts_[2], errors_[2], distances_[2], references_, features_, scratch_;

    // Of the centre at work.
    std::vector<int> index_, varying_, used_, group_;
    std::vector<float> sorted_, weights_, predicted_, x_values_, weighted_, estimates_, sums_;
    std::vector<double> gram_;
};

}  // namespace

NeighbourhoodCounts krigeTile(const TileInput& input, const std::vector<NeighbourhoodModel>& models, int x,
                              int y, std::vector<RowRing>& estimates) {
    int reach = 0;
    for (const NeighbourhoodModel& model : models) reach = std::max(reach, model.reach);
    static thread_local Tile tile;  // megabytes: worth keeping
    tile.load(input, x, y, reach);
    NeighbourhoodCounts counts;
    for (std::size_t m = 0; m < models.size(); ++m) {
        const NeighbourhoodCounts of = tile.krige(models[m], estimates[m]);
        counts.neighbourhoods += of.neighbourhoods;
        counts.own += of.own;
        counts.failed += of.failed;
        counts.effective += of.effective;
        counts.features += of.features;
    }
    return counts;
}

}  // namespace vlx
