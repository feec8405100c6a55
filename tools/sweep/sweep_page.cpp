#include "sweep/sweep_page.h"

#include <Imath/half.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>

#include "sweep/page_files.h"
#include "sweep/sweep_json.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/compare/metrics.h"

namespace vlx {

namespace {

using Json = nlohmann::ordered_json;

/// Too large becomes the largest finite half, because error views subtract; NaN stays NaN.
std::uint16_t halfOf(float value) {
    constexpr auto kMost = static_cast<float>(HALF_MAX);
    return imath_float_to_half(std::clamp(value, -kMost, kMost));
}

std::string base64(const std::vector<unsigned char>& bytes) {
    constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve(bytes.size() / 3 * 4 + 4);
    for (std::size_t i = 0; i < bytes.size(); i += 3) {
        const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
        std::uint32_t word = 0;
        for (std::size_t k = 0; k < 3; ++k) word = (word << 8) | (k < count ? bytes[i + k] : 0u);
        for (std::size_t k = 0; k < 4; ++k) text += k <= count ? kDigits[(word >> (18 - 6 * k)) & 63] : '=';
    }
    return text;
}

/// Halves, high bytes before low ones (which deflates better), deflated, base64.
std::string packed(const std::vector<float>& values) {
    std::vector<unsigned char> bytes(2 * values.size());
    for (std::size_t i = 0; i < values.size(); ++i) {
        const std::uint16_t half = halfOf(values[i]);
        bytes[i] = static_cast<unsigned char>(half >> 8);
        bytes[values.size() + i] = static_cast<unsigned char>(half & 255);
    }
    uLongf size = compressBound(static_cast<uLong>(bytes.size()));
    std::vector<unsigned char> deflated(size);
    if (compress2(deflated.data(), &size, bytes.data(), static_cast<uLong>(bytes.size()), 6) != Z_OK)
        throw Error("", "zlib failed to compress an image");
    deflated.resize(size);
    return base64(deflated);
}

/// The image reduced by a whole factor, channel by channel: all of R, then G, then B.
std::vector<float> planes(const Image& image, int factor) {
    const int width = image.data.width / factor, height = image.data.height / factor;
    std::vector<float> result;
    for (int c = 0; c < image.channelCount(); ++c)
        for (int row = 0; row < height; ++row)
            for (int col = 0; col < width; ++col) {
                double sum = 0;
                for (int y = 0; y < factor; ++y)
                    for (int x = 0; x < factor; ++x) sum += image.at(col * factor + x, row * factor + y)[c];
                result.push_back(static_cast<float>(sum / (factor * factor)));
            }
    return result;
}

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
    const Image image = readImage(path);
    const Image colour = colourOf(image, path);
    const Window& window = image.data;
    const int factor = (std::max(window.width, window.height) + kPageImageSide - 1) / kPageImageSide;
    Json json = {{"x", window.x},
                 {"y", window.y},
                 {"width", window.width / factor},
                 {"height", window.height / factor},
                 {"factor", factor},
                 {"radiance", packed(planes(colour, factor))}};
    if (hasLayer(image, "stddev"))
        json["stddev"] = packed(planes(meanDeviation(colourOf(image, path, "stddev")), factor));
    return json;
}

Json toJson(const Interval& i) {
    return {numberJson(i.value), numberJson(i.lower), numberJson(i.upper), i.count};
}

template <typename Value>
Json mapJson(const std::map<std::string, Value>& map) {
    Json json = Json::object();
    for (const auto& [name, value] : map) {
        if constexpr (std::is_same_v<Value, double>)
            json[name] = numberJson(value);
        else if constexpr (std::is_same_v<Value, SweepSetting::Ratio>)
            json[name] = {{"ratio", toJson(value.ratio)}, {"extrapolated", value.extrapolated}};
        else
            json[name] = toJson(value);
    }
    return json;
}

Json settingJson(const Sweep& sweep, const SweepSetting& s) {
    Json json = {{"method", s.method},
                 {"knob", s.knob},
                 {"hierarchical", s.sampling.hierarchical},
                 {"setting", s.sampling.setting},
                 {"samplesPerPixel", s.samplesPerPixel},
                 {"seconds", toJson(s.seconds)},
                 {"samplingSeconds", toJson(s.samplingSeconds)},
                 {"imageSeconds", toJson(s.imageSeconds)},
                 {"cpuSeconds", toJson(s.cpuSeconds)},
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
    json["agreement"] = s.agreement ? toJson(*s.agreement) : Json(nullptr);
    json["reliability"] = Json::array();
    for (const std::size_t i : s.records) {
        const SweepRecord& record = sweep.records[i];
        if (record.reliability) json["reliability"].push_back(vlx::toJson(*record.reliability));
        if (!record.file.empty() && record.seed == 1)
            json["image"] = imageJson(sweep.options.folder + "/" + record.file);
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
    if (!sweep.options.reference.empty()) data["referenceImage"] = imageJson(sweep.options.reference);
    data["inspections"] = inspectionsJson(sweep);
    return data;
}

void replace(std::string& text, std::string_view place, std::string_view content) {
    for (std::size_t at = text.find(place); at != std::string::npos;
         at = text.find(place, at + content.size()))
        text.replace(at, place.size(), content);
}

std::string escaped(const std::string& text) {
    std::string result;
    for (const char c : text) {
        if (c == '&')
            result += "&amp;";
        else if (c == '<')
            result += "&lt;";
        else
            result += c;
    }
    return result;
}

}  // namespace

std::string toHtml(const Sweep& sweep, const SweepSummary& summary, const SweepPageOptions& options) {
    std::string data = pageData(sweep, summary, options).dump(-1, ' ', false, Json::error_handler_t::replace);
    // Inside <script>, "</script>" or "<!--" of a name would end or change it.
    for (std::size_t at = data.find('<'); at != std::string::npos; at = data.find('<', at))
        data.replace(at, 1, "\\u003c");
    std::string html(kPageHtml);
    const std::size_t slash = sweep.options.input.find_last_of('/');
    replace(html, "@TITLE@", escaped(sweep.options.input.substr(slash == std::string::npos ? 0 : slash + 1)));
    replace(html, "@CSS@", kPageCss);
    replace(html, "@SCRIPT@", kPageScript);
    replace(html, "@DATA@", data);
    return html;
}

}  // namespace vlx
