#include "reconstruct/data/sampled_frame.h"

#include <algorithm>
#include <string>
#include <vector>

#include "reconstruct/common/rebin.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/base/parallel.h"
#include "variolux/geostat/random_drift.h"

namespace vlx {

namespace {

constexpr int kReadRows = 16;
constexpr int kGatheredRows = 64;  // those filled at a time, 11 around them, and those read at a time

SampleLayout layoutOf(const SampleSource& dump, const Drift& options) {
    SampleLayout layout = chooseSampleLayout(dump, options);
    if (layout.features + 5 > kMaxRandomDrift || layout.radiance > kMaxRandomDrift)
        throw Error(dump.path(), "expected at most " + std::to_string(kMaxRandomDrift - 5) +
                                     " features and " + std::to_string(kMaxRandomDrift) +
                                     " radiance channels, found " + std::to_string(layout.features) +
                                     " and " + std::to_string(layout.radiance));
    return layout;
}

}  // namespace

SampledFrame::SampledFrame(const SampleSource& dump, const Drift& options, Kept kept, StageClock& clock)
    : dump_(dump),
      options_(options),
      clock_(clock),
      layout_(layoutOf(dump, options)),
      planes_{layout_.radiance, layout_.features},
      width_(dump.header().data.width * options.scale),
      height_(dump.header().data.height * options.scale),
      readRows_(kReadRows / options.scale),
      picture_(measurePictureScale(dump, layout_)),
      gathered_(width_, planes_.channels(), std::min(kGatheredRows, height_)),
      motion_(width_, layout_.motion < 0 ? 0 : MotionPlanes::kChannels, height_),
      frame_(layout_, picture_, options, width_, height_, kept, *this, clock),
      pixels_(dump, layout_, planes_, picture_, options.scale, width_, height_,
              options.fireflies == Fireflies::Robust, gathered_, frame_.fine().pixels()),
      endRow_(height_) {}

void SampledFrame::own(int first, int end) {
    firstRow_ = first;
    endRow_ = end;
}

void SampledFrame::startAbove(int first) {
    gatheredRows_ = std::max(0, first - PixelData::reach(options_.scale)) / options_.scale * options_.scale;
}

void SampledFrame::readWithin(std::uint64_t most, std::uint64_t held) {
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
    if (gaps) held += GapField::bytes(dump_, layout_);
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
    while (readRows_ > 1 && needed(readRows_) > most) --readRows_;
    if (needed(readRows_) > most)
        throw Error(dump_.path(), "expected a memory limit of at least " + memoryLimitFor(needed(readRows_)) +
                                      " for rows as wide and full as these, found " +
                                      std::to_string(most / 1'000'000) + "M");
}

void SampledFrame::gather(int until) {
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
            if (layout_.motion >= 0)
                gatherMotion(band, layout_, static_cast<int>(row), scale, motion_,
                             first + static_cast<int>(row));
            counts[static_cast<std::size_t>(row)] =
                gatherRow(band, layout_, planes_, static_cast<int>(row), clamp, gathered_,
                          first + static_cast<int>(row));
        });
        for (int row = 0; row < rows; ++row) {
            if (!isOwn(first + row)) continue;
            const GatherCounts& of = counts[static_cast<std::size_t>(row)];
            counts_.samples += of.samples;
            counts_.dropped += of.dropped;
            counts_.empty += of.empty;
            counts_.range.add(of.range);
            counts_.limited += of.limited;
            counts_.luminance += of.luminance;
            counts_.removed += of.removed;
            counts_.light += of.light;
            counts_.noise += of.noise;
        }
        gatheredRows_ += rows;
        clock_.addTo("statistics");
    }
}

void SampledFrame::fill(int first, int end, PixelRows&) {
    gather(end + PixelData::reach(options_.scale));
    pixels_.prepare(first, end);
    std::vector<LimitedRow> limited(static_cast<std::size_t>(end - first));
    parallelFor(first, end, [&](std::int64_t y) {
        limited[static_cast<std::size_t>(y - first)] = pixels_.fillRow(static_cast<int>(y));
    });
    for (int y = first; y < end; ++y) {
        if (!isOwn(y)) continue;
        const LimitedRow& of = limited[static_cast<std::size_t>(y - first)];
        counts_.limited += of.samples;
        counts_.farPixels += of.farPixels;
        counts_.removed += of.luminance;
    }
}

}  // namespace vlx
