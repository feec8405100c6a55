#pragma once

#include <functional>
#include <string>
#include <vector>

#include "reconstruct/common/region.h"
#include "variolux/base/image.h"
#include "variolux/base/progress.h"
#include "variolux/dump/sample_source.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {

/// The channels of a dump that a reconstruction reads, in this order, and their roles in the bands so read.
struct ChannelChoice {
    std::vector<std::string> names;
    BandLayout layout;
    int radianceCount() const { return static_cast<int>(layout.radiance.size()); }
};

/// R, G, B, then A and the sample positions where the dump has them.
ChannelChoice chooseChannels(const DumpHeader& header);

/// The least multiple of `step` greater than `a`, which may be negative: windows may start anywhere.
int nextMultiple(int a, int step);

/// Reads the dump in bands of rows that start at multiples of `step` in raster coordinates (the first and the
/// last may be shorter), step rows or a few times that, or all at once where step is 0, calls body(band,
/// rows) and gives the rows, an image of the radiance channels and the layers stddev, to `sink`. Adds what
/// reading took to report.readSeconds and the samples to report.samples. Throws Error when there is not the
/// memory for a band.
void forEachBand(const SampleSource& reader, const ChannelChoice& channels, int step,
                 ReconstructionReport& report, const RowSink& sink, const Progress& progress,
                 const std::function<void(const SampleBand&, Image& rows)>& body);

}  // namespace vlx
