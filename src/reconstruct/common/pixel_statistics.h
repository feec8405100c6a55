#pragma once

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "reconstruct/common/planes.h"
#include "variolux/base/luminance.h"
#include "variolux/dump/band.h"
#include "variolux/dump/format.h"
#include "variolux/dump/sample_source.h"
#include "variolux/reconstruct/drift.h"

/// What the default method knows of a pixel: moments of its samples, gathered in one pass over the dump.
namespace vlx {

/// The channels of a dump by their roles.
struct SampleLayout {
    std::vector<std::string> names;  ///< channels to read, in this order
    int radiance = 0;                ///< the first ones: R, G, B, then others with the same weights
    int alpha = -1;                  ///< index of A in `names`: no radiance to limit
    int features = 0;                ///< the next ones
    std::vector<int> group;          ///< of each feature; components of one vector share a group
    std::vector<float> scale;        ///< of each feature: what is stored is feature / scale
    int groups = 0;
    bool independentHalves = false;  ///< DumpHeader's, of the samples as they are gathered
    int replicate = -1;              ///< index in `names`
    int position = -1;  ///< index in `names` of sample.x, sample.y after it; where they are needed
    int motion = -1;    ///< index in `names` of the first of kMotionChannels, all four of which are there
    int variance = -1;  ///< index in `names` of the first of kVarianceChannels, all three of which are there
};

/// Of linear R, G, B with the primaries of Rec. 709; not negative.
inline float luminance(const double* rgb) {
    const double y = luminance(rgb[0], rgb[1], rgb[2]);
    return static_cast<float>(y > 0 ? y : 0);
}

/// The channels that options.radiance stands for.
std::vector<std::string> furtherRadiance(const DumpHeader& header, const Drift& options);

/// Finds the roles. Albedo and normals are of order 1 by definition; the scale of depth and of named features
/// is the 99th percentile of their magnitude, at most 4 medians (a background's depth has no bounds), in 16
/// rows spread over the image (the same rows whatever band of the image is reconstructed). Features that are
/// constant in these rows stay: they cost little. Throws Error when a named channel is missing or is R, G or
/// B.
SampleLayout chooseSampleLayout(const SampleSource& dump, const Drift& options);

/// What a feature's value counts as, in units of its scale: itself up to 1, and beyond that 1 + ln |x|. A
/// lamp's albedo of 100 or a sky at depth 1e10 is unlike all else, no more.
inline float saturated(float value) {
    const float magnitude = std::abs(value);
    return magnitude > 1 ? std::copysign(1 + std::log(magnitude), value) : value;
}

/// Radiance of which floats hold sums of squares; no light is as bright.
inline constexpr float kMostRadiance = 0x1p50f;

/// How many samples have radiance beyond kMostRadiance. A few are fireflies, and left out like those that are
/// not finite. More are the picture itself, in a unit that is too small: what is left is no picture.
struct RadianceRange {
    std::int64_t finite = 0, beyond = 0;  ///< samples, of which those are beyond
    float most = 0;                       ///< the greatest magnitude of those

    void add(const RadianceRange& other);
    /// More than 16 samples, and more than 1 in 1000, are beyond.
    bool exceeded() const;
    /// Throws Error when it is exceeded. `where`: of which rows.
    void require(const std::string& path, const std::string& where) const;
};

struct GatherCounts {
    std::int64_t samples = 0, dropped = 0, empty = 0;
    RadianceRange range;
    std::int64_t limited = 0;           ///< samples made darker by the firefly estimator
    double luminance = 0, removed = 0;  ///< sums over samples; nothing is darker than black
    double light = 0;                   ///< the same sum of what may be negative, too
    double noise = 0;                   ///< variance of `light`, of pixels with two samples or more
};

/// Gathers one row (counted from the band's top) into planes of row y.
///
/// Halves A and B are the replicates of even and odd number where the dump has replicates, samples of even
/// and odd number where it says that these are independent (DumpHeader::independentHalves), else a random
/// half of each pixel's samples (seeded by its place): consecutive samples of a low-discrepancy sampler are
/// not alike, and may lie on different sides of the pixel. Single samples belong to A and B by turns along a
/// row, starting with A or B by turns from row to row: a chessboard where every pixel has one. Samples with
/// known error variances (kVarianceChannels) stand for their own scatter. A sample with radiance that is not
/// finite, or beyond kMostRadiance, is dropped; other values that are not finite
/// count as 0. Features are saturated(feature / scale), sample by sample. Sums run in double precision about
/// the pixel's first sample. A `clamp` above 0 limits the luminance of each sample.
GatherCounts gatherRow(const SampleBand& band, const SampleLayout& layout, const GatheredPlanes& planes,
                       int bandRow, double clamp, RowRing& ring, int y);

/// Gathers one row's motion (MotionPlanes) in pixels of the picture, `scale` of which are one of the dump:
/// means over the samples whose motion is known.
void gatherMotion(const SampleBand& band, const SampleLayout& layout, int bandRow, int scale, RowRing& ring,
                  int y);

}  // namespace vlx
