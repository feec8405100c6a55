#include "reconstruct/opinion/opinion.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "reconstruct/common/picture_scale.h"
#include "reconstruct/common/window_sum.h"
#include "reconstruct/opinion/evidence.h"
#include "variolux/base/error.h"
#include "variolux/base/memory.h"
#include "variolux/dump/cropped_samples.h"
#include "variolux/dump/half_samples.h"

namespace vlx {

namespace {

constexpr double kEqualWeights = 0.5;
constexpr double kPriorData = 10;         // that speak for equal weights
constexpr double kRelativeError = 1e-3;   // of a value squared: dark pixels are not all that counts
constexpr float kMostValue = 0x1p50f;     // squares of it are finite floats
constexpr double kTrimmed = 0.02;         // of the pixels
constexpr int kJudgedTile = 256;          // pixels along an axis
constexpr double kJudgedShare = 1 / 8.0;  // of a picture of many tiles
constexpr int kTileBorder = 12;           // pixels that have neighbours on one side only, as a picture's have
constexpr int kApartReach = 4;            // pixels along a row

/// Where the weight is found: tiles spread over the picture, two at least, each a picture of its own; the
/// whole of a picture of up to three tiles.
std::vector<Window> judgedTiles(const Window& picture) {
    const int width = std::min(kJudgedTile, picture.width), height = std::min(kJudgedTile, picture.height);
    const double tiles = static_cast<double>(picture.pixels()) / (double{1} * width * height);
    if (tiles <= 3) return {picture};
    const int count = std::max(2, static_cast<int>(std::lround(kJudgedShare * tiles)));
    std::vector<Window> result;
    for (int i = 0; i < count; ++i) {
        const double along = (i + 0.5) / count, across = std::fmod(0.25 + 0.618 * i, 1.0);
        const bool wide = picture.width > picture.height;
        result.push_back(
            {picture.x + static_cast<int>(std::lround((wide ? along : across) * (picture.width - width))),
             picture.y + static_cast<int>(std::lround((wide ? across : along) * (picture.height - height))),
             width, height});
    }
    return result;
}

/// Rows of progress so far, and of all.
struct Steps {
    const Progress& progress;
    std::int64_t before = 0, all = 0;
    Progress next() const {
        if (!progress) return {};
        return [this](std::int64_t done, std::int64_t) { progress(before + done, all); };
    }
};

/// A draft of samples, pixel by pixel: column and row from the corner of their window, channels R, G, B first
/// and stddev.R, .G, .B last. Not those beside a border that is not the picture's.
template <class F>
void forDraftPixels(const SampleSource& source, const Window& picture, const Drift& options, Steps& steps,
                    F pixel) {
    Drift draft = options;
    draft.quality = Quality::Draft;
    draft.secondOpinion = nullptr;
    draft.diagnostics = false;
    draft.inspect.clear();
    draft.band = {};
    const Window& part = source.header().data;
    const auto borderOf = [](int first, int of) { return first == of ? 0 : kTileBorder; };
    const int left = borderOf(part.x, picture.x), top = borderOf(part.y, picture.y);
    const int right = part.width - borderOf(part.x + part.width, picture.x + picture.width);
    const int bottom = part.height - borderOf(part.y + part.height, picture.y + picture.height);
    const Image outline = driftOutline(source, draft);
    const int channels = outline.channelCount();
    int y = 0;
    reconstructDrift(
        source, draft,
        [&](const float* rows, int count) {
            for (int i = 0; i < count; ++i, ++y) {
                if (y < top || y >= bottom) continue;
                for (int x = left; x < right; ++x)
                    pixel(x, y, rows + (std::ptrdiff_t{i} * part.width + x) * channels, channels);
            }
        },
        steps.next());
    steps.before += part.height;
}

double relativeUnit(const SampleMeans& samples, std::size_t pixel, const float* kriged) {
    double variance = 1e-30, square = 0;
    for (std::size_t c = 0; c < 3; ++c) {
        variance += static_cast<double>(samples.variance[c][pixel]) / 3;
        square += static_cast<double>(kriged[c]) * static_cast<double>(kriged[c]) / 3;
    }
    return 1 / (variance + kRelativeError * square);
}

/// Sums over the tiles that halves are judged in.
struct HalvesSums {
    double follow = 0, follow2 = 0;  ///< sum of (D_A - D_B) (z_A - z_B), and of its square
    double whole = 0, between = 0;   ///< of the squared distance of D from their mean M, and of D_A from D_B
    double left = 0, leftOfHalves = 0;  ///< of (D - z)^2 and of (M - z)^2
    double product = 0, square = 0;     ///< of (z - D) (K - D) and of (K - D)^2
    std::int64_t judged = 0;
};

void compareHalves(const SecondOpinion& opinion, const SampleMeans* ofHalf, const Window& tile,
                   HalvesSums& sums) {
    const auto& [even, odd] = *opinion.halves;
    const int left = tile.x - even.data.x, top = tile.y - even.data.y;
    for (int y = 0; y < tile.height; ++y)
        for (int x = 0; x < tile.width; ++x) {
            const std::size_t p = ofHalf[0].at(x, y);
            if (!ofHalf[0].known(p) || !ofHalf[1].known(p)) continue;
            const float *const e = even.at(left + x, top + y), *const o = odd.at(left + x, top + y),
                               *const all = opinion.image.at(left + x, top + y);
            double follow = 0;
            for (std::size_t c = 0; c < 3; ++c) {
                const double a = e[c], b = o[c], d = all[c];
                const double u =
                    1 / (static_cast<double>(ofHalf[0].variance[c][p] + ofHalf[1].variance[c][p]) +
                         kRelativeError * (a * a + b * b));
                follow += u * (a - b) * static_cast<double>(ofHalf[0].mean[c][p] - ofHalf[1].mean[c][p]);
                sums.whole += u * (d - (a + b) / 2) * (d - (a + b) / 2);
                sums.between += u * (a - b) * (a - b);
                const double z = static_cast<double>(ofHalf[0].mean[c][p] + ofHalf[1].mean[c][p]) / 2;
                sums.left += u * (d - z) * (d - z);
                sums.leftOfHalves += u * ((a + b) / 2 - z) * ((a + b) / 2 - z);
            }
            sums.follow += follow;
            sums.follow2 += follow * follow;
        }
}

/// Throws Error when images of halves follow each the *other* half's noise: (D_A - D_B) (z_A - z_B) is then
/// negative, beyond three standard errors.
void requireOwnHalves(const std::string& name, const HalvesSums& sums) {
    if (sums.follow < -3 * std::sqrt(sums.follow2))
        throw Error(
            name,
            "expected images of the even and of the odd samples, EVEN,ODD, that follow their own, found "
            "images that follow each the other half's: are they exchanged, or is one of another kind?");
}

/// The weight w of the kriging K, of halves, in K w + D (1 - w) that predicts the other half's means z best:
///     w = (sum u (z - D) (K - D) + l / 2) / (sum u (K - D)^2 + l),   u = 1 / (v + 1e-3 K^2).
/// Nothing, and why, where no pixel has samples of both halves, or where the whole image is not of the
/// halves' kind (whyRefused).
struct ValidatedWeight {
    std::optional<double> weight;
    std::string refused;
};

/// One denoiser's image differs from the mean of its halves' by less than they from each other, and leaves as
/// much of the samples' noise as they do (0.96 to 1 times in testdata/results/rivals.md's cases).
std::string whyRefused(const HalvesSums& sums) {
    constexpr double kMostOfLeft = 1.5;
    const double rounding = 0.01 * sums.between;  // of plain averages nothing is left
    if (sums.judged == 0) return "no pixel has samples of both halves";
    if (sums.between == 0) return "both are the same image";
    if (sums.whole > sums.between)
        return "the whole image differs from their mean more than they from each other";
    if (sums.leftOfHalves > kMostOfLeft * sums.left + rounding)
        return "the whole image follows the samples more closely";
    if (sums.left > kMostOfLeft * sums.leftOfHalves + rounding)
        return "they follow the samples more closely than the whole image: were they denoised?";
    return {};
}

ValidatedWeight validatedWeight(const SampleSource& source, const Drift& options, Steps& steps) {
    const SecondOpinion& opinion = *options.secondOpinion;
    const Window& picture = source.header().data;
    const bool replicates = hasReplicates(source);
    HalvesSums sums;
    for (const Window& tile : judgedTiles(picture)) {
        const CroppedSamples part(source, tile);
        const HalfSamples samples[] = {{part, replicates, 0}, {part, replicates, 1}};
        const SampleMeans ofHalf[] = {sampleMeans(samples[0]), sampleMeans(samples[1])};
        compareHalves(opinion, ofHalf, tile, sums);
        requireOwnHalves(source.path(), sums);
        for (int half = 0; half < 2; ++half) {
            const SampleMeans& means = ofHalf[1 - half];
            const Image& denoised = (*opinion.halves)[static_cast<std::size_t>(half)];
            forDraftPixels(samples[half], picture, options, steps, [&](int x, int y, const float* k, int) {
                const std::size_t p = means.at(x, y);
                if (!ofHalf[0].known(p) || !ofHalf[1].known(p)) return;
                ++sums.judged;
                const float* const d = denoised.at(tile.x - picture.x + x, tile.y - picture.y + y);
                const double u = relativeUnit(means, p, k);
                for (std::size_t c = 0; c < 3; ++c) {
                    const double apart = static_cast<double>(k[c] - d[c]);
                    sums.product += u * static_cast<double>(means.mean[c][p] - d[c]) * apart;
                    sums.square += u * apart * apart;
                }
            });
        }
    }
    if (const std::string why = whyRefused(sums); !why.empty()) return {std::nullopt, why};
    return {std::clamp((sums.product + kPriorData * kEqualWeights) / (sums.square + kPriorData), 0.0, 1.0),
            {}};
}

/// The sum of all but the largest kTrimmed of them: places tell of themselves only, and only many of them of
/// the image.
double trimmedSum(std::vector<double> values) {
    std::sort(values.begin(), values.end());
    values.resize(values.size() - static_cast<std::size_t>(kTrimmed * static_cast<double>(values.size())));
    return std::accumulate(values.begin(), values.end(), 0.0);
}

/// Without halves: equal weights, or what two bounds of the other image's squared error say against a draft's
/// predicted s^2, bound / (bound + sum u s^2), if that is more: its certain errors, sum u e, and its distance
/// from the draft beyond the draft's own error, sum u (D - K)^2 - sum u s^2. Two that err by s^2 each differ
/// by at most twice that unless their errors are opposite.
double certainWeight(const SampleSource& source, const Drift& options, const SampleMeans& samples,
                     const std::vector<float>& certain, Steps& steps) {
    const Image& denoised = options.secondOpinion->image;
    const Window& picture = source.header().data;
    std::vector<double> wrong, apart, own;
    for (const Window& tile : judgedTiles(picture))
        forDraftPixels(CroppedSamples(source, tile), picture, options, steps,
                       [&](int column, int row, const float* k, int channels) {
                           const int x = tile.x - picture.x + column, y = tile.y - picture.y + row;
                           const std::size_t p = samples.at(x, y);
                           if (!samples.known(p)) return;
                           const float* const s = k + channels - 3;
                           const double u = relativeUnit(samples, p, k);
                           double predicted = 0, distance = 0;
                           for (int c = 0; c < 3; ++c) {
                               const auto d = static_cast<double>(denoised.at(x, y)[c] - k[c]);
                               distance += u * d * d / 3;
                               predicted += u * static_cast<double>(s[c]) * static_cast<double>(s[c]) / 3;
                           }
                           wrong.push_back(u * static_cast<double>(certain[p]));
                           apart.push_back(distance);
                           own.push_back(predicted);
                       });
    const double predicted = trimmedSum(std::move(own));
    double weight = kEqualWeights;
    for (const double bound : {trimmedSum(std::move(wrong)), trimmedSum(std::move(apart)) - predicted})
        if (bound > 0) weight = std::max(weight, bound / (bound + predicted));
    return weight;
}

/// Combines finished rows with the other image.
class Combiner {
  public:
    Combiner(const Image& denoised, const std::vector<float>& certain, double weight, bool validated,
             int width, int channels, int firstRow)
        : denoised_(denoised),
          certain_(certain),
          weight_(weight),
          validated_(validated),
          width_(width),
          channels_(channels),
          y_(firstRow) {}

    void combineRow(float* row) {
        const auto w = static_cast<std::size_t>(width_);
        std::vector<float> apart2[3], around(w), pixels(w, 1.f), count(w);
        sumAround(pixels, kApartReach, false, count.data());
        for (int c = 0; c < 3; ++c) {
            apart2[c].resize(w);
            for (int x = 0; x < width_; ++x) {
                const float d = denoised_.at(x, y_)[c] - row[x * channels_ + c];
                apart2[c][static_cast<std::size_t>(x)] = d * d;
            }
            sumAround(apart2[c], kApartReach, false, around.data());
            for (std::size_t i = 0; i < w; ++i) apart2[c][i] = around[i] / count[i];
        }
        for (int x = 0; x < width_; ++x) {
            const auto i = static_cast<std::size_t>(x);
            float *const k = row + std::ptrdiff_t{x} * channels_, *const s = k + channels_ - 3;
            const double wrong = certain_[static_cast<std::size_t>(y_) * w + i];
            double own = 0;
            for (int c = 0; c < 3; ++c) own += static_cast<double>(s[c]) * static_cast<double>(s[c]) / 3;
            const double weight = std::max(weight_, wrong > 0 ? wrong / (wrong + own) : 0);
            yielded_ += weight > weight_;
            bool limited = false;
            for (int c = 0; c < 3; ++c) {
                const double deviation = s[c], apart = static_cast<double>(denoised_.at(x, y_)[c] - k[c]);
                const double most = kOpinionDeviations * deviation, full = (1 - weight) * apart;
                const double move = std::clamp(full, -most, most);
                limited = limited || move != full;
                // A validated q is the least squares': what is left is s^2 - q^2 (D - K)^2. Of two estimates
                // that err by s^2 each it is s^2 - q (1 - q) (D - K)^2. Farther apart, one of them is wrong;
                // but what was moved by m from an estimate that errs by s^2 errs by no more than s^2 + m^2.
                const double own2 = deviation * deviation, q = apart != 0 ? move / apart : 0,
                             known = validated_ ? q * q : q * (1 - q);
                const double variance =
                    std::max({own2 - known * static_cast<double>(apart2[c][i]),
                              std::min(move * (apart - move), own2 + move * move), own2 / 4});
                k[c] += static_cast<float>(move);
                s[c] = static_cast<float>(std::sqrt(variance));
            }
            limited_ += limited;
        }
        ++y_;
        rows_ += 1;
    }

    void report(SecondOpinionReport& of) const {
        const double pixels = static_cast<double>(rows_) * width_;
        of.weight = weight_;
        of.yielded = static_cast<double>(yielded_) / pixels;
        of.limited = static_cast<double>(limited_) / pixels;
    }

  private:
    const Image& denoised_;
    const std::vector<float>& certain_;
    double weight_;
    bool validated_;
    int width_, channels_, y_;
    std::int64_t rows_ = 0, yielded_ = 0, limited_ = 0;
};

}  // namespace

Image checkedOpinion(Image image, const std::string& name, const Window& window) {
    for (const char* channel : {"R", "G", "B"})
        if (image.channel(channel) < 0)
            throw Error(name,
                        "expected channels R, G and B of another denoiser, found others: FILE:LAYER "
                        "names a layer");
    const bool placed = image.data.x != 0 || image.data.y != 0;
    if (image.data.width != window.width || image.data.height != window.height ||
        (placed && (image.data.x != window.x || image.data.y != window.y)))
        throw Error(name, "expected the samples' window, " + windowText(window) + ", found " +
                              windowText(image.data));
    Image result = image.select({"R", "G", "B"});
    result.data = window;
    for (std::size_t p = 0; p < result.pixels.size(); ++p)
        if (!(std::abs(result.pixels[p]) <= kMostValue)) {
            const auto pixel = static_cast<std::int64_t>(p / 3);
            throw Error(name, "expected finite values up to 2^50, found " + std::to_string(result.pixels[p]) +
                                  " at column " + std::to_string(window.x + pixel % window.width) + ", row " +
                                  std::to_string(window.y + pixel / window.width));
        }
    return result;
}

ReconstructionReport reconstructWithOpinion(const SampleSource& source, const Drift& options,
                                            const RowSink& sink, const Progress& progress) {
    const SecondOpinion& opinion = *options.secondOpinion;
    const Window& picture = source.header().data;
    const Image outline = driftOutline(source, options);
    for (const Image* image : {&opinion.image, opinion.halves ? &(*opinion.halves)[0] : nullptr,
                               opinion.halves ? &(*opinion.halves)[1] : nullptr})
        if (image && (image->data != picture || image->channelCount() != 3))
            throw Error(source.path(),
                        "expected another denoiser's image of R, G, B over the samples' window");
    measurePictureScale(source, chooseSampleLayout(source, options));  // throws on radiance that is too much
    const std::uint64_t planes = 9 + 13 + 1;  // SampleMeans, what the image differs by, evidence
    requireMemory(source.path(), imageBytes(picture, planes), "another denoiser's image beside the means");

    Steps steps{progress, 0, outline.data.height};
    for (const Window& tile : judgedTiles(picture)) steps.all += (opinion.halves ? 2 : 1) * tile.height;
    SecondOpinionReport report;
    std::vector<float> certain;
    {
        const SampleMeans samples = sampleMeans(source);
        certain = certainError(samples, opinion.image);
        ValidatedWeight found;
        if (opinion.halves) found = validatedWeight(source, options, steps);
        report.refused = found.refused;
        report.validated = found.weight.has_value();
        report.weight =
            found.weight ? *found.weight : certainWeight(source, options, samples, certain, steps);
        steps.all = steps.before + outline.data.height;  // halves may not have been judged
    }
    Combiner combiner(opinion.image, certain, report.weight, report.validated, picture.width,
                      outline.channelCount(), outline.data.y - picture.y);
    std::vector<float> rows;
    Drift alone = options;
    alone.secondOpinion = nullptr;
    const std::ptrdiff_t stride = std::ptrdiff_t{picture.width} * outline.channelCount();
    ReconstructionReport result = reconstructDrift(
        source, alone,
        [&](const float* kriged, int count) {
            rows.assign(kriged, kriged + count * stride);
            for (int row = 0; row < count; ++row) combiner.combineRow(rows.data() + row * stride);
            sink(rows.data(), count);
        },
        steps.next());
    combiner.report(report);
    std::get<DriftReport>(result.method).secondOpinion = report;
    return result;
}

}  // namespace vlx
