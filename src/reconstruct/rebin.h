#pragma once

#include <cstddef>

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

}  // namespace vlx
