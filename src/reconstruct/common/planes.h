#pragma once

#include <algorithm>

#include "reconstruct/common/row_ring.h"

/// The one place that says which plane of a ring (row_ring.h) holds what. A ring is made with channels() of
/// its layout; "r" are the radiance channels (R, G, B, then others with the same weights), "f" the features.
namespace vlx {

/// What samples say of a pixel, as gathered.
struct GatheredPlanes {
    int radiance = 3, features = 0;

    int count() const { return 0; }  ///< usable samples
    int halfCount(int h) const { return 1 + h; }
    int mean(int h) const { return 3 + h * radiance; }  ///< r: of half h; 0 where it has no sample
    int squares() const { return 3 + 2 * radiance; }    ///< R, G, B: summed squared deviations from the mean
    int freedom() const { return squares() + 3; }       ///< degrees of freedom of `squares`
    int stated() const { return squares() + 4; }   ///< 1 where the dump states all error variances, else 0
    int feature() const { return squares() + 5; }  ///< f: means
    int featureError() const { return feature() + features; }           ///< f: error variances of these means
    int featureDifference() const { return feature() + 2 * features; }  ///< FeaturePlanes' `difference`
    int brightest() const { return feature() + 3 * features; }          ///< r: of the brightest sample
    int brightestLuminance() const { return brightest() + radiance; }
    int secondLuminance() const { return brightest() + radiance + 1; }
    int brightestHalf() const { return brightest() + radiance + 2; }
    int channels() const { return brightest() + radiance + 3; }
};

/// What is kriged: means of the halves.
struct DataPlanes {
    int radiance = 3;

    int mean(int h) const { return h * radiance; }           ///< r
    int halfCount(int h) const { return 2 * radiance + h; }  ///< samples: 0 where the mean is no datum
    int count() const { return 2 * radiance + 2; }
    int stated() const { return 2 * radiance + 3; }  ///< 1 where the dump states the error variance
    int gap() const { return 2 * radiance + 4; }  ///< pixels to the nearest samples: 0 where there are some
    int removed() const { return 2 * radiance + 5; }  ///< R, G, B: taken off the mean as a firefly's
    int channels() const { return 2 * radiance + 8; }
};

/// What the variance of a sample is divided by for that of a mean of n, which may be less than one (Merge): 1
/// where there is none.
inline float samplesIn(float n) { return n > 0 ? n : 1; }

/// Scatter of a pixel's samples.
struct SquaresPlanes {
    static constexpr int colour(int c) { return c; }  ///< summed squares of R, G, B
    static constexpr int kFreedom = 3;                ///< their degrees of freedom
    static constexpr int kSamples = 4;
    static constexpr int kAllSquared = 5;  ///< square of the sum of `colour`, in the picture's own unit
    static constexpr int kChannels = 6;
};

/// Features, raw or prefiltered.
struct FeaturePlanes {
    int features = 0;

    int value(int f) const { return f; }
    int error(int f) const { return features + f; }  ///< error variance of `value`
    int channels() const { return 2 * features; }
    /// Of raw features only: half the difference of the halves' means, A less B; 0 where one has no sample.
    int difference(int f) const { return 2 * features + f; }
    int rawChannels() const { return 3 * features; }
};

/// Where a pixel's point was in the frame before, and will be in the next: how far from here, in pixels.
/// What is not known is not a number.
struct MotionPlanes {
    static constexpr int x(bool next) { return next ? 2 : 0; }
    static constexpr int y(bool next) { return next ? 3 : 1; }
    static constexpr int kChannels = 4;
};

/// What prefiltering took off the features that each half shows, r_A and r_B, of each group: sums over its
/// features.
struct ResidualPlanes {
    int groups = 0;

    int products(int g) const { return g; }          ///< of r_A r_B
    int squares(int g) const { return groups + g; }  ///< of ((r_A + r_B) / 2)^2
    int channels() const { return 2 * groups; }
};

/// Scatter of one sample, averaged over pixels that are alike.
struct VariancePlanes {
    static constexpr int colour(int c) { return c; }  ///< variance of R, G, B
    static constexpr int kRarity = 3;  ///< degrees of freedom that it takes to meet what makes it; 0: nothing
    static constexpr int kChannels = 4;
};

/// Sums over neighbourhoods, of one model; those of half 1 begin at perHalf().
struct EstimatePlanes {
    int radiance = 3;

    int weight() const { return 0; }
    int sum(int channel) const { return 1 + channel; }              ///< of weight * (estimate - reference)
    int square(int colour) const { return 1 + radiance + colour; }  ///< of weight * (estimate - reference)^2
    int variance() const { return 1 + radiance + 3; }               ///< of weight * kriging variance
    /// Of weight * what the pixel's datum weighs in its own estimate, the diagonal of the hat matrix.
    int leverage() const { return 1 + radiance + 4; }
    int perHalf() const { return 1 + radiance + 5; }
    int channels() const { return 2 * perHalf(); }
};

/// What one model says of a pixel.
struct ModelPlanes {
    int radiance = 3;

    int half(int h) const { return h * radiance; }     ///< r: estimates from a half
    int variance() const { return 2 * radiance; }      ///< R, G, B: of the mean of both halves'
    int leverage() const { return 2 * radiance + 3; }  ///< what the pixel's datum weighs in its estimate
    int channels() const { return 2 * radiance + 4; }
};

/// What stacking sums over pixels, of m candidates (stacking.h): products (lower triangle), agreement, its
/// variance.
struct MomentPlanes {
    int candidates = 1;

    int products() const { return 0; }
    int agreement() const { return candidates * (candidates + 1) / 2; }
    int variance() const { return agreement() + candidates; }
    int channels() const { return agreement() + 2 * candidates; }
};

/// What all models together say of a pixel.
struct CombinedPlanes {
    int radiance = 3;

    int value() const { return 0; }                     ///< r
    int half(int h) const { return radiance + 3 * h; }  ///< R, G, B from a half
    int variance() const { return radiance + 6; }       ///< R, G, B: but for what halves differ in
    int leverage() const { return radiance + 9; }
    int channels() const { return radiance + 10; }
};

/// What half the resolution says otherwise: the differences of `value` and `half`, and what their gain is
/// found from.
struct DifferencePlanes {
    int radiance = 3;

    int value() const { return 0; }
    int half(int h) const { return radiance + 3 * h; }
    int gain() const { return radiance + 6; }
    int square() const { return radiance + 7; }
    int channels() const { return radiance + 8; }
};

/// The picture before its light is set right.
struct CleanPlanes {
    int radiance = 3;

    int value() const { return 0; }            ///< r
    int variance() const { return radiance; }  ///< R, G, B
    int channels() const { return radiance + 3; }
};

/// Sums along a row of the near window, 0, and of the wide one, 1 (light.h).
struct LightPlanes {
    static constexpr int missing(int window) { return 7 * window; }     ///< R, G, B
    static constexpr int room(int window) { return 7 * window + 3; }    ///< R, G, B
    static constexpr int square(int window) { return 7 * window + 6; }  ///< of what is missing
    static constexpr int kLost = 14;     ///< squares of what fireflies lost, near
    static constexpr int kLight = 15;    ///< that is there, and what fireflies lost, near
    static constexpr int kAllLost = 16;  ///< what fireflies lost, near
    static constexpr int kPixels = 17;   ///< near
    static constexpr int kChannels = 18;

    static constexpr bool isSquare(int plane) {
        return plane == square(0) || plane == square(1) || plane == kLost;
    }
};

/// Sums along a row of what the halves have wrong alike, of the near window, 0, and of the wide one, 1
/// (common_error.h).
struct CommonErrorPlanes {
    static constexpr int products(int window) { return 3 * window; }
    static constexpr int squares(int window) { return 3 * window + 1; }  ///< of products
    static constexpr int pixels(int window) { return 3 * window + 2; }
    static constexpr int kChannels = 6;
};

/// Mean of all samples of a pixel; 0 where it has none.
inline double plainMean(const RowRing& data, const DataPlanes& planes, int channel, int x, int y) {
    const double nA = data.row(planes.halfCount(0), y)[x], nB = data.row(planes.halfCount(1), y)[x];
    if (nA + nB <= 0) return 0;
    return (nA * static_cast<double>(data.row(planes.mean(0) + channel, y)[x]) +
            nB * static_cast<double>(data.row(planes.mean(1) + channel, y)[x])) /
           (nA + nB);
}

/// A pixel's reference value, which sums are taken about so that little cancels: the smaller of its halves'
/// means (a firefly is in one of them).
inline float reference(const RowRing& data, const DataPlanes& planes, int channel, int x, int y) {
    return std::min(data.row(planes.mean(0) + channel, y)[x], data.row(planes.mean(1) + channel, y)[x]);
}

}  // namespace vlx
