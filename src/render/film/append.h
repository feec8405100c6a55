#pragma once

#include <optional>
#include <string>

#include "variolux/dump/reader.h"

namespace vlx::render {

/// Text attribute of a dump that says which picture its samples are of, whatever their number: "WORD: VALUE;
/// WORD: VALUE". Samples of different ones have no common mean.
inline constexpr char kPictureAttribute[] = "tracedPicture";

/// A dump that more samples of the same view are added to.
class EarlierDump {
  public:
    /// Throws Error when the file is no dump or lacks a channel of the tracer's.
    explicit EarlierDump(const std::string& path);

    const DumpHeader& header() const { return reader_.header(); }
    bool hasReplicates() const { return findChannel(header(), "sample.replicate") >= 0; }
    /// Samples in the whole file.
    std::uint64_t samples() const;
    /// Number of the first replicate that is free; none without replicates. Reads the whole file once.
    std::optional<std::uint32_t> freeReplicate() const;
    /// Throws Error unless the picture to be traced is this dump's: same windows and camera, and the same
    /// kPictureAttribute, where both have one.
    void checkSameView(const DumpHeader& traced) const;
    /// The rows of `added` with this dump's samples before the added ones, pixel by pixel.
    SampleBand before(const SampleBand& added) const;

  private:
    DumpReader reader_;
};

}  // namespace vlx::render
