#pragma once

#include <cstdint>

#include "variolux/dump/sample_source.h"

/// What adding samples to a dump of the same view takes.
namespace vlx {

/// Two bands of the same rows and channels as one: pixel by pixel the samples of `first`, then those of
/// `second`.
SampleBand joined(const SampleBand& first, const SampleBand& second);

/// Number of the first replicate that is free in a dump with sample.replicate, which is read whole.
std::uint32_t freeReplicate(const SampleSource& dump);

/// Samples in the whole dump.
std::uint64_t samplesOf(const SampleSource& dump);

}  // namespace vlx
