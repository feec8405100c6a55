#include <algorithm>
#include <atomic>
#include <cmath>

#include "reconstruct/common/bands.h"
#include "reconstruct/common/methods.h"
#include "reconstruct/common/picture_scale.h"
#include "variolux/base/parallel.h"

namespace vlx {

namespace {

constexpr int kNeighbourhood = 4;

/// Variance of one sample over the neighbourhood of a pixel that has too few of its own.
Eigen::VectorXd borrowedVariance(const SampleBand& band, const BandLayout& layout, int column, int row) {
    Window around{column - ((column % kNeighbourhood) + kNeighbourhood) % kNeighbourhood, band.y,
                  kNeighbourhood, band.height};
    const int right = std::min(around.x + around.width, band.x + band.width);
    around.x = std::max(around.x, band.x);
    around.width = right - around.x;
    around.y = std::max(band.y, row - ((row % kNeighbourhood) + kNeighbourhood) % kNeighbourhood);
    around.height = std::min(kNeighbourhood, band.y + band.height - around.y);
    const RegionData data = gatherRegion(band, layout, around, 1);
    if (data.varianceKnown) return data.errorVariances.transpose() * data.counts / data.size();
    if (data.size() < 2) return Eigen::VectorXd::Zero(data.means.cols());
    const Eigen::RowVectorXd mean = data.means.colwise().mean();
    return (data.means.rowwise() - mean).colwise().squaredNorm().transpose() / (data.size() - 1.0);
}

}  // namespace

ReconstructionReport reconstructMean(const SampleSource& dump, const Mean& method, const RowSink& sink,
                                     const Progress& progress) {
    ChannelChoice channels = chooseChannels(dump.header());
    channels.names.resize(channels.layout.radiance.size());  // positions are not needed
    channels.layout.x = channels.layout.y = -1;
    const int radiance = channels.radianceCount();

    const PictureScale picture = measurePictureScale(dump);
    ReconstructionReport report;
    std::atomic<std::int64_t> dropped = 0, empty = 0;
    const auto average = [&](const SampleBand& band, Image& rows) {
        parallelFor(0, band.height, [&](std::int64_t line) {
            const int row = static_cast<int>(line);
            for (int col = 0; col < band.width; ++col) {
                const RegionData pixel =
                    gatherRegion(band, channels.layout, Window{band.x + col, band.y + row, 1, 1}, 1);
                dropped += pixel.dropped;
                float* out = rows.at(col, row);
                if (pixel.samples == 0) {
                    ++empty;
                    std::fill_n(out, radiance, method.empty);
                    for (int c = 0; c < 3; ++c)
                        out[radiance + c] = static_cast<float>(picture.unknownDeviation(c));
                    continue;
                }
                const Eigen::VectorXd variance =
                    pixel.varianceKnown ? Eigen::VectorXd(pixel.errorVariances.row(0) * pixel.counts[0])
                                        : borrowedVariance(band, channels.layout, band.x + col, band.y + row);
                for (int c = 0; c < radiance; ++c) out[c] = static_cast<float>(pixel.means(0, c));
                for (int c = 0; c < 3; ++c)
                    out[radiance + c] = static_cast<float>(std::sqrt(variance[c] / pixel.counts[0]));
            }
        });
    };
    forEachBand(dump, channels, kNeighbourhood, report, sink, progress, average);
    report.droppedSamples = dropped;
    report.emptyPixels = empty;
    return report;
}

}  // namespace vlx
