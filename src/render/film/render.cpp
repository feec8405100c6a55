#include "render/film/render.h"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <chrono>
#include <ctime>
#include <limits>

#include "render/film/band_tracer.h"
#include "render/scene/frame_motion.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/image_io.h"
#include "variolux/base/memory.h"
#include "variolux/dump/writer.h"

namespace vlx::render {
namespace {

constexpr int kBandRows = 16;
/// Bands are made lower until they hold at most this many samples, at about 120 bytes each.
constexpr std::int64_t kBandSamples = 1 << 22;

PlanOptions planOptions(const RenderOptions& options) {
    return {
        options.camera, options.width, options.height, options.path.maxBounces, {.all = true, .without = {}}};
}

/// The sum over a band's pixels of the luminance of their means.
double luminanceOf(const SampleBand& band) {
    double sum = 0;
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        const std::uint64_t first = band.offsets[p], end = band.offsets[p + 1];
        double pixel = 0;
        for (std::uint64_t s = first; s < end; ++s)
            pixel +=
                static_cast<double>(luminance(Rgb{band.values[0][s], band.values[1][s], band.values[2][s]}));
        if (end > first) sum += pixel / static_cast<double>(end - first);
    }
    return sum;
}

/// The same of splats, whose replicates share the picture.
double luminanceOf(SplatImages& splats) {
    double sum = 0;
    const Window& window = splats.data();
    for (int r = 0; r < splats.replicates(); ++r)
        for (int y = window.y; y < window.y + window.height; ++y)
            for (int x = window.x; x < window.x + window.width; ++x)
                sum += static_cast<double>(
                    luminance(Rgb{splats.at(x, y, r, 0), splats.at(x, y, r, 1), splats.at(x, y, r, 2)}));
    return sum / splats.replicates();
}

/// Of the whole picture, whatever the band.
DumpHeader headerOf(const Scene& scene, const View& view, const RenderOptions& options) {
    DumpHeader header;
    header.display = {0, 0, options.width, options.height};
    header.data = options.crop.value_or(header.display);
    if (options.integrator == IntegratorKind::Bidirectional) {
        header.splatReplicates = options.splatReplicates();
        header.replicatesShare = true;
    }
    header.independentHalves =
        options.earlier != nullptr
            ? options.earlier->header().independentHalves
            : !options.hierarchical && options.replicates == 1 && options.integrator == IntegratorKind::Path;
    if (!options.integratorReason.empty()) header.extra["integrator"] = options.integratorReason;
    const bool replicates = header.splatReplicates > 1 || options.replicates > 1 ||
                            (options.earlier != nullptr && options.earlier->hasReplicates());
    const Plan plan = options.plan ? *options.plan : planEffects(scene, planOptions(options));
    // What is added to a dump has the channels that are there.
    const RecordedFeatures features =
        options.plan && options.earlier == nullptr ? options.plan->features : RecordedFeatures{};
    const bool motion = options.earlier != nullptr || plan.motion.recorded;
    for (const DumpChannel& channel : tracedChannels()) {
        if (!replicates && channel.name == "sample.replicate") continue;
        if (!features.albedo && channel.name.starts_with("albedo.")) continue;
        if (!features.normalAndDepth && (channel.name.starts_with("N.") || channel.name == "Z")) continue;
        if (!motion && std::ranges::count(kMotionChannels, channel.name) > 0) continue;
        if (options.earlier != nullptr && findChannel(options.earlier->header(), channel.name) < 0) continue;
        header.channels.push_back(channel);
    }
    header.compression = options.compression;
    header.renderer = "vlx-trace" + (options.version.empty() ? "" : " " + options.version);
    header.scene = scene.name;
    header.pixelFilter = "box";
    header.effects = plan.simulated();
    std::string leftOut;
    for (const PlannedEffect& e : plan.effects)
        if (plan.leftOut.has(e.effect))
            leftOut += (leftOut.empty() ? "" : ",") + std::string(nameOf(e.effect));
    if (!leftOut.empty()) header.extra["effectsLeftOut"] = leftOut;
    if (!options.inputs.empty()) header.extra[kInputsAttribute] = options.inputs;
    if (!options.picture.empty()) header.extra[kPictureAttribute] = options.picture;
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
    if (integrator == IntegratorKind::Bidirectional) {
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
    DumpHeader header = headerOf(scene, view, options);
    if (options.earlier != nullptr) options.earlier->checkSameView(header);
    const Window window = header.data = bandOf(header.data, options.band);
    if (window.height == 0)
        throw Error(path, "expected at most as many bands as rows, found " +
                              std::to_string(options.band.count) + " bands");
    DumpWriter writer(path, header);
    std::optional<SplatImages> splats;
    if (options.integrator == IntegratorKind::Bidirectional) splats.emplace(window, header.splatReplicates);
    // Also where it is not this plan's to record, but a dump's that is added to: unknown without a sequence.
    const FrameMotion motion(scene, scene.cameras[options.camera], options.width, options.height);
    PathOptions traced = options.path;
    if (scene.shutter.frame > 0 && findChannel(header, kMotionChannels[0]) >= 0) traced.motion = &motion;
    const std::unique_ptr<Integrator> integrator =
        makeIntegrator(options.integrator, scene, accelerator, view, window, traced);
    BandTracer bands(*integrator, options, header);

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
    double shone = 0;  // luminance of all pixels
    const std::clock_t cpuStart = std::clock();
    using Clock = std::chrono::steady_clock;
    for (int y = window.y; y < window.y + window.height;) {
        const int end = std::min(floorToRegion(y) + bandRows, window.y + window.height);
        const auto start = Clock::now();
        SampleBand band = bands.trace({window.x, y, window.width, end - y}, regionDone);
        report.traceSeconds += std::chrono::duration<double>(Clock::now() - start).count();
        report.samples += band.samples();
        shone += luminanceOf(band);
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
    if (splats) shone += luminanceOf(*splats);
    report.meanLuminance = shone / static_cast<double>(window.pixels());
    if (splats) writer.writeSplats(std::move(*splats));
    writer.close(before + report.traceSeconds);
    report.writeCpuSeconds = writer.cpuSeconds();
    report.traceCpuSeconds =
        static_cast<double>(std::clock() - cpuStart) / CLOCKS_PER_SEC - report.writeCpuSeconds;
    return report;
}

}  // namespace vlx::render
