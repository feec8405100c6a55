#pragma once

#include <cstddef>

#include "reconstruct/common/pixel_statistics.h"
#include "variolux/dump/band.h"

namespace vlx {

/// The same samples on a raster `scale` times as fine along each axis: each goes to the part of its pixel
/// that its position (channels `xChannel`, `yChannel` of the band) falls in; positions outside the pixel to
/// the nearest part, those that are not finite to the middle one. Samples of a part keep their order.
SampleBand rebin(const SampleBand& band, int scale, std::size_t xChannel, std::size_t yChannel);

/// One sample for each replicate of a pixel: the mean of the replicate's samples, which have light in common
/// (DumpHeader::replicatesShare), so that what is left is independent. A value that is not finite makes the
/// mean so.
SampleBand averageReplicates(const SampleBand& band, std::size_t replicateChannel);

/// Samples of `rows` rows from row y (counted from the dump's top) as statistics are gathered from them: the
/// layout's channels, in parts of pixels where scale is above 1, each replicate's mean where replicates
/// share.
SampleBand readRows(const SampleSource& dump, const SampleLayout& layout, int scale, int y, int rows);

}  // namespace vlx
