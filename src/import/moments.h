#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "import/import.h"

namespace vlx {

/// In a dump, of a pixel whose variance is not known (FORMAT.md).
inline constexpr float kUnknownVariance = -1;

/// What renderers call a pixel's variance. n: samples a pixel; x: one of them.
enum class VarianceMeaning {
    OfSample,      ///< of a single sample, unbiased: the mean's is this / n
    OfMean,        ///< of the pixel, the mean of n samples
    SecondMoment,  ///< the mean of x^2: the mean's variance is (this - mean^2) / (n - 1)
};

/// Where a renderer puts what, and what it means.
enum class MomentPreset {
    Auto,      ///< by the channels that only one of them has
    Pbrt,      ///< pbrt-v4, gbuffer film: Variance.R G B is of a single sample; samplesPerPixel in the header
    Mitsuba,   ///< Mitsuba 3, moment integrator: m2_I.X Y Z are second moments of I.X Y Z
    Tungsten,  ///< OutputBuffer with sample variance: NAMEVariance.exr is of the mean
    Arnold,    ///< layer variance of a variance_filter: taken as of a single sample
    RenderMan,  ///< mse: of the mean
    Plain,      ///< R G B and variance.R G B (or variance from another image); say what it means
};

/// Images of one thing each, for renderers that write no layers. Empty: none.
struct CompanionImages {
    std::string variance;
    std::string albedo;
    std::string normal;
    std::string depth;
};

struct MomentOptions {
    MomentPreset preset = MomentPreset::Auto;
    std::optional<VarianceMeaning> meaning;  ///< the preset's when not given
    /// Whether variances are those of X, Y, Z. pbrt's are with its default sensor, cie1931; Mitsuba's always.
    std::optional<bool> xyz;
    double samples = 0;  ///< samples a pixel; 0: the header's, where the meaning needs it
    CompanionImages with;
    std::string layer = {};  ///< where R, G, B (and A) are, and Cycles' features beside them: findColour()
    ChannelMap map;  ///< entries override the preset's; variance.R from the channel that holds the variance
    /// Further channels or layers of radiance (radianceChannels), kept under their names. They have no
    /// variances: where there are halves, a part of R is scaled as R is, so that parts still add up.
    std::vector<std::string> radiance = {};
    /// Two samples a pixel: halves of independent noise made of mean and variance (below); else one.
    bool halves = true;
    std::uint64_t seed = 0;  ///< of the halves
    std::string renderer;    ///< for the header; from the image's metadata when empty
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

/// Makes a dump of a flat image that has a variance for each pixel.
///
/// The dump has channels variance.R, variance.G, variance.B: the known error variance of each sample. With
/// `halves` a pixel of mean m and variance of the mean v becomes the two samples m + s and m - s, s^2 = v,
/// where the sign of s is a coin's, thrown for (seed, pixel) and shared by R, G and B. Each has the error
/// variance 2 v; their mean is m, and the variance of their mean, estimated from the two, is v. If e is the
/// error of m, the errors of the halves are e + s and e - s: unbiased, as the sign is random, and
/// uncorrelated, E[(e + s) (e - s)] = var(e) - v = 0, with those of other pixels too. So they can serve to
/// choose between linear estimates as two halves of the renderer's samples would (with a fixed sign one half
/// would be too bright, the other too dark). Uncorrelated is not independent: where a choice is not linear in
/// the data they are an approximation. A lone firefly, whose s is about m, lands in one of the halves, as it
/// would have. Without `halves` a pixel is the one sample m with variance v.
///
/// A variance that is not finite, negative (rounding of second moments: all samples agreed), or of fewer
/// samples than it takes, is not known: then the pixel is one sample m with variance -1; a pixel whose mean
/// is not finite is one sample. Variances of X, Y, Z become those of R, G, B (Rec. 709) as if the errors of
/// X, Y, Z were perfectly correlated, which holds for noise of one hue. Works by bands of rows. Throws Error
/// when images cannot be read or have different windows, when R, G, B or a variance cannot be found, when the
/// number of samples is needed and not known, and as DumpWriter. The preset Plain finds the layers of
/// Blender's files too, as StackPreset::Cycles does.
ImportReport importMoments(const std::string& image, const std::string& dump, const MomentOptions& options,
                           const Progress& progress = {});

/// The same samples without a dump. Memory is that of the rows asked for. Throws as importMoments.
std::unique_ptr<ImportedSamples> openMoments(const std::string& image, const MomentOptions& options);

struct BufferOptions {
    CompanionImages with;  ///< variance: of the mean of both buffers (VarianceMeaning::OfMean)
    ChannelMap map;        ///< of both buffers
    std::string renderer;
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

/// Joins half-buffers A and B, each the mean of half of a pixel's samples, into a dump of two samples a
/// pixel, replicates 0 and 1. With a variance v of the mean of both, each gets variance.* = 2 v. Channels are
/// found as by StackPreset::Auto. Throws as importMoments.
ImportReport importBuffers(const std::string& a, const std::string& b, const std::string& dump,
                           const BufferOptions& options, const Progress& progress = {});

}  // namespace vlx
