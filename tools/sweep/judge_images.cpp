#include "sweep/judge_images.h"

#include <cmath>
#include <map>
#include <optional>
#include <vector>

#include "sweep/assess_image.h"
#include "variolux/compare/colour_image.h"
#include "variolux/compare/sequence.h"

namespace vlx {

namespace {

/// Frames one below the other: for what looks at single pixels.
struct Strip {
    Image reference, colour, stddev, referenceStddev;

    static void append(Image& strip, const Image& frame) {
        if (strip.pixels.empty()) {
            strip = frame;
            return;
        }
        strip.data.height += frame.data.height;
        strip.pixels.insert(strip.pixels.end(), frame.pixels.begin(), frame.pixels.end());
    }
};

}  // namespace

void judgeImages(const SweepPlan& plan, const std::string& command, const std::string& dump,
                 const std::string& image, const std::string& stem, SweepRecord& record) {
    const std::vector<std::string> dumps = plan.files(dump), images = plan.files(image);
    const double count = static_cast<double>(images.size());
    const auto add = [&](const std::string& name, double value) { record.values[name] += value / count; };
    SequenceComparison sequence;
    Strip strip;
    bool mapped = true, referenceMapped = true;
    for (std::size_t i = 0; i < images.size(); ++i) {
        const std::string& path = images[i];
        const ColourImage made = readColour(path, {}, true);
        const Image& colour = made.colour;
        const std::optional<Image>& stddev = made.stddev;
        mapped = mapped && stddev;
        if (!plan.references.empty()) {
            const ReferenceImage& reference = plan.references[i];
            sequence.add(plan.frames.empty() ? 0 : plan.frames[i], reference.colour, colour, nullptr, path);
            referenceMapped = referenceMapped && reference.stddev;
            if (reference.stddev)
                add("floor", predictedError(reference.colour, *reference.stddev, path).relMse);
            if (stddev) {
                record.values["exact_pixels"] += exactPixels(colour, *stddev, reference);
                Strip::append(strip.reference, reference.colour);
                Strip::append(strip.colour, colour);
                Strip::append(strip.stddev, *stddev);
                if (reference.stddev) Strip::append(strip.referenceStddev, *reference.stddev);
            }
        }
        if (stddev) {
            const PredictedError predicted = predictedError(colour, *stddev, path);
            add("predicted_rmse", predicted.rmse);
            add("predicted_relmse", predicted.relMse);
        } else if (plan.references.empty()) {
            for (const auto& [name, value] : assessedErrors(plan, command, dumps[i], path, stem))
                add(name, value);
        }
    }
    if (plan.references.empty()) return;

    const SequenceErrors errors = sequence.errors();
    for (const SequenceFrame& frame : errors.frames)
        for (const MetricInfo& info : metricInfos())
            add(std::string(info.name), frame.comparison[info.metric]);
    if (std::isfinite(errors.flicker.value)) record.values["flicker"] = errors.flicker.value;
    if (mapped)
        record.reliability = reliabilityOf(
            strip.reference, strip.colour, strip.stddev,
            referenceMapped ? std::optional(strip.referenceStddev) : std::nullopt, images.front());
}

}  // namespace vlx
