#include "sequence/sequence_report.h"

#include <cmath>

#include "page/page.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

using Json = nlohmann::ordered_json;
using Row = std::vector<std::string>;

std::string figure(double value) { return std::isnan(value) ? "n/a" : formatted("%.3g", value); }

// "1 to 5", or where some between are not there, their number too.
std::string framesText(const std::vector<int>& frames) {
    const std::string first = std::to_string(frames.front()), last = std::to_string(frames.back());
    const std::string count = std::to_string(frames.size());
    if (frames.size() == 1) return "1 frame (" + first + ")";
    const bool gaps = frames.back() - frames.front() + 1 != static_cast<int>(frames.size());
    return count + " frames (" + first + " to " + last + (gaps ? ", not all)" : ")");
}

// A value and, in a second row, its interval.
void addRows(std::vector<Row>& rows, const SequenceReport& report, const std::string& title,
             Interval SequenceErrors::*value) {
    Row values = {title}, intervals = {"  95 %"};
    for (const auto& sequence : report.sequences) {
        const Interval& i = sequence.errors.*value;
        values.push_back(figure(i.value));
        intervals.push_back(std::isnan(i.lower) ? "n/a" : figure(i.lower) + " to " + figure(i.upper));
    }
    rows.push_back(std::move(values));
    rows.push_back(std::move(intervals));
}

// Of all sequences: pixels that are in no metric.
std::string exclusions(const SequenceReport& report) {
    std::string text;
    for (const auto& sequence : report.sequences) {
        std::int64_t excluded = 0;
        for (const SequenceFrame& frame : sequence.errors.frames) excluded += frame.comparison.excluded;
        if (excluded > 0)
            text += sequence.name + ": " + std::to_string(excluded) +
                    " pixels of all frames are not finite, in it or in the reference, and left out\n";
    }
    return text;
}

Json named(const Interval& interval) {
    return {{"value", numberJson(interval.value)},
            {"lower", numberJson(interval.lower)},
            {"upper", numberJson(interval.upper)}};
}

}  // namespace

std::string toText(const SequenceReport& report) {
    std::vector<Row> rows;
    Row& names = rows.emplace_back(Row{"relMSE of frame"});
    for (const auto& sequence : report.sequences) names.push_back(sequence.name);
    for (std::size_t i = 0; i < report.frames.size(); ++i) {
        Row& row = rows.emplace_back(Row{"  " + std::to_string(report.frames[i])});
        for (const auto& sequence : report.sequences)
            row.push_back(figure(sequence.errors.frames[i].comparison[Metric::RelMse]));
    }
    addRows(rows, report, "relMSE of all", &SequenceErrors::relMse);
    addRows(rows, report, "flicker", &SequenceErrors::flicker);
    if (!report.motion.empty())
        addRows(rows, report, "flicker along motion", &SequenceErrors::flickerAlongMotion);
    return framesText(report.frames) + " of " + std::to_string(report.window.width) + " x " +
           std::to_string(report.window.height) + " pixels, against " + report.reference + "\n\n" +
           aligned(rows) + exclusions(report);
}

std::string toJson(const SequenceReport& report) {
    const Window& w = report.window;
    Json json = {{"reference", report.reference},
                 {"motion", report.motion.empty() ? Json(nullptr) : Json(report.motion)},
                 {"window", {w.x, w.y, w.width, w.height}},
                 {"tile", kSequenceTile},
                 {"sequences", Json::array()}};
    for (const auto& sequence : report.sequences) {
        Json frames = Json::array();
        for (const SequenceFrame& frame : sequence.errors.frames) {
            Json metrics = Json::object();
            for (const MetricInfo& info : metricInfos())
                metrics[std::string(info.name)] = numberJson(frame.comparison[info.metric]);
            frames.push_back({{"frame", frame.number},
                              {"metrics", std::move(metrics)},
                              {"excluded", frame.comparison.excluded},
                              {"flicker", numberJson(frame.flicker)},
                              {"flicker_along_motion", numberJson(frame.flickerAlongMotion)}});
        }
        json["sequences"].push_back({{"path", sequence.path},
                                     {"name", sequence.name},
                                     {"relmse", named(sequence.errors.relMse)},
                                     {"flicker", named(sequence.errors.flicker)},
                                     {"flicker_along_motion", named(sequence.errors.flickerAlongMotion)},
                                     {"frames", std::move(frames)}});
    }
    return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vlx
