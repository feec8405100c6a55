#pragma once

#include <vector>

#include "reconstruct/common/row_ring.h"

/// What the halves' estimates have wrong alike, which their difference cannot show: METHOD.md 7.8.
namespace vlx {

/// Of the mean of two estimates a, b of s the squared error is, exactly,
///     ((a + b) / 2 - s)^2 = (a - b)^2 / 4 + (a - s)(b - s).
/// With each half's own data the noise of the second term cancels:
///     E[(z_A - a)(z_B - b)] = E[(a - s)(b - s)],
/// but for what a's weights, chosen by B, know of B's noise, which makes it smaller. In units of the noise of
/// a pixel's mean, p the mean over colours of (z_A - a)(z_B - b) n / v less what the rest of the error map
/// says that the halves have in common, sums over a window under weights g
///     T = sum g p,    N = sum g,    Q = sum g^2 p^2
/// say how much is missing there, as far as it is no accident (James and Stein; near, beyond two standard
/// errors, as many windows are looked at):
///     q_wide = (T / N (1 - Q / T^2)+)+,    q = (q_wide + (T' / N' - q_wide) (1 - 4 Q' / (T' - q_wide
///     N')^2)+)+
/// first over 33 rows and 513 columns, then what the 33 x 33 pixels, ', have that differs. A pixel's error
/// variance grows by q v / n. That is nothing where the rest says what is wrong; textures and wires finer
/// than a pixel, and fields rougher than the drift, it does not know.
class CommonError {
  public:
    static constexpr int kNear = 16;   ///< pixels along each axis
    static constexpr int kWide = 256;  ///< along rows

    /// `sums`: CommonErrorPlanes.
    CommonError(int width, int height, RowRing& sums) : width_(width), height_(height), sums_(sums) {}

    /// Row y of the sums. p of its pixels; `known`: 1, or 0 where a half has no sample (p is 0 there).
    void sumRow(int y, const std::vector<float>& products, const std::vector<float>& known);
    /// q of the pixels of row y. Rows within kNear are summed.
    std::vector<double> shares(int y) const;

  private:
    int width_, height_;
    RowRing& sums_;
};

}  // namespace vlx
