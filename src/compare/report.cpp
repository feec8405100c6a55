#include "variolux/compare/report.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

const MetricInfo& infoOf(Metric metric) { return metricInfos()[static_cast<std::size_t>(metric)]; }

bool isCount(Metric metric) { return metric == Metric::NonFinite || metric == Metric::Negative; }

/// What limits and rankings look at.
double judged(Metric metric, double value) { return metric == Metric::Bias ? std::abs(value) : value; }

std::string cell(Metric metric, double value) {
    if (std::isnan(value)) return "n/a";
    switch (metric) {
        case Metric::Mape:
            return formatted("%.2f %%", 100 * value);
        case Metric::Bias:
            return formatted("%+.3f %%", 100 * value);
        case Metric::Psnr:
            return formatted("%.2f", value);
        case Metric::Ssim:
            return formatted("%.4f", value);
        case Metric::NonFinite:
        case Metric::Negative:
            return formatted("%.0f", value);
        default:
            return formatted("%.4g", value);
    }
}

std::vector<std::string> metricRow(const Report& report, const MetricInfo& info) {
    std::optional<double> best;
    if (report.images.size() > 1 && !isCount(info.metric))
        for (const ReportEntry& entry : report.images) {
            const double value = judged(info.metric, entry.comparison[info.metric]);
            if (std::isnan(value)) continue;
            if (!best || (info.higherIsBetter ? value > *best : value < *best)) best = value;
        }
    std::vector<std::string> row = {std::string(info.title)};
    for (const ReportEntry& entry : report.images) {
        const double value = entry.comparison[info.metric];
        const bool marked = best && judged(info.metric, value) == *best;
        row.push_back(cell(info.metric, value) + (marked ? " *" : "  "));
    }
    return row;
}

std::vector<std::string> calibrationRow(const Report& report, const std::string& title,
                                        double (*value)(const Calibration&)) {
    std::vector<std::string> row = {title};
    for (const ReportEntry& entry : report.images)
        row.push_back((entry.calibration ? formatted("%.3f", value(*entry.calibration)) : "n/a") + "  ");
    return row;
}

nlohmann::ordered_json finiteOrNull(double value) {
    if (!std::isfinite(value)) return nullptr;
    return value;
}

}  // namespace

std::vector<std::string> shortNames(const std::vector<std::string>& paths) {
    std::vector<std::string> names;
    for (const std::string& path : paths) names.push_back(std::filesystem::path(path).stem().string());
    std::vector<std::string> unique = names;
    for (std::size_t i = 0; i < names.size(); ++i)
        if (std::count(names.begin(), names.end(), names[i]) > 1) unique[i] = paths[i];
    return unique;
}

Limit parseLimit(const std::string& text, bool higherIsBetter) {
    const std::size_t sign = text.find('=');
    const std::optional<Metric> metric = findMetric(text.substr(0, sign));
    if (sign == std::string::npos || !metric || infoOf(*metric).higherIsBetter != higherIsBetter) {
        std::string names;
        for (const MetricInfo& info : metricInfos())
            if (info.higherIsBetter == higherIsBetter)
                names += (names.empty() ? "" : ", ") + std::string(info.name);
        throw Error({}, "expected METRIC=VALUE with METRIC one of " + names + ", found '" + text + "'");
    }
    double value = 0;
    const char* const end = text.data() + text.size();
    const auto [at, status] = std::from_chars(text.data() + sign + 1, end, value);
    if (status != std::errc() || at != end || !std::isfinite(value))
        throw Error({}, "expected a number after '=', found '" + text + "'");
    return {*metric, value};
}

std::vector<Violation> checkLimits(const Report& report, const std::vector<Limit>& limits) {
    std::vector<Violation> violations;
    for (const ReportEntry& entry : report.images)
        for (const Limit& limit : limits) {
            const double found = entry.comparison[limit.metric];
            const double value = judged(limit.metric, found);
            const bool kept =
                infoOf(limit.metric).higherIsBetter ? value >= limit.value : value <= limit.value;
            if (!kept) violations.push_back({entry.path, limit, found});
        }
    return violations;
}

std::string describe(const Violation& violation) {
    const MetricInfo& info = infoOf(violation.limit.metric);
    return violation.path + ": " + std::string(info.name) + " is " + formatted("%.6g", violation.found) +
           ", the limit is " + formatted("%.6g", violation.limit.value);
}

std::string toText(const Report& report) {
    std::string text = "reference  " + report.reference + "  " + std::to_string(report.window.width) + " x " +
                       std::to_string(report.window.height) + " pixels\n\n";
    std::vector<std::vector<std::string>> rows = {{""}};
    bool calibrated = false;
    for (const ReportEntry& entry : report.images) {
        rows.front().push_back(entry.name + "  ");
        calibrated = calibrated || entry.calibration;
    }
    for (const MetricInfo& info : metricInfos()) rows.push_back(metricRow(report, info));
    if (calibrated) {
        rows.push_back(calibrationRow(report, "within 1 stddev (0.683)",
                                      [](const Calibration& c) { return c.withinOne; }));
        rows.push_back(calibrationRow(report, "within 2 stddev (0.954)",
                                      [](const Calibration& c) { return c.withinTwo; }));
        rows.push_back(calibrationRow(report, "predicted / actual RMSE",
                                      [](const Calibration& c) { return c.predictedRmse / c.actualRmse; }));
    }
    text += aligned(rows);
    if (report.images.size() > 1) text += "\n* best of the row\n";

    std::string notes;
    if (!report.images.empty()) {
        const Comparison& any = report.images.front().comparison;
        if (any.referenceNonFinite > 0)
            notes += "reference: " + std::to_string(any.referenceNonFinite) + " pixels are not finite\n";
        if (any.referenceNegative > 0)
            notes += "reference: " + std::to_string(any.referenceNegative) + " pixels are negative\n";
    }
    for (const ReportEntry& entry : report.images) {
        if (entry.comparison.excluded > 0)
            notes += entry.path + ": " + std::to_string(entry.comparison.excluded) + " of " +
                     std::to_string(entry.comparison.pixels) +
                     " pixels are not finite here or in the reference: excluded from all metrics\n";
        if (entry.calibration && entry.calibration->excluded > 0)
            notes += entry.path + ": " + std::to_string(entry.calibration->excluded) +
                     " values without a usable standard deviation: excluded from its calibration\n";
    }
    if (!notes.empty()) text += "\n" + notes;
    return text;
}

std::string toJson(const Report& report) {
    using Json = nlohmann::ordered_json;
    Json images = Json::array();
    for (const ReportEntry& entry : report.images) {
        Json metrics;
        for (const MetricInfo& info : metricInfos()) {
            const double value = entry.comparison[info.metric];
            if (isCount(info.metric))
                metrics[std::string(info.name)] = static_cast<std::int64_t>(value);
            else
                metrics[std::string(info.name)] = finiteOrNull(value);
        }
        Json image = {{"path", entry.path},
                      {"name", entry.name},
                      {"channels", entry.channels},
                      {"pixels", entry.comparison.pixels},
                      {"excluded", entry.comparison.excluded},
                      {"ssim_windows", entry.comparison.ssimWindows},
                      {"metrics", metrics}};
        if (const std::optional<Calibration>& calibration = entry.calibration)
            image["calibration"] = {{"within_1_stddev", finiteOrNull(calibration->withinOne)},
                                    {"within_2_stddev", finiteOrNull(calibration->withinTwo)},
                                    {"predicted_rmse", finiteOrNull(calibration->predictedRmse)},
                                    {"actual_rmse", finiteOrNull(calibration->actualRmse)},
                                    {"values", calibration->values},
                                    {"excluded", calibration->excluded}};
        images.push_back(std::move(image));
    }
    Json violations = Json::array();
    for (const Violation& violation : report.violations)
        violations.push_back({{"path", violation.path},
                              {"metric", infoOf(violation.limit.metric).name},
                              {"value", finiteOrNull(violation.found)},
                              {"limit", violation.limit.value}});
    Json reference = {
        {"path", report.reference},
        {"channels", report.referenceChannels},
        {"window", {report.window.x, report.window.y, report.window.width, report.window.height}}};
    if (!report.images.empty()) {
        reference["nonfinite"] = report.images.front().comparison.referenceNonFinite;
        reference["negative"] = report.images.front().comparison.referenceNegative;
    }
    // Paths need not be UTF-8: what is not becomes U+FFFD instead of an exception.
    const Json all = {{"reference", reference}, {"images", images}, {"violations", violations}};
    return all.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace vlx
