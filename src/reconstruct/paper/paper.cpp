#include <algorithm>
#include <cmath>
#include <optional>

#include "reconstruct/common/bands.h"
#include "reconstruct/common/methods.h"
#include "reconstruct/common/picture_scale.h"
#include "reconstruct/paper/krige_region.h"
#include "variolux/base/error.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

constexpr int kCellsPerPixel = 4;  // along each axis: 16 cells a pixel

/// The regions of a grid of `size` pixels through raster (0, 0), cut to the window.
std::vector<Window> regionsOf(const Window& window, int size) {
    std::vector<Window> regions;
    for (int y = window.y; y < window.y + window.height; y = nextMultiple(y, size))
        for (int x = window.x; x < window.x + window.width; x = nextMultiple(x, size))
            regions.push_back({x, y, std::min(nextMultiple(x, size), window.x + window.width) - x,
                               std::min(nextMultiple(y, size), window.y + window.height) - y});
    return regions;
}

void store(const RegionEstimate& estimate, int radiance, Image& image) {
    const Window& pixels = estimate.diagnostics.pixels;
    for (int p = 0; p < pixels.pixels(); ++p) {
        float* out =
            image.at(pixels.x - image.data.x + p % pixels.width, pixels.y - image.data.y + p / pixels.width);
        for (int c = 0; c < radiance; ++c) out[c] = static_cast<float>(estimate.values(p, c));
        for (int c = 0; c < 3; ++c) out[radiance + c] = static_cast<float>(estimate.stddev(p, c));
    }
}

/// Nothing is certain: where all samples agree, others may not; a region without samples may be anything.
void doubt(const PictureScale& picture, RegionEstimate& estimate) {
    const RegionDiagnostics& of = estimate.diagnostics;
    for (int c = 0; c < 3; ++c)
        for (Eigen::Index p = 0; p < estimate.stddev.rows(); ++p)
            if (of.outcome == RegionOutcome::Empty) {
                estimate.stddev(p, c) = picture.unknownDeviation(c);
            } else {
                const double level = std::max(std::abs(estimate.values(p, c)), picture.level);
                const double unseen = unseenVariance(static_cast<double>(of.samples), level);
                estimate.stddev(p, c) =
                    std::sqrt(estimate.stddev(p, c) * estimate.stddev(p, c) + estimate.agreed(p, c) * unseen);
            }
}

/// Pixels of a region without a usable sample.
std::int64_t emptyPixels(const RegionData& data) {
    std::vector<bool> filled(static_cast<std::size_t>(data.pixels.pixels()));
    for (Eigen::Index i = 0; i < data.size(); ++i) filled[static_cast<std::size_t>(data.pixelOf(i))] = true;
    return std::count(filled.begin(), filled.end(), false);
}

}  // namespace

std::optional<std::string> Paper::validate() const {
    if (regionSize < 0 || regionSize > 64)
        return "expected a region size of 1 to 64 pixels, or 0 for the whole image, found " +
               std::to_string(regionSize);
    return std::nullopt;
}

ReconstructionReport reconstructPaper(const SampleSource& dump, const Paper& method, const RowSink& sink,
                                      const Progress& progress) {
    const DumpHeader& header = dump.header();
    const ChannelChoice channels = chooseChannels(header);
    const int radiance = channels.radianceCount();
    const bool whole = method.regionSize == 0;
    const PictureScale picture = measurePictureScale(dump);

    ReconstructionReport report;
    PaperReport& of = report.method.emplace<PaperReport>();
    const auto krigeBand = [&](const SampleBand& band, Image& rows) {
        const std::vector<Window> regions =
            whole ? std::vector<Window>{header.data} : regionsOf(rows.data, method.regionSize);
        std::vector<RegionDiagnostics> diagnostics(regions.size());
        std::vector<std::int64_t> dropped(regions.size()), empty(regions.size());
        std::vector<std::optional<RegionInspection>> inspections(regions.size());
        parallelFor(0, static_cast<std::int64_t>(regions.size()), [&](std::int64_t i) {
            const auto index = static_cast<std::size_t>(i);
            const RegionData data = gatherRegion(band, channels.layout, regions[index], kCellsPerPixel);
            if (data.size() > kMaxRegionData)
                throw Error(dump.path(), "a region holds " + std::to_string(data.size()) + " data, at most " +
                                             std::to_string(kMaxRegionData) + " can be kriged together");
            const bool inspect =
                std::any_of(method.inspect.begin(), method.inspect.end(),
                            [&](const auto& p) { return regions[index].contains(p.first, p.second); });
            RegionEstimate estimate = krigeRegion(data, method, inspect);
            if (inspect) inspections[index] = std::move(estimate.inspection);
            doubt(picture, estimate);
            store(estimate, radiance, rows);
            diagnostics[index] = estimate.diagnostics;
            dropped[index] = data.dropped;
            empty[index] = emptyPixels(data);
        });
        for (std::size_t i = 0; i < regions.size(); ++i) {
            ++of.outcomes[static_cast<std::size_t>(diagnostics[i].outcome)];
            report.droppedSamples += dropped[i];
            report.emptyPixels += empty[i];
            of.jitteredSystems += diagnostics[i].jitter > 0 ? 1 : 0;
            of.inaccuratePixels += diagnostics[i].inaccurate;
            if (inspections[i]) of.inspections[of.regions.size() + i] = std::move(*inspections[i]);
        }
        of.regions.insert(of.regions.end(), diagnostics.begin(), diagnostics.end());
    };
    forEachBand(dump, channels, method.regionSize, report, sink, progress, krigeBand);
    return report;
}

}  // namespace vlx
