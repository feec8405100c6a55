#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/row_ring.h"

/// The picture's light is the samples' light: METHOD.md 7.7.
namespace vlx {

/// How far from a pixel light is compared: kNear around it, and kWide along rows, (1 - u^2)^2 along each
/// axis.
struct LightReach {
    static constexpr int kNear = 16;
    static constexpr int kWide = 256;
};

/// Fireflies that were limited, and error variances that go with brightness, make the estimate darker than
/// the samples are on average: by little in each pixel, by much in all. With rho = z - y, what the samples'
/// mean z has more than the estimate y, sums over a window under weights g, of R, G, B each,
///     T = sum g rho,    Q = sum over colours of sum g^2 rho^2,    A = sum g a,
///     a = y^1.5 / (1 + y / (20 s)):
/// a, what a pixel is given a share of, s the standard deviation that is predicted for it. The power lies
/// between y, the share that all have had, and y^2, the least relative change (chosen by looking: METHOD.md
/// 7.7); what is known to
/// within 5 % or better has less. A pixel moves by l a, l = T / A as far as it is no accident, as the rho
/// themselves tell (James and Stein, colours together; self-normalised: one outlier has T^2 = Q, and is
/// nothing):
///     l_wide = k T / A,                        k = (1 - Q / |T|^2)+
///     l = l_wide + k' (T' / A' - l_wide),      k' = (1 - Q' / |T' - l_wide A'|^2)+
/// first of the wide window, then what the near one, ', has that differs from it; but by no more than s, and
/// not below 0. (Small area estimation calls it benchmarking: Rao and Molina 2015, 6.4.6.)
class Light {
  public:
    Light(int width, int height, RowRing& sums) : width_(width), height_(height), sums_(sums) {}

    /// Of one row, R, G, B each: y, s, rho, and what fireflies lost.
    struct Row {
        explicit Row(int width);
        std::vector<float> value[3], deviation[3], missing[3], lost[3];
    };
    /// Row y of the sums (LightPlanes).
    void sumRow(int y, const Row& row);
    /// l of R, G, B, pixel by pixel of row y. Then the variance of what fireflies lost, r a pixel, sum g^2
    /// r^2, as a share of the square of the light, sum g (y + r): it is known to as many samples as lost it;
    /// and what they lost a pixel and colour. Rows kNear around it are summed.
    struct Shares {
        std::vector<double> moved[3], lost, lostLevel;
    };
    Shares shares(int y) const;

    /// Variance of what fireflies lost of a pixel of value y: in proportion to y, and to what they lost
    /// around it, which may be all the light there is; thrice, as what few have lost may be missing
    /// elsewhere.
    static double lostVariance(const Shares& of, std::size_t x, double value) {
        const double light = std::max(0.0, value) + of.lostLevel[x];
        return 3 * of.lost[x] * light * light;
    }
    /// By what a pixel of value y moves, of l; s^2: its error variance, `lost` that of lost light.
    static double step(double l, double value, double variance, double lost) {
        if (!(value > 0 && variance > 0)) return 0;
        const double most = std::min(value, std::sqrt(variance + lost));
        return std::clamp(l * room(value, std::sqrt(variance)), -most, most);
    }

  private:
    /// a
    static double room(double value, double deviation) {
        return value > 0 && deviation > 0 ? value * std::sqrt(value) * deviation / (deviation + 0.05 * value)
                                          : 0;
    }

    int width_, height_;
    RowRing& sums_;
};

}  // namespace vlx
