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

SampleBand BandTracer::trace(const Window& rows, const std::function<void(std::int64_t)>& regionDone) {
    const int firstX = rows.x / kRegionSize, firstY = rows.y / kRegionSize;
    const int across = (rows.x + rows.width - 1) / kRegionSize - firstX + 1;
    const int down = (rows.y + rows.height - 1) / kRegionSize - firstY + 1;
    regions_.resize(static_cast<std::size_t>(across) * static_cast<std::size_t>(down));
    const auto count = static_cast<std::int64_t>(regions_.size());
    SampleBand band = bandOf(rows);
    // Where each pixel gets as many samples, their places are known and they go there at once.
    const bool even = !options_.hierarchical && options_.map == nullptr;
    if (even) {
        for (std::size_t p = 0; p <= band.pixels(); ++p)
            band.offsets[p] = p * static_cast<std::uint64_t>(options_.spp);
        allocate(band);
    }
    const ChannelArrays direct(band);
    parallelFor(0, count, [&](std::int64_t i) {
        const int rx = firstX + static_cast<int>(i % across), ry = firstY + static_cast<int>(i / across);
        traceRegion(rx, ry, rows, regions_[static_cast<std::size_t>(i)], even ? &direct : nullptr);
        regionDone(1);
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

void BandTracer::traceRegion(int rx, int ry, const Window& rows, RegionResult& out,
                             const ChannelArrays* direct) const {
    out.window = clipped(rx, ry, rows);
    out.records.clear();
    out.counts.fill(0);
    out.nonFinite = 0;
    out.splats.clear();
    std::vector<Splat> splats;
    const int left = rx * kRegionSize, top = ry * kRegionSize;
    const Shade shade = [&](const CameraSample& s) {
        PathSample sample = integrator_.trace(s, splats);
        const bool outside = !rows.contains(s.column, s.row);  // of the band: another band's sample
        for (const Splat& splat : splats)
            out.splats.push_back({static_cast<int>(std::floor(splat.x)),
                                  static_cast<int>(std::floor(splat.y)), s.replicate, splat.radiance});
        splats.clear();
        if (!isFinite(sample.radiance)) {
            out.nonFinite += !outside;
            sample.radiance = {};
        }
        if (outside) return sample.radiance;
        const int pixel = (s.row - top) * kRegionSize + (s.column - left);
        const std::uint32_t number = out.counts[static_cast<std::size_t>(pixel)]++;
        const Record record{pixel, s.x, s.y, s.replicate, sample};
        if (direct == nullptr) {
            out.records.push_back(record);
        } else {
            const std::int64_t place = std::int64_t{s.row - rows.y} * rows.width + (s.column - rows.x);
            direct->put(static_cast<std::uint64_t>(place * options_.spp) + number, record);
        }
        return sample.radiance;
    };
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
