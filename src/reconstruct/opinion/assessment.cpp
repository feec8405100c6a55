#include "variolux/reconstruct/assessment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "reconstruct/opinion/evidence.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/base/text.h"
#include "variolux/dump/half_samples.h"

namespace vlx {

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kRelativeFloor = 0.01;  // of relMSE
constexpr int kBlock = 16;               // pixels along an axis: what errors have in common is smaller
constexpr double kFewestBlocks = 4;
// Standard error, relative, of the mean squared error that an error map predicts, with a validated weight
// and without: testdata/results/second_opinion.md.
constexpr double kMapError = 0.5, kUnvalidatedError = 1;
// Of u(y) = 1 / (y^2 + s^2 + 0.01) against the mean of u(truth), by the second derivative: about as many s^2
// u^2.
constexpr double kUnitBias = 3;
constexpr double kLeastError = 0.05;  // relative: of all that is not accounted for
constexpr double kInterval = 1.96;    // standard errors of 95 %
constexpr float kRefuted = 1e-3f;

/// An estimate of a mean and its standard error; NaN where there is none.
struct Estimate {
    double value = kNan, error = kNan;
};

/// Sums over a block of pixels.
struct Block {
    double sum = 0, count = 0;
};

/// relMSE of the mean of a denoiser's images of halves, unbiased: its variance, (D_A - D_B)^2 / 4, and its
/// squared bias, (z_A - D_A) (z_B - D_B), in which neither noise meets itself. Its standard error is what
/// blocks differ by or, if that is more, what the noise of the halves leads to, whose variance both share:
/// where few samples are far brighter, chance that one half met them is the chance of the other.
Estimate estimateByHalves(const SampleSource& source, const SecondOpinion& opinion,
                          const std::vector<float>* unit) {
    const bool replicates = hasReplicates(source);
    const SampleMeans ofHalf[] = {sampleMeans(HalfSamples(source, replicates, 0)),
                                  sampleMeans(HalfSamples(source, replicates, 1))};
    const auto& [even, odd] = *opinion.halves;
    const int across = (ofHalf[0].width + kBlock - 1) / kBlock;
    std::vector<Block> blocks(static_cast<std::size_t>(across) *
                              static_cast<std::size_t>((ofHalf[0].height + kBlock - 1) / kBlock));
    double noise = 0;
    for (int y = 0; y < ofHalf[0].height; ++y)
        for (int x = 0; x < ofHalf[0].width; ++x) {
            const std::size_t p = ofHalf[0].at(x, y);
            if (!ofHalf[0].known(p) || !ofHalf[1].known(p)) continue;
            Block& block = blocks[static_cast<std::size_t>(y / kBlock * across + x / kBlock)];
            ++block.count;
            double variance = 0;  // colours share their noise
            for (std::size_t c = 0; c < 3; ++c) {
                const double a = even.pixels[3 * p + c], b = odd.pixels[3 * p + c];
                const double left = (static_cast<double>(ofHalf[0].mean[c][p]) - a) *
                                    (static_cast<double>(ofHalf[1].mean[c][p]) - b);
                const auto u = static_cast<double>(unit[c][p]);
                block.sum += u * ((a - b) * (a - b) / 4 + left) / 3;
                variance += u * static_cast<double>(ofHalf[0].own[c][p] + ofHalf[1].own[c][p]) / 6;
            }
            noise += variance * variance;
        }
    double sum = 0, count = 0, square = 0, used = 0;
    for (const Block& block : blocks) {
        if (block.count == 0) continue;
        sum += block.sum;
        count += block.count;
        ++used;
    }
    if (used < kFewestBlocks) return {};
    const double mean = sum / count;
    for (const Block& block : blocks) {
        const double d = block.sum - mean * block.count;
        square += d * d * used / (used - 1);
    }
    return {mean, std::sqrt(std::max(square, noise)) / count};
}

}  // namespace

Assessment assess(const SampleSource& source, const Drift& options, const Progress& progress) {
    if (!options.secondOpinion || options.band.count != 1)
        throw Error(source.path(), "expected another denoiser's image to assess, and no band of it");
    const SecondOpinion& opinion = *options.secondOpinion;
    const Window& picture = source.header().data;
    requireMemory(source.path(), imageBytes(picture, 7 + 7 + 16), "an assessment held whole");
    Reconstruction combined = reconstruct(source, options, progress);
    const Image kriged = combined.image.select({"R", "G", "B", "stddev.R", "stddev.G", "stddev.B"});
    combined.image = {};

    Assessment result;
    result.kriging = std::move(combined.report);
    result.map =
        Image(picture, {"stddev.R", "stddev.G", "stddev.B", "bias.R", "bias.G", "bias.B", "confidence"});
    result.map.display = source.header().display;
    const std::size_t pixels = static_cast<std::size_t>(picture.pixels());
    std::vector<float> unit[3], likely(pixels, 1.f);
    for (auto& plane : unit) plane.resize(pixels);
    double own = 0, unitError = 0;
    AssessmentReport& report = result.report;
    for (std::size_t p = 0; p < pixels; ++p)
        for (std::size_t c = 0; c < 3; ++c) {
            const double y = kriged.pixels[6 * p + c], s = kriged.pixels[6 * p + 3 + c];
            const double apart = static_cast<double>(opinion.image.pixels[3 * p + c]) - y;
            const double error = s * s + apart * apart, u = 1 / (y * y + s * s + kRelativeFloor);
            unit[c][p] = static_cast<float>(u);
            result.map.pixels[7 * p + c] = static_cast<float>(error);
            report.byMap += u * error / (3 * static_cast<double>(pixels));
            own += u * s * s / (3 * static_cast<double>(pixels));
            unitError += kUnitBias * u * error * u * s * s / (3 * static_cast<double>(pixels));
            likely[p] =
                std::min(likely[p], static_cast<float>(s * s / std::max(apart * apart, s * s + 1e-300)));
        }
    report.validated = result.kriging.drift().secondOpinion->validated;
    report.refused = result.kriging.drift().secondOpinion->refused;
    // Of (D - y)^2 + s^2 + 2 (D - y) (y - truth), whose mean is the first two, only the first is known.
    report.byMapError = (report.validated ? kMapError : kUnvalidatedError) * std::sqrt(own * report.byMap);
    const Estimate halves = report.validated ? estimateByHalves(source, opinion, unit) : Estimate{};
    report.byHalves = halves.value;
    report.byHalvesError = halves.error;
    double precision = 1 / (report.byMapError * report.byMapError), sum = report.byMap * precision;
    if (halves.error > 0) {
        precision += 1 / (halves.error * halves.error);
        sum += halves.value / (halves.error * halves.error);
    }
    if (report.byMap > 0) {
        // Two that contradict each other are both less sure than they say (Birge's ratio).
        const double contradiction = halves.error > 0 ? std::abs(halves.value - report.byMap) /
                                                            std::hypot(halves.error, report.byMapError)
                                                      : 0;
        const double both = std::max(1.0, contradiction) / std::sqrt(precision);
        report.relMse = std::max(sum / precision, both / kInterval);
        const double deviation =
            std::hypot(both, unitError / report.byMap * report.relMse, kLeastError * report.relMse);
        const double factor = std::exp(kInterval * deviation / report.relMse);
        report.low = report.relMse / factor;
        report.high = report.relMse * factor;
    }

    const SampleMeans means = sampleMeans(source);
    const Doubts doubts = doubtsOf(means, opinion.image);
    const double scale = report.byMap > 0 ? report.relMse / report.byMap : 1;
    for (std::size_t p = 0; p < pixels; ++p) {
        float* const out = result.map.pixels.data() + 7 * p;
        for (std::size_t c = 0; c < 3; ++c) {
            out[c] = static_cast<float>(std::sqrt(scale * static_cast<double>(out[c])));
            out[3 + c] = doubts.bias[c][p];
        }
        out[6] = std::min(doubts.confidence[p], likely[p]);
        report.biased += (out[3] != 0 || out[4] != 0 || out[5] != 0) / static_cast<double>(pixels);
        report.refuted += (out[6] < kRefuted) / static_cast<double>(pixels);
    }
    return result;
}

std::string toText(const AssessmentReport& of) {
    std::string text = formatted("relMSE %.3g", of.relMse) + formatted(" (95 %%: %.3g to ", of.low) +
                       formatted("%.3g); ", of.high);
    if (of.byHalvesError > 0)
        text += formatted("images of halves say %.3g", of.byHalves) +
                formatted(" +- %.2g, ", of.byHalvesError) + formatted("the kriging %.3g", of.byMap) +
                formatted(" +- %.2g\n", of.byMapError);
    else
        text += "by what it differs from the kriging\n";
    if (!of.refused.empty()) text += "WARNING: the images of halves were not used: " + of.refused + "\n";
    if (of.byHalvesError > 0 &&
        std::abs(of.byHalves - of.byMap) > 2 * std::hypot(of.byHalvesError, of.byMapError))
        text +=
            "WARNING: the two contradict each other: are these one denoiser's images of the whole and of "
            "both halves?\n";
    text += formatted("significantly biased in %.3g %% of the pixels, ", 100 * of.biased) +
            formatted("refuted by the samples (confidence below 0.001) in %.3g %%\n", 100 * of.refuted);
    return text;
}

std::string toJson(const AssessmentReport& of) {
    const auto orNull = [](double value) {
        return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json();
    };
    return nlohmann::ordered_json{{"relMse", of.relMse},
                                  {"low", of.low},
                                  {"high", of.high},
                                  {"byMap", of.byMap},
                                  {"byMapError", of.byMapError},
                                  {"byHalves", orNull(of.byHalves)},
                                  {"byHalvesError", orNull(of.byHalvesError)},
                                  {"validated", of.validated},
                                  {"refused", of.refused},
                                  {"biased", of.biased},
                                  {"refuted", of.refuted}}
        .dump();
}

}  // namespace vlx
