#pragma once

#include <cstdint>

#include "pixel_statistics.h"
#include "row_ring.h"

/// From gathered statistics to the data that are kriged: means of the halves without fireflies, holes filled.
namespace vlx {

/// Pixels within which a pixel without samples looks for some; also covers what fireflies are compared with.
inline constexpr int kHoleReach = 5;

/// Planes of the data, r being the number of radiance channels: 0 means of half A, r means of half B, 2 r
/// count of A, 2 r + 1 of B, 2 r + 2 of both, 2 r + 3 whether the pixel is exact.
inline constexpr int dataPlanes(int radiance) { return 2 * radiance + 4; }

/// What was taken off the fireflies of a row.
struct LimitedRow {
    std::int64_t samples = 0;
    double luminance = 0;
};

/// Refers to its rings. Rows may be filled at the same time.
class PixelData {
  public:
    /// `squares`: sums of squares of R, G, B; their degrees of freedom. `robust`: Fireflies::Robust.
    PixelData(const SampleLayout& layout, const GatheredPlanes& planes, int width, int height, bool robust,
              RowRing& gathered, RowRing& data, RowRing& squares)
        : layout_(layout),
          planes_(planes),
          width_(width),
          height_(height),
          radiance_(layout.radiance),
          robust_(robust),
          gathered_(gathered),
          data_(data),
          squares_(squares) {}

    /// Fills row y of data and squares; rows kHoleReach around it are gathered.
    LimitedRow fillRow(int y);

  private:
    void fillHole(int x, int y);
    void limitPixel(int x, int y, LimitedRow& limited);
    bool isExact(int x, int y) const;
    float halfMean(int count, int mean, int x, int y) const;
    float secondBrightest(int x, int y) const;
    void borrowSquares(int x, int y, float* squares, float& freedom) const;

    const SampleLayout& layout_;
    const GatheredPlanes& planes_;
    int width_, height_, radiance_;
    bool robust_;
    RowRing &gathered_, &data_, &squares_;
};

}  // namespace vlx
