#include "variolux/reconstruct/reconstruction.h"

#include <nlohmann/json.hpp>
#include <sstream>

namespace vlx {

namespace {

nlohmann::ordered_json json(const ReconstructionReport& report) {
    nlohmann::ordered_json regions = nlohmann::ordered_json::object();
    for (int i = 0; i < kRegionOutcomes; ++i)
        regions[std::string(name(static_cast<RegionOutcome>(i)))] =
            report.regions[static_cast<std::size_t>(i)];
    return {{"samples", report.samples},
            {"droppedSamples", report.droppedSamples},
            {"limitedSamples", report.limitedSamples},
            {"energyRemoved", report.energyRemoved},
            {"emptyPixels", report.emptyPixels},
            {"exactPixels", report.exactPixels},
            {"regions", regions},
            {"jitteredSystems", report.jitteredSystems},
            {"neighbourhoods", report.neighbourhoods},
            {"ownNeighbourhoods", report.ownNeighbourhoods},
            {"failedNeighbourhoods", report.failedNeighbourhoods},
            {"driftFunctions", report.neighbourhoods > 0
                                   ? report.driftFunctions / static_cast<double>(report.neighbourhoods)
                                   : 0},
            {"seconds", report.seconds},
            {"readSeconds", report.readSeconds},
            {"solveSeconds", report.solveSeconds}};
}

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
    std::ostringstream text;
    text << report.samples << " samples";
    if (report.droppedSamples > 0) text << ", " << report.droppedSamples << " dropped (non-finite)";
    if (report.emptyPixels > 0) text << ", " << report.emptyPixels << " pixels without samples";
    text << "\n";
    bool first = true;
    for (int i = 0; i < kRegionOutcomes; ++i) {
        const std::int64_t count = report.regions[static_cast<std::size_t>(i)];
        if (count == 0) continue;
        text << (first ? "regions: " : ", ") << count << " " << name(static_cast<RegionOutcome>(i));
        first = false;
    }
    if (!first) text << "\n";
    if (report.limitedSamples > 0)
        text << report.limitedSamples << " fireflies limited, " << 100 * report.energyRemoved
             << " % of the light removed\n";
    if (report.neighbourhoods > 0)
        text << report.neighbourhoods << " neighbourhoods kriged, "
             << report.driftFunctions / static_cast<double>(report.neighbourhoods)
             << " drift functions on average\n";
    if (report.failedNeighbourhoods > 0)
        text << report.failedNeighbourhoods << " neighbourhoods fell back to their mean\n";
    if (report.jitteredSystems > 0) text << report.jitteredSystems << " systems needed jitter\n";
    return text.str();
}

std::string toJson(const ReconstructionReport& report) { return json(report).dump(2); }

std::string toJson(const Reconstruction& reconstruction) {
    nlohmann::ordered_json document = {{"report", json(reconstruction.report)}};
    auto& regions = document["regions"] = nlohmann::ordered_json::array();
    for (const RegionDiagnostics& r : reconstruction.regions)
        regions.push_back({{"x", r.pixels.x},
                           {"y", r.pixels.y},
                           {"width", r.pixels.width},
                           {"height", r.pixels.height},
                           {"outcome", name(r.outcome)},
                           {"data", r.data},
                           {"samples", r.samples},
                           {"nugget", r.nugget},
                           {"sill", r.sill},
                           {"range", r.range},
                           {"exponent", r.exponent},
                           {"errorVariance", r.errorVariance},
                           {"colourScale", r.colourScale},
                           {"condition", r.condition},
                           {"jitter", r.jitter}});
    return document.dump(1);
}

void addDiagnosticLayers(Reconstruction& reconstruction) {
    const Image& old = reconstruction.image;
    std::vector<std::string> channels = old.channels;
    for (const char* layer : {"nugget", "sill", "range", "exponent", "errorVariance", "outcome"})
        channels.push_back(std::string("diagnostics.") + layer);
    Image image(old.data, channels);
    image.display = old.display;
    for (int row = 0; row < image.data.height; ++row)
        for (int col = 0; col < image.data.width; ++col)
            std::copy_n(old.at(col, row), old.channelCount(), image.at(col, row));
    for (const RegionDiagnostics& r : reconstruction.regions)
        for (int row = r.pixels.y; row < r.pixels.y + r.pixels.height; ++row)
            for (int col = r.pixels.x; col < r.pixels.x + r.pixels.width; ++col) {
                float* values = image.at(col - image.data.x, row - image.data.y) + old.channelCount();
                for (const double value :
                     {r.nugget, r.sill, r.range, r.exponent, r.errorVariance, static_cast<double>(r.outcome)})
                    *values++ = static_cast<float>(value);
            }
    reconstruction.image = std::move(image);
}

}  // namespace vlx
