#include "render/film/render.h"

#include <array>
#include <atomic>
#include <cassert>
#include <chrono>
#include <ctime>
#include <limits>

#include "render/integrator/bidirectional.h"
#include "variolux/base/error.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/base/memory.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/writer.h"

namespace vlx::render {
namespace {

constexpr int kBandRows = 16;
/// Bands are made lower until they hold at most this many samples, at about 120 bytes each.
constexpr std::int64_t kBandSamples = 1 << 22;

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

int floorToRegion(int v) { return v / kRegionSize * kRegionSize; }

/// The part of region (rx, ry) inside `window`.
Window clipped(int rx, int ry, const Window& window) {
    const int x0 = std::max(rx * kRegionSize, window.x), y0 = std::max(ry * kRegionSize, window.y);
    const int x1 = std::min((rx + 1) * kRegionSize, window.x + window.width);
    const int y1 = std::min((ry + 1) * kRegionSize, window.y + window.height);
    return {x0, y0, x1 - x0, y1 - y0};
}

PlanOptions planOptions(const RenderOptions& options) {
    return {
        options.camera, options.width, options.height, options.path.maxBounces, {.all = true, .without = {}}};
}

/// Of the whole picture, whatever the band.
DumpHeader headerOf(const Scene& scene, const View& view, const RenderOptions& options) {
    DumpHeader header;
    header.display = {0, 0, options.width, options.height};
    header.data = options.crop.value_or(header.display);
    if (options.integrator == Integrator::Bidirectional) {
        header.splatReplicates = options.splatReplicates();
        header.replicatesShare = true;
    }
    if (!options.integratorReason.empty()) header.extra["integrator"] = options.integratorReason;
    const bool replicates = header.splatReplicates > 1 || options.replicates > 1 ||
                            (options.earlier != nullptr && options.earlier->hasReplicates());
    // What is added to a dump has the channels that are there.
    const RecordedFeatures features =
        options.plan && options.earlier == nullptr ? options.plan->features : RecordedFeatures{};
    for (const DumpChannel& channel : standardChannels()) {
        if (!replicates && channel.name == "sample.replicate") continue;
        if (!features.albedo && channel.name.starts_with("albedo.")) continue;
        if (!features.normalAndDepth && (channel.name.starts_with("N.") || channel.name == "Z")) continue;
        if (options.earlier != nullptr && findChannel(options.earlier->header(), channel.name) < 0) continue;
        header.channels.push_back(channel);
    }
    header.compression = options.compression;
    header.renderer = "vlx-trace" + (options.version.empty() ? "" : " " + options.version);
    header.scene = scene.name;
    header.pixelFilter = "box";
    const Plan plan = options.plan ? *options.plan : planEffects(scene, planOptions(options));
    header.effects = plan.simulated();
    std::string leftOut;
    for (const PlannedEffect& e : plan.effects)
        if (plan.leftOut.has(e.effect))
            leftOut += (leftOut.empty() ? "" : ",") + std::string(nameOf(e.effect));
    if (!leftOut.empty()) header.extra["effectsLeftOut"] = leftOut;
    if (!options.inputs.empty()) header.extra[kInputsAttribute] = options.inputs;
    header.seed = static_cast<std::int64_t>(options.seed);
    if (!options.hierarchical) header.samples = options.spp;
    if (options.earlier != nullptr) {
        const double mean =
            static_cast<double>(options.earlier->samples()) / static_cast<double>(header.data.pixels());
        header.samples = mean + options.spp;
    }
    header.worldToCamera = view.worldToCamera();
    header.worldToNDC = view.worldToNdc();
    return header;
}

/// A band's channels, to be written sample by sample.
class ChannelArrays {
  public:
    explicit ChannelArrays(SampleBand& band) : count_(band.values.size()) {
        const auto& standard = standardChannels();
        for (std::size_t c = 0, at = 0; c < count_; ++c, ++at) {
            while (standard[at].name != band.channels[c]) ++at;  // in the same order, some left out
            channels_[c] = {band.values[c].data(), at};
        }
    }
    void put(std::uint64_t at, const Record& r) const {
        const PathSample& s = r.sample;
        const std::array<float, 14> values = {s.radiance.x, s.radiance.y,
                                              s.radiance.z, s.hit ? 1.f : 0.f,
                                              s.depth,      r.x,
                                              r.y,          s.albedo.x,
                                              s.albedo.y,   s.albedo.z,
                                              s.normal.x,   s.normal.y,
                                              s.normal.z,   static_cast<float>(r.replicate)};
        for (std::size_t c = 0; c < count_; ++c) channels_[c].first[at] = values[channels_[c].second];
    }

  private:
    std::array<std::pair<float*, std::size_t>, 14> channels_{};  ///< and which value each takes
    std::size_t count_;
};

class BandTracer {
  public:
    BandTracer(const PathTracer& tracer, const BidirectionalTracer* both, const View& view,
               const RenderOptions& options, const DumpHeader& header)
        : tracer_(tracer),
          both_(both),
          view_(view),
          options_(options),
          header_(header),
          whole_(options.crop.value_or(header.display)),
          lens_(options.path.effects.has(Effect::DepthOfField)),
          time_(options.path.effects.hasAny({Effect::CameraMotion, Effect::ObjectMotion})),
          seed_(options.seed),
          firstReplicate_(0) {
        if (options.earlier == nullptr) return;
        // Numbers of their own: the earlier samples may have used this seed.
        seed_ = hashOf(options.seed, options.earlier->samples(), 0x617070u);
        firstReplicate_ = options.earlier->freeReplicate();
    }

    /// Traces the rows of `rows` (the data window's columns).
    SampleBand trace(const Window& rows, const std::function<void(std::int64_t)>& regionDone) {
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

    const std::vector<RegionResult>& regions() const { return regions_; }

    /// Adds the band's splats, in the order of regions and samples. Returns how many overflowed.
    std::uint64_t addTo(SplatImages& images) const {
        const auto subpaths =
            static_cast<double>(images.data().pixels()) * options_.spp / images.replicates();
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

  private:
    SampleBand bandOf(const Window& rows) const {
        SampleBand band;
        band.x = rows.x;
        band.y = rows.y;
        band.width = rows.width;
        band.height = rows.height;
        band.offsets.assign(band.pixels() + 1, 0);
        return band;
    }

    void allocate(SampleBand& band) const {
        for (const DumpChannel& channel : header_.channels) {
            band.channels.push_back(channel.name);
            band.values.emplace_back(band.samples());
        }
    }

    PathSample traced(const CameraSample& s, std::vector<Splat>& splats) const {
        const PathSampler sampler(s.seed, s.index);
        const Vec2 lens = lens_ ? sampler.pair(dimension::kLens) : Vec2{};
        const float time = time_ ? sampler.pair(dimension::kTime).x : 0;
        return both_ != nullptr ? both_->trace(s.x, s.y, lens, time, sampler, splats)
                                : tracer_.trace(view_.ray(s.x, s.y, lens, time), sampler);
    }

    /// Into the region's records, or straight into the band.
    void traceRegion(int rx, int ry, const Window& rows, RegionResult& out,
                     const ChannelArrays* direct) const {
        out.window = clipped(rx, ry, rows);
        out.records.clear();
        out.counts.fill(0);
        out.nonFinite = 0;
        out.splats.clear();
        std::vector<Splat> splats;
        const int left = rx * kRegionSize, top = ry * kRegionSize;
        const Shade shade = [&](const CameraSample& s) {
            PathSample sample = traced(s, splats);
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
            out.refined = sampleHierarchically(clipped(rx, ry, whole_), rx, ry, options_.refinement,
                                               options_.seed, shade);
        } else if (options_.map != nullptr) {
            const auto countAt = [&](int x, int y) {
                return options_.map->samplesAt(x, y, options_.spp, seed_);
            };
            sampleCounts(out.window, countAt, firstReplicate_, seed_, shade);
        } else if (options_.earlier != nullptr) {
            sampleCounts(
                out.window, [&](int, int) { return options_.spp; }, firstReplicate_, seed_, shade);
        } else {
            const int replicates = both_ != nullptr ? header_.splatReplicates : options_.replicates;
            sampleUniformly(out.window, options_.spp, replicates, options_.seed, shade);
        }
    }

    /// The regions' samples in the band's order: pixel by pixel, each pixel's in the order they were taken.
    void gather(const Window& rows, SampleBand& band) const {
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
            forPixels(region,
                      [&](std::size_t local, std::size_t pixel) { next[local] = band.offsets[pixel]; });
            for (const Record& r : region.records) arrays.put(next[static_cast<std::size_t>(r.pixel)]++, r);
        });
    }

    const PathTracer& tracer_;
    const BidirectionalTracer* both_;
    const View& view_;
    const RenderOptions& options_;
    const DumpHeader& header_;
    Window whole_;  // the picture's part, whatever the band
    bool lens_;
    bool time_;
    std::uint64_t seed_;
    std::uint32_t firstReplicate_;
    std::vector<RegionResult> regions_;
};

}  // namespace

void RenderOptions::follow(const Plan& adopted) {
    plan = adopted;
    path.effects = adopted.planned;
    path.leftOut = {};
    for (const PlannedEffect& e : adopted.effects)
        if (adopted.leftOut.has(e.effect) && tracerLeavesOut(e.effect)) path.leftOut.set(e.effect);
}

int RenderOptions::splatReplicates() const {
    constexpr std::int64_t kMostBytes = std::int64_t{2} << 30;
    const std::int64_t pixels = crop ? crop->pixels() : std::int64_t{width} * height;
    const auto most = std::min<std::int64_t>(kMostSplatReplicates, kMostBytes / (12 * pixels));
    if (replicates > 1 || spp == 1) return replicates <= most ? replicates : 0;
    for (int n = static_cast<int>(std::min<std::int64_t>(most, spp)); n > 1; --n)
        if (spp % n == 0) return n;
    return 0;
}

std::optional<std::string> RenderOptions::validate(const Scene& scene) const {
    constexpr int kMost = 1 << 20;
    if (width < 1 || height < 1 || width > kMost || height > kMost)
        return "width and height must be 1 to " + std::to_string(kMost);
    if (crop) {
        const bool inside = crop->width >= 1 && crop->height >= 1 && crop->x >= 0 && crop->y >= 0 &&
                            crop->x <= width - crop->width && crop->y <= height - crop->height;
        if (!inside)
            return "expected a part inside the picture of " + std::to_string(width) + " x " +
                   std::to_string(height) + " pixels, found --crop " + std::to_string(crop->x) + "," +
                   std::to_string(crop->y) + "," + std::to_string(crop->width) + "," +
                   std::to_string(crop->height);
    }
    if (band.count < 1 || band.index < 0 || band.index >= band.count)
        return "band must be one of 1 to its number of bands";
    const Window part = bandOf(crop.value_or(Window{0, 0, width, height}), band);
    if (constexpr std::int64_t kMostPixels = std::int64_t{1} << 32; part.pixels() > kMostPixels)
        return "expected at most " + std::to_string(kMostPixels) + " pixels to trace, found " +
               std::to_string(part.width) + " x " + std::to_string(part.height) +
               ": give a smaller --width or --height, or a part with --crop or --band";
    if (camera >= scene.cameras.size())
        return "camera " + std::to_string(camera) + " does not exist, the scene has " +
               std::to_string(scene.cameras.size());
    const Camera& c = scene.cameras[camera];
    if (!c.unusable.empty()) return "camera '" + c.name + "' cannot be used: " + c.unusable;
    if (spp < 1 || spp > 1 << 24) return "spp must be 1 to 2^24";
    if (seed > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max()))
        return "seed must be less than 2^63";
    if (replicates < 1 || spp % replicates != 0) return "replicates must divide spp";
    if (hierarchical && replicates != 1) return "hierarchical sampling has one randomisation, not replicates";
    if (hierarchical && (map != nullptr || earlier != nullptr))
        return "hierarchical sampling neither follows a sample map nor adds to a dump";
    if (replicates != 1 && (map != nullptr || earlier != nullptr))
        return "samples of a map, or added to a dump, are one randomisation, not replicates";
    if (integrator == Integrator::Bidirectional) {
        if (hierarchical || map != nullptr || earlier != nullptr)
            return "bidirectional tracing takes as many samples in each pixel: it goes with neither "
                   "hierarchical sampling nor a sample map nor an earlier dump";
        if (band.count > 1)
            return "bidirectional tracing, which this picture calls for, is not cut into bands: light of "
                   "every "
                   "sample falls anywhere; give all bands --integrator path";
        if (path.leftOut.has(Effect::Caustics)) return "only path tracing leaves caustics out";
        if (replicates > kMostSplatReplicates)
            return "bidirectional tracing has at most " + std::to_string(kMostSplatReplicates) +
                   " replicates";
        if (splatReplicates() == 0)
            return "bidirectional tracing wants a number of samples with a divisor of 2 to 64 (the "
                   "replicates of its splats), whose images fit into 2 GiB";
    }
    if (!(refinement.tolerance >= 0)) return "tolerance must be 0 or more";
    if (refinement.levels < 1 || refinement.levels > 5) return "levels must be 1 to 5";
    if (path.maxBounces < 0 || path.maxBounces > 1 << 16) return "max bounces must be 0 to 65536";
    return std::nullopt;
}

RenderReport renderDump(const Scene& scene, const Accelerator& accelerator, const std::string& path,
                        const RenderOptions& options, const Progress& progress) {
    assert(!options.validate(scene));
    const View view(scene.cameras[options.camera], options.width, options.height);
    const PathTracer tracer(scene, accelerator, options.path);
    DumpHeader header = headerOf(scene, view, options);
    if (options.earlier != nullptr) options.earlier->checkSameView(header);
    const Window window = header.data = bandOf(header.data, options.band);
    if (window.height == 0)
        throw Error(path, "expected at most as many bands as rows, found " +
                              std::to_string(options.band.count) + " bands");
    DumpWriter writer(path, header);
    std::optional<BidirectionalTracer> both;
    std::optional<SplatImages> splats;
    if (options.integrator == Integrator::Bidirectional) {
        both.emplace(scene, accelerator, view, window, options.path);
        splats.emplace(window, header.splatReplicates);
    }
    BandTracer bands(tracer, both ? &*both : nullptr, view, options, header);

    const std::int64_t mostSpp = options.hierarchical
                                     ? std::int64_t{1} << (2 * (options.refinement.levels - 1))
                                 : options.map != nullptr ? options.map->most(options.spp)
                                                          : options.spp;
    int bandRows = kBandRows;
    while (bandRows > kRegionSize && bandRows * mostSpp * window.width > kBandSamples)
        bandRows -= kRegionSize;

    const std::int64_t fewest = options.hierarchical ? 1 : options.spp;
    requireMemory(path,
                  static_cast<std::uint64_t>(fewest * window.width * std::min(window.height, kRegionSize)) *
                      header.channels.size() * sizeof(float),
                  "the samples of a row of regions: a smaller --width, --crop or --spp needs less");

    const int regionsAcross = (window.x + window.width - 1) / kRegionSize - window.x / kRegionSize + 1;
    const int regionsDown = (window.y + window.height - 1) / kRegionSize - window.y / kRegionSize + 1;
    const std::int64_t total = std::int64_t{regionsAcross} * regionsDown;
    std::atomic<std::int64_t> done = 0;
    const auto regionDone = [&](std::int64_t n) {
        const std::int64_t now = done += n;
        if (progress) progress(now, total);
    };

    RenderReport report;
    const std::clock_t cpuStart = std::clock();
    using Clock = std::chrono::steady_clock;
    for (int y = window.y; y < window.y + window.height;) {
        const int end = std::min(floorToRegion(y) + bandRows, window.y + window.height);
        const auto start = Clock::now();
        SampleBand band = bands.trace({window.x, y, window.width, end - y}, regionDone);
        report.traceSeconds += std::chrono::duration<double>(Clock::now() - start).count();
        report.samples += band.samples();
        if (splats) report.nonFinite += bands.addTo(*splats);
        for (const RegionResult& region : bands.regions()) {
            report.nonFinite += region.nonFinite;
            report.refinedCells.resize(std::max(report.refinedCells.size(), region.refined.size()));
            for (std::size_t i = 0; i < region.refined.size(); ++i)
                report.refinedCells[i] += static_cast<std::uint64_t>(region.refined[i]);
        }
        writer.write(options.earlier != nullptr ? options.earlier->before(band) : std::move(band));
        y = end;
    }
    // Merging adds the bands' seconds up: the first one has the earlier ones.
    const bool first = options.earlier != nullptr && options.band.index == 0;
    const double before = first ? options.earlier->header().renderSeconds.value_or(0) : 0;
    if (splats) writer.writeSplats(std::move(*splats));
    writer.close(before + report.traceSeconds);
    report.writeCpuSeconds = writer.cpuSeconds();
    report.traceCpuSeconds =
        static_cast<double>(std::clock() - cpuStart) / CLOCKS_PER_SEC - report.writeCpuSeconds;
    return report;
}

}  // namespace vlx::render
