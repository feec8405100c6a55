#pragma once

#include <string>
#include <vector>

#include "variolux/dump/sample_source.h"

namespace vlx {

/// The samples of a part of a picture: a source whose data window is `part`, of the same display window.
/// Refers to the source. Reads whole rows of it.
class CroppedSamples : public SampleSource {
  public:
    /// Throws Error when the part has no pixels, or some that the source has not.
    CroppedSamples(const SampleSource& source, const Window& part);

    const std::string& path() const override { return source_.path(); }
    const DumpHeader& header() const override { return header_; }
    SampleBand read(int y, int rows, const std::vector<std::string>& channels = {}) const override;

  private:
    const SampleSource& source_;
    DumpHeader header_;
};

}  // namespace vlx
