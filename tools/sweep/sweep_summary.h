#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "sweep/sweep.h"
#include "variolux/compare/statistics.h"

/// What the runs of a sweep say together.
namespace vlx {

/// An error of images that curves are drawn of: positive, better when lower.
struct SweepMeasure {
    std::string name;   ///< as in SweepRecord::values; "dssim" is 1 - ssim
    std::string title;  ///< for people
    bool needsReference = true;
};

/// relmse, relmse_trimmed, rmse, mape, rmse_tm, dssim, flicker, predicted_rmse, predicted_relmse.
const std::vector<SweepMeasure>& sweepMeasures();

/// One method at one sampling, over its repetitions. Errors, times and ratios are geometric means, the other
/// values arithmetic means, with 95 % intervals over the repetitions.
struct SweepSetting {
    std::string method;
    std::string knob;
    SweepSampling sampling;
    double samplesPerPixel = 0;
    Interval seconds;            ///< sampling and making the image, wall time (see SweepMethod::tracersOwn)
    Interval samplingSeconds;    ///< NaN when it is not known
    Interval imageSeconds;       ///< of the command alone
    Interval cpuSeconds;         ///< processor time of all
    std::int64_t peakBytes = 0;  ///< of the command that needs most, in any repetition
    std::map<std::string, double> stages;  ///< mean wall seconds, sampling's and image's
    std::map<std::string, Interval> values;
    std::optional<Interval> agreement;  ///< predicted_rmse / rmse, with a reference
    std::string command;                ///< of the first repetition
    std::string samplingCommand;
    std::vector<std::size_t> records;  ///< images, indices into Sweep::records
    std::vector<std::string> failures;

    /// Against plain averaging of uniform samples (the method "mean"); the interval is from the scatter of
    /// the repetitions of both.
    struct Ratio {
        Interval ratio;
        bool extrapolated = false;  ///< averaging was not measured at such an error: its fitted line's word
    };
    // By measure, where both have it; the first two only where the time of sampling is known.
    std::map<std::string, Ratio> speedUp;       ///< times as long averaging takes to the same error
    std::map<std::string, Ratio> errorRatio;    ///< the error divided by averaging's in the same time
    std::map<std::string, Ratio> samplesSaved;  ///< times as many samples averaging takes to the same error
};

/// The settings of one method along one ladder.
struct SweepSeries {
    std::string method;
    bool hierarchical = false;
    std::string name;                   ///< "paper", "paper, hierarchical sampling"
    std::vector<std::size_t> settings;  ///< indices, by samples a pixel; variations are no series
    /// Slope of log error by log samples a pixel, and by log seconds: -1 for a mean squared error of
    /// independent samples, -1/2 for its root. Over all repetitions.
    std::map<std::string, Interval> slopeBySamples, slopeByTime;
};

/// All series at the time of one of averaging's settings.
struct EqualTime {
    double seconds = 0;
    std::string budget;  ///< "mean, 256 spp"
    /// A series' error by measure, read off its curve; missing where it was not measured around that time.
    std::map<std::string, std::map<std::string, SweepSetting::Ratio>> errors;
};

struct SweepSummary {
    std::vector<SweepSetting> settings;
    std::vector<SweepSeries> series;
    std::map<std::string, std::vector<std::size_t>> pareto;  ///< by measure: settings by increasing time
    std::vector<EqualTime> equalTimes;  ///< empty where the time of sampling is not known
    /// The settings' times are those of the image alone: the renderer's are not known.
    bool imageTimesOnly = false;
};

SweepSummary summarize(const Sweep& sweep);

/// A wish from text "MEASURE=VALUE". Throws Error naming the measures there are.
struct SweepTarget {
    std::string measure;
    double value = 0;
};
SweepTarget parseTarget(const std::string& text);

/// The setting of least time whose mean error is at most the target, or nothing.
std::optional<std::size_t> cheapestSetting(const SweepSummary& summary, const SweepTarget& target);

/// What was found, for a terminal: errors, times, slopes, failures.
std::string toText(const SweepSummary& summary, const Sweep& sweep);

}  // namespace vlx
