#include "variolux/reconstruct/reconstruct.h"

#include <algorithm>
#include <limits>

#include "reconstruct/common/bands.h"
#include "reconstruct/common/methods.h"
#include "reconstruct/common/relative_error.h"
#include "reconstruct/opinion/opinion.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"

namespace vlx {

Reconstruction wholeOf(const SampleSource& source, const Image& outline,
                       const std::function<ReconstructionReport(const RowSink&)>& rowsOf) {
    requireMemory(source.path(), imageBytes(outline.data, outline.channels.size()), "an image held whole");
    Reconstruction result;
    result.image = Image(outline.data, outline.channels);
    result.image.display = outline.display;
    int row = 0;
    result.report = rowsOf([&](const float* rows, int count) {
        std::copy(rows, rows + std::ptrdiff_t{count} * outline.data.width * outline.channelCount(),
                  result.image.at(0, row));
        row += count;
    });
    return result;
}

namespace {

ReconstructionReport reconstructGaussian(const SampleSource& source, const Gaussian& method,
                                         const RowSink& sink, const Progress& progress) {
    const Mean mean{.empty = std::numeric_limits<float>::quiet_NaN()};  // a hole to the filter
    const Reconstruction average = wholeOf(source, outline(source, mean), [&](const RowSink& keep) {
        return reconstructMean(source, mean, keep, progress);
    });
    const Image filtered = gaussianFilter(average.image.select({"R", "G", "B"}), method.sigma).image;
    sink(filtered.pixels.data(), filtered.data.height);
    return average.report;
}

}  // namespace

void requireInside(const std::vector<std::pair<int, int>>& pixels, const Window& window,
                   const std::string& path) {
    for (const auto& [x, y] : pixels)
        if (!window.contains(x, y))
            throw Error(path, "expected pixels to inspect within " + windowText(window) + ", found (" +
                                  std::to_string(x) + ", " + std::to_string(y) + ")");
}

Image outline(const SampleSource& source, const Method& method) {
    if (const Drift* drift = std::get_if<Drift>(&method)) return driftOutline(source, *drift);
    if (const Gaussian* gaussian = std::get_if<Gaussian>(&method))
        if (const auto broken = gaussian->validate()) throw Error("", *broken);
    if (const Paper* paper = std::get_if<Paper>(&method)) {
        if (const auto broken = paper->validate()) throw Error("", *broken);
        requireInside(paper->inspect, source.header().data, source.path());
    }
    Image image;
    image.data = source.header().data;
    image.display = source.header().display;
    image.channels = {"R", "G", "B"};
    if (std::holds_alternative<Gaussian>(method)) return image;
    if (findChannel(source.header(), "A") >= 0) image.channels.emplace_back("A");
    for (const char* layer : kStddevChannels) image.channels.emplace_back(layer);
    return image;
}

ReconstructionReport reconstruct(const SampleSource& source, const Method& method, const RowSink& sink,
                                 const Progress& progress) {
    const Image image = outline(source, method);  // throws when options are invalid
    struct Run {
        const SampleSource& source;
        const RowSink sink;
        const Progress& progress;
        auto operator()(const Drift& m) const {
            return m.secondOpinion ? reconstructWithOpinion(source, m, sink, progress)
                                   : reconstructDrift(source, m, sink, progress);
        }
        auto operator()(const Paper& m) const { return reconstructPaper(source, m, sink, progress); }
        auto operator()(const Mean& m) const { return reconstructMean(source, m, sink, progress); }
        auto operator()(const Gaussian& m) const { return reconstructGaussian(source, m, sink, progress); }
    };
    MeasuredRows measured(image, sink);
    ReconstructionReport report = std::visit(Run{source, measured.sink(), progress}, method);
    report.predictedRelMse = measured.relMse();
    return report;
}

Reconstruction reconstruct(const SampleSource& source, const Method& method, const Progress& progress) {
    return wholeOf(source, outline(source, method),
                   [&](const RowSink& keep) { return reconstruct(source, method, keep, progress); });
}

}  // namespace vlx
