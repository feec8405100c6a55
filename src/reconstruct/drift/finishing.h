#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/drift/common_error.h"
#include "reconstruct/drift/level.h"
#include "reconstruct/drift/light.h"

/// From the combined estimate to the picture and its error: drift.h, 7 to 9.
namespace vlx {

/// How alike the noise of pixels beside each other is: d, the difference of a pixel's halves in units of its
/// standard deviation, cut at 3, is noise alone; products of neighbours' are 0 on average where pixels do not
/// share samples.
struct NoiseCorrelation {
    double products = 0;  ///< sum of d d'
    double squares = 0;   ///< sum of (d^2 + d'^2) / 2
    double chance = 0;    ///< sum of (d d')^2

    void add(const NoiseCorrelation& other);
    double value() const { return squares > 0 ? products / squares : 0; }
    double standardError() const;
};

/// Refers to its level and rings. Rows may be worked on at the same time.
class Finishing {
  public:
    static constexpr int kAlikeReach = 2;  ///< of the error map: 5 x 5 pixels
    static constexpr int kReach = 4;       ///< of alpha: 9 x 9 pixels

    /// `combined`: CombinedPlanes, instead of the level's own; `clean`: CleanPlanes; `light`: LightPlanes;
    /// `common`: CommonErrorPlanes.
    Finishing(const SampleLayout& layout, const Drift& options, const PictureScale& picture,
              const LevelRows& level, const RowRing& combined, RowRing& clean, RowRing& light,
              RowRing& common);

    /// Row y of `clean`: a pixel beyond the range of its eight neighbours moves towards them, by what its own
    /// noise explains of how far: shrinkage(beyond^2, h^2 sum over colours of v / n), h its leverage and v
    /// the variance of a sample, or the mean of it over 3 x 3 pixels. All channels move by the same weight,
    /// along the line to the neighbour nearest to the range's border. Combined rows y - 1 to y + 1 are there.
    void cleanRow(int y);
    /// The variance and the alpha of row y of `clean`, and row y of `light` and `common`. Clean row y and
    /// combined rows y - kReach to y + kReach are there.
    ///
    /// Alpha: K + s (M - K), M the mean of the pixel's samples, K the kriging's, s the share of what they
    /// differ by that the noise of M does not explain, shrinkage(sum (K - M)^2, sum (1 - h) v) over 9 x 9
    /// pixels: with 1 - s the weight of K of least squared error, since E[(K - M)^2] is K's squared error +
    /// (1 - 2 h) v. Where samples agree on 0 or 1, K must be right about such pixels to be heard: of those
    /// that it puts as near to that value or nearer, samples must show half of what it says that they are
    /// off, which is all if it is right and nothing if it is wrong; else s is 1.
    void errorRow(int y);
    struct Counts {
        std::int64_t exact = 0;  ///< pixels
        double moved = 0;        ///< luminance given back, summed over samples
        double image = 0;        ///< luminance of the image, summed over samples
        double noise = 0;        ///< variance of the same sum of the samples' own luminance
        NoiseCorrelation neighbours;
    };
    /// Row y of the picture: radiance channels and stddev of R, G, B, interleaved. Rows of LightReach::kNear
    /// around it are there.
    Counts outputRow(int y, float* out) const;

  private:
    double sampleVariance(int c, int x, int y) const;
    bool isExact(int x, int y) const;
    std::vector<float> sharedVariances(int y) const;
    struct Coverage {
        double kriged = 0, mean = 0, noise = 0;
    };
    Coverage coverageAt(int x, int y) const;
    void coverageRow(int y);
    double halvesApart(int x, int y) const;
    NoiseCorrelation neighboursInRow(int y) const;
    double meanVariance(int c, int x, int y) const;
    double gapVariance(int c, int x, int y) const;
    std::optional<double> commonError(int x, int y, const double* predicted) const;

    const SampleLayout& layout_;
    DataPlanes planes_;
    CombinedPlanes combinedPlanes_;
    CleanPlanes cleanPlanes_;
    const Drift& options_;
    int width_, height_, radiance_;
    std::vector<int> colour_;  // of each radiance channel: 0 to 2, or -1: none of these
    const PictureScale& picture_;
    const RowRing &data_, &features_, &variances_, &combined_;
    RowRing& clean_;
    Light light_;
    CommonError common_;
};

}  // namespace vlx
