// Alpha, and what the report says of the whole image: its predicted error, and noise that pixels share.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "variolux/dump/sample_buffer.h"
#include "variolux/reconstruct/reconstruct.h"

namespace vlx {
namespace {

constexpr int kWide = 48, kHigh = 40;

/// Samples of R, G, B, A and albedo of which `sample(x, y)`, raster positions, says alpha and albedo; lit
/// with noise of 30 %.
SampleBuffer covered(int spp, unsigned seed,
                     const std::function<std::pair<float, float>(double, double, std::mt19937&)>& sample) {
    DumpHeader header;
    header.data = header.display = {0, 0, kWide, kHigh};
    SampleBand band{0, 0, kWide, kHigh, {0}, {}, {}};
    for (const char* name : {"R", "G", "B", "A", "albedo.R", "albedo.G", "albedo.B"}) {
        header.channels.push_back({name, ChannelType::Float});
        band.channels.emplace_back(name);
    }
    band.values.resize(7);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> within;
    std::normal_distribution<float> noise(1, 0.3f);
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            for (int s = 0; s < spp; ++s) {
                const auto [alpha, albedo] = sample(x + within(random), y + within(random), random);
                const float light = noise(random);
                for (std::size_t c = 0; c < 3; ++c) {
                    band.values[c].push_back(alpha * albedo * light);
                    band.values[4 + c].push_back(alpha * albedo);
                }
                band.values[3].push_back(alpha);
            }
            band.offsets.push_back(band.values[0].size());
        }
    return SampleBuffer(header, std::move(band));
}

/// A textured card before nothing, its sides aslant.
std::pair<float, float> card(double x, double y, std::mt19937&) {
    const bool on = x - 0.11 * y > 8 && x + 0.07 * y < 41 && y - 0.09 * x > 6 && y + 0.05 * x < 34;
    const bool dark = (static_cast<int>(x / 4) + static_cast<int>(y / 4)) % 2 == 0;
    return {on ? 1.f : 0.f, dark ? 0.1f : 0.8f};
}

TEST(Coverage, AnOpaqueCardIsOpaqueAndItsEdgesAreNoWorseThanTheSamples) {
    std::vector<double> truth;
    std::mt19937 none;
    for (int y = 0; y < kHigh; ++y)
        for (int x = 0; x < kWide; ++x) {
            int on = 0;
            for (int i = 0; i < 400; ++i)
                on += card(x + (i % 20 + 0.5) / 20, y + (i / 20 + 0.5) / 20, none).first > 0;
            truth.push_back(on / 400.0);
        }
#ifdef VARIOLUX_SANITIZED
    const std::vector<int> counts = {4};
#else
    const std::vector<int> counts = {4, 8, 16};
#endif
    for (const int spp : counts) {
        double kriged = 0, own = 0;
        int agree = 0, doubted = 0;
        for (unsigned seed = 1; seed <= 4; ++seed) {
            const SampleBuffer samples = covered(spp, seed, card);
            const Image image = reconstruct(samples, Drift{}).image,
                        mean = reconstruct(samples, Mean{}).image;
            for (int y = 0; y < kHigh; ++y)
                for (int x = 0; x < kWide; ++x) {
                    const double of = mean.at(x, y)[3], value = image.at(x, y)[3],
                                 is = truth[static_cast<std::size_t>(y * kWide + x)];
                    if (of == 0 || of == 1) {
                        ++agree;
                        doubted += value != of;
                    } else {
                        kriged += (value - is) * (value - is);
                        own += (of - is) * (of - is);
                    }
                }
        }
        EXPECT_LE(doubted, agree / 100) << spp;
        EXPECT_LE(std::sqrt(kriged), 1.02 * std::sqrt(own)) << spp;
    }
}

// Where coverage is small everywhere, samples that agree on 0 do so by chance: it is neither
// noisy nor lost.
TEST(Coverage, SmokeIsSmoothAndStays) {
    for (const float density : {0.05f, 0.1f, 0.5f}) {
        const auto smoke = [density](double, double, std::mt19937& random) {
            return std::pair{std::bernoulli_distribution(static_cast<double>(density))(random) ? 1.f : 0.f,
                             0.5f};
        };
        const SampleBuffer samples = covered(4, 11, smoke);
        const Image image = reconstruct(samples, Drift{}).image, mean = reconstruct(samples, Mean{}).image;
        double kriged = 0, own = 0, bias = 0;
        for (int y = 0; y < kHigh; ++y)
            for (int x = 0; x < kWide; ++x) {
                const float error = image.at(x, y)[3] - density, of = mean.at(x, y)[3] - density;
                kriged += error * error;
                own += of * of;
                bias += error / (kWide * kHigh);
            }
        EXPECT_LT(std::sqrt(kriged), 0.5 * std::sqrt(own)) << density;
        // Of 7,680 samples the mean has a standard error of 0.0057 at most: four of them.
        EXPECT_NEAR(bias, 0, 0.023) << density;
    }
}

// An edge out of focus: what samples say of it is chance for some pixels on either side.
TEST(Coverage, AnEdgeOutOfFocusIsSmooth) {
    constexpr double kBlur = 2.5, kEdge = 20.3;  // pixels
    const auto blurred = [&](double x, double y, std::mt19937& random) {
        const double seen = y + std::normal_distribution<double>(0, kBlur)(random);
        return std::pair{seen > kEdge ? 1.f : 0.f, static_cast<int>(x / 6) % 2 == 0 ? 0.2f : 0.7f};
    };
    const SampleBuffer samples = covered(8, 6, blurred);
    const Image image = reconstruct(samples, Drift{}).image, mean = reconstruct(samples, Mean{}).image;
    double kriged = 0, own = 0;
    for (int y = 14; y < 27; ++y)
        for (int x = 0; x < kWide; ++x) {
            const double is = 0.5 * std::erfc((kEdge - y - 0.5) / (kBlur * std::sqrt(2.0)));
            kriged += (image.at(x, y)[3] - is) * (image.at(x, y)[3] - is);
            own += (mean.at(x, y)[3] - is) * (mean.at(x, y)[3] - is);
        }
    EXPECT_LT(std::sqrt(kriged), 0.75 * std::sqrt(own));
}

TEST(Coverage, BandsAreTheWholeImage) {
    const SampleBuffer samples = covered(4, 3, card);
    const Image whole = reconstruct(samples, Drift{}).image;
    int row = 0;
    for (int i = 0; i < 3; ++i) {
        const Image band = reconstruct(samples, Drift{.band = {i, 3}}).image;
        for (int y = 0; y < band.data.height; ++y, ++row)
            for (int x = 0; x < kWide; ++x)
                ASSERT_EQ(band.at(x, y)[3], whole.at(x, row)[3]) << x << " " << row;
    }
    EXPECT_EQ(row, kHigh);
}

TEST(Report, PredictsItsRelMse) {
    const SampleBuffer samples = covered(8, 5, card);
    for (const Method& method : std::vector<Method>{Drift{}, Mean{}}) {
        const Reconstruction result = reconstruct(samples, method);
        double sum = 0;
        for (int y = 0; y < kHigh; ++y)
            for (int x = 0; x < kWide; ++x)
                for (int c = 0; c < 3; ++c) {
                    const double value = result.image.at(x, y)[c], deviation = result.image.at(x, y)[4 + c];
                    sum += deviation * deviation / (value * value + 0.01);
                }
        ASSERT_TRUE(result.report.predictedRelMse);
        EXPECT_NEAR(*result.report.predictedRelMse, sum / (3 * kWide * kHigh), 1e-9);
        EXPECT_THAT(toText(result.report), testing::HasSubstr("predicted error, relMSE: "));
    }
    EXPECT_FALSE(reconstruct(samples, Gaussian{}).report.predictedRelMse);
}

/// A flat grey picture of two images, whose noise is that of `weights` along rows.
SampleBuffer greyWithNoise(const std::vector<float>& weights) {
    DumpHeader header;
    header.data = header.display = {0, 0, 64, 64};
    SampleBand band{0, 0, 64, 64, {0}, {"R", "G", "B", "sample.replicate"}, {}};
    for (const std::string& name : band.channels) header.channels.push_back({name, ChannelType::Float});
    band.values.resize(4);
    std::mt19937 random(2);
    std::normal_distribution<float> normal;
    const auto reach = weights.size() - 1;
    for (int y = 0; y < 64; ++y) {
        std::vector<float> white[2];
        for (auto& row : white)
            for (std::size_t i = 0; i < 64 + reach; ++i) row.push_back(normal(random));
        for (std::size_t x = 0; x < 64; ++x) {
            for (int half = 0; half < 2; ++half) {
                float noise = 0;
                for (std::size_t k = 0; k <= reach; ++k) noise += weights[k] * white[half][x + k];
                for (std::size_t c = 0; c < 3; ++c) band.values[c].push_back(1 + 0.2f * noise);
                band.values[3].push_back(static_cast<float>(half));
            }
            band.offsets.push_back(band.values[0].size());
        }
    }
    return SampleBuffer(header, std::move(band));
}

TEST(Report, TellsNoiseThatPixelsShare) {
    const ReconstructionReport own = reconstruct(greyWithNoise({1}), Drift{}).report;
    EXPECT_LT(std::abs(own.drift().neighbourCorrelation), 4 * own.drift().neighbourCorrelationError);
    EXPECT_THAT(toText(own), testing::Not(testing::HasSubstr("share their noise")));
    // Of weights a, b, a neighbours correlate by 2 a b / (2 a^2 + b^2): 2/3; cutting d at 3
    // changes little.
    const ReconstructionReport shared = reconstruct(greyWithNoise({0.5f, 1, 0.5f}), Drift{}).report;
    EXPECT_NEAR(shared.drift().neighbourCorrelation, 2.0 / 3, 0.05);
    EXPECT_THAT(toText(shared), testing::HasSubstr("share their noise (correlation 0.6"));
}

}  // namespace
}  // namespace vlx
