#pragma once

#include <string>
#include <vector>

#include "variolux/dump/sample_source.h"

namespace vlx {

/// Whether samples belong to two replicates and more (sample.replicate). Reads that channel, at most the
/// whole of it.
bool hasReplicates(const SampleSource& source);

/// The samples of even, 0, or odd number, 1, of each pixel, counted from 0 in the order of `source`; where it
/// has replicates (`replicates`: hasReplicates()), those of its even or odd ones. Refers to the source.
class HalfSamples : public SampleSource {
  public:
    HalfSamples(const SampleSource& source, bool replicates, int parity);

    const std::string& path() const override { return source_.path(); }
    /// The source's, but that the halves of a half are not known to be independent.
    const DumpHeader& header() const override { return header_; }
    SampleBand read(int y, int rows, const std::vector<std::string>& channels = {}) const override;

  private:
    const SampleSource& source_;
    DumpHeader header_;
    bool replicates_;
    unsigned parity_;
};

}  // namespace vlx
