#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "exr/flat_images.h"
#include "import/moments.h"

namespace vlx {

/// Means and variances of pixels, wherever they come from.
struct MomentChannels {
    /// A further channel of radiance: of one of the colours 0 to 2, or of none (-1).
    struct Radiance {
        std::string name;
        FlatChannel channel;
        int colour = -1;
    };

    std::array<FlatChannel, 3> mean;                  ///< R, G, B
    std::array<FlatChannel, 3> variance;              ///< or second moments
    std::optional<std::array<FlatChannel, 3>> first;  ///< first moments that go with second ones; else `mean`
    std::optional<FlatChannel> count;                 ///< samples of each pixel; else `samples`
    std::vector<Radiance> radiance;
    std::vector<std::pair<std::string, FlatChannel>> features;  ///< dump channel, from where
    VarianceMeaning meaning = VarianceMeaning::OfMean;
    bool xyz = false;
    double samples = 0;
};

struct MomentOutput {
    std::string renderer;
    bool halves = true;
    std::uint64_t seed = 0;
    DumpCompression compression = DumpCompression::Zips;
    std::string inputs = {};  ///< for the header's kInputsAttribute (base/fingerprint.h)
};

/// The samples that importMoments() describes.
class MomentRows : public ImportedSamples {
  public:
    /// `report` says what was taken from where; the rest is added to it.
    MomentRows(std::unique_ptr<FlatImages> images, MomentChannels channels, MomentOutput output,
               ImportReport report);

    const std::string& path() const override { return images_->path(0); }
    const DumpHeader& header() const override { return header_; }
    SampleBand read(int y, int rows, const std::vector<std::string>& channels) const override;
    ImportReport report() const override;

  private:
    using Triple = std::array<double, 3>;

    struct Doubts {
        std::int64_t unknown = 0;   // pixels whose variance is
        std::int64_t negative = 0;  // values
    };

    Triple triple(const std::array<FlatChannel, 3>& channels, std::size_t pixel) const;
    Triple variance(std::size_t pixel, Doubts& doubts) const;

    const std::unique_ptr<FlatImages> images_;
    const MomentChannels channels_;
    const MomentOutput output_;
    ImportReport report_;
    DumpHeader header_;
    std::array<std::size_t, 3> colour_{}, variance_{};
    std::vector<std::size_t> radiance_, features_;  // of each: its channel in the header
    std::size_t replicate_ = 0;
    mutable std::vector<Doubts> doubts_;  // of each row read so far
};

/// Writes all samples into a dump.
void writeSamples(const SampleSource& source, const std::string& dump, const Progress& progress);

}  // namespace vlx
