#include "variolux/reconstruct/reconstruction.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "variolux/base/text.h"

namespace vlx {

namespace {

double perNeighbourhood(const DriftReport& report, double sum) {
    return report.neighbourhoods > 0 ? sum / static_cast<double>(report.neighbourhoods) : 0;
}

nlohmann::ordered_json json(const PaperReport& report) {
    nlohmann::ordered_json regions = nlohmann::ordered_json::object();
    for (int i = 0; i < kRegionOutcomes; ++i)
        regions[std::string(name(static_cast<RegionOutcome>(i)))] =
            report.outcomes[static_cast<std::size_t>(i)];
    return {{"regions", regions},
            {"jitteredSystems", report.jitteredSystems},
            {"inaccuratePixels", report.inaccuratePixels}};
}

nlohmann::ordered_json json(const DriftReport& report) {
    nlohmann::ordered_json document = {
        {"limitedSamples", report.limitedSamples},
        {"energyRemoved", report.energyRemoved},
        {"energyReturned", report.energyReturned},
        {"light", report.light},
        {"lightError", report.lightError},
        {"neighbourCorrelation", report.neighbourCorrelation},
        {"farPixels", report.farPixels},
        {"exactPixels", report.exactPixels},
        {"neighbourhoods", report.neighbourhoods},
        {"ownNeighbourhoods", report.ownNeighbourhoods},
        {"failedNeighbourhoods", report.failedNeighbourhoods},
        {"driftFeatures", perNeighbourhood(report, static_cast<double>(report.driftFeatures))},
        {"driftFunctions", perNeighbourhood(report, report.driftFunctions)},
        {"seconds", report.seconds}};
    if (const auto& of = report.sequence)
        document["sequence"] = {{"frames", of->frames},
                                {"wanted", of->wanted},
                                {"gain", of->gain},
                                {"equalSeeds", of->equalSeeds},
                                {"withoutMotion", of->withoutMotion}};
    if (const auto& of = report.secondOpinion)
        document["secondOpinion"] = {{"validated", of->validated},
                                     {"refused", of->refused},
                                     {"weight", of->weight},
                                     {"yielded", of->yielded},
                                     {"limited", of->limited}};
    return document;
}

nlohmann::ordered_json json(std::monostate) { return nlohmann::ordered_json::object(); }

nlohmann::ordered_json json(const ReconstructionReport& report) {
    nlohmann::ordered_json document = {{"samples", report.samples},
                                       {"droppedSamples", report.droppedSamples},
                                       {"emptyPixels", report.emptyPixels},
                                       {"readSeconds", report.readSeconds},
                                       {"solveSeconds", report.solveSeconds}};
    if (report.predictedRelMse) document["predictedRelMse"] = *report.predictedRelMse;
    document.update(std::visit([](const auto& of) { return json(of); }, report.method));
    return document;
}

/// Five digits: a drawing needs no more, and files stay small.
nlohmann::ordered_json rounded(double value) {
    if (!std::isfinite(value)) return nullptr;
    return std::strtod(formatted("%.5g", value).c_str(), nullptr);
}

std::string_view name(StructureType type) {
    switch (type) {
        case StructureType::Spherical:
            return "spherical";
        case StructureType::Exponential:
            return "exponential";
        case StructureType::Gaussian:
            return "gaussian";
        case StructureType::Stable:
            return "stable";
        case StructureType::Matern:
            return "matern";
        case StructureType::Linear:
            return "linear";
    }
    return "";
}

nlohmann::ordered_json json(const VariogramModel& model, double reach) {
    nlohmann::ordered_json document = {{"nugget", rounded(model.nugget)}};
    auto& structures = document["structures"] = nlohmann::ordered_json::array();
    for (const VariogramStructure& s : model.structures)
        structures.push_back({{"type", name(s.type)},
                              {"sill", rounded(s.sill)},
                              {"range", rounded(s.range)},
                              {"shape", rounded(s.shape)}});
    auto& curve = document["curve"] = nlohmann::ordered_json::array();
    constexpr int kPoints = 80;
    for (int i = 0; i <= kPoints; ++i) {
        const double h = reach * (i + 0.01) / kPoints;  // not 0, where gamma is 0 whatever the nugget
        curve.push_back({rounded(h), rounded(semivariance(model, h))});
    }
    return document;
}

nlohmann::ordered_json json(const RegionInspection& inspection) {
    const Window& w = inspection.neighbourhood;
    nlohmann::ordered_json document = {
        {"neighbourhood", {{"x", w.x}, {"y", w.y}, {"width", w.width}, {"height", w.height}}},
        {"distance", inspection.distance},
        {"pairs", inspection.pairs}};
    auto& cloud = document["cloud"] = nlohmann::ordered_json::array();
    for (const auto& [distance, value] : inspection.cloud)
        cloud.push_back({rounded(distance), rounded(value)});
    auto& classes = document["classes"] = nlohmann::ordered_json::array();
    for (const VariogramBin& bin : inspection.classes)
        classes.push_back({{"distance", rounded(bin.distance)},
                           {"semivariance", rounded(bin.semivariance)},
                           {"standardError", rounded(bin.standardError)},
                           {"pairs", rounded(bin.pairs)}});
    document["model"] = nullptr;
    if (!inspection.model.structures.empty())
        document["model"] =
            json(inspection.model, inspection.classes.empty() ? 1 : inspection.classes.back().upper);
    document["crossValidation"] = nullptr;
    if (const CrossValidation& v = inspection.crossValidation; v.data > 0)
        document["crossValidation"] = {
            {"data", v.data}, {"rmse", rounded(v.rmse)}, {"meanSquareScore", rounded(v.meanSquareScore)}};
    document["fallbacks"] = inspection.fallbacks;
    return document;
}

nlohmann::ordered_json json(const RegionDiagnostics& r) {
    return {{"outcome", name(r.outcome)},
            {"data", r.data},
            {"samples", r.samples},
            {"nugget", r.nugget},
            {"sill", r.sill},
            {"range", r.range},
            {"exponent", r.exponent},
            {"errorVariance", r.errorVariance},
            {"colourScale", r.colourScale},
            {"condition", r.condition},
            {"jitter", r.jitter},
            {"inaccurate", r.inaccurate}};
}

nlohmann::ordered_json json(const ResidualRegion& r) {
    return {{"data", r.data},           {"pairs", r.pairs},   {"nugget", r.nugget},
            {"sill", r.sill},           {"range", r.range},   {"exponent", r.exponent},
            {"statistic", r.statistic}, {"pValue", r.pValue}, {"structure", r.structure}};
}

std::string inWords(const PaperReport& report) {
    std::ostringstream text;
    bool first = true;
    for (int i = 0; i < kRegionOutcomes; ++i) {
        const std::int64_t count = report.outcomes[static_cast<std::size_t>(i)];
        if (count == 0) continue;
        text << (first ? "regions: " : ", ") << count << " " << name(static_cast<RegionOutcome>(i));
        first = false;
    }
    if (!first) text << "\n";
    if (report.jitteredSystems > 0) text << report.jitteredSystems << " systems needed jitter\n";
    if (report.inaccuratePixels > 0)
        text << report.inaccuratePixels << " pixels of ill-conditioned systems may be off by rounding\n";
    return text.str();
}

std::string lightInWords(const DriftReport& report) {
    std::ostringstream text;
    if (report.light > 0)
        text << "the image has " << 100 * report.light << " % of its samples' light (standard error "
             << 100 * report.lightError << " %)\n";
    else
        text << "no sample has light\n";
    return text.str();
}

std::string neighboursInWords(const DriftReport& report) {
    constexpr double kMuch = 0.1, kStandardErrors = 5;
    const double found = report.neighbourCorrelation;
    if (report.sequence || found < kMuch || found < kStandardErrors * report.neighbourCorrelationError)
        return {};
    return "WARNING: pixels beside each other share their noise (correlation " + formatted("%.2f", found) +
           "): a pixel filter gave samples to several of them, which kriging takes for structure and the "
           "error map does not know; render with a box filter of one pixel\n";
}

std::string inWords(const SequenceReport& of) {
    std::ostringstream text;
    if (of.frames == 0)
        text << "none of the " << of.wanted
             << " frames around it is there: nothing is added to its samples\n";
    else
        text << of.frames << " of " << of.wanted << " frames around it are there: they add "
             << std::round(100 * (of.gain - 1)) / 100 << " times as many samples as its own\n";
    if (of.frames > 0 && of.withoutMotion > 0)
        text << of.withoutMotion << " of these " << of.frames + 1
             << " have no motion vectors: there data are used as they lie, which is right where nothing "
                "moves\n";
    if (of.equalSeeds > 0)
        text << "WARNING: " << of.equalSeeds
             << " of them have the same seed: their noise is the same where nothing moves, and counts for "
                "nothing there; render every frame with a seed of its own\n";
    return text.str();
}

std::string inWords(const DriftReport& report) {
    constexpr double kMuchLight = 0.1;
    std::ostringstream text;
    text << report.limitedSamples << " fireflies limited, " << 100 * report.energyRemoved
         << " % of the light removed; " << 100 * report.energyReturned
         << " % given back where samples have more than the estimate"
         << (report.energyRemoved - report.energyReturned > kMuchLight
                 ? " (WARNING: much; where few samples find the light, --fireflies keep keeps it)\n"
                 : "\n")
         << lightInWords(report) << report.neighbourhoods << " neighbourhoods kriged, "
         << std::round(100 * perNeighbourhood(report, report.driftFunctions)) / 100
         << " drift functions on average, "
         << perNeighbourhood(report, static_cast<double>(report.driftFeatures)) << " features varying\n";
    text << neighboursInWords(report);
    if (report.sequence) text << inWords(*report.sequence);
    if (const auto& of = report.secondOpinion)
        text << "the kriging weighs " << 100 * of->weight << " %, the other image the rest ("
             << (of->validated         ? "validated on samples that neither had seen"
                 : of->refused.empty() ? "not validated: images of halves of the samples, made as the whole "
                                         "one, would tell more"
                                       : "WARNING: the images of halves were not used: " + of->refused)
             << "); in " << 100 * of->yielded << " % of the pixels samples speak against the other image, in "
             << 100 * of->limited << " % its pull is limited to " << kOpinionDeviations
             << " standard deviations\n";
    if (!report.residuals.empty())
        text << std::ranges::count_if(report.residuals, [](const ResidualRegion& r) { return r.structure; })
             << " of " << report.residuals.size()
             << " regions have structure left in their residuals (5 % would by chance)\n";
    if (report.failedNeighbourhoods > 0)
        text << report.failedNeighbourhoods << " neighbourhoods fell back to their mean\n";
    return text.str();
}

std::string inWords(std::monostate) { return {}; }

}  // namespace

std::string_view name(RegionOutcome outcome) {
    switch (outcome) {
        case RegionOutcome::Kriged:
            return "kriged";
        case RegionOutcome::NoStructure:
            return "no structure";
        case RegionOutcome::TooFewData:
            return "too few data";
        case RegionOutcome::AllEqual:
            return "all equal";
        case RegionOutcome::FitFailed:
            return "fit failed";
        case RegionOutcome::SolveFailed:
            return "solve failed";
        case RegionOutcome::Empty:
            return "empty";
    }
    return "";
}

std::string toText(const ReconstructionReport& report) {
    const DriftReport* drift = std::get_if<DriftReport>(&report.method);
    std::ostringstream text;
    text << report.samples << " samples";
    if (report.droppedSamples > 0)
        text << ", " << report.droppedSamples
             << (drift ? " dropped (non-finite, or beyond 10^15)" : " dropped (non-finite)");
    if (report.emptyPixels > 0) text << ", " << report.emptyPixels << " pixels without samples";
    if (drift && drift->farPixels > 0)
        text << " (" << drift->farPixels << " of them more than 5 pixels from any)";
    if (drift && drift->exactPixels > 0)
        text << ", " << drift->exactPixels << " pixels kept: their stated error is 0";
    text << "\n";
    if (report.predictedRelMse)
        text << "predicted error, relMSE: " << formatted("%.3g", *report.predictedRelMse) << "\n";
    text << std::visit([](const auto& of) { return inWords(of); }, report.method);
    return text.str();
}

std::string toJson(const ReconstructionReport& report) { return json(report).dump(2); }

std::string toJson(const Reconstruction& reconstruction) {
    nlohmann::ordered_json document = {{"report", json(reconstruction.report)}};
    auto& regions = document["regions"] = nlohmann::ordered_json::array();
    const auto add = [&](const auto& of, const auto& inspections) {
        for (std::size_t i = 0; i < of.size(); ++i) {
            const Window& w = of[i].pixels;
            regions.push_back({{"x", w.x}, {"y", w.y}, {"width", w.width}, {"height", w.height}});
            regions.back().update(json(of[i]));
            if (const auto found = inspections.find(i); found != inspections.end())
                regions.back()["inspection"] = json(found->second);
        }
    };
    if (const auto* drift = std::get_if<DriftReport>(&reconstruction.report.method))
        add(drift->residuals, drift->inspections);
    else
        add(reconstruction.report.paper().regions, reconstruction.report.paper().inspections);
    return document.dump(1);
}

void addDiagnosticLayers(Reconstruction& reconstruction) {
    const auto* drift = std::get_if<DriftReport>(&reconstruction.report.method);
    const std::vector<std::string> paperLayers = {"nugget",   "sill",          "range",
                                                  "exponent", "errorVariance", "outcome"};
    const std::vector<std::string> driftLayers = {"nugget", "sill", "range", "exponent", "pValue"};
    const Image& old = reconstruction.image;
    std::vector<std::string> channels = old.channels;
    for (const std::string& layer : drift ? driftLayers : paperLayers)
        channels.push_back("diagnostics." + layer);
    Image image(old.data, channels);
    image.display = old.display;
    for (int row = 0; row < image.data.height; ++row)
        for (int col = 0; col < image.data.width; ++col)
            std::copy_n(old.at(col, row), old.channelCount(), image.at(col, row));
    const auto fill = [&](const Window& pixels, std::initializer_list<double> of) {
        for (int row = pixels.y; row < pixels.y + pixels.height; ++row)
            for (int col = pixels.x; col < pixels.x + pixels.width; ++col) {
                float* values = image.at(col - image.data.x, row - image.data.y) + old.channelCount();
                for (const double value : of) *values++ = static_cast<float>(value);
            }
    };
    if (drift)
        for (const ResidualRegion& r : drift->residuals)
            fill(r.pixels, {r.nugget, r.sill, r.range, r.exponent, r.pValue});
    else
        for (const RegionDiagnostics& r : reconstruction.report.paper().regions)
            fill(r.pixels,
                 {r.nugget, r.sill, r.range, r.exponent, r.errorVariance, static_cast<double>(r.outcome)});
    reconstruction.image = std::move(image);
}

}  // namespace vlx
