#pragma once

#include <cstdint>
#include <vector>

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/drift/level.h"

/// From the combined estimate to the picture and its error: drift.h, 7 to 9.
namespace vlx {

/// Refers to its level and rings. Rows may be worked on at the same time.
class Finishing {
  public:
    static constexpr int kLightReach =
        16;  ///< pixels: a window of 33 x 33 pixels, (1 - u^2)^2 along each axis
    static constexpr int kAlikeReach = 2;  ///< of the error map: 5 x 5 pixels

    /// `combined`: CombinedPlanes, instead of the level's own; `clean`: radiance channels; `light`:
    /// LightPlanes.
    Finishing(const SampleLayout& layout, double strength, int scale, const PictureScale& picture,
              const LevelRows& level, const RowRing& combined, RowRing& clean, RowRing& light);

    /// Row y of `clean`: a pixel beyond the range of its eight neighbours moves towards them, by what its own
    /// noise explains of how far: shrinkage(beyond^2, h^2 sum over colours of v / n), h its leverage and v
    /// the variance of a sample, or the mean of it over 3 x 3 pixels. All channels move by the same weight,
    /// along the line to the neighbour nearest to the range's border. Combined rows y - 1 to y + 1 are there.
    void cleanRow(int y);
    /// Row y of `light`, weighted sums along the row. Clean row y is there.
    void lightRow(int y);
    struct Counts {
        std::int64_t exact = 0;  ///< pixels
        double returned = 0;     ///< luminance, summed over samples
    };
    /// Row y of the picture: radiance channels and stddev of R, G, B, interleaved. Rows of kLightReach around
    /// it are there.
    Counts outputRow(int y, float* out) const;

  private:
    double sampleVariance(int c, int x, int y) const;
    bool isExact(int x, int y) const;
    float likeness(int x, int y, int col, int row) const;
    void sharedVariance(int x, int y, double* variance) const;
    std::vector<double> returned(int y) const;

    const SampleLayout& layout_;
    DataPlanes planes_;
    CombinedPlanes combinedPlanes_;
    double strength_;
    int scale_, width_, height_, radiance_;
    std::vector<int> colour_;  // of each radiance channel: 0 to 2, or -1: none of these
    const PictureScale& picture_;
    const RowRing &data_, &features_, &variances_, &combined_;
    RowRing &clean_, &light_;
};

}  // namespace vlx
