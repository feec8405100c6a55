// Another denoiser's image as secondary variable: what it is worth where it is right, and what a wrong one
// costs.

#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "opinion_pictures.h"
#include "reconstruct/opinion/evidence.h"
#include "variolux/base/error.h"
#include "variolux/dump/cropped_samples.h"
#include "variolux/dump/half_samples.h"

namespace vlx {
namespace {

struct OpinionErrors {
    double actual = 0, predicted = 0;
};

OpinionErrors errorsOf(const Image& image) {
    OpinionErrors mean;
    const double values = 3.0 * kPicture.width * kPicture.height;
    for (int y = 0; y < kPicture.height; ++y)
        for (int x = 0; x < kPicture.width; ++x)
            for (int c = 0; c < 3; ++c) {
                const double d = static_cast<double>(image.at(x, y)[c]) - truthAt(x, y),
                             s = static_cast<double>(image.at(x, y)[3 + c]);
                mean.actual += d * d / values;
                mean.predicted += s * s / values;
            }
    return mean;
}

TEST(SecondOpinion, ARightOneHelpsAndTheErrorMapKnows) {
    const SampleBuffer samples = samplesOf(eightSamples);
    const OpinionErrors kriged = errorsOf(reconstruct(samples, Drift{}).image);
    for (const bool halves : {true, false}) {
        const Reconstruction result = reconstruct(samples, withOpinion(truthAt, halves));
        const SecondOpinionReport report = result.report.drift().secondOpinion.value();
        const OpinionErrors errors = errorsOf(result.image);
        EXPECT_LT(errors.actual, (halves ? 0.6 : 0.7) * kriged.actual) << halves;
        const double ratio = errors.predicted / errors.actual;
        EXPECT_GT(ratio, 0.5) << halves;
        EXPECT_LT(ratio, 4) << halves;  // of an image four times better than the kriging the map is cautious
        EXPECT_EQ(report.validated, halves);
        if (halves)
            EXPECT_LT(report.weight, 0.4);
        else
            EXPECT_EQ(report.weight, 0.5);
        EXPECT_LT(report.yielded, 0.02) << halves;
    }
}

TEST(SecondOpinion, AWrongOneCostsNextToNothing) {
    const SampleBuffer samples = samplesOf(eightSamples);
    const double alone = errorsOf(reconstruct(samples, Drift{}).image).actual;
    const std::pair<const char*, std::function<double(int, int)>> wrong[] = {
        {"black", [](int, int) { return 0.0; }},
        {"too bright", [](int x, int y) { return 1.1 * truthAt(x, y); }},
        {"shifted", [](int x, int y) { return truthAt(x + 2, y); }},
        {"another scene", [](int x, int y) { return 2 + std::sin(0.3 * (x + y)); }}};
    for (const auto& [name, of] : wrong)
        for (const bool halves : {true, false}) {
            const Reconstruction result = reconstruct(samples, withOpinion(of, halves));
            EXPECT_LT(errorsOf(result.image).actual, 1.1 * alone) << name << " " << halves;
            // Too bright by a tenth, it errs little more than the kriging.
            EXPECT_GT(result.report.drift().secondOpinion->weight,
                      name == std::string("too bright") ? 0.4 : 0.8)
                << name << " " << halves;
        }
}

TEST(SecondOpinion, MovesNoPixelBeyondTwoOfItsDeviations) {
    const SampleBuffer samples = samplesOf(eightSamples);
    const Image alone = reconstruct(samples, Drift{}).image;
    // Wild in single pixels, of which no window can be certain.
    const Image both =
        reconstruct(
            samples,
            withOpinion([](int x, int y) { return truthAt(x, y) + (x % 11 == 3 && y % 13 == 5 ? 20 : 0); },
                        false))
            .image;
    for (std::size_t p = 0; p < alone.pixels.size(); p += 6)
        for (std::size_t c = 0; c < 3; ++c)
            ASSERT_LE(std::abs(both.pixels[p + c] - alone.pixels[p + c]), 2.0001f * alone.pixels[p + 3 + c])
                << p;
}

TEST(SecondOpinion, YieldsWhereItIsWrongAndNowhereElse) {
    const SampleBuffer samples = samplesOf(eightSamples);
    const Image alone = reconstruct(samples, Drift{}).image;
    const auto hidden = [](int x, int y) { return x >= 16 && x < 40 && y >= 16 && y < 40; };
    const Image both =
        reconstruct(samples,
                    withOpinion([&](int x, int y) { return hidden(x, y) ? 0.0 : truthAt(x, y); }, true))
            .image;
    double error[2][2] = {};  // hidden or not, of alone and both
    for (int y = 0; y < kPicture.height; ++y)
        for (int x = 0; x < kPicture.width; ++x)
            for (int c = 0; c < 3; ++c)
                for (const Image* image : {&alone, &both})
                    error[hidden(x, y)][image == &both] +=
                        std::pow(static_cast<double>(image->at(x, y)[c]) - truthAt(x, y), 2);
    EXPECT_LT(error[1][1], 1.3 * error[1][0]);  // its border is in windows of both; 4 times without any
    EXPECT_LT(error[0][1], 0.9 * error[0][0]);
}

TEST(SecondOpinion, BandsAreTheWholeImage) {
    const SampleBuffer samples = samplesOf([](int x, int y) { return (x * y) % 5; });  // and gaps
    Drift options = withOpinion(truthAt, true);
    const Image whole = reconstruct(samples, options).image;
    std::size_t at = 0;
    for (int i = 0; i < 3; ++i) {
        options.band = {i, 3};
        for (const float value : reconstruct(samples, options).image.pixels) {
            ASSERT_TRUE(std::isfinite(value));
            ASSERT_EQ(value, whole.pixels[at++]) << i;
        }
    }
    EXPECT_EQ(at, whole.pixels.size());
}

TEST(SecondOpinion, TilesOfALargePictureTellTheWeight) {
    const Window strip{5, -7, 800, 24};  // judged in two tiles, not in the whole
    const SampleBuffer samples = samplesOf(eightSamples, 11, strip);
    // Right on the left: both tiles count, wherever they lie.
    const auto half = [](int x, int y) { return x < 400 ? truthAt(x, y) : 0.5 * truthAt(x, y); };
    const auto weight = [&](const std::function<double(int, int)>& of) {
        SecondOpinion opinion{opinionOf(1, of, 0.03, strip), {}};
        opinion.halves = {opinionOf(2, of, 0.04, strip), opinionOf(3, of, 0.04, strip)};
        const Drift options{.secondOpinion = std::make_shared<SecondOpinion>(std::move(opinion))};
        const SecondOpinionReport report = reconstruct(samples, options).report.drift().secondOpinion.value();
        EXPECT_TRUE(report.validated);
        return report.weight;
    };
    EXPECT_LT(weight(truthAt), 0.4);
    EXPECT_GT(weight(half), 0.5);
    EXPECT_GT(weight([](int, int) { return 0.0; }), 0.9);
}

TEST(SecondOpinion, OneSampleAPixelHasNoHalvesToJudgeBy) {
    const SampleBuffer samples = samplesOf([](int, int) { return 1; });
    const Reconstruction result = reconstruct(samples, withOpinion(truthAt, true));
    EXPECT_FALSE(result.report.drift().secondOpinion->validated);
    EXPECT_LT(result.report.drift().secondOpinion->weight, 0.9);
    EXPECT_LT(errorsOf(result.image).actual, errorsOf(reconstruct(samples, Drift{}).image).actual);
}

TEST(SecondOpinion, OptionsThatDoNotFitAreErrors) {
    const SampleBuffer samples = samplesOf(eightSamples);
    Drift options = withOpinion(truthAt, false);
    options.scale = 2;
    EXPECT_THROW(reconstruct(samples, options), Error);
    options = withOpinion(truthAt, false);
    options.strength = 0.5;
    EXPECT_THROW(reconstruct(samples, options), Error);
    options = withOpinion(truthAt, false);
    options.radiance = {"R"};
    EXPECT_THROW(reconstruct(samples, options), Error);
    SecondOpinion small{Image({-3, 5, 95, 80}, {"R", "G", "B"}), {}};
    EXPECT_THROW(
        reconstruct(samples, Drift{.secondOpinion = std::make_shared<SecondOpinion>(std::move(small))}),
        Error);
}

TEST(CheckedOpinion, TellsWhatIsWrong) {
    EXPECT_EQ(checkedOpinion(Image({0, 0, 96, 80}, {"R", "G", "B"}), "a.pfm", kPicture).data, kPicture);
    EXPECT_EQ(checkedOpinion(opinionOf(1), "a.exr", kPicture).pixels, opinionOf(1).pixels);
    EXPECT_THROW(checkedOpinion(Image({0, 0, 80, 96}, {"R", "G", "B"}), "a", kPicture), Error);
    EXPECT_THROW(checkedOpinion(Image({1, 5, 96, 80}, {"R", "G", "B"}), "a", kPicture), Error);
    EXPECT_THROW(checkedOpinion(Image(kPicture, {"Y"}), "a", kPicture), Error);
    Image infinite = opinionOf(1);
    infinite.at(7, 2)[1] = std::numeric_limits<float>::infinity();
    try {
        checkedOpinion(infinite, "a", kPicture);
        FAIL();
    } catch (const Error& e) {
        EXPECT_NE(std::string(e.what()).find("column 4, row 7"), std::string::npos) << e.what();
    }
}

TEST(CertainError, IsALowerBound) {
    const SampleMeans samples = sampleMeans(samplesOf(eightSamples));
    const auto share = [](const std::vector<float>& errors) {
        double found = 0;
        for (const float e : errors) found += e > 0;
        return found / static_cast<double>(errors.size());
    };
    EXPECT_LT(share(certainError(samples, opinionOf(1))), 0.02);
    const std::vector<float> dim =
        certainError(samples, opinionOf(1, [](int x, int y) { return 0.95 * truthAt(x, y); }));
    EXPECT_GT(share(dim), 0.5);  // by its mean, over a hundred pixels
    double mean = 0, actual = 0;
    for (int y = 0; y < kPicture.height; ++y)
        for (int x = 0; x < kPicture.width; ++x) {
            mean += static_cast<double>(dim[samples.at(x, y)]);
            actual += std::pow(0.05 * truthAt(x, y), 2) + 0.03 * 0.03;
        }
    EXPECT_LT(mean, actual);
}

TEST(HalfSamples, AreThoseOfEvenAndOddNumber) {
    DumpHeader header;
    header.data = header.display = {0, 0, 2, 1};
    header.independentHalves = true;
    header.channels = {{"R"}, {"G"}, {"B"}, {"sample.replicate"}};
    const std::vector<float> values = {1, 2, 3, 4, 5}, replicate = {0, 0, 1, 1, 2};
    const SampleBuffer source(
        header,
        {0, 0, 2, 1, {0, 4, 5}, {"R", "G", "B", "sample.replicate"}, {values, values, values, replicate}});
    EXPECT_TRUE(hasReplicates(source));
    using Values = std::vector<float>;
    EXPECT_EQ(HalfSamples(source, false, 0).read(0, 1, {"R"}).values[0], (Values{1, 3, 5}));
    EXPECT_EQ(HalfSamples(source, false, 1).read(0, 1, {"G"}).values[0], (Values{2, 4}));
    const HalfSamples even(source, true, 0);
    EXPECT_FALSE(even.header().independentHalves);
    const SampleBand band = even.read(0, 1);
    EXPECT_EQ(band.channels.size(), 4U);
    EXPECT_EQ(band.values[0], (Values{1, 2, 5}));
    EXPECT_EQ(band.offsets, (std::vector<std::uint64_t>{0, 2, 3}));
}

TEST(CroppedSamples, AreThoseOfTheirPart) {
    const SampleBuffer all = samplesOf([](int x, int y) { return (x + 2 * y) % 4; });
    const Window part{10, 20, 30, 17};
    const CroppedSamples cropped(all, part);
    EXPECT_EQ(cropped.header().data, part);
    EXPECT_EQ(cropped.header().display, kPicture);
    const SampleBand whole = all.read(22, 5), kept = cropped.read(22, 5);
    EXPECT_EQ(kept.x, part.x);
    ASSERT_EQ(kept.pixels(), 150U);
    for (std::size_t row = 0; row < 5; ++row)
        for (std::size_t x = 0; x < 30; ++x) {
            const std::size_t p = row * 96 + 13 + x, q = row * 30 + x;
            ASSERT_EQ(kept.offsets[q + 1] - kept.offsets[q], whole.offsets[p + 1] - whole.offsets[p]);
            for (std::uint64_t i = 0; i < kept.offsets[q + 1] - kept.offsets[q]; ++i)
                ASSERT_EQ(kept.values[2][kept.offsets[q] + i], whole.values[2][whole.offsets[p] + i]);
        }
    EXPECT_EQ(kept.values[0].size(), kept.offsets.back());
    EXPECT_THROW(cropped.read(19, 3), Error);
    EXPECT_THROW(cropped.read(36, 2), Error);
    for (const Window& outside : {Window{-4, 20, 5, 5}, Window{90, 20, 4, 5}, Window{0, 5, 5, 0}})
        EXPECT_THROW(CroppedSamples(all, outside), Error);
}

}  // namespace
}  // namespace vlx
