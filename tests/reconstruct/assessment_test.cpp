// What the samples say of another denoiser's image, against what is known of it.

#include "variolux/reconstruct/assessment.h"

#include <gtest/gtest.h>

#include <cmath>

#include "opinion_pictures.h"
#include "reconstruct/opinion/evidence.h"
#include "variolux/base/error.h"
#include "variolux/dump/half_samples.h"

namespace vlx {
namespace {

using TruthLike = std::function<double(int, int)>;

double tooDark(int x, int y) { return 0.85 * truthAt(x, y); }

/// Of halves that have twice the variance of the whole.
Drift assessedOf(const TruthLike& of, bool halves) {
    constexpr double kNoise = 0.03, kNoiseOfHalves = 0.03 * 1.4142;
    SecondOpinion opinion{opinionOf(1, of, kNoise), {}};
    if (halves) opinion.halves = {opinionOf(2, of, kNoiseOfHalves), opinionOf(3, of, kNoiseOfHalves)};
    return {.secondOpinion = std::make_shared<SecondOpinion>(std::move(opinion))};
}

double actualRelMse(const Image& image) {
    double sum = 0;
    for (int y = 0; y < kPicture.height; ++y)
        for (int x = 0; x < kPicture.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const double t = truthAt(x, y), d = static_cast<double>(image.at(x, y)[c]) - t;
                sum += d * d / (t * t + 0.01);
            }
    return sum / (3.0 * static_cast<double>(kPicture.pixels()));
}

TEST(Assessment, FindsTheErrorOfGoodAndOfWrongImages) {
    const SampleBuffer samples = samplesOf(eightSamples);
    const std::pair<const char*, TruthLike> kinds[] = {
        {"good", truthAt},
        {"too dark", tooDark},
        {"shifted", [](int x, int y) { return truthAt(x + 2, y); }},
        {"another scene", [](int x, int y) { return 2 + std::sin(0.3 * (x + y)); }},
        {"black", [](int, int) { return 0.0; }}};
    for (const auto& [name, of] : kinds)
        for (const bool halves : {true, false}) {
            const Drift options = assessedOf(of, halves);
            const AssessmentReport report = assess(samples, options).report;
            const double actual = actualRelMse(options.secondOpinion->image);
            EXPECT_LT(report.low, actual) << name << " " << halves;
            EXPECT_GT(report.high, actual) << name << " " << halves;
            EXPECT_EQ(report.byHalvesError > 0, halves) << name;
            if (name == std::string("good")) {
                EXPECT_LT(report.refuted, 0.002);
                EXPECT_LT(report.biased, 0.02);
            } else {
                EXPECT_NEAR(report.relMse / actual, 1, halves ? 0.2 : 0.35) << name << " " << halves;
                EXPECT_GT(report.refuted, 0.5) << name;
            }
        }
}

TEST(Assessment, ByHalvesIsUnbiased) {
    constexpr int kRepetitions = 12;
    double sum = 0, square = 0;
    for (unsigned seed = 1; seed <= kRepetitions; ++seed) {
        SecondOpinion opinion{opinionOf(3 * seed, tooDark), {}};
        opinion.halves = {opinionOf(3 * seed + 1, tooDark), opinionOf(3 * seed + 2, tooDark)};
        Image mean = (*opinion.halves)[0];
        for (std::size_t i = 0; i < mean.pixels.size(); ++i)
            mean.pixels[i] = (mean.pixels[i] + (*opinion.halves)[1].pixels[i]) / 2;
        const double ratio =
            assess(samplesOf(eightSamples, seed),
                   {.quality = Quality::Draft, .secondOpinion = std::make_shared<SecondOpinion>(opinion)})
                .report.byHalves /
            actualRelMse(mean);
        sum += ratio;
        square += ratio * ratio;
    }
    const double mean = sum / kRepetitions,
                 error = std::sqrt((square / kRepetitions - mean * mean) / (kRepetitions - 1));
    EXPECT_NEAR(mean, 1, 4 * error + 0.02);  // 2 %: the unit, 1 / (y^2 + 0.01), knows the samples
    EXPECT_LT(error, 0.1);
}

TEST(Assessment, TheMapShowsWhereAndHowMuch) {
    const auto dark = [](int x, int y) { return x >= 24 && x < 72 && y >= 20 && y < 60; };
    const SampleBuffer samples = samplesOf(eightSamples);
    const Assessment of = assess(
        samples, withOpinion([&](int x, int y) { return (dark(x, y) ? 0.8 : 1) * truthAt(x, y); }, true));
    ASSERT_EQ(of.map.channels, (std::vector<std::string>{"stddev.R", "stddev.G", "stddev.B", "bias.R",
                                                         "bias.G", "bias.B", "confidence"}));
    double bias[2] = {}, wrong[2] = {}, square[2] = {}, refuted[2] = {}, count[2] = {};
    for (int y = 0; y < kPicture.height; ++y)
        for (int x = 0; x < kPicture.width; ++x) {
            const bool near = x >= 8 && x < 88 && y >= 4 && y < 76;  // 15 pixels and less from it
            if (near && !dark(x, y)) continue;
            const int at = dark(x, y);
            const float* const map = of.map.at(x, y);
            for (int c = 0; c < 3; ++c) {
                bias[at] += static_cast<double>(map[3 + c]) / 3;
                square[at] += static_cast<double>(map[c]) * static_cast<double>(map[c]) / 3;
            }
            wrong[at] += dark(x, y) ? -0.2 * truthAt(x, y) : 0;
            refuted[at] += map[6] < 1e-3f;
            ++count[at];
        }
    EXPECT_NEAR(bias[1] / wrong[1], 1, 0.2);
    EXPECT_NEAR(bias[0] / count[0], 0, 0.03 * std::abs(bias[1]) / count[1]);
    EXPECT_GT(refuted[1], 0.8 * count[1]);
    EXPECT_LT(refuted[0], 0.01 * count[0]);
    EXPECT_GT(square[1] / count[1], 5 * square[0] / count[0]);
}

TEST(Assessment, OnePixelProvesNothingAroundIt) {
    const auto wild = [](int x, int y) { return x == 45 && y == 45 ? 1000 : truthAt(x, y); };
    const Assessment of = assess(samplesOf(eightSamples), assessedOf(wild, true));
    EXPECT_NEAR(of.map.at(45, 45)[0], 1000, 100);  // its own error is known
    EXPECT_LT(of.map.at(45, 45)[6], 1e-3f);
    for (const int away : {3, 8, 14})
        for (int c = 0; c < 3; ++c) {
            EXPECT_EQ(of.map.at(45 + away, 45)[3 + c], 0) << away;
            EXPECT_GT(of.map.at(45 + away, 45)[6], 1e-3f) << away;
        }
}

TEST(Assessment, HalvesThatAreNotTheImagesAreRefused) {
    const SampleBuffer samples = samplesOf(eightSamples);
    const auto refusedWith = [&](const Image& even, const Image& odd) {
        SecondOpinion opinion{opinionOf(1), {}};
        opinion.halves = {even, odd};
        const AssessmentReport report =
            assess(samples, {.quality = Quality::Draft,
                             .secondOpinion = std::make_shared<SecondOpinion>(std::move(opinion))})
                .report;
        EXPECT_EQ(report.validated, report.refused.empty());
        EXPECT_EQ(report.byHalvesError > 0, report.validated);
        return report.refused;
    };
    const auto averageOf = [&](int parity) {
        return reconstruct(HalfSamples(samples, false, parity), Mean{}).image.select({"R", "G", "B"});
    };
    EXPECT_EQ(refusedWith(opinionOf(2), opinionOf(3)), "");
    EXPECT_NE(refusedWith(opinionOf(2), opinionOf(2)).find("same image"), std::string::npos);
    EXPECT_NE(refusedWith(averageOf(0), averageOf(1)).find("were they denoised"), std::string::npos);
    EXPECT_NE(refusedWith(opinionOf(2, tooDark), opinionOf(3, tooDark)).find("from their mean"),
              std::string::npos);
}

TEST(Assessment, NeedsAnImageOfTheWholePicture) {
    const SampleBuffer samples = samplesOf(eightSamples);
    EXPECT_THROW(assess(samples, Drift{}), Error);
    Drift banded = withOpinion(truthAt, false);
    banded.band = {0, 2};
    EXPECT_THROW(assess(samples, banded), Error);
}

}  // namespace
}  // namespace vlx
