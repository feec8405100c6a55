#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/reconstruct/second_opinion.h"

/// The default method: kriging with external drift in overlapping neighbourhoods, several models, chosen
/// between by halves of the samples.
///
/// 1. *Data*: each pixel's mean of the samples of half A, and of half B. Its error variance is known from the
///    samples; it is noisy and correlated with the mean, so that of one sample is averaged over pixels with
///    alike features (radius 5, joint bilateral on the features with their own error variances).
/// 2. *Drift*: the constant, image coordinates to second order, and the features (albedo, normal, depth, and
///    named ones), which are prefiltered where they are noisy: each half's by the other's patches
///    (drift/prefilter.h). Its coefficients are random with variances estimated in each neighbourhood
///    (geostat/random_drift.h): the covariance of the field is that of finite rank, and a group of functions
///    that explains nothing costs nothing.
/// 3. *Neighbourhood*: pixels around a centre, every few pixels. A datum's error variance grows with its
///    composite distance from the centre: v / w, w = exp(-d / k^2), where d compares the colour patches (7 x
///    7 pixels) of the *other* half with their known noise, so that weights are independent of what they
///    weigh:
///        d = mean over patch and colours of (|dz|^2 - (v1 + min(v1, v2))) / (v1 + v2)
///    (Rousselle, Knaus and Zwicker 2012; an unbiased squared distance in units of its noise). The medium
///    model joins the distance of the features, sum over them of df^2 / (0.2^2 + 2 (u1 + u2)), u their error
///    variances and 1 their scale: noise hides edges from the colours that features show.
/// 4. *No seams*: a neighbourhood predicts all its pixels; a pixel averages the predictions of all
///    neighbourhoods that hold it, weighted by w over their noise.
/// 5. *Models*: medium and strict, large and tolerant, small; they and the pixel's plain mean are combined
///    per pixel by stacking (Breiman 1996): convex weights that predict half B from half A and the reverse,
///    fitted over about 20 x 20 pixels; the plain mean enters only where it improves by one standard error.
/// 6. *Half the resolution*: the same data, 2 x 2 pixels as one, are kriged by the same models, C. The
///    estimate K becomes K + w (L - K), L = K + up(C - down(K)), with the w in 0 to 1 by which each half's
///    correction predicts the other half's data best in 7 x 7 pixels (half_resolution.h). Noise of low
///    frequency, which neighbourhoods of a few pixels share, is less at half the resolution. Pictures of less
///    than 32 pixels along an axis have no such level.
/// 7. *Outliers and light*: a pixel beyond the range of its eight neighbours moves towards them by the share
///    of the excess that its own noise explains. What the samples around (33 x 33 pixels, and 513 along
///    rows) have more light than the estimate is given back in proportion to y^1.5, as far as it is no
///    accident, by no more than a pixel's standard deviation (drift/light.h): the image's mean stays within
///    about 1 % of the samples', or two standard errors of it.
/// 8. *Error map*: the estimator's own variance. The noise of the halves' common data is estimated twice, and
///    half of each taken: by what the halves' combinations differ in, (A - B)^2 / 4 over 5 x 5 pixels of
///    alike features; and by the kriging variance of the neighbourhoods, v (1 + p) / sum w (p effective
///    functions), less what they spread about their mean, which averaging takes off. That spread is added, as
///    what the drift does not say, and so is what a model differs from the combination by beyond its own
///    variance; half the resolution mixes its own in by w, where that is less, and adds w (1 - w) (L - K)^2.
///    Errors u of the features make sum b^2 u of it. What the halves have wrong alike their difference does
///    not show: the product of their residuals does, (z_A - A)(z_B - B), in which noise cancels; what it has
///    more than all this, pooled over 33 rows by 33 and 513 columns, is added (drift/common_error.h). Lost
///    light is known to as many samples as lost it: y^2 times sum r^2 / (sum y)^2. A pixel's own scatter
///    beyond two standard deviations of its mean counts by h^2.
/// 9. *What samples do not say*: no pixel is exact but where the dump states an error variance of 0, there
///    and at all pixels that it was pooled over. What the n samples around a pixel did not see has a
///    probability of up to 3 / n (95 % confidence): the variance of a sample is larger by 3 / n times the
///    square of the picture's mean level, or of the pixel's own where no two of them differ; there, what a
///    window twice as wide met counts as far as chance explains that the pixel's own did not
///    (drift/prefilter.h). A pixel without samples, or without those
///    of a half, is no datum: it is predicted by the neighbourhoods that reach it, else (more than 5 pixels
///    from any sample) read off means of blocks of 8 x 8 pixels, interpolated, smoothly from half a
///    neighbourhood's reach to the whole of it; its error grows by the
///    semivariance of the picture at the distance of the nearest samples, towards the field's own spread. Of
///    features, what exceeds their scale counts by its logarithm, and in a neighbourhood the few values that
///    lie farther from the range of all others than it is wide count as not known.
/// 10. *Sequences* (sequence.h): data of the frames before and after join the frame's own before step 2. What
///    was at a pixel's point, by its motion from frame to frame, is interpolated between the four pixels
///    around, and weighted by exp(-20 d - f - m): d what the other half's colours and the features around
///    differ by, f what those of the pixel do, m the square of what motion there and back does, in pixels. A
///    frame's own data weigh 1. Kriging then sees more samples in a pixel, sum w n.
///
/// R, G and B of a pixel whose mean is not negative are not, unless further radiance channels are named
/// (parts of light must add up). A, the coverage that radiance is premultiplied with, has the same weights as
/// far as its noise explains what the mean of the pixel's samples says otherwise (drift/finishing.h). Where
/// samples agree on 0 or 1 it stays so, unless those around show that it was chance. It is kept within 0
/// to 1.
namespace vlx {

/// Frames on either side that add to one of a Sequence, at most.
inline constexpr int kMostTemporal = 8;

/// What is given up for speed: models used, and how densely neighbourhoods overlap.
enum class Quality {
    Draft,     ///< the medium model, a neighbourhood every 8 pixels; features averaged over 7 x 7
    Standard,  ///< three models, every 3 to 8 pixels
    High,      ///< three models, every 2 to 3 pixels
};

/// What happens to samples that are brighter than all else around (fireflies).
enum class Fireflies {
    Keep,    ///< nothing: as noisy as the samples, and no light is lost to this step
    Robust,  ///< the brightest sample of the 5 x 5 pixels of the dump around it, if there are 9 or more,
             ///< counts as bright as the second brightest (a Winsorised mean: of 25 n samples one, so the
             ///< bias vanishes as n grows); where many lose light it is given back to their surroundings
    Clamp,   ///< samples above a given luminance are scaled down to it: a bias that stays
};

/// Steps of the method, all of them taken. Leaving one out shows what it does (METHOD.md 7, and
/// testdata/results/ablation.md).
struct DriftSteps {
    bool prefilter = true;       ///< 2: noisy features are prefiltered; else their pixels' own means
    bool unseen = true;          ///< 9: error variances count what no sample met; else only what samples show
    bool stacking = true;        ///< 5: models are combined; else the medium one alone
    bool halfResolution = true;  ///< 6
    bool outliers = true;        ///< 7: pixels beyond the range of their neighbours
    bool light = true;           ///< 7: light given back
};

/// The method's options. With a scale above 1 the samples are sorted into parts of their pixels by their
/// positions, and parts without samples are predicted; the windows grow by the scale. Memory depends on the
/// picture's width, not its height. Every channel gets the same weights: parts that add up to R, G, B still
/// do. A pixel without samples is predicted and counted; a sample with radiance that is not finite, or beyond
/// 2^50, is left out and counted. reconstruct() throws Error when options name channels that the dump lacks,
/// ask for a scale where it has no positions or for more bands than rows, when maxMemory is too little,
/// saying what would do, and when more than 16 samples and 1 in 1000 are beyond 2^50: that is no firefly, but
/// a picture in too small a unit; of rows spread over it this is known before any work, else at the end.
struct Drift {
    Quality quality = Quality::Standard;
    Fireflies fireflies = Fireflies::Robust;
    double clamp = 10;             ///< luminance, Fireflies::Clamp; > 0
    double strength = 1;           ///< 0: the mean of what fireflies leaves, 1: the estimate; between: linear
    bool standardFeatures = true;  ///< use albedo, N and Z where the dump has them
    std::vector<std::string> features = {};  ///< further channels to use as drift
    /// Further channels, or layers (radianceChannels), to estimate with the same weights: light groups.
    std::vector<std::string> radiance = {};

    /// Also measure what is left: DriftReport::residuals. Not with bands, which cut regions.
    bool diagnostics = false;
    /// Raster coordinates (x, y) of pixels of the image whose regions are to be inspected
    /// (DriftReport::inspections), with `diagnostics`.
    std::vector<std::pair<int, int>> inspect = {};

    int temporal = 0;  ///< 0 to kMostTemporal: frames before and after that add to one of a Sequence
    int scale = 1;     ///< 1 to 4: pixels of the image along each axis for one of the dump
    DriftSteps steps = {};
    Band band = {};  ///< only these rows: the pixels that they have in the whole image, bit for bit

    /// What another denoiser made of the same samples, to be combined with the estimate (second_opinion.h;
    /// METHOD.md 7.11): R, G, B and their error. Not with a scale above 1, a strength below 1, nor with
    /// `radiance`, whose parts would not add up.
    std::shared_ptr<const SecondOpinion> secondOpinion = {};

    /// Bytes that the process may take, at most (resident memory, as the kernel counts it); 0: any number.
    /// Fewer rows of the dump are then read at a time.
    std::uint64_t maxMemory = 0;

    /// The broken constraint in words, or nothing.
    std::optional<std::string> validate() const;
};

}  // namespace vlx
