#include <array>
#include <cmath>
#include <limits>
#include <set>

#include "sweep/sweep.h"
#include "sweep/sweep_json.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

using Json = nlohmann::ordered_json;

namespace {

constexpr std::array<const char*, 3> kKinds = {"sampling", "image", "inspection"};

double numberOf(const Json& json) {
    return json.is_null() ? std::numeric_limits<double>::quiet_NaN() : json.get<double>();
}

Reliability reliabilityFrom(const Json& json) {
    Reliability r;
    r.calibration.withinOne = numberOf(json.at("withinOne"));
    r.calibration.withinTwo = numberOf(json.at("withinTwo"));
    r.calibration.predictedRmse = numberOf(json.at("predictedRmse"));
    r.calibration.actualRmse = numberOf(json.at("actualRmse"));
    r.calibration.values = json.at("values");
    r.calibration.excluded = json.at("excluded");
    for (const Json& bin : json.at("bins"))
        r.bins.push_back({numberOf(bin.at(0)), numberOf(bin.at(1)), bin.at(2)});
    for (std::size_t i = 0; i < r.scores.size(); ++i) r.scores[i] = numberOf(json.at("scores").at(i));
    for (std::size_t i = 0; i < r.coverage.size(); ++i) r.coverage[i] = numberOf(json.at("coverage").at(i));
    r.below = numberOf(json.at("below"));
    r.above = numberOf(json.at("above"));
    r.certain = numberOf(json.at("certain"));
    r.meanScore = numberOf(json.at("meanScore"));
    r.meanSquareScore = numberOf(json.at("meanSquareScore"));
    return r;
}

Json numbers(const std::map<std::string, double>& values) {
    Json json = Json::object();
    for (const auto& [name, value] : values) json[name] = numberJson(value);
    return json;
}

std::map<std::string, double> numbersFrom(const Json& json) {
    std::map<std::string, double> values;
    for (const auto& [name, value] : json.items()) values[name] = numberOf(value);
    return values;
}

std::string csvText(const std::string& text) {
    if (text.find_first_of(",\"\n") == std::string::npos) return text;
    std::string quoted = "\"";
    for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
    return quoted + "\"";
}

std::string csvNumber(double value) { return std::isfinite(value) ? Json(value).dump() : ""; }

}  // namespace

Json toJson(const Reliability& r) {
    Json json = {{"withinOne", numberJson(r.calibration.withinOne)},
                 {"withinTwo", numberJson(r.calibration.withinTwo)},
                 {"predictedRmse", numberJson(r.calibration.predictedRmse)},
                 {"actualRmse", numberJson(r.calibration.actualRmse)},
                 {"values", r.calibration.values},
                 {"excluded", r.calibration.excluded},
                 {"below", numberJson(r.below)},
                 {"above", numberJson(r.above)},
                 {"certain", numberJson(r.certain)},
                 {"meanScore", numberJson(r.meanScore)},
                 {"meanSquareScore", numberJson(r.meanSquareScore)}};
    json["bins"] = Json::array();
    for (const ReliabilityBin& bin : r.bins)
        json["bins"].push_back({numberJson(bin.predicted), numberJson(bin.actual), bin.values});
    json["scores"] = Json::array();
    for (const double share : r.scores) json["scores"].push_back(numberJson(share));
    json["coverage"] = Json::array();
    for (const double share : r.coverage) json["coverage"].push_back(numberJson(share));
    return json;
}

std::string samplingText(const SweepSampling& sampling) {
    return formatted(sampling.hierarchical ? "tolerance %g" : "%g spp", sampling.setting);
}

std::string toJsonLine(const SweepRecord& r) {
    Json json = {{"key", r.key},
                 {"kind", kKinds[static_cast<std::size_t>(r.kind)]},
                 {"method", r.method},
                 {"knob", r.knob},
                 {"sampling", r.sampling.hierarchical ? "hierarchical" : "uniform"},
                 {"setting", r.sampling.setting},
                 {"seed", r.seed},
                 {"command", r.command},
                 {"failure", r.failure},
                 {"samplesPerPixel", r.samplesPerPixel},
                 {"dumpBytes", r.dumpBytes},
                 {"seconds", numberJson(r.seconds)},
                 {"cpuSeconds", numberJson(r.cpuSeconds)},
                 {"peakBytes", r.peakBytes},
                 {"load", numberJson(r.load)},
                 {"stages", numbers(r.stages)},
                 {"values", numbers(r.values)},
                 {"file", r.file}};
    if (r.reliability) json["reliability"] = toJson(*r.reliability);
    return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

SweepRecord parseRecord(const std::string& line, const std::string& path) {
    try {
        const Json json = Json::parse(line);
        SweepRecord r;
        r.key = json.at("key");
        const std::string kind = json.at("kind");
        r.kind = kind == kKinds[0] ? SweepKind::Sampling
                                   : (kind == kKinds[1] ? SweepKind::Image : SweepKind::Inspection);
        r.method = json.at("method");
        r.knob = json.at("knob");
        r.sampling = {json.at("sampling") == "hierarchical", json.at("setting")};
        r.seed = json.at("seed");
        r.command = json.at("command");
        r.failure = json.at("failure");
        r.samplesPerPixel = json.at("samplesPerPixel");
        r.dumpBytes = json.at("dumpBytes");
        r.seconds = numberOf(json.at("seconds"));
        r.cpuSeconds = numberOf(json.at("cpuSeconds"));
        r.peakBytes = json.at("peakBytes");
        r.load = numberOf(json.at("load"));
        r.stages = numbersFrom(json.at("stages"));
        r.values = numbersFrom(json.at("values"));
        r.file = json.at("file");
        if (json.contains("reliability")) r.reliability = reliabilityFrom(json.at("reliability"));
        return r;
    } catch (const Json::exception& error) {
        throw Error(path, std::string("expected a line that a sweep wrote: ") + error.what());
    }
}

std::string toCsv(const std::vector<SweepRecord>& records) {
    std::set<std::string> stages, values;
    for (const SweepRecord& r : records) {
        for (const auto& [name, value] : r.stages) stages.insert(name);
        for (const auto& [name, value] : r.values) values.insert(name);
    }
    std::string text =
        "kind,method,knob,sampling,setting,seed,samples_per_pixel,dump_bytes,seconds,cpu_seconds,peak_bytes,"
        "load,failure,command";
    for (const auto& name : stages) text += ",seconds_" + csvText(name);
    for (const auto& name : values) text += "," + csvText(name);
    text += "\n";
    for (const SweepRecord& r : records) {
        text += std::string(kKinds[static_cast<std::size_t>(r.kind)]) + "," + csvText(r.method) + "," +
                csvText(r.knob) + "," + (r.sampling.hierarchical ? "hierarchical" : "uniform") + "," +
                csvNumber(r.sampling.setting) + "," + std::to_string(r.seed) + "," +
                csvNumber(r.samplesPerPixel) + "," + std::to_string(r.dumpBytes) + "," +
                csvNumber(r.seconds) + "," + csvNumber(r.cpuSeconds) + "," + std::to_string(r.peakBytes) +
                "," + csvNumber(r.load) + "," + csvText(r.failure) + "," + csvText(r.command);
        for (const auto& [names, map] : {std::pair{&stages, &r.stages}, std::pair{&values, &r.values}})
            for (const auto& name : *names) {
                const auto found = map->find(name);
                text += "," + (found == map->end() ? std::string() : csvNumber(found->second));
            }
        text += "\n";
    }
    return text;
}

}  // namespace vlx
