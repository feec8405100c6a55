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
///     T = sum g rho,    Q = sum over colours of sum g^2 rho^2,    A = sum g a,    a = y^1.5 / (1 + y / (20
///     s)):
/// a, what a pixel is given a share of, s the standard deviation that is predicted for it. The power is a
/// convention between y, the share that all have had, and y^2, the least relative change; what is known to
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
    /// l of R, G, B, pixel by pixel of row y; last, the variance of what fireflies lost, sum g^2 r^2, as a
    /// share of the light's square: it is known to as many samples as lost it. Rows kNear around it are
    /// summed.
    struct Shares {
        std::vector<double> moved[3], lost;
    };
    Shares shares(int y) const;

    /// By what a pixel of value y and standard deviation s moves, of l. `lost`: of Shares.
    static double step(double l, double value, double deviation, double lost) {
        if (!(value > 0 && deviation > 0)) return 0;
        const double most = std::min(value, std::sqrt(deviation * deviation + lostVariance(lost, value)));
        return std::clamp(l * room(value, deviation), -most, most);
    }
    /// Of what fireflies around a pixel lost: as many as r^2 are few, and have not been met as often.
    static double lostVariance(double lost, double value) { return 3 * lost * value * value; }

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
