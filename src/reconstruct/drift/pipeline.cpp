#include <algorithm>
#include <cmath>
#include <memory>

#include "reconstruct/common/methods.h"
#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/pixel_statistics.h"
#include "reconstruct/common/rebin.h"
#include "reconstruct/common/stage_clock.h"
#include "reconstruct/drift/finishing.h"
#include "reconstruct/drift/half_resolution.h"
#include "reconstruct/drift/level.h"
#include "reconstruct/drift/pixel_data.h"
#include "reconstruct/drift/prefilter.h"
#include "reconstruct/drift/residual_field.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/base/parallel.h"
#include "variolux/geostat/random_drift.h"

namespace vlx {

namespace {

constexpr int kReadRows = 16;
constexpr int kFilledRows = 32;  // pixels of data filled at a time
// Rows kept at each stage: what later stages look back at, and as far ahead as it is filled for them.
constexpr int kGatheredRows = 64;   // those filled, 11 around them, and those read at a time
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

/// The stages of the reconstruction, each a ring of rows that is filled just ahead of what the next one
/// needs: samples are gathered to pixels, these limited to data, which two levels krige; the picture of full
/// resolution is corrected by that of half the resolution, and finished.
class Pipeline {
  public:
    Pipeline(const SampleSource& dump, const Drift& options, const RowSink& sink, const Progress& progress)
        : dump_(dump),
          options_(options),
          sink_(sink),
          progress_(progress),
          layout_(layoutOf(dump, options)),
          planes_{layout_.radiance, layout_.features},
          width_(dump.header().data.width * options.scale),
          height_(dump.header().data.height * options.scale),
          halved_(options.steps.halfResolution && std::min(width_, height_) >= kLeastHalved),
          readRows_(kReadRows / options.scale),
          radiance_(layout_.radiance),
          drift_(report_.method.emplace<DriftReport>()),
          clock_(drift_.seconds),
          picture_(measurePictureScale(dump, layout_)),
          gathered_(width_, planes_.channels(), kept(kGatheredRows)),
          fine_(
              layout_, options.steps, planOf(options.quality, false), width_, height_, halved_, picture_,
              [this](int until) { fill(until); }, drift_, clock_),
          pixels_(dump, layout_, planes_, picture_, options.scale, width_, height_,
                  options.fireflies == Fireflies::Robust, gathered_, fine_.pixels()),
          differences_(width_, halved_ ? DifferencePlanes{radiance_}.channels() : 0, kept(kCorrectedRows)),
          corrected_(width_, halved_ ? CombinedPlanes{radiance_}.channels() : 0, kept(kCorrectedRows)),
          clean_(width_, CleanPlanes{radiance_}.channels(), kept(kCleanRows)),
          light_(width_, LightPlanes::kChannels, kept(kFinishingRows)),
          common_(width_, CommonErrorPlanes::kChannels, kept(kFinishingRows)),
          finishing_(layout_, options, picture_, fine_.rows(), halved_ ? corrected_ : fine_.rows().combined,
                     clean_, light_, common_) {
        if (halved_) {
            coarse_ = std::make_unique<Level>(
                layout_, options.steps, planOf(options.quality, true), (width_ + 1) / 2, (height_ + 1) / 2, 0,
                picture_, [this](int until) { fill(2 * until); }, drift_, clock_);
            fine_.lookAt(*coarse_);
            correction_ = std::make_unique<Correction>(radiance_, fine_.rows(), coarse_->rows(), differences_,
                                                       corrected_);
        }
        requireMemory(dump.path(), ringBytes(), "rows as wide as these");
        if (options.maxMemory > 0) limitRowsRead();
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

    ReconstructionReport run() {
        while (finishedRows_ < endRow_) {
            finish(std::min(endRow_, finishedRows_ + kTile));
            if (progress_) progress_(finishedRows_ - firstRow_, endRow_ - firstRow_);
        }
        if (luminance_ > 0) {
            drift_.energyRemoved = removed_ / luminance_;
            drift_.energyReturned = returned_ / luminance_;
        }
        drift_.light = 0;
        if (samplesLight_ > 0) {
            drift_.light = imageLight_ / samplesLight_;
            // Of the samples as they came; where pixels have one sample, what their neighbours say of it.
            drift_.lightError = std::sqrt(std::max(sampleNoise_, lightNoise_)) / samplesLight_;
        }
        for (const auto& [stage, seconds] : drift_.seconds)
            (stage == "read" ? report_.readSeconds : report_.solveSeconds) += seconds;
        return std::move(report_);
    }

  private:
    static SampleLayout layoutOf(const SampleSource& dump, const Drift& options) {
        SampleLayout layout = chooseSampleLayout(dump, options);
        if (layout.features + 5 > kMaxRandomDrift || layout.radiance > kMaxRandomDrift)
            throw Error(dump.path(), "expected at most " + std::to_string(kMaxRandomDrift - 5) +
                                         " features and " + std::to_string(kMaxRandomDrift) +
                                         " radiance channels, found " + std::to_string(layout.features) +
                                         " and " + std::to_string(layout.radiance));
        return layout;
    }

    /// Lets each stage start just far enough above row `first` for that row to be what it is in the whole
    /// image.
    void startAbove(int first) {
        finishedRows_ = first;
        cleanRows_ = std::max(0, first - LightReach::kNear);
        correctedRows_ = std::max(0, cleanRows_ - Finishing::kAlikeReach);
        differenceRows_ = std::max(0, correctedRows_ - Correction::kReach);
        int filled = fine_.startAbove(halved_ ? fineAbove(differenceRows_) : correctedRows_);
        if (halved_) filled = std::min(filled, 2 * coarse_->startAbove(differenceRows_ / 2 - 1));
        filledRows_ = filled / 2 * 2;
        gatheredRows_ =
            std::max(0, filledRows_ - PixelData::reach(options_.scale)) / options_.scale * options_.scale;
    }

    /// The first fine row that the correction of row y looks at, and the end of what it looks at.
    static int fineAbove(int y) { return std::max(0, 2 * (y / 2 - 1)); }
    static int fineBelow(int y) { return 2 * (y / 2 + 2); }

    /// How many of `rows` rows a ring of the whole image has use for.
    int kept(int rows) const { return std::min(rows, height_); }

    /// Of all rows that are kept; none is taken yet when the pipeline is made.
    std::uint64_t ringBytes() const {
        std::uint64_t bytes = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(kept(kTile)) *
                              static_cast<std::uint64_t>(radiance_ + 3) * sizeof(float);
        for (const RowRing* ring : {&gathered_, &differences_, &corrected_, &clean_, &light_, &common_})
            bytes += ring->bytes();
        return bytes + fine_.ringBytes() + (coarse_ ? coarse_->ringBytes() : 0);
    }

    /// Chooses how many rows are read at a time by options_.maxMemory and the fullest row of the dump.
    void limitRowsRead() {
        const Window& data = dump_.header().data;
        std::uint64_t samples = 0;
        bool gaps = false;
        for (int y = data.y; y < data.y + data.height; ++y) {
            std::uint64_t ofRow = 0;
            for (const std::uint32_t n : dump_.counts(y, 1)) {
                ofRow += n;
                gaps = gaps || n == 0;
            }
            samples = std::max(samples, ofRow);
        }
        const std::uint64_t held = std::max(kProcessBytes, residentMemory() + kFurtherBytes) + ringBytes() +
                                   kThreadBytes * static_cast<std::uint64_t>(threadCount()) +
                                   (gaps ? GapField::bytes(dump_, layout_) : 0);
        // The values of a row, twice where they are sorted into parts of pixels; and, on each thread that
        // unpacks one, all its channels packed and unpacked.
        const auto width = static_cast<std::uint64_t>(data.width);
        const std::uint64_t values =
            (samples * layout_.names.size() * 4 + width * 16) * (options_.scale > 1 ? 2 : 1);
        const std::uint64_t unpacking = samples * dump_.header().channels.size() * 8 + width * 8;
        const auto needed = [&](int rows) {
            return held + static_cast<std::uint64_t>(rows) * values +
                   static_cast<std::uint64_t>(std::min(rows, threadCount())) * unpacking;
        };
        readRows_ = kReadRows / options_.scale;
        while (readRows_ > 1 && needed(readRows_) > options_.maxMemory) --readRows_;
        if (needed(readRows_) > options_.maxMemory)
            throw Error(dump_.path(), "expected a memory limit of at least " +
                                          std::to_string((needed(readRows_) + 999'999) / 1'000'000) +
                                          "M for rows as wide and full as these, found " +
                                          std::to_string(options_.maxMemory / 1'000'000) + "M");
    }

    bool own(int y) const { return y >= firstRow_ && y < endRow_; }

    // Each stage fills rows up to (not including) `until`, cut to the image, after the stages that it needs.

    void gather(int until) {
        until = std::min(until, height_);
        while (gatheredRows_ < until) {
            const int scale = options_.scale, first = gatheredRows_;
            const int sourceRows = std::min(readRows_, (height_ - first) / scale);
            const int rows = sourceRows * scale;
            const SampleBand band = readRows(dump_, layout_, scale, first / scale, sourceRows);
            clock_.addTo("read");
            std::vector<GatherCounts> counts(static_cast<std::size_t>(rows));
            const double clamp = options_.fireflies == Fireflies::Clamp ? options_.clamp : 0;
            gathered_.claim(first, first + rows);
            parallelFor(0, rows, [&](std::int64_t row) {
                counts[static_cast<std::size_t>(row)] =
                    gatherRow(band, layout_, planes_, static_cast<int>(row), clamp, gathered_,
                              first + static_cast<int>(row));
            });
            for (int row = 0; row < rows; ++row) {
                if (!own(first + row)) continue;
                const GatherCounts& of = counts[static_cast<std::size_t>(row)];
                report_.samples += of.samples;
                report_.droppedSamples += of.dropped;
                report_.emptyPixels += of.empty;
                drift_.limitedSamples += of.limited;
                luminance_ += of.luminance;
                removed_ += of.removed;
                samplesLight_ += of.light;
                sampleNoise_ += of.noise;
            }
            gatheredRows_ += rows;
            clock_.addTo("statistics");
        }
    }

    /// Data of both levels.
    void fill(int until) {
        until = std::min(until, height_);
        while (filledRows_ < until) {
            const int first = filledRows_, end = std::min(height_, first + kFilledRows);
            gather(end + PixelData::reach(options_.scale));
            pixels_.prepare(first, end);
            fine_.pixels().claim(first, end);
            std::vector<LimitedRow> limited(static_cast<std::size_t>(end - first));
            parallelFor(first, end, [&](std::int64_t y) {
                limited[static_cast<std::size_t>(y - first)] = pixels_.fillRow(static_cast<int>(y));
            });
            for (int y = first; y < end; ++y) {
                if (!own(y)) continue;
                const LimitedRow& of = limited[static_cast<std::size_t>(y - first)];
                drift_.limitedSamples += of.samples;
                drift_.farPixels += of.farPixels;
                removed_ += of.luminance;
            }
            if (coarse_) {
                coarse_->pixels().claim(first / 2, (end + 1) / 2);
                parallelFor(first / 2, (end + 1) / 2, [&](std::int64_t y) {
                    halveRow(fine_.pixels(), width_, height_, radiance_, layout_.features,
                             static_cast<int>(y), coarse_->pixels());
                });
            }
            filledRows_ = end;
            clock_.addTo("statistics");
        }
    }

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
            correct(end + Finishing::kAlikeReach);
            for (RowRing* ring : {&clean_, &light_, &common_}) ring->claim(cleanRows_, end);
            parallelFor(cleanRows_, end, [&](std::int64_t y) {
                finishing_.cleanRow(static_cast<int>(y));
                finishing_.errorRow(static_cast<int>(y));
            });
            cleanRows_ = end;
            clock_.addTo("finishing");
        }
    }

    void finish(int until) {
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
        }
        for (int y = finishedRows_; y < until && residuals_; ++y) residuals_->addRow(y, drift_);
        clock_.addTo("finishing");
        sink_(rows_.pixels.data(), until - finishedRows_);
        finishedRows_ = until;
        clock_.addTo("output");
    }

    const SampleSource& dump_;
    const Drift& options_;
    const RowSink& sink_;
    const Progress& progress_;
    SampleLayout layout_;
    GatheredPlanes planes_;
    int width_, height_;
    bool halved_;  // large enough for a coarse level
    int readRows_, radiance_;
    ReconstructionReport report_;
    DriftReport& drift_;  // in it
    StageClock clock_;
    PictureScale picture_;
    RowRing gathered_;
    Level fine_;
    std::unique_ptr<Level> coarse_;
    PixelData pixels_;
    RowRing differences_, corrected_;
    std::unique_ptr<Correction> correction_;
    RowRing clean_, light_, common_;
    Finishing finishing_;
    std::optional<ResidualField> residuals_;
    int firstRow_ = 0, endRow_ = 0;  // of the band
    int gatheredRows_ = 0, filledRows_ = 0, differenceRows_ = 0, correctedRows_ = 0, cleanRows_ = 0,
        finishedRows_ = 0;
    double luminance_ = 0, removed_ = 0, returned_ = 0;
    double samplesLight_ = 0, sampleNoise_ = 0;  // GatherCounts
    double imageLight_ = 0, lightNoise_ = 0;     // Finishing::Counts
    Image rows_;                                 // finished, on their way out
};

}  // namespace

std::optional<std::string> Drift::validate() const {
    if (!(strength >= 0 && strength <= 1))
        return "expected a strength of 0 to 1, found " + std::to_string(strength);
    if (secondOpinion && (scale != 1 || strength != 1 || !radiance.empty()))
        return "expected no scale, strength or radiance with another denoiser's image, which has none";
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
    return Pipeline(dump, options, sink, progress).run();
}

}  // namespace vlx
