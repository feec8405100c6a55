#pragma once

#include <algorithm>
#include <array>
#include <vector>

#include "reconstruct/drift/neighbourhoods.h"
#include "variolux/geostat/random_drift.h"

/// Kriging with external drift in one neighbourhood: METHOD.md 7.2 to 7.4.
namespace vlx {

inline constexpr int kPositionFunctions = 5;   ///< x, y, x^2, y^2, xy
inline constexpr float kFarthest = 3.6f;       ///< composite distance: data farther away weigh nothing
inline constexpr float kLeastSquare = 1e-30f;  ///< of radiance, or of its noise
inline constexpr float kMostCountRatio =
    4;  ///< a datum counts at most as many samples as four of the centre's
inline constexpr float kLeastCountRatio =
    1e-3f;  ///< and as many to predict as this many: no datum, but a place
inline constexpr float kFeatureWidth2 =
    0.04f;  ///< (a fifth of a feature's scale)^2: as unlike as noise of one

/// What a tile holds of one half, in planes of kTileSide x kTileSide.
struct TilePlanes {
    const float* means = nullptr;       ///< radiance channels
    const float* counts = nullptr;      ///< samples: 0 is no datum
    const float* errors = nullptr;      ///< error variance of a mean, averaged over R, G, B
    const float* references = nullptr;  ///< radiance channels: what estimates are summed about
    const float* features = nullptr;    ///< FeaturePlanes
    int radiance = 3, featureCount = 0;
    const std::vector<int>* group = nullptr;  ///< of each feature
    int groups = 0;

    static std::size_t plane(int k) { return static_cast<std::size_t>(k) * kTileSide * kTileSide; }
};

/// A centre and the data around it. Its memory is kept for the next.
class Centre {
  public:
    /// Begins at place `at` of the tile's planes.
    void begin(const TilePlanes& tile, int at, int reach);
    /// The pixel (dx, dy) away, which is `alike` the centre (0 to 1).
    void add(int dx, int dy, float alike);
    /// Kriges, and adds what is predicted for all its pixels to `sums` (EstimatePlanes of one half).
    void krige(float* sums, NeighbourhoodCounts& counts);

  private:
    int size() const { return count_; }
    float* row(int r) { return rows_.data() + r * stride_; }
    double gram(int a, int b) const {
        return gram_[static_cast<std::size_t>(a >= b ? a * gramRows_ + b : b * gramRows_ + a)];
    }
    /// Sums of products about the weighted means.
    double centred(int a, int b) const { return gram(a, b) - gram(a, 0) * gram(b, 0) / total_; }
    void stackFunctions();
    void stackRadiance();
    RandomDrift fit();
    void limitFunctions();
    void predict(const RandomDrift& drift, float* sums);
    void sumFeatureErrors(const RandomDrift& drift, float* out, int padded) const;
    void scatter(const float* values, float* to) const;

    TilePlanes tile_;
    std::size_t centre_ = 0;
    int reach_ = 0, stride_ = 0;
    float own_ = 1;                           // samples of the centre, one at least
    int count_ = 0;                           // of data, and pixels to be predicted
    std::vector<int> index_;                  // of the data, in a plane
    std::vector<float> weights_, predicted_;  // of the data; of what is predicted there
    bool gaps_ = false;                       // pixels without data are among them
    double noise_ = 0, total_ = 0;            // sums over data: of weighted error variances, of weights
    double variance_ = 0;                     // of a datum of weight 1

    /// Rows as long as there are data, each `stride_` apart: 1, position functions, features that vary,
    /// radiance.
    std::vector<float> rows_, weighted_, sorted_, estimates_;
    std::vector<int> varying_;                            // features
    std::array<double, kMaxRandomDrift> featureNoise_{};  // of each of them: summed weighted error variances
    int functions_ = 0, gramRows_ = 0;
    std::vector<double> gram_;

    std::vector<int> used_, group_;  // rows that are drift functions: those that are not constant
    std::array<double, kMaxRandomDrift> unit_{};  // one over the standard deviation of each
};

inline void Centre::add(int dx, int dy, float alike) {
    const int at = static_cast<int>(centre_) + dy * kTileSide + dx;
    const auto place = static_cast<std::size_t>(at), next = static_cast<std::size_t>(count_++);
    const float ratio = std::clamp(tile_.counts[place] / own_, kLeastCountRatio, kMostCountRatio);
    const float weight = alike * ratio;
    const bool datum = tile_.counts[place] > 0;
    index_[next] = at;
    weights_[next] = datum ? weight : 0.f;
    predicted_[next] = weight;
    const float perReach = 1.f / static_cast<float>(reach_);
    const float px = static_cast<float>(dx) * perReach, py = static_cast<float>(dy) * perReach;
    float* p = row(1) + next;
    p[0] = px;
    p[stride_] = py;
    p[2 * stride_] = px * px;
    p[3 * stride_] = py * py;
    p[4 * stride_] = px * py;
    gaps_ = gaps_ || !datum;
    if (!datum) return;
    noise_ += static_cast<double>(weight) * tile_.errors[place] * ratio;
    total_ += static_cast<double>(weight);
}

}  // namespace vlx
