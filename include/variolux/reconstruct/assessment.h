#pragma once

#include "variolux/reconstruct/reconstruct.h"

/// How wrong another denoiser's image is, said by the samples that it was made of: METHOD.md, 7.12.
namespace vlx {

/// Of the whole image; relMSE is the mean over pixels and colours of (D - truth)^2 / (truth^2 + 0.01),
/// in which y^2 + s^2 of the combination and its standard deviation stand for truth^2.
struct AssessmentReport {
    double relMse = 0;
    double low = 0, high = 0;  ///< its 95 % interval
    /// The two estimates that it is the mean of, weighted by their standard errors: what the combination of
    /// the image with the kriging says, and the unbiased one from images of halves (NaN without them, and of
    /// pictures too small for a standard error).
    double byMap = 0, byMapError = 0;
    double byHalves = 0, byHalvesError = 0;
    bool validated = false;  ///< by images of halves: byMap knows how much nearer to the samples the image is
    std::string refused;     ///< why images of halves that were there were not used; else empty
    double biased = 0;       ///< share of pixels with a significant bias
    double refuted = 0;      ///< share of pixels with a confidence below 0.001
};

struct Assessment {
    /// stddev.R, .G, .B: standard deviation of the image's error, bias included; bias.R, .G, .B: what it is
    /// too bright by (negative: too dark) within 7 or 15 pixels, where that is significant, else 0;
    /// confidence: the probability that noise alone makes the samples within up to 15 pixels differ from the
    /// image as much as they do, and at most 1 / t^2 where it lies t standard deviations from the combination
    /// (Chebyshev).
    Image map;
    AssessmentReport report;
    ReconstructionReport kriging;  ///< of the combination that it rests on
};

/// Assesses options.secondOpinion's image by kriging the samples with these options. Without halves the
/// interval is wider: what the image and the kriging have in common is not known. Throws as reconstruct(),
/// and when options have no second opinion or only a band. Bit-identical for any number of threads.
Assessment assess(const SampleSource& source, const Drift& options, const Progress& progress = {});

std::string toText(const AssessmentReport& report);
std::string toJson(const AssessmentReport& report);

}  // namespace vlx
