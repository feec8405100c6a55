#include "sweep/sweep.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>

#include "compare/constants.h"
#include "sweep/sweep_images.h"
#include "sweep/sweep_page.h"
#include "sweep/sweep_summary.h"
#include "variolux/base/error.h"

namespace vlx {
namespace {

/// A made-up sweep in which tracing takes 1/8 s a sample: averaging has relmse 1/spp, "better" takes a second
/// more for a quarter of the error, "worse" two for the same error. Repetitions differ by a factor.
Sweep madeUp(int seeds, double scatter = 1.1) {
    Sweep sweep;
    sweep.options.methods = {{.name = "mean", .tracersOwn = true}, {.name = "better"}, {.name = "worse"}};
    sweep.options.reference = "reference.exr";
    for (const double spp : {4.0, 16.0, 64.0})
        for (int seed = 1; seed <= seeds; ++seed) {
            SweepRecord dump;
            dump.kind = SweepKind::Sampling;
            dump.sampling = {false, spp};
            dump.seed = seed;
            dump.samplesPerPixel = spp;
            dump.seconds = dump.cpuSeconds = spp / 8;
            dump.stages = {{"trace", spp / 8}};
            dump.command = "trace " + std::to_string(seed);
            sweep.records.push_back(dump);
            const double factor = std::pow(scatter, seed - 0.5 * (seeds + 1));
            for (const auto& [name, seconds, error] :
                 {std::tuple{"mean", 9.0, 1 / spp}, {"better", 1.0, 0.25 / spp}, {"worse", 2.0, 1 / spp}}) {
                SweepRecord image;
                image.method = name;
                image.sampling = dump.sampling;
                image.seed = seed;
                image.seconds = image.cpuSeconds = seconds;
                image.values = {{"relmse", error * factor}, {"rmse", std::sqrt(error * factor)}};
                image.command = name;
                sweep.records.push_back(image);
            }
        }
    return sweep;
}

const SweepSetting& setting(const SweepSummary& summary, const std::string& method, double spp) {
    for (const SweepSetting& s : summary.settings)
        if (s.method == method && s.sampling.setting == spp) return s;
    throw std::runtime_error("no such setting");
}

TEST(SweepSummary, TimesSlopesAndGains) {
    const SweepSummary summary = summarize(madeUp(3));
    ASSERT_EQ(summary.settings.size(), 9u);
    // The average is the tracer's: the time of making it again does not count.
    EXPECT_NEAR(setting(summary, "mean", 16).seconds.value, 2, 1e-9);
    EXPECT_NEAR(setting(summary, "better", 16).seconds.value, 3, 1e-9);

    const Interval error = setting(summary, "mean", 16).values.at("relmse");
    EXPECT_NEAR(error.value, 1.0 / 16, 1e-9);
    EXPECT_NEAR(std::log(error.upper / error.value), studentQuantile95(2) * std::log(1.1) / std::sqrt(3.0),
                1e-6);

    ASSERT_EQ(summary.series.size(), 3u);
    EXPECT_NEAR(summary.series[0].slopeBySamples.at("relmse").value, -1, 1e-9);
    EXPECT_NEAR(summary.series[0].slopeBySamples.at("rmse").value, -0.5, 1e-9);
    EXPECT_NEAR(summary.series[0].slopeByTime.at("rmse").value, -0.5, 1e-9);
    EXPECT_GT(summary.series[1].slopeByTime.at("rmse").value, -2);

    // Averaging needs 64 samples, 8 s, to what "better" has of 16 samples in 3 s.
    const SweepSetting& better = setting(summary, "better", 16);
    EXPECT_NEAR(better.samplesSaved.at("relmse").ratio.value, 4, 1e-6);
    EXPECT_NEAR(better.speedUp.at("relmse").ratio.value, 8.0 / 3, 1e-6);
    EXPECT_FALSE(better.speedUp.at("relmse").extrapolated);
    // Averaging of 3 s has 24 samples.
    EXPECT_NEAR(better.errorRatio.at("relmse").ratio.value, 0.25 / 16 * 24, 1e-6);
    const SweepSetting& far = setting(summary, "better", 64);
    EXPECT_TRUE(far.speedUp.at("relmse").extrapolated);
    EXPECT_NEAR(far.speedUp.at("relmse").ratio.value, 32.0 / 9, 1e-6);
    EXPECT_FALSE(far.errorRatio.contains("relmse"));  // averaging was not run for 9 s
    // One that loses is shown losing, and surely so.
    const SweepSetting& worse = setting(summary, "worse", 16);
    EXPECT_NEAR(worse.speedUp.at("relmse").ratio.value, 0.5, 1e-6);
    EXPECT_LT(worse.speedUp.at("relmse").ratio.upper, 1);

    ASSERT_EQ(summary.equalTimes.size(), 3u);
    EXPECT_NEAR(summary.equalTimes[2].seconds, 8, 1e-9);
    EXPECT_NEAR(summary.equalTimes[2].errors.at("mean").at("relmse").ratio.value, 1.0 / 64, 1e-9);
    EXPECT_TRUE(summary.equalTimes[2].errors.contains("better"));
    EXPECT_FALSE(summary.equalTimes[0].errors.contains("better"));

    for (const std::size_t i : summary.pareto.at("relmse")) EXPECT_NE(summary.settings[i].method, "worse");
    EXPECT_EQ(summary.pareto.at("relmse").size(), 4u);  // all of "better"; averaging of 4 samples
}

TEST(SweepSummary, OneRepetitionHasNoIntervals) {
    const SweepSummary summary = summarize(madeUp(1));
    EXPECT_TRUE(std::isnan(setting(summary, "mean", 4).values.at("relmse").lower));
    EXPECT_TRUE(std::isnan(setting(summary, "better", 4).speedUp.at("relmse").ratio.lower));
}

TEST(SweepSummary, UnknownTracingTimeCountsOnlyImages) {
    Sweep sweep = madeUp(2);
    sweep.fromDump = true;
    sweep.samplingTimeKnown = false;
    for (SweepRecord& r : sweep.records)
        if (r.kind == SweepKind::Sampling) r.seconds = r.cpuSeconds = kNan;
    const SweepSummary summary = summarize(sweep);
    EXPECT_TRUE(summary.imageTimesOnly);
    EXPECT_NEAR(setting(summary, "mean", 16).seconds.value, 9, 1e-9);
    EXPECT_TRUE(setting(summary, "better", 16).speedUp.empty());
    EXPECT_NEAR(setting(summary, "better", 16).samplesSaved.at("relmse").ratio.value, 4, 1e-6);
    EXPECT_TRUE(summary.equalTimes.empty());
}

TEST(SweepSummary, FailuresAreListedAndDoNotCount) {
    Sweep sweep = madeUp(2);
    sweep.records[2].failure = "exit code 1";  // "better" of 4 samples, first repetition
    sweep.records[2].values.clear();
    const SweepSummary summary = summarize(sweep);
    const SweepSetting& s = setting(summary, "better", 4);
    EXPECT_EQ(s.failures, std::vector<std::string>{"exit code 1"});
    EXPECT_EQ(s.values.at("relmse").count, 1);
    EXPECT_NE(toText(summary, sweep).find("failed: exit code 1"), std::string::npos);
}

TEST(SweepTarget, CheapestSettingReachesIt) {
    const SweepSummary summary = summarize(madeUp(3));
    // 1/64: averaging of 64 samples takes 8 s, "better" of 16 samples 3 s.
    const auto best = cheapestSetting(summary, {"relmse", 0.0157});
    ASSERT_TRUE(best);
    EXPECT_EQ(summary.settings[*best].method, "better");
    EXPECT_EQ(summary.settings[*best].samplesPerPixel, 16);
    EXPECT_FALSE(cheapestSetting(summary, {"relmse", 1e-6}));
    EXPECT_EQ(parseTarget("relmse=0.01").value, 0.01);
    for (const char* text :
         {"", "relmse", "relmse=", "relmse=x", "relmse=1x", "relmse=0", "relmse=-1", "relmse=inf", "psnr=30"})
        EXPECT_THROW(parseTarget(text), Error) << text;
}

TEST(SweepMethods, VariationsAndExternalCommands) {
    const auto& methods = builtInMethods();
    const auto varied = expandVariation(methods, "paper --region 2,8");
    ASSERT_EQ(varied.size(), 2u);
    EXPECT_EQ(varied[1].name, "paper --region 8");
    EXPECT_EQ(varied[1].knob, "paper --region");
    EXPECT_TRUE(varied[1].command.ends_with("--method paper --region 8"));
    EXPECT_EQ(expandVariation(methods, "paper --no-colour-distance").size(), 1u);
    for (const std::string& text : builtInVariations()) EXPECT_FALSE(expandVariation(methods, text).empty());
    for (const char* text :
         {"", "paper", "paper region 2", "magic --x 1", "paper --region 2,,3", "paper --region 2 3"})
        EXPECT_THROW(expandVariation(methods, text), Error) << text;

    const SweepMethod external = parseExternal("mine=prog -x {input} {output}");
    EXPECT_EQ(external.name, "mine");
    EXPECT_EQ(external.command, "prog -x {input} {output}");
    for (const char* text :
         {"", "mine", "=prog {input} {output}", "mine=", "mine=prog {input}", "mine=prog {output}"})
        EXPECT_THROW(parseExternal(text), Error) << text;
}

TEST(SweepRecord, LineReadsBackAsWritten) {
    SweepRecord r = madeUp(1).records[1];
    r.key = "0123";
    r.knob = "a --b";
    r.failure = "line\n\"quoted\"";
    r.seconds = kNan;
    r.stages = {{"read", 0.25}};
    r.values["psnr"] = std::numeric_limits<double>::infinity();
    r.reliability.emplace();
    r.reliability->bins = {{1, 2, 3}};
    r.reliability->scores[5] = 0.5;
    r.reliability->coverage[18] = 0.75;
    const std::string line = toJsonLine(r);
    EXPECT_EQ(line.find('\n'), std::string::npos);
    const SweepRecord read = parseRecord(line, "file");
    EXPECT_EQ(toJsonLine(read), line);
    EXPECT_EQ(read.failure, r.failure);
    EXPECT_TRUE(std::isnan(read.seconds));
    EXPECT_EQ(read.reliability->bins[0].values, 3);
    EXPECT_EQ(read.reliability->coverage[18], 0.75);
    for (const char* text : {"", "{}", "[]", "{\"key\": 1}"})
        EXPECT_THROW(parseRecord(text, "file"), Error) << text;
}

TEST(SweepRecord, CsvHasOneRowARecordAndQuotes) {
    Sweep sweep = madeUp(1);
    sweep.records[0].command = "trace \"a\", b";
    std::istringstream lines(toCsv(sweep.records));
    std::string head, row;
    std::getline(lines, head);
    std::getline(lines, row);
    EXPECT_TRUE(head.starts_with("kind,method,"));
    EXPECT_NE(head.find(",seconds_trace,relmse,rmse"), std::string::npos) << head;
    EXPECT_NE(row.find("\"trace \"\"a\"\", b\""), std::string::npos) << row;
    std::size_t rows = 1;
    while (std::getline(lines, row)) ++rows;
    EXPECT_EQ(rows, sweep.records.size());
}

TEST(SweepImages, ExactPixelsHaveNoErrorAndKnowIt) {
    const Image one({0, 0, 4, 1}, {"R", "G", "B"});
    ReferenceImage reference{one, one};
    Image colour = one, stddev = one;
    EXPECT_EQ(exactPixels(colour, stddev, reference), 4);
    colour.pixels[0] = 1;                 // wrong in red
    stddev.pixels[5] = 1;                 // not known in blue
    reference.stddev->pixels[6] = 1e-9f;  // the reference does not know
    EXPECT_EQ(exactPixels(colour, stddev, reference), 1);
    reference.stddev.reset();
    EXPECT_EQ(exactPixels(colour, stddev, reference), 2);
}

TEST(SweepPage, HoldsTheDataWhateverNamesSay) {
    Sweep sweep = madeUp(2);
    sweep.options.input = "a/<b>&.glb";
    sweep.options.reference.clear();
    for (SweepRecord& r : sweep.records) {
        r.values = {{"predicted_rmse", 0.5}, {"predicted_relmse", 0.25}};
        if (r.method == "worse") r.method = "</script><script>alert(1)</script>";
    }
    const std::string html = toHtml(sweep, summarize(sweep));
    EXPECT_NE(html.find("<title>&lt;b>&amp;.glb"), std::string::npos);
    EXPECT_EQ(html.find("alert(1)</script>"), std::string::npos);
    const std::string open = "id=\"data\">";
    const std::size_t begin = html.find(open) + open.size();
    const auto data = nlohmann::json::parse(html.substr(begin, html.find("</script>", begin) - begin));
    EXPECT_EQ(data["settings"].size(), 9u);
    EXPECT_EQ(data["settings"][2]["method"], "</script><script>alert(1)</script>");
    EXPECT_EQ(html.find("@DATA@"), std::string::npos);
    EXPECT_EQ(html.find("https://"), std::string::npos);
}

}  // namespace
}  // namespace vlx
