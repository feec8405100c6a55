#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>

#include "reconstruct/common/gap_field.h"
#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"

/// From gathered statistics to the data that are kriged: means of the halves without fireflies, holes filled.
namespace vlx {

/// Pixels within which a pixel without samples, or without those of a half, looks for some.
inline constexpr int kHoleReach = 5;

/// Degrees of freedom of a pixel of one sample, whose variance is what its neighbours differ from it by.
inline constexpr float kBorrowedFreedom = 1e-3f;

/// What kriging starts from, a ring of rows each.
struct PixelRows {
    RowRing data;     ///< DataPlanes
    RowRing squares;  ///< SquaresPlanes
    RowRing raw;      ///< FeaturePlanes

    void claim(int first, int end) {
        for (RowRing* ring : {&data, &squares, &raw}) ring->claim(first, end);
    }
};

/// What was taken off the fireflies of a row, and what was filled in.
struct LimitedRow {
    std::int64_t samples = 0;
    double luminance = 0;
    std::int64_t farPixels = 0;  ///< without samples within kHoleReach
};

/// Refers to its rings. Rows may be filled at the same time.
class PixelData {
  public:
    /// `scale`: pixels of the image along each axis for one of the dump; `robust`: Fireflies::Robust.
    PixelData(const SampleSource& dump, const SampleLayout& layout, const GatheredPlanes& planes,
              const PictureScale& picture, int scale, int width, int height, bool robust, RowRing& gathered,
              PixelRows& out)
        : dump_(dump),
          layout_(layout),
          planes_(planes),
          dataPlanes_{layout.radiance},
          unit_(picture.unit()),
          scale_(scale),
          width_(width),
          height_(height),
          radiance_(layout.radiance),
          robust_(robust),
          gathered_(gathered),
          out_(out) {}

    /// Rows that must be gathered above and below the ones that are filled.
    static int reach(int scale);

    /// To be called before the rows [first, until) are filled: reads the dump once more if one of their
    /// pixels has no samples within kHoleReach.
    void prepare(int first, int until);
    /// Fills row y; rows reach() around it are gathered.
    LimitedRow fillRow(int y);

  private:
    struct Place {
        int x, y;  // x -1: none
        float distance;
    };
    Place nearest(int count, int x, int y) const;
    float fillHole(int x, int y, LimitedRow& row);
    void limitPixel(int x, int y, LimitedRow& row);
    float halfMean(int half, int c, int x, int y) const;
    float secondBrightest(int x, int y) const;
    void borrowFeatureErrors(int x, int y) const;
    void borrowSquares(int x, int y, float* squares, float& freedom) const;

    const SampleSource& dump_;
    const SampleLayout& layout_;
    const GatheredPlanes& planes_;
    DataPlanes dataPlanes_;
    double unit_;  // of variance
    int scale_, width_, height_, radiance_;
    bool robust_;
    RowRing& gathered_;
    PixelRows& out_;
    std::unique_ptr<GapField> far_;
};

/// Calls f(x, y) for the fine pixels that a pixel of half the resolution stands for.
template <class F>
void forParts(int width, int height, int x, int y, F f) {
    for (int row = 2 * y; row < std::min(height, 2 * y + 2); ++row)
        for (int col = 2 * x; col < std::min(width, 2 * x + 2); ++col) f(col, row);
}

/// A picture less wide or high is kriged at its own resolution only.
inline constexpr int kLeastHalved = 32;

/// Rows of `fine` that row y of the coarse level stands for: 2 y and 2 y + 1, or the last.
/// The data of each 2 x 2 pixels as one: means of the halves, which stay the same samples; counts k^2 / sum
/// 1/n of k pixels with data, so that a variance over a count stays the error variance; sums of squares and
/// degrees of freedom added; features averaged with their error variances. `width` and `height` are the fine
/// level's. Fills row y of coarse.
void halveRow(const PixelRows& fine, int width, int height, int radiance, int features, int y,
              PixelRows& coarse);

}  // namespace vlx
