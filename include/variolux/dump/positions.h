#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "variolux/dump/sample_source.h"

namespace vlx {

/// What programs mean by the position of a sample. In a dump's sample.x and sample.y it is the first: pixel
/// (x, y) holds the positions from (x, y) to (x + 1, y + 1), and y grows downwards.
enum class PositionConvention {
    Raster,
    Flipped,            ///< pixels, y counted from the picture's bottom
    Corner,             ///< pixels, counted from the corner of the data window
    Centre,             ///< pixels whose centres have whole coordinates
    Normalised,         ///< 0 to 1 over the picture (display window)
    NormalisedFlipped,  ///< likewise, from the bottom
    Ndc,                ///< -1 to 1 over the picture, y upwards
    RelativeCentre,     ///< -0.5 to 0.5 within the pixel
    Relative,           ///< 0 to 1 within the pixel
};

/// Each convention, its name for command lines, and what it is in words; last those that others are cases of:
/// whatever lies in 0 to 1 could be relative.
struct PositionConventionName {
    PositionConvention convention;
    std::string name, words;
};
const std::vector<PositionConventionName>& positionConventions();

/// The raster position that (x, y), of a sample of pixel (px, py), is by a convention.
std::pair<double, double> rasterPosition(PositionConvention convention, const DumpHeader& header, int px,
                                         int py, double x, double y);

/// Where the positions of samples are.
struct PositionReport {
    std::uint64_t samples = 0;
    std::uint64_t notFinite = 0;
    std::uint64_t outside = 0;  ///< of their pixel
    double furthest = 0;        ///< of those, in pixels from the pixel's border, along x or y
    /// By which at least nine in ten of those outside are in their pixels, where those are many. A wide pixel
    /// filter has none.
    std::optional<PositionConvention> likely = {};
    std::optional<std::pair<double, double>> shift = {};  ///< likewise: pixels by which all are off
};

/// One sentence for people; empty when all samples are in their pixels.
std::string toText(const PositionReport& report);

/// Counts positions while they are read.
class PositionCheck {
  public:
    explicit PositionCheck(const DumpHeader& header);
    /// The samples of a band with the channels sample.x and sample.y: of all its rows, or of one, counted
    /// from 0.
    void add(const SampleBand& band);
    void add(const SampleBand& band, int row);
    PositionReport report() const;

  private:
    DumpHeader header_;
    double tolerance_;  // of a coordinate, relative: what storing it loses
    PositionReport counts_;
    std::vector<std::uint64_t> within_;                 // of those outside, by each convention
    std::vector<std::pair<float, float>> someOffsets_;  // of the first samples from their pixels' centres
};

/// The samples of another source, their positions made raster positions and checked as they are read for the
/// first time.
class PositionedSamples : public SampleSource {
  public:
    /// `source` must outlive it. `checkAlways`: positions are checked also where nobody reads them.
    PositionedSamples(const SampleSource& source, PositionConvention convention, bool checkAlways);

    const std::string& path() const override { return source_.path(); }
    const DumpHeader& header() const override { return source_.header(); }
    SampleBand read(int y, int rows, const std::vector<std::string>& channels = {}) const override;
    std::vector<std::uint32_t> counts(int y, int rows) const override { return source_.counts(y, rows); }

    PositionReport report() const { return check_.report(); }

  private:
    const SampleSource& source_;
    const PositionConvention convention_;
    const bool checkAlways_;
    mutable PositionCheck check_;
    mutable std::vector<bool> checked_;  // rows
};

}  // namespace vlx
