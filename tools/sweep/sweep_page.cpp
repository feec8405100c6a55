#include "sweep/sweep_page.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "page/page.h"
#include "sweep/sweep_json.h"
#include "variolux/base/error.h"
#include "variolux/compare/colour_image.h"

namespace vlx {

extern const PageSources kSweepPage;

namespace {

using Json = nlohmann::ordered_json;

/// Root of the mean variance of the colours.
Image meanDeviation(const Image& stddev) {
    Image mean(stddev.data, {"Y"});
    for (int row = 0; row < mean.data.height; ++row)
        for (int col = 0; col < mean.data.width; ++col) {
            const float* s = stddev.at(col, row);
            *mean.at(col, row) = std::sqrt((s[0] * s[0] + s[1] * s[1] + s[2] * s[2]) / 3);
        }
    return mean;
}

Json imageJson(const std::string& path) {
    const ColourImage image = readColour(path, {}, true);
    const int factor = pageImageFactor(image.colour.data);
    Json json = pageImage(image.colour, factor);
    if (image.stddev) json["stddev"] = packedPlanes(meanDeviation(*image.stddev), factor);
    return json;
}

template <typename Value>
Json mapJson(const std::map<std::string, Value>& map) {
    Json json = Json::object();
    for (const auto& [name, value] : map) {
        if constexpr (std::is_same_v<Value, double>)
            json[name] = numberJson(value);
        else if constexpr (std::is_same_v<Value, SweepSetting::Ratio>)
            json[name] = {{"ratio", intervalJson(value.ratio)}, {"extrapolated", value.extrapolated}};
        else
            json[name] = intervalJson(value);
    }
    return json;
}

Json settingJson(const Sweep& sweep, const SweepSetting& s) {
    Json json = {{"method", s.method},
                 {"knob", s.knob},
                 {"hierarchical", s.sampling.hierarchical},
                 {"setting", s.sampling.setting},
                 {"samplesPerPixel", s.samplesPerPixel},
                 {"seconds", intervalJson(s.seconds)},
                 {"samplingSeconds", intervalJson(s.samplingSeconds)},
                 {"imageSeconds", intervalJson(s.imageSeconds)},
                 {"cpuSeconds", intervalJson(s.cpuSeconds)},
                 {"peakBytes", s.peakBytes},
                 {"stages", mapJson(s.stages)},
                 {"values", mapJson(s.values)},
                 {"speedUp", mapJson(s.speedUp)},
                 {"errorRatio", mapJson(s.errorRatio)},
                 {"samplesSaved", mapJson(s.samplesSaved)},
                 {"command", s.command},
                 {"samplingCommand", s.samplingCommand},
                 {"failures", s.failures},
                 {"runs", s.records.size()}};
    json["agreement"] = s.agreement ? intervalJson(*s.agreement) : Json(nullptr);
    json["reliability"] = Json::array();
    for (const std::size_t i : s.records) {
        const SweepRecord& record = sweep.records[i];
        if (record.reliability) json["reliability"].push_back(toJson(*record.reliability));
        if (!record.file.empty() && record.seed == 1)
            json["image"] = imageJson(sweep.options.folder + "/" + shownFrame(sweep.options, record.file));
    }
    return json;
}

Json inspectionsJson(const Sweep& sweep) {
    Json all = Json::array();
    for (const SweepRecord& record : sweep.records) {
        if (record.kind != SweepKind::Inspection || !record.failure.empty()) continue;
        const std::string path = sweep.options.folder + "/" + record.file;
        std::ifstream stream(path, std::ios::binary);
        Json document = Json::parse(stream, nullptr, false);
        if (!document.is_object() || !document.contains("regions"))
            throw Error(path, "expected the JSON that vlx-krige --diagnostics writes");
        all.push_back({{"method", record.method},
                       {"setting", record.sampling.setting},
                       {"regions", std::move(document["regions"])}});
    }
    return all;
}

Json pageData(const Sweep& sweep, const SweepSummary& summary, const SweepPageOptions& options) {
    Json data = {{"input", sweep.options.input},
                 {"reference", sweep.options.reference},
                 {"frames", sweep.options.frames},
                 {"shownFrame", shownFrame(sweep.options, "#")},
                 {"fromDump", sweep.fromDump},
                 {"imageTimesOnly", summary.imageTimesOnly},
                 {"date", sweep.date},
                 {"seeds", sweep.options.seeds},
                 {"threads", sweep.options.threads},
                 {"detail", sweep.options.detailSpp},
                 {"machine",
                  {{"processor", sweep.machine.processor},
                   {"processors", sweep.machine.processors},
                   {"memory", sweep.machine.memoryGigabytes},
                   {"system", sweep.machine.system}}}};
    data["measures"] = Json::array();
    for (const SweepMeasure& m : sweepMeasures())
        if (!m.needsReference || !sweep.options.reference.empty())
            data["measures"].push_back({{"name", m.name}, {"title", m.title}});
    data["loads"] = Json::array();
    for (const SweepRecord& r : sweep.records)
        if (r.kind == SweepKind::Image) data["loads"].push_back(numberJson(r.load));
    data["settings"] = Json::array();
    for (const SweepSetting& s : summary.settings) data["settings"].push_back(settingJson(sweep, s));
    data["series"] = Json::array();
    for (const SweepSeries& s : summary.series)
        data["series"].push_back({{"method", s.method},
                                  {"hierarchical", s.hierarchical},
                                  {"name", s.name},
                                  {"settings", s.settings},
                                  {"slopeBySamples", mapJson(s.slopeBySamples)},
                                  {"slopeByTime", mapJson(s.slopeByTime)}});
    data["pareto"] = summary.pareto;
    data["equalTimes"] = Json::array();
    for (const EqualTime& t : summary.equalTimes) {
        Json errors = Json::object();
        for (const auto& [series, byMeasure] : t.errors) errors[series] = mapJson(byMeasure);
        data["equalTimes"].push_back({{"seconds", t.seconds}, {"budget", t.budget}, {"errors", errors}});
    }
    data["targets"] = Json::array();
    for (const SweepTarget& target : options.targets) {
        const auto best = cheapestSetting(summary, target);
        data["targets"].push_back({{"measure", target.measure},
                                   {"value", target.value},
                                   {"setting", best ? Json(*best) : Json(nullptr)}});
    }
    data["crops"] = Json::array();
    for (const Window& crop : options.crops)
        data["crops"].push_back({crop.x, crop.y, crop.width, crop.height});
    if (!sweep.options.reference.empty())
        data["referenceImage"] = imageJson(shownFrame(sweep.options, sweep.options.reference));
    data["inspections"] = inspectionsJson(sweep);
    return data;
}

}  // namespace

std::string toHtml(const Sweep& sweep, const SweepSummary& summary, const SweepPageOptions& options) {
    const std::size_t slash = sweep.options.input.find_last_of('/');
    return pageOf(kSweepPage, sweep.options.input.substr(slash == std::string::npos ? 0 : slash + 1),
                  pageData(sweep, summary, options));
}

}  // namespace vlx
