#include "sweep/sweep_summary.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <sstream>

#include "variolux/base/error.h"

namespace vlx {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr const char* kBaseline = "mean";

bool isTracersOwn(const Sweep& sweep, const std::string& method) {
    for (const SweepMethod& m : sweep.options.methods)
        if (m.name == method) return m.tracersOwn;
    return false;
}

/// Wall time from nothing to the image. What the tracer has anyway costs only tracing, where that is known.
double totalSeconds(const Sweep& sweep, const SweepRecord& sampling, const SweepRecord& image) {
    if (!sweep.samplingTimeKnown) return image.seconds;
    return sampling.seconds + (isTracersOwn(sweep, image.method) ? 0 : image.seconds);
}

double measured(const SweepRecord& record, const std::string& measure) {
    if (measure == "dssim") return 1 - measured(record, "ssim");
    const auto found = record.values.find(measure);
    return found == record.values.end() ? kNan : found->second;
}

/// The sampling record that an image was made of: the last one before it of equal sampling and repetition.
const SweepRecord& samplingOf(const Sweep& sweep, const SweepRecord& image) {
    for (const SweepRecord& record : sweep.records)
        if (record.kind == SweepKind::Sampling && record.sampling == image.sampling &&
            record.seed == image.seed)
            return record;
    throw Error("", "expected a record of the sampling of each image");
}

template <typename Value>
std::vector<double> collect(const SweepSetting& setting, const Value& value) {
    std::vector<double> values;
    for (const std::size_t i : setting.records) values.push_back(value(i));
    return values;
}

/// Variance of the mean of the logarithms, from the interval that was made of it.
double logVariance(const Interval& interval) {
    if (interval.count < 2 || !(interval.lower > 0)) return 0;
    const double half = std::log(interval.upper / interval.lower) / 2;
    const double error = half / studentQuantile95(interval.count - 1);
    return error * error;
}

SweepSetting settingOf(const Sweep& sweep, const std::string& method, const std::string& knob,
                       const SweepSampling& sampling) {
    SweepSetting setting;
    setting.method = method;
    setting.knob = knob;
    setting.sampling = sampling;
    for (std::size_t i = 0; i < sweep.records.size(); ++i) {
        const SweepRecord& r = sweep.records[i];
        if (r.kind != SweepKind::Image || r.method != method || !(r.sampling == sampling)) continue;
        if (setting.command.empty()) {
            setting.command = r.command;
            setting.samplingCommand = samplingOf(sweep, r).command;
        }
        if (r.failure.empty())
            setting.records.push_back(i);
        else
            setting.failures.push_back(r.failure);
    }
    if (setting.records.empty()) return setting;

    const auto record = [&](std::size_t i) -> const SweepRecord& { return sweep.records[i]; };
    const double n = static_cast<double>(setting.records.size());
    const bool own = sweep.samplingTimeKnown && isTracersOwn(sweep, method);
    for (const std::size_t i : setting.records) {
        const SweepRecord& dump = samplingOf(sweep, record(i));
        setting.samplesPerPixel += dump.samplesPerPixel / n;
        setting.peakBytes = std::max({setting.peakBytes, dump.peakBytes, own ? 0 : record(i).peakBytes});
        for (const auto& [stage, seconds] : dump.stages) setting.stages[stage] += seconds / n;
        if (!own)
            for (const auto& [stage, seconds] : record(i).stages) setting.stages[stage] += seconds / n;
    }
    setting.seconds = geometricInterval(collect(setting, [&](std::size_t i) {
        return totalSeconds(sweep, samplingOf(sweep, record(i)), record(i));
    }));
    setting.samplingSeconds = geometricInterval(
        collect(setting, [&](std::size_t i) { return samplingOf(sweep, record(i)).seconds; }));
    setting.imageSeconds =
        geometricInterval(collect(setting, [&](std::size_t i) { return record(i).seconds; }));
    setting.cpuSeconds = geometricInterval(collect(setting, [&](std::size_t i) {
        const double sampled = samplingOf(sweep, record(i)).cpuSeconds;
        return (std::isfinite(sampled) ? sampled : 0) + (own ? 0 : record(i).cpuSeconds);
    }));

    std::map<std::string, bool> names;  // whether it varies by factors
    for (const auto& [name, value] : record(setting.records.front()).values) names[name] = false;
    for (const SweepMeasure& measure : sweepMeasures())
        if (std::isfinite(measured(record(setting.records.front()), measure.name)))
            names[measure.name] = true;
    for (const auto& [name, byFactors] : names) {
        const auto values = collect(setting, [&](std::size_t i) { return measured(record(i), name); });
        setting.values[name] = byFactors ? geometricInterval(values) : meanInterval(values);
    }
    if (names.contains("rmse") && names.contains("predicted_rmse"))
        setting.agreement = geometricInterval(collect(setting, [&](std::size_t i) {
            return record(i).values.at("predicted_rmse") / record(i).values.at("rmse");
        }));
    return setting;
}

std::vector<SweepSetting> settingsOf(const Sweep& sweep) {
    std::vector<SweepSetting> settings;
    for (const SweepRecord& r : sweep.records) {
        if (r.kind != SweepKind::Image) continue;
        const bool known = std::any_of(settings.begin(), settings.end(), [&](const SweepSetting& s) {
            return s.method == r.method && s.sampling == r.sampling;
        });
        if (!known) settings.push_back(settingOf(sweep, r.method, r.knob, r.sampling));
    }
    return settings;
}

bool has(const SweepSetting& setting, const std::string& measure) {
    const auto found = setting.values.find(measure);
    return found != setting.values.end() && found->second.value > 0 && std::isfinite(setting.seconds.value);
}

std::vector<SweepSeries> seriesOf(const Sweep& sweep, const std::vector<SweepSetting>& settings) {
    std::vector<SweepSeries> all;
    for (std::size_t i = 0; i < settings.size(); ++i) {
        const SweepSetting& s = settings[i];
        if (!s.knob.empty() || s.records.empty()) continue;
        auto series = std::find_if(all.begin(), all.end(), [&](const SweepSeries& known) {
            return known.method == s.method && known.hierarchical == s.sampling.hierarchical;
        });
        if (series == all.end()) {
            all.push_back({s.method,
                           s.sampling.hierarchical,
                           s.method + (s.sampling.hierarchical ? ", hierarchical sampling" : ""),
                           {},
                           {},
                           {}});
            series = all.end() - 1;
        }
        series->settings.push_back(i);
    }
    for (SweepSeries& series : all) {
        std::stable_sort(series.settings.begin(), series.settings.end(), [&](std::size_t a, std::size_t b) {
            return settings[a].samplesPerPixel < settings[b].samplesPerPixel;
        });
        if (series.settings.size() < 2) continue;  // repetitions of one setting scatter, they have no slope
        for (const SweepMeasure& measure : sweepMeasures()) {
            std::vector<double> samples, seconds, errors;
            for (const std::size_t i : series.settings) {
                if (!has(settings[i], measure.name)) continue;
                for (const std::size_t r : settings[i].records) {
                    const SweepRecord& image = sweep.records[r];
                    const SweepRecord& dump = samplingOf(sweep, image);
                    const double error = measured(image, measure.name);
                    if (!(error > 0)) continue;
                    errors.push_back(std::log(error));
                    samples.push_back(std::log(dump.samplesPerPixel));
                    seconds.push_back(std::log(totalSeconds(sweep, dump, image)));
                }
            }
            if (const auto line = fitLine(samples, errors)) series.slopeBySamples[measure.name] = line->slope;
            if (const auto line = fitLine(seconds, errors)) series.slopeByTime[measure.name] = line->slope;
        }
    }
    return all;
}

enum class Cost { Time, Samples };

std::vector<CurvePoint> curveOf(const SweepSummary& summary, const SweepSeries& series,
                                const std::string& measure, Cost cost) {
    std::vector<CurvePoint> curve;
    for (const std::size_t i : series.settings) {
        const SweepSetting& s = summary.settings[i];
        if (has(s, measure))
            curve.push_back({std::log(cost == Cost::Time ? s.seconds.value : s.samplesPerPixel),
                             std::log(s.values.at(measure).value), logVariance(s.values.at(measure))});
    }
    return curve;
}

/// exp(log) with the interval that the variance and the fewest repetitions allow.
Interval ratioInterval(double log, double variance, int count) {
    if (count < 2) return {std::exp(log), kNan, kNan, count};
    const double half = studentQuantile95(count - 1) * std::sqrt(variance);
    return {std::exp(log), std::exp(log - half), std::exp(log + half), count};
}

int fewestRuns(const SweepSummary& summary, const SweepSeries& series) {
    int fewest = std::numeric_limits<int>::max();
    for (const std::size_t i : series.settings)
        fewest = std::min(fewest, static_cast<int>(summary.settings[i].records.size()));
    return fewest;
}

void compareWithBaseline(SweepSummary& summary, const SweepSeries& baseline) {
    const int runs = fewestRuns(summary, baseline);
    for (const SweepMeasure& measure : sweepMeasures()) {
        const auto byTime = curveOf(summary, baseline, measure.name, Cost::Time);
        const auto bySamples = curveOf(summary, baseline, measure.name, Cost::Samples);
        for (SweepSetting& s : summary.settings) {
            if (!has(s, measure.name)) continue;
            const Interval& error = s.values.at(measure.name);
            const double logSeconds = std::log(s.seconds.value), logError = std::log(error.value);
            const int count = std::min(runs, static_cast<int>(s.records.size()));
            const bool self = s.method == baseline.method && !s.sampling.hierarchical;
            if (self) continue;
            if (const auto cost = costAtError(bySamples, logError, logVariance(error)))
                s.samplesSaved[measure.name] = {
                    ratioInterval(cost->log - std::log(s.samplesPerPixel), cost->variance, count),
                    cost->extrapolated};
            if (summary.imageTimesOnly) continue;
            if (const auto cost = costAtError(byTime, logError, logVariance(error)))
                s.speedUp[measure.name] = {
                    ratioInterval(cost->log - logSeconds, cost->variance + logVariance(s.seconds), count),
                    cost->extrapolated};
            if (const auto other = errorAtCost(byTime, logSeconds))
                s.errorRatio[measure.name] = {
                    ratioInterval(logError - other->log, other->variance + logVariance(error), count), false};
        }
    }
}

std::vector<EqualTime> equalTimesOf(const SweepSummary& summary, const SweepSeries& baseline) {
    std::vector<EqualTime> times;
    for (const std::size_t b : baseline.settings) {
        const SweepSetting& budget = summary.settings[b];
        EqualTime time{budget.seconds.value, budget.method + ", " + samplingText(budget.sampling), {}};
        for (const SweepSeries& series : summary.series)
            for (const SweepMeasure& measure : sweepMeasures()) {
                const auto curve = curveOf(summary, series, measure.name, Cost::Time);
                if (const auto error = errorAtCost(curve, std::log(budget.seconds.value)))
                    time.errors[series.name][measure.name] = {
                        ratioInterval(error->log, error->variance, fewestRuns(summary, series)), false};
            }
        times.push_back(std::move(time));
    }
    return times;
}

}  // namespace

const std::vector<SweepMeasure>& sweepMeasures() {
    static const std::vector<SweepMeasure> measures = {
        {"relmse", "relMSE", true},
        {"relmse_trimmed", "relMSE without the worst 0.1 %", true},
        {"rmse", "RMSE", true},
        {"mape", "MAPE", true},
        {"rmse_tm", "tone-mapped RMSE", true},
        {"dssim", "1 - SSIM", true},
        {"flicker", "flicker of frames", true},
        {"predicted_relmse", "relMSE predicted by the error map", false},
        {"predicted_rmse", "RMSE predicted by the error map", false}};
    return measures;
}

SweepSummary summarize(const Sweep& sweep) {
    SweepSummary summary;
    summary.imageTimesOnly = !sweep.samplingTimeKnown;
    summary.settings = settingsOf(sweep);
    summary.series = seriesOf(sweep, summary.settings);
    for (const SweepMeasure& measure : sweepMeasures()) {
        std::vector<double> seconds, errors;
        for (const SweepSetting& s : summary.settings) {
            seconds.push_back(s.seconds.value);
            errors.push_back(has(s, measure.name) && s.knob.empty() ? s.values.at(measure.name).value : kNan);
        }
        summary.pareto[measure.name] = paretoFront(seconds, errors);
    }
    for (const SweepSeries& series : summary.series)
        if (series.method == kBaseline && !series.hierarchical) {
            compareWithBaseline(summary, series);
            if (!summary.imageTimesOnly) summary.equalTimes = equalTimesOf(summary, series);
        }
    return summary;
}

SweepTarget parseTarget(const std::string& text) {
    const std::size_t sign = text.find('=');
    const std::string measure = text.substr(0, sign);
    std::string names;
    bool known = false;
    for (const SweepMeasure& m : sweepMeasures()) {
        names += (names.empty() ? "" : ", ") + m.name;
        known = known || m.name == measure;
    }
    char* end = nullptr;
    const std::string number = sign == std::string::npos ? "" : text.substr(sign + 1);
    const double value = std::strtod(number.c_str(), &end);
    if (!known || number.empty() || *end != '\0' || !(value > 0) || !std::isfinite(value))
        throw Error("", "expected MEASURE=VALUE with a positive value and MEASURE one of " + names +
                            ", found '" + text + "'");
    return {measure, value};
}

std::optional<std::size_t> cheapestSetting(const SweepSummary& summary, const SweepTarget& target) {
    std::optional<std::size_t> best;
    for (std::size_t i = 0; i < summary.settings.size(); ++i) {
        const SweepSetting& s = summary.settings[i];
        if (!has(s, target.measure) || s.values.at(target.measure).value > target.value) continue;
        if (!best || s.seconds.value < summary.settings[*best].seconds.value) best = i;
    }
    return best;
}

std::string toText(const SweepSummary& summary, const Sweep& sweep) {
    std::ostringstream text;
    const std::string measure = sweep.options.reference.empty() ? "predicted_relmse" : "relmse";
    char line[256];
    std::snprintf(line, sizeof line, "%-32s %-16s %10s %22s %8s %10s\n",
                  summary.imageTimesOnly ? "method (times: image only)" : "method", "sampling", "seconds",
                  measure.c_str(), "MB", summary.imageTimesOnly ? "samples x" : "time x");
    text << line;
    for (const SweepSetting& s : summary.settings) {
        std::string error = "-", speed = "-";
        if (has(s, measure)) {
            const Interval& e = s.values.at(measure);
            std::snprintf(line, sizeof line, "%.4g", e.value);
            error = line;
            if (e.count > 1) {
                std::snprintf(line, sizeof line, " (%.3g-%.3g)", e.lower, e.upper);
                error += line;
            }
        }
        const auto& gains = summary.imageTimesOnly ? s.samplesSaved : s.speedUp;
        if (const auto found = gains.find(measure); found != gains.end()) {
            std::snprintf(line, sizeof line, "%s%.2f", found->second.extrapolated ? "~" : "",
                          found->second.ratio.value);
            speed = line;
        }
        std::snprintf(line, sizeof line, "%-32s %-16s %10.3g %22s %8.0f %10s\n", s.method.c_str(),
                      samplingText(s.sampling).c_str(), s.seconds.value, error.c_str(),
                      static_cast<double>(s.peakBytes) / (1 << 20), speed.c_str());
        text << line;
        for (const std::string& failure : s.failures) text << "    failed: " << failure << "\n";
    }
    text << (summary.imageTimesOnly ? "samples x: times as many samples" : "time x: times as long")
         << " as plain averaging takes to the same error (~: by its fitted line)\n";
    for (const SweepSeries& series : summary.series)
        if (const auto slope =
                series.slopeBySamples.find(sweep.options.reference.empty() ? "predicted_rmse" : "rmse");
            slope != series.slopeBySamples.end()) {
            std::snprintf(line, sizeof line, "slope of RMSE by samples, %s: %.3f", series.name.c_str(),
                          slope->second.value);
            text << line;
            if (std::isfinite(slope->second.lower)) {
                std::snprintf(line, sizeof line, " (%.3f to %.3f)", slope->second.lower, slope->second.upper);
                text << line;
            }
            text << "\n";
        }
    return text.str();
}

}  // namespace vlx
