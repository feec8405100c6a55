#include "reconstruct/drift/pipeline.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "reconstruct/common/methods.h"
#include "reconstruct/common/stage_clock.h"
#include "reconstruct/data/sampled_frame.h"
#include "reconstruct/drift/finishing.h"
#include "reconstruct/drift/half_resolution.h"
#include "reconstruct/drift/level.h"
#include "reconstruct/drift/residual_field.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

// Rows kept at each stage: what later stages look back at, and as far ahead as it is filled for them.
constexpr int kCorrectedRows = 88;  // and differences
constexpr int kCleanRows = 56;      // of 32 that go out together, and the light around them
constexpr int kFinishingRows = 72;  // and their sums

// What a process holds besides its rows, rounded up from 12 and 4 MB measured on Debian 12: the libraries
// that it maps, unless it holds more already, and what else it takes; and each thread's tiles.
constexpr std::uint64_t kProcessBytes = 25'000'000, kFurtherBytes = 10'000'000;
constexpr std::uint64_t kThreadBytes = 8'000'000;

Window scaled(const Window& window, int scale) {
    return {window.x * scale, window.y * scale, window.width * scale, window.height * scale};
}

/// Throws Error when the options are invalid, by themselves or for this dump.
void check(const SampleSource& dump, const Drift& options) {
    if (const auto broken = options.validate()) throw Error("", *broken);
    for (const Window& w : {dump.header().data, dump.header().display}) {
        const std::int64_t scale = options.scale;
        if (!isPossible(w.x * scale, w.y * scale, w.width * scale, w.height * scale))
            throw Error(dump.path(), "expected pixels within 2^30 of 0 after --scale " +
                                         std::to_string(scale) + ", found others: a smaller --scale helps");
    }
}

}  // namespace

/// The stages of the reconstruction, each a ring of rows that is filled just ahead of what the next one
/// needs: samples are gathered to pixels, these limited to data, which two levels krige; the picture of full
/// resolution is corrected by that of half the resolution, and finished.
class FrameKriging::Stages {
  public:
    Stages(const SampleSource& dump, const Drift& options, Frame& frame, ReconstructionReport& report,
           StageClock& clock)
        : path_(dump.path()),
          options_(options),
          report_(report),
          drift_(std::get<DriftReport>(report.method)),
          clock_(clock),
          frame_(frame),
          layout_(frame_.layout()),
          width_(frame_.width()),
          height_(frame_.height()),
          halved_(frame_.halved()),
          radiance_(layout_.radiance),
          fine_(layout_, options, false, frame_.fine(), drift_, clock_),
          differences_(width_, halved_ ? DifferencePlanes{radiance_}.channels() : 0, kept(kCorrectedRows)),
          corrected_(width_, halved_ ? CombinedPlanes{radiance_}.channels() : 0, kept(kCorrectedRows)),
          clean_(width_, CleanPlanes{radiance_}.channels(), kept(kCleanRows)),
          light_(width_, LightPlanes::kChannels, kept(kFinishingRows)),
          common_(width_, CommonErrorPlanes::kChannels, kept(kFinishingRows)),
          finishing_(layout_, options, frame_.picture(), fine_.rows(),
                     halved_ ? corrected_ : fine_.rows().combined, clean_, light_, common_) {
        if (halved_) {
            coarse_ = std::make_unique<Level>(layout_, options, true, frame_.coarse(), drift_, clock_);
            correction_ = std::make_unique<Correction>(radiance_, fine_.rows(), coarse_->rows(), differences_,
                                                       corrected_);
        }
        const Window window = driftOutline(dump, options).data;
        firstRow_ = window.y - scaled(dump.header().data, options.scale).y;
        endRow_ = firstRow_ + window.height;
        rows_ = Image({0, 0, width_, kept(kTile)},
                      std::vector<std::string>(static_cast<std::size_t>(radiance_ + 3)));
        startAbove(firstRow_);
        if (options.diagnostics)
            residuals_.emplace(width_, height_, window, options.inspect, fine_.rows(),
                               halved_ ? corrected_ : fine_.rows().combined, radiance_);
    }

    void run(const RowSink& sink, const Progress& progress) {
        while (finishedRows_ < endRow_) {
            finish(std::min(endRow_, finishedRows_ + kTile), sink);
            if (progress) progress(finishedRows_ - firstRow_, endRow_ - firstRow_);
        }
        const FrameCounts& counts = frame_.counts();
        counts.range.require(path_, "of the picture");
        report_.samples = counts.samples;
        report_.droppedSamples = counts.dropped;
        report_.emptyPixels = counts.empty;
        drift_.limitedSamples = counts.limited;
        drift_.farPixels = counts.farPixels;
        if (counts.luminance > 0) {
            drift_.energyRemoved = counts.removed / counts.luminance;
            drift_.energyReturned = returned_ / counts.luminance;
        }
        drift_.neighbourCorrelation = neighbours_.value();
        drift_.neighbourCorrelationError = neighbours_.standardError();
        drift_.light = 0;
        if (counts.light > 0) {
            drift_.light = imageLight_ / counts.light;
            // Of the samples as they came; where pixels have one sample, what their neighbours say of it.
            drift_.lightError = std::sqrt(std::max(counts.noise, lightNoise_)) / counts.light;
        }
        for (const auto& [stage, seconds] : drift_.seconds)
            (stage == "read" ? report_.readSeconds : report_.solveSeconds) += seconds;
    }

    /// Of all rows that are kept; none is taken yet when the pipeline is made.
    std::uint64_t ringBytes() const {
        std::uint64_t bytes = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(kept(kTile)) *
                              static_cast<std::uint64_t>(radiance_ + 3) * sizeof(float);
        for (const RowRing* ring : {&differences_, &corrected_, &clean_, &light_, &common_})
            bytes += ring->bytes();
        return bytes + frame_.ringBytes() + fine_.ringBytes() + (coarse_ ? coarse_->ringBytes() : 0);
    }

  private:
    /// Lets each stage start just far enough above row `first` for that row to be what it is in the whole
    /// image.
    void startAbove(int first) {
        finishedRows_ = first;
        cleanRows_ = std::max(0, first - LightReach::kNear);
        correctedRows_ = std::max(0, cleanRows_ - Finishing::kReach);
        differenceRows_ = std::max(0, correctedRows_ - Correction::kReach);
        const int fine = fine_.startAbove(halved_ ? fineAbove(differenceRows_) : correctedRows_);
        frame_.startAbove(fine, halved_ ? coarse_->startAbove(differenceRows_ / 2 - 1) : 0);
    }

    /// The first fine row that the correction of row y looks at, and the end of what it looks at.
    static int fineAbove(int y) { return std::max(0, 2 * (y / 2 - 1)); }
    static int fineBelow(int y) { return 2 * (y / 2 + 2); }

    /// How many of `rows` rows a ring of the whole image has use for.
    int kept(int rows) const { return std::min(rows, height_); }

    // Each stage fills rows up to (not including) `until`, cut to the image, after the stages that it needs.

    void correct(int until) {
        until = std::min(until, height_);
        if (!halved_) return fine_.combine(until);
        if (correctedRows_ >= until) return;
        const int differences = std::min(height_, until + Correction::kReach);
        fine_.combine(fineBelow(differences - 1));
        coarse_->combine((differences - 1) / 2 + 2);
        differences_.claim(differenceRows_, differences);
        parallelFor(differenceRows_, differences,
                    [&](std::int64_t y) { correction_->differenceRow(static_cast<int>(y)); });
        differenceRows_ = differences;
        corrected_.claim(correctedRows_, until);
        parallelFor(correctedRows_, until,
                    [&](std::int64_t y) { correction_->correctRow(static_cast<int>(y)); });
        correctedRows_ = until;
        clock_.addTo("combining");
    }

    void clean(int until) {
        until = std::min(until, height_);
        while (cleanRows_ < until) {  // few rows at a time: the rings hold no more
            const int end = std::min(until, cleanRows_ + kTile);
            correct(end + Finishing::kReach);
            for (RowRing* ring : {&clean_, &light_, &common_}) ring->claim(cleanRows_, end);
            parallelFor(cleanRows_, end, [&](std::int64_t y) {
                finishing_.cleanRow(static_cast<int>(y));
                finishing_.errorRow(static_cast<int>(y));
            });
            cleanRows_ = end;
            clock_.addTo("finishing");
        }
    }

    void finish(int until, const RowSink& sink) {
        until = std::min(until, height_);
        clean(until + LightReach::kNear);
        std::vector<Finishing::Counts> counts(static_cast<std::size_t>(until - finishedRows_));
        parallelFor(finishedRows_, until, [&](std::int64_t y) {
            const auto row = static_cast<int>(y) - finishedRows_;
            counts[static_cast<std::size_t>(row)] =
                finishing_.outputRow(static_cast<int>(y), rows_.at(0, row));
        });
        for (const Finishing::Counts& of : counts) {
            drift_.exactPixels += of.exact;
            returned_ += of.moved;
            imageLight_ += of.image;
            lightNoise_ += of.noise;
            neighbours_.add(of.neighbours);
        }
        for (int y = finishedRows_; y < until && residuals_; ++y) residuals_->addRow(y, drift_);
        requireNumbers(until - finishedRows_);
        clock_.addTo("finishing");
        sink(rows_.pixels.data(), until - finishedRows_);
        finishedRows_ = until;
        clock_.addTo("output");
    }

    /// Samples that are no numbers are left out: none can come of the others but by a fault here, and a
    /// picture with holes must not pass for one.
    void requireNumbers(int count) const {
        const int channels = rows_.channelCount();
        for (int row = 0; row < count; ++row)
            for (int x = 0; x < width_; ++x)
                for (int c = 0; c < channels; ++c)
                    if (!std::isfinite(rows_.at(x, row)[c]))
                        throw Error(path_, "expected numbers, computed one that is not in row " +
                                               std::to_string(finishedRows_ + row) + ", column " +
                                               std::to_string(x) +
                                               ": a fault of this program, please report it; --method mean "
                                               "averages these samples");
    }

    std::string path_;
    const Drift& options_;
    ReconstructionReport& report_;
    DriftReport& drift_;  // in it
    StageClock& clock_;
    Frame& frame_;
    const SampleLayout& layout_;
    int width_, height_;
    bool halved_;  // large enough for a coarse level
    int radiance_;
    Level fine_;
    std::unique_ptr<Level> coarse_;
    RowRing differences_, corrected_;
    std::unique_ptr<Correction> correction_;
    RowRing clean_, light_, common_;
    Finishing finishing_;
    std::optional<ResidualField> residuals_;
    int firstRow_ = 0, endRow_ = 0;  // of the band
    int differenceRows_ = 0, correctedRows_ = 0, cleanRows_ = 0, finishedRows_ = 0;
    double returned_ = 0, imageLight_ = 0, lightNoise_ = 0;  // Finishing::Counts
    NoiseCorrelation neighbours_;
    Image rows_;  // finished, on their way out
};

FrameKriging::FrameKriging(const SampleSource& dump, const Drift& options, Frame& frame,
                           ReconstructionReport& report, StageClock& clock)
    : stages_(std::make_unique<Stages>(dump, options, frame, report, clock)) {}

FrameKriging::~FrameKriging() = default;

std::uint64_t FrameKriging::ringBytes() const { return stages_->ringBytes(); }

void FrameKriging::run(const RowSink& sink, const Progress& progress) { stages_->run(sink, progress); }

std::uint64_t bytesBesideRows() {
    return std::max(kProcessBytes, residentMemory() + kFurtherBytes) +
           kThreadBytes * static_cast<std::uint64_t>(threadCount());
}

std::optional<std::string> Drift::validate() const {
    if (!(strength >= 0 && strength <= 1))
        return "expected a strength of 0 to 1, found " + std::to_string(strength);
    if (secondOpinion && (scale != 1 || strength != 1 || !radiance.empty()))
        return "expected no scale, strength or radiance with another denoiser's image, which has none";
    if (temporal < 0 || temporal > kMostTemporal)
        return "expected 0 to " + std::to_string(kMostTemporal) + " frames on either side, found " +
               std::to_string(temporal);
    if (temporal > 0 && secondOpinion)
        return "expected no other denoiser's image with frames of a sequence, which its errors were not of";
    if (temporal > 0 && diagnostics) return "expected no diagnostics with frames of a sequence";
    if (scale < 1 || scale > 4) return "expected a scale of 1 to 4, found " + std::to_string(scale);
    if (band.count < 1 || band.index < 0 || band.index >= band.count)
        return "expected a band from 1 to " + std::to_string(band.count) + ", found " +
               std::to_string(band.index + 1);
    if (diagnostics && band.count > 1) return "expected no band with diagnostics: regions would be cut";
    if (fireflies == Fireflies::Clamp && !(clamp > 0 && std::isfinite(clamp)))
        return "expected a luminance above 0 to clamp at, found " + std::to_string(clamp);
    return std::nullopt;
}

Image driftOutline(const SampleSource& dump, const Drift& options) {
    check(dump, options);
    Image image;
    image.data = bandOf(scaled(dump.header().data, options.scale), options.band);
    if (options.band.count > dump.header().data.height * options.scale)
        throw Error(dump.path(), "expected at least as many rows as bands, found " +
                                     std::to_string(dump.header().data.height * options.scale) +
                                     " rows and " + std::to_string(options.band.count) + " bands");
    requireInside(options.inspect, image.data, dump.path());
    image.display = scaled(dump.header().display, options.scale);
    image.channels = {"R", "G", "B"};
    if (findChannel(dump.header(), "A") >= 0) image.channels.emplace_back("A");
    const std::vector<std::string> further = furtherRadiance(dump.header(), options);
    image.channels.insert(image.channels.end(), further.begin(), further.end());
    image.channels.insert(image.channels.end(), std::begin(kStddevChannels), std::end(kStddevChannels));
    return image;
}

ReconstructionReport reconstructDrift(const SampleSource& dump, const Drift& options, const RowSink& sink,
                                      const Progress& progress) {
    if (options.temporal > 0) throw Error(dump.path(), "expected a Sequence for frames around this one");
    ReconstructionReport report;
    StageClock clock(report.method.emplace<DriftReport>().seconds);
    SampledFrame samples(dump, options, Kept::Rows, clock);
    FrameKriging kriging(dump, options, samples.frame(), report, clock);
    requireMemory(dump.path(), kriging.ringBytes(), "rows as wide as these");
    if (options.maxMemory > 0) samples.readWithin(options.maxMemory, bytesBesideRows() + kriging.ringBytes());
    const Window own = driftOutline(dump, options).data;
    const int first = own.y - dump.header().data.y * options.scale;
    samples.own(first, first + own.height);
    kriging.run(sink, progress);
    return report;
}

}  // namespace vlx
