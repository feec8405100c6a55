#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "variolux/base/image.h"
#include "variolux/reconstruct/inspection.h"
#include "variolux/reconstruct/second_opinion.h"

namespace vlx {

/// How a region of the image got its values. Everything but Kriged is a fallback or a special case, counted
/// in the report and drawn in the diagnostic layer `diagnostics.outcome` (the number of the enumerator).
enum class RegionOutcome {
    Kriged,       ///< a variogram was fitted and the system solved
    NoStructure,  ///< the fitted sill is zero: kriging is then the weighted mean of the region's data
    TooFewData,   ///< fewer than 3 data: their mean
    AllEqual,     ///< all data equal in every channel: that value, its error what they may not have seen
    FitFailed,    ///< no variogram could be fitted: the mean
    SolveFailed,  ///< the kriging system could not be solved even with the solver's fallbacks: the mean
    Empty,        ///< no usable sample at all: zero, with the picture's spread as its error, and counted
};
inline constexpr int kRegionOutcomes = 7;

/// For reports: "kriged", "no structure", ...
std::string_view name(RegionOutcome outcome);

/// What was fitted and done in one region.
struct RegionDiagnostics {
    Window pixels;
    RegionOutcome outcome = RegionOutcome::Empty;
    int data = 0;              ///< data of the kriging system
    std::int64_t samples = 0;  ///< samples that went into them
    double nugget = 0;         ///< of the fitted model; squared radiance, summed over R, G, B
    double sill = 0;           ///< partial sill, same unit
    double range = 0;          ///< pixels (of composite distance when that is on)
    double exponent = 0;       ///< alpha of the stable model
    double errorVariance = 0;  ///< of one sample: pooled residual variance, summed over R, G, B
    double colourScale = 0;    ///< pixels of composite distance a unit of radiance; 0 when off
    double condition = 0;      ///< estimated condition number of the system, 0 where none was solved
    double jitter = 0;         ///< relative diagonal jitter that the solver had to add; 0 normally
    int inaccurate = 0;  ///< pixels whose kriging is less accurate than asked (TargetStatus::Inaccurate)
};

/// What the paper's method did.
struct PaperReport {
    std::array<std::int64_t, kRegionOutcomes> outcomes{};  ///< count by RegionOutcome
    std::int64_t jitteredSystems = 0;                      ///< kriging systems that needed jitter
    std::int64_t inaccuratePixels = 0;                     ///< rounding may show (TargetStatus::Inaccurate)
    std::vector<RegionDiagnostics> regions;                ///< row by row
    std::map<std::size_t, RegionInspection> inspections;   ///< of regions (by index) where it was asked for
};

/// What the default method left in one region of 32 x 32 pixels: the variogram of the residuals, from
/// products of the two halves', in which noise cancels. Squared radiance, summed over R, G, B.
struct ResidualRegion {
    Window pixels;
    std::int64_t data =
        0;  ///< pixels with samples in both halves, and noise; below 100 there is no variogram
    std::int64_t pairs = 0;  ///< at lags of 1 to 16 pixels
    double nugget = 0;  ///< what single pixels lack, less what one half's weights know of the other's noise
    double sill = 0;    ///< partial sill of the stable model
    double range = 0;   ///< pixels
    double exponent = 0;
    double statistic = 0;  ///< of sillTest()
    double pValue = 1;
    bool structure = false;  ///< significant at 0.05: neighbouring pixels are wrong together
};

/// What frames around a frame (sequence.h) add to it.
struct SequenceReport {
    int frames = 0;         ///< that are there
    int wanted = 0;         ///< that the options ask for
    double gain = 1;        ///< what they make of the number of samples: times as many, on average
    int equalSeeds = 0;     ///< of `frames`: they sampled with the seed of this one
    int withoutMotion = 0;  ///< of them and the frame itself: points are taken to stand still there
};

/// What the default method did.
struct DriftReport {
    std::int64_t farPixels = 0;       ///< empty, and with no samples within 5 pixels either
    std::int64_t exactPixels = 0;     ///< the dump states an error of 0: kept as they are
    std::int64_t limitedSamples = 0;  ///< made darker by the firefly estimator
    double energyRemoved = 0;         ///< share of all samples' luminance that this took away
    double energyReturned = 0;        ///< and that was moved back to where samples have more than the
                                      ///< estimate, whether fireflies lost it or not
    double light = 1;                 ///< luminance of the image over that of all samples, as they came:
                       ///< sums over samples (a pixel counts as often as it was sampled); 0: there is none
    double lightError = 0;  ///< standard error of the samples', as a share of it
    /// Correlation of the noise of pixels beside each other in a row, from the differences of their halves,
    /// and its standard error: 0 is what all error variances take it for. A pixel filter that gives a sample
    /// to several pixels makes it 0.1 to 0.8. With frames of a sequence, whose data lie between pixels, it
    /// says nothing of the renderer.
    double neighbourCorrelation = 0, neighbourCorrelationError = 0;
    std::int64_t neighbourhoods = 0;         ///< kriged, over models and halves
    std::int64_t ownNeighbourhoods = 0;      ///< centred on pixels unlike their regular centres
    std::int64_t failedNeighbourhoods = 0;   ///< not solvable: their weighted mean
    std::int64_t driftFeatures = 0;          ///< sum over neighbourhoods of the features that vary there; the
                                             ///< others are no drift
    double driftFunctions = 0;               ///< sum over neighbourhoods of the effective number of functions
    std::optional<SequenceReport> sequence;  ///< of a frame of one
    std::optional<SecondOpinionReport> secondOpinion;  ///< where there was one
    std::map<std::string, double> seconds;             ///< wall time by stage
    std::vector<ResidualRegion> residuals;             ///< row by row; where asked for (Drift::diagnostics)
    std::map<std::size_t, RegionInspection> inspections;  ///< of residuals (by index) where it was asked for
};

/// What a run did, for people and machines.
struct ReconstructionReport {
    std::int64_t samples = 0;         ///< samples read
    std::int64_t droppedSamples = 0;  ///< non-finite radiance: left out
    std::int64_t emptyPixels = 0;     ///< pixels without a usable sample of their own
    /// Mean over pixels and colours of stddev^2 / (value^2 + 0.01): the relMSE that the error map predicts.
    /// Nothing where there is no error map.
    std::optional<double> predictedRelMse;
    double readSeconds = 0;                                         ///< wall time in the reader
    double solveSeconds = 0;                                        ///< wall time of everything else
    std::variant<std::monostate, PaperReport, DriftReport> method;  ///< of those that have more to say

    const PaperReport& paper() const { return std::get<PaperReport>(method); }
    const DriftReport& drift() const { return std::get<DriftReport>(method); }
};

/// A reconstructed image with what there is to know about it.
struct Reconstruction {
    /// R, G, B, A when the dump has it, stddev.R, stddev.G, stddev.B: the standard deviation of the
    /// estimate's error; with diagnostics, layers diagnostics.* follow.
    Image image;
    ReconstructionReport report;
};

std::string toText(const ReconstructionReport& report);
std::string toJson(const ReconstructionReport& report);

/// Of the paper's method and the default: the report and all regions, what `vlx-krige --diagnostics` writes
/// beside the image.
std::string toJson(const Reconstruction& reconstruction);

/// Appends the layers diagnostics.nugget, .sill, .range, .exponent, and of the paper's method .errorVariance,
/// .outcome, of the default .pValue to the image, constant over each region.
void addDiagnosticLayers(Reconstruction& reconstruction);

}  // namespace vlx
