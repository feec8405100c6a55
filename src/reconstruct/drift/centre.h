#pragma once

#include <array>
#include <vector>

#include "reconstruct/drift/gram.h"
#include "reconstruct/drift/neighbourhoods.h"
#include "variolux/geostat/random_drift.h"

/// Kriging with external drift in one neighbourhood: METHOD.md 7.2 to 7.4.
namespace vlx {

inline constexpr int kPositionFunctions = 5;   ///< x, y, x^2, y^2, xy
inline constexpr float kFarthest = 3.6f;       ///< composite distance: data farther away weigh nothing
inline constexpr float kLeastWeight = 0.01f;   ///< of a datum: nearExp(kFarthest)
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
    /// The centre at place `at` of the tile's planes; `alike`: what the pixels of its surroundings are like
    /// it, from 0 to 1. Kriges, and adds what is predicted for all of them to `sums` (EstimatePlanes of one
    /// half).
    void krige(const TilePlanes& tile, int at, const Surroundings& around, const float* alike, float* sums,
               NeighbourhoodCounts& counts);

  private:
    int padded() const { return (count_ + 7) & ~7; }
    float* row(int r) { return rows_.data() + r * stride_; }
    /// The data's values of a plane, less `about`; 0 beyond the data.
    void list(const float* plane, float about, float* values) const;
    void begin(const TilePlanes& tile, int at, const Surroundings& around);
    void select(const Surroundings& around, const float* alike);
    double gram(int a, int b) const {
        return gram_[static_cast<std::size_t>(a >= b ? b * gramRows_ + a : a * gramRows_ + b)];
    }
    /// Sums of products about the weighted means.
    double centred(int a, int b) const { return gram(a, b) - gram(a, 0) * gram(b, 0) / total_; }
    void stackFunctions();
    void stackRadiance();
    RandomDrift fit();
    void limitFunctions();
    void predict(const RandomDrift& drift, float* sums);
    void sumFeatureErrors(const RandomDrift& drift, float* out) const;

    TilePlanes tile_;
    std::size_t centre_ = 0;
    int reach_ = 0, stride_ = 0;
    int count_ = 0;              // of data, and pixels to be predicted
    std::vector<DataRun> runs_;  // where they lie
    int runCount_ = 0;
    std::vector<float> weights_, predicted_;  // of the data; of what is predicted there
    bool gaps_ = false;                       // pixels without data are among them
    double noise_ = 0, total_ = 0;            // sums over data: of weighted error variances, of weights
    double variance_ = 0;                     // of a datum of weight 1

    /// Rows as long as there are data, each `stride_` apart: 1, position functions, features that vary,
    /// radiance.
    std::vector<float> rows_, errors_, weighted_, sorted_, estimates_;  // errors_: of features that vary
    std::vector<int> varying_;                                          // features
    std::array<double, kMaxRandomDrift> featureNoise_{};  // of each of them: summed weighted error variances
    int functions_ = 0, gramRows_ = 0;
    std::vector<double> gram_;

    std::vector<int> used_, group_;  // rows that are drift functions: those that are not constant
    std::array<double, kMaxRandomDrift> unit_{};  // one over the standard deviation of each
};

}  // namespace vlx
