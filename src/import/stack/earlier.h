#pragma once

#include <string>
#include <vector>

#include "variolux/dump/reader.h"

namespace vlx {

/// A dump that the samples of images are added to.
class EarlierStack {
  public:
    /// Throws Error when the file is no dump, and when its windows or channels are not those of `added`.
    EarlierStack(const std::string& path, const DumpHeader& added);

    /// Lets the header of the images' samples say what is so of both.
    void enterInto(DumpHeader& header) const;

    const DumpReader& samples() const { return reader_; }
    std::uint32_t firstReplicate() const { return firstReplicate_; }

    /// What the dump has now with those of `images` images, and whether its samples are means of as many of
    /// the renderer's as theirs, `averaged`.
    std::vector<std::string> notes(std::size_t images, double averaged) const;

  private:
    double meanSamples() const;  // of a pixel

    DumpReader reader_;
    std::uint32_t firstReplicate_ = 0;
};

}  // namespace vlx
