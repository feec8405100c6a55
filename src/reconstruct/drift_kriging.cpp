#include "variolux/reconstruct/drift_kriging.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "combination.h"
#include "neighbourhoods.h"
#include "picture_scale.h"
#include "pixel_data.h"
#include "pixel_statistics.h"
#include "prefilter.h"
#include "rebin.h"
#include "stacking.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/base/parallel.h"
#include "variolux/geostat/random_drift.h"

namespace vlx {

namespace {

constexpr int kReadRows = 16;
// Rows kept at each stage: what later stages look back at, and as far ahead as it is filled for them. With
// tiles of 32 rows, centres that reach 15 and patches that reach 3, data are filled 160 rows ahead of the row
// that is combined; the others are used up earlier.
constexpr int kDataRows = 192;
constexpr int kGatheredRows = 128;
constexpr int kFeatureRows = 128;  // and variances
constexpr int kSumRows = 128;
constexpr int kEstimateRows = 64;  // and moments

// What a process holds besides its rows, rounded up from 135 and 4 MB measured on Debian 12: the libraries
// that it maps, and each thread's tiles.
constexpr std::uint64_t kProcessBytes = 150'000'000;
constexpr std::uint64_t kThreadBytes = 8'000'000;

/// The last one is the small one, which the first is shrunk towards.
std::vector<NeighbourhoodModel> modelsOf(Quality quality) {
    switch (quality) {
        case Quality::Draft:
            return {{8, 0.8f, 6, true}};
        case Quality::Standard:
            break;
        case Quality::High:
            return {{8, 0.8f, 2, true}, {15, 3.f, 3, false}, {4, 1.f, 2, false}};
    }
    return {{8, 0.8f, 4, true}, {15, 3.f, 5, false}, {4, 1.f, 3, false}};
}

Window scaled(const Window& window, int scale) {
    return {window.x * scale, window.y * scale, window.width * scale, window.height * scale};
}

/// Throws Error when the options are invalid, by themselves or for this dump.
void check(const SampleSource& dump, const DriftKrigingOptions& options) {
    if (const auto broken = options.validate()) throw Error("", *broken);
    for (const Window& w : {dump.header().data, dump.header().display}) {
        const std::int64_t scale = options.scale;
        if (!isPossible(w.x * scale, w.y * scale, w.width * scale, w.height * scale))
            throw Error(dump.path(), "expected pixels within 2^30 of 0 after --scale " +
                                         std::to_string(scale) + ", found others: a smaller --scale helps");
    }
}

class Stopwatch {
  public:
    /// Adds the time since the last call (or construction) to `seconds`.
    void addTo(double& seconds) {
        const auto now = std::chrono::steady_clock::now();
        seconds += std::chrono::duration<double>(now - last_).count();
        last_ = now;
    }

  private:
    std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// The stages of the reconstruction, each a ring of rows that is filled just ahead of what the next one
/// needs.
class Pipeline {
  public:
    Pipeline(const SampleSource& dump, const DriftKrigingOptions& options, const RowSink& sink,
             const Progress& progress)
        : dump_(dump),
          options_(options),
          sink_(sink),
          progress_(progress),
          layout_(chooseSampleLayout(dump, options)),
          planes_(layout_),
          models_(modelsOf(options.quality)),
          width_(dump.header().data.width * options.scale),
          height_(dump.header().data.height * options.scale),
          readRows_(kReadRows / options.scale),
          radiance_(layout_.radiance),
          gathered_(width_, planes_.channels, kept(kGatheredRows)),
          data_(width_, DataPlanes{radiance_}.channels(), kept(kDataRows)),
          squares_(width_, kSquaresPlanes, kept(kDataRows)),
          features_(width_, 2 * layout_.features, kept(kFeatureRows)),
          variances_(width_, 3, kept(kFeatureRows)),
          moments_(width_, Combination::momentPlanes(static_cast<int>(models_.size())), kept(kEstimateRows)),
          picture_(measurePictureScale(dump, layout_)),
          pixels_(dump, layout_, planes_, options.scale, width_, height_,
                  options.fireflies == Fireflies::Robust, gathered_, data_, squares_),
          combination_(radiance_, layout_.alpha, options.strength, options.scale, width_, height_, picture_,
                       data_, features_, layout_.features, variances_, estimates_, moments_) {
        if (layout_.features + 5 > kMaxRandomDrift || radiance_ > kMaxRandomDrift)
            throw Error(dump.path(), "expected at most " + std::to_string(kMaxRandomDrift - 5) +
                                         " features and " + std::to_string(kMaxRandomDrift) +
                                         " radiance channels, found " + std::to_string(layout_.features) +
                                         " and " + std::to_string(radiance_));
        const EstimatePlanes planes{radiance_};
        for (std::size_t m = 0; m < models_.size(); ++m) {
            sums_.emplace_back(width_, planes.channels(), kept(kSumRows));
            estimates_.emplace_back(width_, 2 * radiance_ + 3, kept(kEstimateRows));
        }
        requireMemory(dump.path(), ringBytes(), "rows as wide as these");
        if (options.maxMemory > 0) limitRowsRead();
        const Window window = driftKrigingOutline(dump, options).data;
        firstRow_ = window.y - scaled(dump.header().data, options.scale).y;
        endRow_ = firstRow_ + window.height;
        rows_ = Image({0, 0, width_, kept(kTile)},
                      std::vector<std::string>(static_cast<std::size_t>(radiance_ + 3)));
        startAbove(firstRow_);
    }

    ReconstructionReport run() {
        while (combinedRows_ < endRow_) {
            combine(std::min(endRow_, combinedRows_ + kTile));
            if (progress_) progress_(combinedRows_ - firstRow_, endRow_ - firstRow_);
        }
        for (const auto& [stage, seconds] : report_.seconds)
            (stage == "read" ? report_.readSeconds : report_.solveSeconds) += seconds;
        return std::move(report_);
    }

  private:
    /// Lets each stage start just far enough above row `first` for that row to be what it is in the whole
    /// image: as far as stages look back, in whole tiles where they work by tiles.
    void startAbove(int first) {
        const auto tileAbove = [](int row) { return std::max(0, row) / kTile * kTile; };
        combinedRows_ = first;
        finishedRows_ = std::max(0, first - kStackReach);
        krigedRows_ = tileAbove(finishedRows_ - kMaxReach);
        zeroedRows_ = std::max(0, krigedRows_ - kMaxReach);
        varianceRows_ = std::max(0, krigedRows_ - kTileMargin);
        featureRows_ = tileAbove(varianceRows_ - kVarianceReach);
        dataRows_ = std::max(0, featureRows_ - kTileMargin);
        gatheredRows_ =
            std::max(0, dataRows_ - PixelData::reach(options_.scale)) / options_.scale * options_.scale;
    }

    /// How many of `rows` rows a ring of the whole image has use for.
    int kept(int rows) const { return std::min(rows, height_); }

    /// Of all rows that are kept; none is taken yet when the pipeline is made.
    std::uint64_t ringBytes() const {
        std::uint64_t bytes = static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(kept(kTile)) *
                              static_cast<std::uint64_t>(radiance_ + 3) * sizeof(float);
        for (const RowRing* ring : {&gathered_, &data_, &squares_, &features_, &variances_, &moments_})
            bytes += ring->bytes();
        for (const auto* list : {&sums_, &estimates_})
            for (const RowRing& ring : *list) bytes += ring.bytes();
        return bytes;
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
        const std::uint64_t held = kProcessBytes + ringBytes() +
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
            watch_.addTo(report_.seconds["read"]);
            std::vector<GatherCounts> counts(static_cast<std::size_t>(rows));
            const double clamp = options_.fireflies == Fireflies::Clamp ? options_.clamp : 0;
            parallelFor(0, rows, [&](std::int64_t row) {
                counts[static_cast<std::size_t>(row)] =
                    gatherRow(band, layout_, planes_, static_cast<int>(row), clamp, gathered_,
                              first + static_cast<int>(row));
            });
            ReconstructionReport& report = report_;
            for (int row = 0; row < rows; ++row) {
                if (!own(first + row)) continue;
                const GatherCounts& of = counts[static_cast<std::size_t>(row)];
                report.samples += of.samples;
                report.droppedSamples += of.dropped;
                report.emptyPixels += of.empty;
                report.limitedSamples += of.limited;
                luminance_ += of.luminance;
                removed_ += of.removed;
            }
            gatheredRows_ += rows;
            watch_.addTo(report.seconds["statistics"]);
        }
    }

    /// Means of the halves without fireflies, sums of squares, and their degrees of freedom.
    void limit(int until) {
        until = std::min(until, height_);
        if (dataRows_ >= until) return;
        gather(until + PixelData::reach(options_.scale));
        const int first = dataRows_;
        pixels_.prepare(first, until);
        std::vector<LimitedRow> limited(static_cast<std::size_t>(until - first));
        parallelFor(first, until, [&](std::int64_t y) {
            limited[static_cast<std::size_t>(y - first)] = pixels_.fillRow(static_cast<int>(y));
        });
        for (int y = first; y < until; ++y) {
            if (!own(y)) continue;
            const LimitedRow& of = limited[static_cast<std::size_t>(y - first)];
            report_.limitedSamples += of.samples;
            report_.farPixels += of.farPixels;
            removed_ += of.luminance;
        }
        report_.energyRemoved = luminance_ > 0 ? removed_ / luminance_ : 0;
        dataRows_ = until;
        watch_.addTo(report_.seconds["statistics"]);
    }

    void prefilter(int until) {
        until = std::min(until, height_);
        while (featureRows_ < until) {
            limit(featureRows_ + kTile + kTileMargin);
            const int y = featureRows_;
            parallelFor(0, (width_ + kTile - 1) / kTile, [&](std::int64_t tile) {
                prefilterFeatures(gathered_, layout_, planes_, static_cast<int>(tile) * kTile, y, width_,
                                  height_, features_);
            });
            featureRows_ = std::min(height_, featureRows_ + kTile);
            watch_.addTo(report_.seconds["features"]);
        }
    }

    void smooth(int until) {
        until = std::min(until, height_);
        if (varianceRows_ >= until) return;
        prefilter(until + kVarianceReach);
        limit(until + kVarianceReach);
        parallelFor(varianceRows_, until, [&](std::int64_t y) {
            smoothVariances(squares_, data_, {radiance_}, features_, layout_.features, picture_,
                            static_cast<int>(y), width_, height_, variances_);
        });
        varianceRows_ = until;
        watch_.addTo(report_.seconds["variances"]);
    }

    /// Neighbourhoods centred in rows up to `until`.
    void krige(int until) {
        until = std::min(until, height_);
        while (krigedRows_ < until) {
            const int y = krigedRows_;
            smooth(y + kTile + kTileMargin);
            TileInput input{&data_,        &features_,     &variances_, {radiance_}, layout_.features,
                            layout_.group, layout_.groups, width_,      height_};
            // Rows that this tile row is the first to reach.
            for (RowRing& ring : sums_)
                for (int row = zeroedRows_; row < std::min(height_, y + kTile + kMaxReach); ++row)
                    std::fill_n(ring.row(0, row), width_ * ring.channels(), 0.f);
            zeroedRows_ = std::min(height_, y + kTile + kMaxReach);
            const int tiles = (width_ + kTile - 1) / kTile;
            std::vector<NeighbourhoodCounts> counts(static_cast<std::size_t>(tiles));
            for (int phase = 0; phase < 2; ++phase)  // tiles of one phase do not reach each other's pixels
                parallelFor(0, (tiles + 1 - phase) / 2, [&](std::int64_t i) {
                    const int tile = 2 * static_cast<int>(i) + phase;
                    counts[static_cast<std::size_t>(tile)] =
                        krigeTile(input, models_, tile * kTile, y, sums_);
                });
            ReconstructionReport& report = report_;
            for (const NeighbourhoodCounts& of : counts) {
                report.neighbourhoods += of.neighbourhoods;
                report.ownNeighbourhoods += of.own;
                report.failedNeighbourhoods += of.failed;
                report.driftFunctions += of.effective;
                report.driftFeatures += of.features;
            }
            krigedRows_ = std::min(height_, krigedRows_ + kTile);
            watch_.addTo(report.seconds["kriging"]);
        }
    }

    /// Estimates of the halves and spread of each model, and the moments of stacking.
    void finish(int until) {
        until = std::min(until, height_);
        if (finishedRows_ >= until) return;
        krige(until + kMaxReach);
        parallelFor(finishedRows_, until, [&](std::int64_t y) {
            for (std::size_t m = 0; m < models_.size(); ++m) finishRow(m, static_cast<int>(y));
            if (models_.size() > 1) shrinkRow(static_cast<int>(y));
            combination_.momentsRow(static_cast<int>(y));
        });
        finishedRows_ = until;
        watch_.addTo(report_.seconds["combining"]);
    }

    void finishRow(std::size_t m, int y) {
        const EstimatePlanes planes{radiance_};
        const DataPlanes data{radiance_};
        for (int x = 0; x < width_; ++x) {
            double variance[3] = {};
            double perSample = 1e-300;  // of noise, over colours
            for (int c = 0; c < 3; ++c) perSample += static_cast<double>(variances_.row(c, y)[x]) / 3;
            for (int half = 0; half < 2; ++half) {
                const int first = half * planes.perHalf();
                // A half without data here takes the other's estimate.
                int from = first;
                if (sums_[m].row(first, y)[x] <= 0) from = planes.perHalf() - first;
                const double weight = sums_[m].row(from, y)[x];
                for (int c = 0; c < radiance_; ++c) {
                    if (weight <= 0) {  // no neighbourhood with data reaches it
                        estimates_[m].row(half * radiance_ + c, y)[x] = data_.row(data.mean(half) + c, y)[x];
                        if (c < 3) variance[c] += 2 * static_cast<double>(variances_.row(c, y)[x]);
                        continue;
                    }
                    const double shift = sums_[m].row(from + planes.sum(c), y)[x] / weight;
                    estimates_[m].row(half * radiance_ + c, y)[x] =
                        static_cast<float>(reference(data_, data, c, x, y) + shift);
                    if (c >= 3) continue;
                    const double spread =
                        std::max(0.0, sums_[m].row(from + planes.square(c), y)[x] / weight - shift * shift);
                    const double kriging = sums_[m].row(from + planes.variance(), y)[x] / weight;
                    const double own = kriging * static_cast<double>(variances_.row(c, y)[x]) / perSample;
                    variance[c] += spread + std::max(0.0, own - spread) / 2;
                }
            }
            for (int c = 0; c < 3; ++c)
                estimates_[m].row(2 * radiance_ + c, y)[x] = static_cast<float>(variance[c] / 4);
        }
    }

    /// The first model towards the small one, pixel by pixel: a pixel with unlike features all around is left
    /// with its own noisy mean, an outlier for one.
    void shrinkRow(int y) {
        RowRing &first = estimates_.front(), &small = estimates_.back();
        for (int x = 0; x < width_; ++x) {
            double apart = 0, variance = 0;
            for (int c = 0; c < 3; ++c) {
                const double a = first.row(c, y)[x], b = first.row(radiance_ + c, y)[x];
                const double d = (a + b - small.row(c, y)[x] - small.row(radiance_ + c, y)[x]) / 2;
                apart += d * d;
                variance += (a - b) * (a - b) / 4;
            }
            const auto kept = static_cast<float>(shrinkage(apart, variance));
            for (int k = 0; k < 2 * radiance_; ++k) {
                const float towards = small.row(k, y)[x];
                first.row(k, y)[x] = towards + kept * (first.row(k, y)[x] - towards);
            }
        }
    }

    void combine(int until) {
        until = std::min(until, height_);
        finish(until + kStackReach);
        std::vector<std::int64_t> exact(static_cast<std::size_t>(until - combinedRows_));
        parallelFor(combinedRows_, until, [&](std::int64_t y) {
            const auto row = static_cast<int>(y) - combinedRows_;
            exact[static_cast<std::size_t>(row)] =
                combination_.combineRow(static_cast<int>(y), rows_.at(0, row));
        });
        for (const std::int64_t of : exact) report_.exactPixels += of;
        watch_.addTo(report_.seconds["combining"]);
        sink_(rows_.pixels.data(), until - combinedRows_);
        combinedRows_ = until;
        watch_.addTo(report_.seconds["output"]);
    }

    const SampleSource& dump_;
    const DriftKrigingOptions& options_;
    const RowSink& sink_;
    const Progress& progress_;
    SampleLayout layout_;
    GatheredPlanes planes_;
    std::vector<NeighbourhoodModel> models_;
    int width_, height_, readRows_, radiance_;
    RowRing gathered_;
    RowRing data_;     // pixel_data.h
    RowRing squares_;  // sums of squares of R, G, B; their degrees of freedom
    RowRing features_, variances_;
    std::vector<RowRing> sums_, estimates_;  // of each model; estimates_: A, B, spread of R, G, B
    RowRing moments_;
    PictureScale picture_;
    PixelData pixels_;
    Combination combination_;
    int firstRow_ = 0, endRow_ = 0;  // of the band
    int gatheredRows_ = 0, dataRows_ = 0, featureRows_ = 0, varianceRows_ = 0, krigedRows_ = 0,
        zeroedRows_ = 0, finishedRows_ = 0, combinedRows_ = 0;
    double luminance_ = 0, removed_ = 0;
    Stopwatch watch_;
    Image rows_;  // finished, on their way out
    ReconstructionReport report_;
};

}  // namespace

std::optional<std::string> DriftKrigingOptions::validate() const {
    if (!(strength >= 0 && strength <= 1))
        return "expected a strength of 0 to 1, found " + std::to_string(strength);
    if (scale < 1 || scale > 4) return "expected a scale of 1 to 4, found " + std::to_string(scale);
    if (band.count < 1 || band.index < 0 || band.index >= band.count)
        return "expected a band from 1 to " + std::to_string(band.count) + ", found " +
               std::to_string(band.index + 1);
    if (fireflies == Fireflies::Clamp && !(clamp > 0 && std::isfinite(clamp)))
        return "expected a luminance above 0 to clamp at, found " + std::to_string(clamp);
    return std::nullopt;
}

Image driftKrigingOutline(const SampleSource& dump, const DriftKrigingOptions& options) {
    check(dump, options);
    Image image;
    image.data = bandOf(scaled(dump.header().data, options.scale), options.band);
    if (image.data.height == 0)
        throw Error(dump.path(), "expected at least as many rows as bands, found " +
                                     std::to_string(dump.header().data.height * options.scale) +
                                     " rows and " + std::to_string(options.band.count) + " bands");
    image.display = scaled(dump.header().display, options.scale);
    image.channels = {"R", "G", "B"};
    if (findChannel(dump.header(), "A") >= 0) image.channels.emplace_back("A");
    const std::vector<std::string> further = furtherRadiance(dump.header(), options);
    image.channels.insert(image.channels.end(), further.begin(), further.end());
    for (const char* name : {"stddev.R", "stddev.G", "stddev.B"}) image.channels.emplace_back(name);
    return image;
}

ReconstructionReport reconstructDriftKriging(const SampleSource& dump, const DriftKrigingOptions& options,
                                             const RowSink& sink, const Progress& progress) {
    check(dump, options);
    return Pipeline(dump, options, sink, progress).run();
}

Reconstruction reconstructDriftKriging(const SampleSource& dump, const DriftKrigingOptions& options,
                                       const Progress& progress) {
    const Image outline = driftKrigingOutline(dump, options);
    requireMemory(dump.path(), imageBytes(outline.data, outline.channels.size()), "an image held whole");
    Reconstruction result;
    result.image = Image(outline.data, outline.channels);
    result.image.display = outline.display;
    int row = 0;
    const auto keep = [&](const float* rows, int count) {
        std::copy(rows, rows + std::ptrdiff_t{count} * outline.data.width * outline.channelCount(),
                  result.image.at(0, row));
        row += count;
    };
    result.report = reconstructDriftKriging(dump, options, keep, progress);
    return result;
}

}  // namespace vlx
