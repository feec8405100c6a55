#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "variolux/dump/band.h"
#include "variolux/dump/format.h"

namespace vlx {

/// Where a reconstruction gets samples from: a dump (DumpReader), an image of means and variances
/// (MomentSource), or memory (SampleBuffer). All give the same bits for the same samples.
class SampleSource {
  public:
    virtual ~SampleSource() = default;

    /// What messages call it: a file's path.
    virtual const std::string& path() const = 0;
    virtual const DumpHeader& header() const = 0;

    /// Samples of rows [y, y + rows), in any order of calls, one at a time, of the named channels only, in
    /// the given order (all of the header's when empty). Throws Error on rows outside the data window, on
    /// unknown channels, and on what is wrong with a file. Values of sample.replicate are such that
    /// replicateNumber() knows them.
    virtual SampleBand read(int y, int rows, const std::vector<std::string>& channels = {}) const = 0;

    /// Numbers of samples of rows [y, y + rows), pixel by pixel. Same errors.
    virtual std::vector<std::uint32_t> counts(int y, int rows) const {
        const SampleBand band = read(y, rows, {"R"});
        std::vector<std::uint32_t> counts;
        for (std::size_t p = 0; p < band.pixels(); ++p)
            counts.push_back(static_cast<std::uint32_t>(band.offsets[p + 1] - band.offsets[p]));
        return counts;
    }

  protected:
    SampleSource() = default;
    SampleSource(const SampleSource&) = default;
    SampleSource& operator=(const SampleSource&) = default;
};

}  // namespace vlx
