#pragma once

#include <cstdint>

#include "variolux/dump/band.h"
#include "variolux/dump/format.h"

namespace vlx {

/// A value of a UINT channel: the nearest integer. Negative and NaN become 0, what is too large the largest.
std::uint32_t toUint(float value);

/// What `value` is when it comes back from a file.
float asStored(float value, ChannelType type);

/// Rounds the values of a band that holds `header`'s channels, in its order.
void roundToStored(SampleBand& band, const DumpHeader& header);

/// The channels of `band` named, in this order; all when none is. Throws Error on unknown ones.
SampleBand selectChannels(SampleBand band, const std::vector<std::string>& channels, const std::string& path);

/// Throws Error, naming the pixel, when a value of sample.replicate is no number of a replicate.
void checkReplicates(const std::string& path, const SampleBand& band);

/// Throws Error unless the rows [y, y + rows) lie within the header's data window.
void checkRows(const std::string& path, const DumpHeader& header, int y, int rows);

}  // namespace vlx
