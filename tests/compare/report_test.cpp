#include "variolux/compare/report.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "compare/constants.h"
#include "variolux/base/error.h"

namespace vlx {
namespace {

ReportEntry entry(const std::string& name, Metric metric, double value) {
    ReportEntry result{name + ".exr", name, {"R", "G", "B"}, {}, {}};
    result.comparison.values[static_cast<std::size_t>(metric)] = value;
    return result;
}

TEST(ParseLimit, TakesMetricsOfTheRightDirection) {
    const Limit limit = parseLimit("relmse=1.5e-3", false);
    EXPECT_EQ(limit.metric, Metric::RelMse);
    EXPECT_EQ(limit.value, 1.5e-3);
    EXPECT_EQ(parseLimit("psnr=-3", true).value, -3);
    for (const char* text : {"psnr=1", "relmse", "relmse=", "=1", "", "relmse=1 ", "relmse=inf", "RELMSE=1"})
        EXPECT_THROW(parseLimit(text, false), Error) << text;
    try {
        parseLimit("mse=1", true);
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("psnr, ssim"), std::string::npos) << error.what();
    }
}

TEST(CheckLimits, JudgesEveryImageByEveryLimit) {
    Report report;
    report.images = {entry("a", Metric::RelMse, 0.1), entry("b", Metric::RelMse, 0.2)};
    EXPECT_TRUE(checkLimits(report, {{Metric::RelMse, 0.2}}).empty());  // equal is not passed
    const std::vector<Violation> found = checkLimits(report, {{Metric::RelMse, 0.1}, {Metric::Psnr, 1}});
    ASSERT_EQ(found.size(), 3u);
    EXPECT_EQ(found[0].path, "a.exr");
    EXPECT_EQ(found[0].limit.metric, Metric::Psnr);
    EXPECT_EQ(found[1].path, "b.exr");
    EXPECT_EQ(found[1].found, 0.2);
    EXPECT_NE(describe(found[1]).find("b.exr: relmse is 0.2, the limit is 0.1"), std::string::npos);
}

TEST(CheckLimits, NoNumberIsAViolationAndBiasCountsByMagnitude) {
    Report report;
    report.images = {entry("a", Metric::Ssim, kNan)};
    EXPECT_EQ(checkLimits(report, {{Metric::Ssim, -1}}).size(), 1u);
    report.images = {entry("a", Metric::Mse, kNan)};
    EXPECT_EQ(checkLimits(report, {{Metric::Mse, 1e9}}).size(), 1u);
    report.images = {entry("a", Metric::Bias, -0.3)};
    EXPECT_EQ(checkLimits(report, {{Metric::Bias, 0.2}}).size(), 1u);
    EXPECT_EQ(checkLimits(report, {{Metric::Bias, 0.4}}).size(), 0u);
    report.images = {entry("a", Metric::Psnr, std::numeric_limits<double>::infinity())};
    EXPECT_EQ(checkLimits(report, {{Metric::Psnr, 90}}).size(), 0u);
}

TEST(ShortNames, AreStemsUnlessTheyCollide) {
    EXPECT_EQ(shortNames({"x/a.exr", "b.png", "y/a.exr"}),
              (std::vector<std::string>{"x/a.exr", "b", "y/a.exr"}));
}

TEST(ToText, MarksTheBestByTheMetricsDirection) {
    Report report;
    report.reference = "r.exr";
    report.images = {entry("worse", Metric::Ssim, 0.3), entry("better", Metric::Ssim, 0.9),
                     entry("none", Metric::Ssim, kNan)};
    const std::string text = toText(report);
    EXPECT_NE(text.find("0.9000 *"), std::string::npos) << text;
    EXPECT_EQ(text.find("0.3000 *"), std::string::npos) << text;
    EXPECT_NE(text.find("n/a"), std::string::npos) << text;
    report.images = {entry("a", Metric::Bias, 0.1), entry("b", Metric::Bias, -0.05)};
    EXPECT_NE(toText(report).find("-5.000 % *"), std::string::npos) << toText(report);
    // One image has nobody to beat.
    report.images.pop_back();
    EXPECT_EQ(toText(report).find('*'), std::string::npos);
}

TEST(ToJson, IsValidWhateverTheNumbersAndPaths) {
    Report report;
    report.reference = "caf\xe9 \"r\".exr";  // Latin-1, not UTF-8
    for (const double value : {kNan, std::numeric_limits<double>::infinity(), 1e-300}) {
        report.images = {entry("a", Metric::Mse, value)};
        report.images[0].calibration = Calibration{kNan, kNan, kNan, kNan, 0, 5};
        const nlohmann::json json = nlohmann::json::parse(toJson(report));
        EXPECT_EQ(json["images"][0]["metrics"]["mse"].is_null(), !std::isfinite(value));
        EXPECT_TRUE(json["images"][0]["calibration"]["within_1_stddev"].is_null());
        EXPECT_EQ(json["images"][0]["calibration"]["excluded"], 5);
    }
}

}  // namespace
}  // namespace vlx
