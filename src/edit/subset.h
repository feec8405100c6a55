#pragma once

#include <cstdint>
#include <string>

#include "variolux/base/progress.h"
#include "variolux/dump/format.h"

namespace vlx {

struct SubsetOptions {
    std::uint32_t samples = 1;  ///< samples a pixel to keep
    std::uint32_t part = 0;     ///< which of the disjoint sub-sets of this size, from 0
    std::uint64_t seed = 0;     ///< another seed, another division into sub-sets
    DumpCompression compression = DumpCompression::Rle;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

struct SubsetReport {
    std::uint64_t samples = 0;     ///< written
    std::uint32_t replicates = 0;  ///< kept; 0 when the division was by single samples
};

/// Writes a dump of fewer samples a pixel: what a renderer would have written that had stopped earlier. The
/// parts 0, 1, 2, ... of one seed and size share no sample, so that they are independent where the samples
/// are.
///
/// Where the dump has sample.replicate with at least two values, whole replicates are kept (samples of one
/// randomisation are not independent of each other), chosen for the whole image and numbered anew from 0.
/// Otherwise each pixel's samples are shuffled by a hash of (seed, pixel, index): a random part of a
/// low-discrepancy set, which converges more slowly than the set itself.
///
/// Windows, channels and attributes stay; variolux:samples becomes `samples`, variolux:renderSeconds its
/// share. Works by bands of rows. The result depends on the input and options alone. Throws Error when
/// samples is 0, when the dump does not hold (part + 1) * samples a pixel (naming what it holds), when
/// `samples` is not a multiple of what a replicate holds, and as DumpReader and DumpWriter.
SubsetReport subsetDump(const std::string& input, const std::string& output, const SubsetOptions& options,
                        const Progress& progress = {});

}  // namespace vlx
