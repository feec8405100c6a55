#pragma once

#include <string>

#include "variolux/dump/sample_source.h"

namespace vlx {

/// Samples in memory, for a renderer that reconstructs what it has so far without files:
///
///     vlx::DumpHeader header;
///     header.data = header.display = {0, 0, width, height};
///     header.channels = {{"R"}, {"G"}, {"B"}, {"A", vlx::ChannelType::Half}};
///     vlx::SampleBand samples;                       // band.h: one array a channel, pixel by pixel
///     ...
///     const vlx::SampleBuffer buffer(header, std::move(samples));
///     const vlx::Progress shown = [&](std::int64_t done, std::int64_t total) {
///         if (restarted) throw Cancelled();
///         show(done, total);
///     };
///     const vlx::Reconstruction image = vlx::reconstruct(buffer, vlx::Drift{}, shown);
///
/// What a Progress throws ends the reconstruction and comes out of it. FORMAT.md says which
/// channels there are and what they mean. Values are rounded to their channels' types, so that the result has
/// the bits that it would have by way of a dump with this header.
class SampleBuffer : public SampleSource {
  public:
    /// `samples` are those of the whole data window, its channels the header's in their order. `name` is for
    /// messages. Throws Error on a window without pixels, without R, G and B, and when the samples do not fit
    /// the header or their own offsets.
    SampleBuffer(DumpHeader header, SampleBand samples, std::string name = "samples in memory");

    const std::string& path() const override { return name_; }
    const DumpHeader& header() const override { return header_; }
    SampleBand read(int y, int rows, const std::vector<std::string>& channels = {}) const override;

  private:
    std::string name_;
    DumpHeader header_;
    SampleBand samples_;
};

}  // namespace vlx
