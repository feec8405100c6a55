#pragma once

#include <vector>

#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/row_ring.h"

/// What a picture is like as a whole: for pixels of which, and around which, samples say nothing.
namespace vlx {

/// Of radiance: half floats cannot tell values apart that differ by less, relative to their level.
inline constexpr double kAgreement = 1.0 / 1024;

/// Measured in 16 rows spread evenly over the dump, whatever band of it is reconstructed; in all rows where
/// these hold no light.
struct PictureScale {
    /// Mean radiance, the largest of R, G, B's; 1 where the whole dump is black: what light was missed there
    /// is then taken to be white.
    double level = 1;
    /// Of one sample of R, G, B: the mean over pixels; half the mean squared difference of neighbours where
    /// no pixel has two samples. Above 0.
    double variance[3] = {1, 1, 1};
    /// Semivariances of R, G, B at lags of 1, 2, 4, ... pixels along rows, not decreasing: half the mean
    /// product of what the two halves' means differ by, in which noise cancels (half the mean square where
    /// pixels have but one sample), but no less than a standard error of that; level^2 at lags that no two
    /// pixels with samples have. The last is the field's spread.
    std::vector<double> semivariance[3];

    /// 1 / the sum of the variances.
    double unit() const { return 1 / (variance[0] + variance[1] + variance[2]); }
    /// Standard deviation of the mean of `samples` samples that all have the same value.
    double agreedDeviation(double value, double samples) const;
    /// Standard deviation of colour c about 0: of a pixel that no sample says anything of.
    double unknownDeviation(int c) const;

    /// Semivariance of colour c at a distance of some pixels, linear in its logarithm between lags.
    double semivarianceAt(int c, double pixels) const;
};

/// The probability of what was not seen in n samples of which no two differ is at most 3 / n (with 95 %
/// confidence): the variance of one sample that this leaves, where an unseen one differs by `level`.
inline double unseenVariance(double samples, double level) {
    return 3 / (samples > 3 ? samples : 3) * level * level;
}

/// Throws Error where these rows have too much radiance (RadianceRange).
PictureScale measurePictureScale(const SampleSource& dump, const SampleLayout& layout);
/// The same for methods that know no features, and compute in double precision: of any finite radiance.
PictureScale measurePictureScale(const SampleSource& dump);

}  // namespace vlx
