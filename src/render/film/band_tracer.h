#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "render/film/region_sampling.h"
#include "render/film/render.h"
#include "render/integrator/integrator.h"
#include "variolux/dump/band.h"
#include "variolux/dump/writer.h"

namespace vlx::render {

/// The channels that the tracer may write, in its order: the standard ones, and those of motion.
const std::vector<DumpChannel>& tracedChannels();

/// Everything about one sample that goes into the dump.
struct Record {
    int pixel;  ///< inside the region, row by row
    float x, y;
    std::uint32_t replicate;
    PathSample sample;
};

struct RegionSplat {
    int x, y;
    std::uint32_t replicate;
    Rgb radiance;
};

/// A region's samples while its band is traced.
struct RegionResult {
    Window window;  ///< its pixels inside the data window
    std::vector<Record> records;
    std::array<std::uint32_t, kRegionSize * kRegionSize> counts{};
    std::vector<int> refined;
    std::vector<RegionSplat> splats;
    std::uint64_t nonFinite = 0;
};

/// The first column or row of the region that `v` is in.
inline int floorToRegion(int v) { return v / kRegionSize * kRegionSize; }

/// Traces a picture band by band: whole regions in parallel, then their samples in the band's order.
class BandTracer {
  public:
    BandTracer(const Integrator& integrator, const RenderOptions& options, const DumpHeader& header);

    /// Traces the rows of `rows` (the data window's columns).
    SampleBand trace(const Window& rows, const std::function<void(std::int64_t)>& regionDone);

    const std::vector<RegionResult>& regions() const { return regions_; }

    /// Adds the band's splats, in the order of regions and samples. Returns how many overflowed.
    std::uint64_t addTo(SplatImages& images) const;

  private:
    class ChannelArrays;

    SampleBand bandOf(const Window& rows) const;
    void allocate(SampleBand& band) const;
    struct Grid;
    /// Neighbouring regions, their samples in one stream: into the regions' records, or straight into the
    /// band.
    void traceRegions(const Grid& grid, std::size_t first, std::size_t end, const ChannelArrays* direct);
    void sampleRegion(RegionResult& out, int rx, int ry, const Shade& shade) const;
    /// Returns its radiance, 0 where that is not finite.
    Rgb take(const Grid& grid, const CameraSample& s, PathSample sample, const ChannelArrays* direct);
    /// The regions' samples in the band's order: pixel by pixel, each pixel's in the order they were taken.
    void gather(const Window& rows, SampleBand& band) const;

    const Integrator& integrator_;
    const RenderOptions& options_;
    const DumpHeader& header_;
    Window whole_;  // the picture's part, whatever the band
    std::uint64_t seed_;
    std::optional<std::uint32_t> firstReplicate_;  // none: without replicates
    std::vector<RegionResult> regions_;
};

}  // namespace vlx::render
