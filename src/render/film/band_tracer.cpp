#include "render/film/band_tracer.h"

#include <algorithm>
#include <cmath>

#include "variolux/base/hash.h"
#include "variolux/base/parallel.h"

namespace vlx::render {
namespace {

/// The part of region (rx, ry) inside `window`.
Window clipped(int rx, int ry, const Window& window) {
    const int x0 = std::max(rx * kRegionSize, window.x), y0 = std::max(ry * kRegionSize, window.y);
    const int x1 = std::min((rx + 1) * kRegionSize, window.x + window.width);
    const int y1 = std::min((ry + 1) * kRegionSize, window.y + window.height);
    return {x0, y0, x1 - x0, y1 - y0};
}

}  // namespace

const std::vector<DumpChannel>& tracedChannels() {
    static const std::vector<DumpChannel> channels = [] {
        std::vector<DumpChannel> all = standardChannels();
        for (const std::string_view name : kMotionChannels)
            all.push_back({std::string(name), ChannelType::Float});
        return all;
    }();
    return channels;
}

/// A band's channels, to be written sample by sample.
class BandTracer::ChannelArrays {
  public:
    explicit ChannelArrays(SampleBand& band) : count_(band.values.size()) {
        const auto& all = tracedChannels();
        for (std::size_t c = 0, at = 0; c < count_; ++c, ++at) {
            while (all[at].name != band.channels[c]) ++at;  // in the same order, some left out
            channels_[c] = {band.values[c].data(), at};
        }
    }
    void put(std::uint64_t at, const Record& r) const {
        const PathSample& s = r.sample;
        const std::array<float, kChannels> values = {s.radiance.x,
                                                     s.radiance.y,
                                                     s.radiance.z,
                                                     s.hit ? 1.f : 0.f,
                                                     s.depth,
                                                     r.x,
                                                     r.y,
                                                     s.albedo.x,
                                                     s.albedo.y,
                                                     s.albedo.z,
                                                     s.normal.x,
                                                     s.normal.y,
                                                     s.normal.z,
                                                     static_cast<float>(r.replicate),
                                                     s.moved.before.x,
                                                     s.moved.before.y,
                                                     s.moved.after.x,
                                                     s.moved.after.y};
        for (std::size_t c = 0; c < count_; ++c) channels_[c].first[at] = values[channels_[c].second];
    }

  private:
    static constexpr std::size_t kChannels = 18;

    std::array<std::pair<float*, std::size_t>, kChannels> channels_{};  ///< and which value each takes
    std::size_t count_;
};

BandTracer::BandTracer(const Integrator& integrator, const RenderOptions& options, const DumpHeader& header)
    : integrator_(integrator),
      options_(options),
      header_(header),
      whole_(options.crop.value_or(header.display)),
      seed_(options.seed) {
    if (options.earlier == nullptr) return;
    // Numbers of their own: the earlier samples may have used this seed.
    seed_ = hashOf(options.seed, options.earlier->samples(), 0x617070u);
    firstReplicate_ = options.earlier->freeReplicate();
}

/// The regions that `rows` touch.
struct BandTracer::Grid {
    explicit Grid(const Window& traced)
        : rows(traced),
          firstX(traced.x / kRegionSize),
          firstY(traced.y / kRegionSize),
          across((traced.x + traced.width - 1) / kRegionSize - firstX + 1),
          down((traced.y + traced.height - 1) / kRegionSize - firstY + 1) {}

    std::size_t count() const { return static_cast<std::size_t>(across) * static_cast<std::size_t>(down); }
    int columnOf(std::size_t region) const { return firstX + static_cast<int>(region) % across; }
    int rowOf(std::size_t region) const { return firstY + static_cast<int>(region) / across; }
    std::size_t at(const CameraSample& s) const {
        return static_cast<std::size_t>((s.row / kRegionSize - firstY) * across +
                                        (s.column / kRegionSize - firstX));
    }

    Window rows;
    int firstX, firstY, across, down;
};

SampleBand BandTracer::trace(const Window& rows, const std::function<void(std::int64_t)>& regionDone) {
    const Grid grid(rows);
    regions_.resize(grid.count());
    SampleBand band = bandOf(rows);
    // Where each pixel gets as many samples, their places are known and they go there at once.
    const bool even = !options_.hierarchical && options_.map == nullptr;
    if (even) {
        for (std::size_t p = 0; p <= band.pixels(); ++p)
            band.offsets[p] = p * static_cast<std::uint64_t>(options_.spp);
        allocate(band);
    }
    const ChannelArrays direct(band);
    const auto fill = kStream / (static_cast<std::size_t>(options_.spp) * kRegionSize * kRegionSize);
    const std::size_t together = std::max<std::size_t>(fill, 1);
    const auto runs = static_cast<std::int64_t>((grid.count() + together - 1) / together);
    parallelFor(0, runs, [&](std::int64_t i) {
        const std::size_t first = static_cast<std::size_t>(i) * together;
        const std::size_t end = std::min(first + together, grid.count());
        traceRegions(grid, first, end, even ? &direct : nullptr);
        regionDone(static_cast<std::int64_t>(end - first));
    });
    if (!even) gather(rows, band);
    return band;
}

std::uint64_t BandTracer::addTo(SplatImages& images) const {
    const auto subpaths = static_cast<double>(images.data().pixels()) * options_.spp / images.replicates();
    const auto scale = static_cast<float>(1 / subpaths);
    std::uint64_t nonFinite = 0;
    for (const RegionResult& region : regions_)
        for (const RegionSplat& s : region.splats) {
            if (!isFinite(s.radiance)) {
                ++nonFinite;
                continue;
            }
            const Rgb v = s.radiance * scale;
            const auto replicate = static_cast<int>(s.replicate);
            images.at(s.x, s.y, replicate, 0) += v.x;
            images.at(s.x, s.y, replicate, 1) += v.y;
            images.at(s.x, s.y, replicate, 2) += v.z;
        }
    return nonFinite;
}

SampleBand BandTracer::bandOf(const Window& rows) const {
    SampleBand band;
    band.x = rows.x;
    band.y = rows.y;
    band.width = rows.width;
    band.height = rows.height;
    band.offsets.assign(band.pixels() + 1, 0);
    return band;
}

void BandTracer::allocate(SampleBand& band) const {
    for (const DumpChannel& channel : header_.channels) {
        band.channels.push_back(channel.name);
        band.values.emplace_back(band.samples());
    }
}

void BandTracer::traceRegions(const Grid& grid, std::size_t first, std::size_t end,
                              const ChannelArrays* direct) {
    std::vector<CameraSample> samples;
    std::vector<PathSample> found;
    std::vector<Splat> splats;
    const auto addSplats = [&] {
        for (const Splat& splat : splats) {
            const CameraSample& s = samples[splat.sample];
            regions_[grid.at(s)].splats.push_back({static_cast<int>(std::floor(splat.x)),
                                                   static_cast<int>(std::floor(splat.y)), s.replicate,
                                                   splat.radiance});
        }
        splats.clear();
    };
    const auto flush = [&] {
        found.resize(samples.size());
        integrator_.trace(samples, found, splats);
        addSplats();
        for (std::size_t i = 0; i < samples.size(); ++i) take(grid, samples[i], found[i], direct);
        samples.clear();
    };
    const Shade atOnce = [&](const CameraSample& s) {
        samples.assign(1, s);
        const PathSample sample = integrator_.trace(s, splats);
        addSplats();
        return take(grid, s, sample, direct);
    };
    const Shade inStream = [&](const CameraSample& s) {
        samples.push_back(s);
        if (samples.size() == kStream) flush();
        return Rgb{};
    };
    for (std::size_t i = first; i < end; ++i) {
        RegionResult& out = regions_[i];
        out.window = clipped(grid.columnOf(i), grid.rowOf(i), grid.rows);
        out.records.clear();
        out.counts.fill(0);
        out.nonFinite = 0;
        out.splats.clear();
        sampleRegion(out, grid.columnOf(i), grid.rowOf(i), options_.hierarchical ? atOnce : inStream);
    }
    if (!options_.hierarchical) flush();
}

Rgb BandTracer::take(const Grid& grid, const CameraSample& s, PathSample sample,
                     const ChannelArrays* direct) {
    RegionResult& out = regions_[grid.at(s)];
    const Window& rows = grid.rows;
    const bool outside = !rows.contains(s.column, s.row);  // of the band: another band's sample
    if (!isFinite(sample.radiance)) {
        out.nonFinite += !outside;
        sample.radiance = {};
    }
    if (outside) return sample.radiance;
    const int pixel = s.row % kRegionSize * kRegionSize + s.column % kRegionSize;
    const std::uint32_t number = out.counts[static_cast<std::size_t>(pixel)]++;
    const Record record{pixel, s.x, s.y, s.replicate, sample};
    if (direct == nullptr) {
        out.records.push_back(record);
    } else {
        const std::int64_t place = std::int64_t{s.row - rows.y} * rows.width + (s.column - rows.x);
        direct->put(static_cast<std::uint64_t>(place * options_.spp) + number, record);
    }
    return sample.radiance;
}

void BandTracer::sampleRegion(RegionResult& out, int rx, int ry, const Shade& shade) const {
    if (options_.hierarchical) {
        // All that the whole picture has of the region: it says where cells are refined.
        out.refined =
            sampleHierarchically(clipped(rx, ry, whole_), rx, ry, options_.refinement, options_.seed, shade);
    } else if (options_.map != nullptr) {
        const auto countAt = [&](int x, int y) { return options_.map->samplesAt(x, y, options_.spp, seed_); };
        sampleCounts(out.window, countAt, firstReplicate_, seed_, shade);
    } else if (options_.earlier != nullptr) {
        sampleCounts(
            out.window, [&](int, int) { return options_.spp; }, firstReplicate_, seed_, shade);
    } else {
        const bool both = options_.integrator == IntegratorKind::Bidirectional;
        const int replicates = both ? header_.splatReplicates : options_.replicates;
        sampleUniformly(out.window, options_.spp, replicates, options_.seed, shade);
    }
}

void BandTracer::gather(const Window& rows, SampleBand& band) const {
    const auto forPixels = [&](const RegionResult& region, auto visit) {
        const int left = floorToRegion(region.window.x), top = floorToRegion(region.window.y);
        for (int y = region.window.y; y < region.window.y + region.window.height; ++y)
            for (int x = region.window.x; x < region.window.x + region.window.width; ++x)
                visit(static_cast<std::size_t>((y - top) * kRegionSize + (x - left)),
                      static_cast<std::size_t>(y - rows.y) * static_cast<std::size_t>(rows.width) +
                          static_cast<std::size_t>(x - rows.x));
    };
    for (const RegionResult& region : regions_)
        forPixels(region, [&](std::size_t local, std::size_t pixel) {
            band.offsets[pixel + 1] = region.counts[local];
        });
    for (std::size_t p = 0; p < band.pixels(); ++p) band.offsets[p + 1] += band.offsets[p];
    allocate(band);
    const ChannelArrays arrays(band);
    parallelFor(0, static_cast<std::int64_t>(regions_.size()), [&](std::int64_t i) {
        const RegionResult& region = regions_[static_cast<std::size_t>(i)];
        std::array<std::uint64_t, kRegionSize * kRegionSize> next{};
        forPixels(region, [&](std::size_t local, std::size_t pixel) { next[local] = band.offsets[pixel]; });
        for (const Record& r : region.records) arrays.put(next[static_cast<std::size_t>(r.pixel)]++, r);
    });
}

}  // namespace vlx::render
