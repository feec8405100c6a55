#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "reconstruct/data/sampled_frame.h"

/// Where a frame's points are in the frames around it, and how like the data there are: drift.h, 10.
namespace vlx {

/// A frame beside the one that is kriged.
struct Neighbour {
    const SampledFrame* frame;
    bool sameSeed =
        false;  ///< its samples in a pixel are those of the own frame: where nothing moves, no news
};

/// One of the four pixels around a place, in the picture, and its weight by smoothstep: a linear one blurs
/// more, the nearest pixel is off by more.
struct Corner {
    int column, row;
    float part;
};
std::array<Corner, 4> cornersOf(float column, float row, int width, int height);

/// A feature in units of another scale, `ratio` times as large: saturated() of what it was.
float rescaled(float value, float ratio);

/// Of each neighbour and pixel: the place there, by the motion of one frame after the other, and the weight
/// of each of the four pixels around it,
///     w = exp(-20 d - f - m),    0 where that is below 0.01.
///  - d of the *other* half, so that weights are independent of what they weigh: how far its means are apart.
///    e = sum of dz / sum of sqrt(v (1 / n1 + 1 / n2)) over the colours, v the smaller of the two frames'
///    variances of a sample; at most 3 either way (a change of light is in many pixels, a firefly in one).
///    s, the mean of e over 5 x 5 pixels, shows a bias that is in all of them long before squares of single
///    pixels do: the mean of s^2 - 1 / 25 over 7 x 7 pixels, and over 21 x 21, each less its standard error.
///  - d has the same of features, which show what colours are too noisy for: the means over 7 x 7 and 21 x 21
///    pixels of (|df|^2 - u) / (0.03^2 + u), df what a feature is beyond the range of the four pixels there
///    (no interpolation explains that), u the error variances of both; at most 9.
///  - f of the features of the pixel there, sum of (df^2 - (u1 + u2)) / (0.2^2 + 25 u1), at least 0, with the
///    own pixel's error variances u1: one that knows its features (a thin bar before a window) wants their
///    like, one at an edge takes what it may be.
///  - m = |motion there and back|^2, in pixels: what was hidden goes elsewhere.
class Likeness {
  public:
    /// `before`: the frames 1, 2, ... before this one; `after` likewise. Of the same size and channels as it,
    /// all rows filled and kept.
    Likeness(const SampledFrame& own, std::vector<Neighbour> before, std::vector<Neighbour> after);

    std::size_t neighbours() const { return before_.size() + after_.size(); }
    const Neighbour& neighbour(std::size_t k) const {
        return k < before_.size() ? before_[k] : after_[k - before_.size()];
    }

    /// Rows from `first` on are asked for; up to `end`; then of those rows the rest may be.
    void startAbove(int first);
    void fill(int end);
    /// Where the point of pixel (x, y) is in neighbour k; false: not in its picture.
    bool place(int x, int y, std::size_t k, float* column, float* row) const;
    /// Of row y: exp(-20 d - m), of each neighbour and half for its pixels; 0 where there is no place.
    std::vector<float> weightsOf(int y) const;
    /// exp(-f) of pixel (x, y) and that at (column, row) of neighbour k.
    float featureWeight(int x, int y, std::size_t k, int column, int row) const;
    std::uint64_t ringBytes() const { return apart_.bytes(); }

  private:
    struct WindowSums {
        std::vector<float> sum, count;
    };
    void followRow(int y);
    void compareRow(int y, std::size_t k, const std::vector<float>& places);
    void averageRow(int y);
    WindowSums sumsAround(int y, int plane, int known, int reach) const;

    const SampledFrame& frame_;
    const SampleLayout& layout_;
    DataPlanes planes_;
    FeaturePlanes features_;
    std::vector<Neighbour> before_, after_;
    int width_, height_;
    RowRing apart_;  // ApartPlanes of each neighbour
    int comparedRows_ = 0, averagedRows_ = 0;
};

}  // namespace vlx
