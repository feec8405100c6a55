#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "variolux/dump/sample_source.h"

namespace vlx {

/// Reads a dump in bands of rows, in any order, from the first deep scanline part of an OpenEXR file, whoever
/// wrote it. Nothing in a header is trusted: windows, chunk tables, sizes and sample counts are checked
/// against the file's size and each other before memory is asked for. Memory is one band, whatever the
/// image's height. Reading is const and may be done from several threads at once.
class DumpReader : public SampleSource {
  public:
    /// Opens the file and reads its header. Throws Error (naming the file, and what is wrong) when it is
    /// missing, not OpenEXR, flat, deep tiled, truncated, lacks R, G or B, or has a header that its size
    /// contradicts.
    explicit DumpReader(const std::string& path);
    ~DumpReader() override;
    DumpReader(DumpReader&&) noexcept;
    DumpReader& operator=(DumpReader&&) noexcept;

    const std::string& path() const override;
    const DumpHeader& header() const override;
    std::uint64_t fileBytes() const;

    /// Samples of rows [y, y + rows), of the named channels only, in the given order (all of the header's
    /// when empty). Where the dump has splats, R, G and B hold those of the sample's replicate: means of
    /// samples are means of the whole light. Decompression of the rows is spread over threads; the result
    /// does not depend on their number. Throws Error naming the file, the scanline and the reason when a
    /// chunk is missing, truncated, or inconsistent (counts that decrease, sizes that disagree); throws Error
    /// on rows outside the window or unknown channels.
    SampleBand read(int y, int rows, const std::vector<std::string>& channels = {}) const override;

    /// Sample counts of rows [y, y + rows), row by row. Same errors.
    std::vector<std::uint32_t> counts(int y, int rows) const override;

  private:
    struct Impl;
    std::unique_ptr<Impl> impl_;
};

}  // namespace vlx
