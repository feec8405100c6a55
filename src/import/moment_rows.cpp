#include "import/moment_rows.h"

#include <algorithm>
#include <cmath>

#include "dump/stored_values.h"
#include "import/channel_presets.h"
#include "variolux/base/hash.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

constexpr int kWrittenRows = 32;
// Values of a band to be written, at four bytes, a few times.
constexpr std::size_t kWrittenValues = std::size_t{8} << 20;

// Rec. 709 primaries, D65.
constexpr double kRgbOfXyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                    {-0.9692660, 1.8760108, 0.0415560},
                                    {0.0556434, -0.2040259, 1.0572252}};

// +1 or -1, as a coin falls for each (seed, pixel).
double signOf(std::uint64_t seed, int x, int y) { return (hashOf(seed, x, y) >> 63) == 0 ? 1 : -1; }

}  // namespace

MomentRows::MomentRows(std::unique_ptr<FlatImages> images, MomentChannels channels, MomentOutput output,
                       ImportReport report)
    : images_(std::move(images)),
      channels_(std::move(channels)),
      output_(std::move(output)),
      report_(std::move(report)) {
    ChannelMap map = {{"R", ""},          {"G", ""},          {"B", ""},
                      {"variance.R", ""}, {"variance.G", ""}, {"variance.B", ""}};
    for (const auto& further : channels_.radiance) map[further.name] = "";
    for (const auto& [name, channel] : channels_.features) map[name] = "";
    header_.data = images_->data();
    header_.display = images_->display();
    header_.channels = dumpChannels(map, output_.halves);
    header_.compression = output_.compression;
    header_.renderer = output_.renderer;
    setInputs(header_, output_.inputs);
    if (channels_.samples > 0) header_.samples = channels_.samples;
    const auto indexOf = [&](const std::string& name) {
        return static_cast<std::size_t>(findChannel(header_, name));
    };
    for (std::size_t c = 0; c < 3; ++c) {
        colour_[c] = indexOf(std::string(1, "RGB"[c]));
        variance_[c] = indexOf(std::string("variance.") + "RGB"[c]);
    }
    for (const auto& further : channels_.radiance) radiance_.push_back(indexOf(further.name));
    for (const auto& [name, channel] : channels_.features) features_.push_back(indexOf(name));
    if (output_.halves) replicate_ = indexOf("sample.replicate");
    doubts_.resize(static_cast<std::size_t>(header_.data.height));
}

MomentRows::Triple MomentRows::triple(const std::array<FlatChannel, 3>& channels, std::size_t pixel) const {
    Triple values{};
    for (std::size_t c = 0; c < 3; ++c) values[c] = images_->value(channels[c], pixel);
    return values;
}

// Of the mean; kUnknownVariance where there is none.
MomentRows::Triple MomentRows::variance(std::size_t pixel, Doubts& doubts) const {
    const Triple given = triple(channels_.variance, pixel);
    const Triple first = triple(channels_.first ? *channels_.first : channels_.mean, pixel);
    const double n = channels_.count ? images_->value(*channels_.count, pixel) : channels_.samples;
    Triple result{};
    for (std::size_t c = 0; c < 3; ++c) {
        double v = given[c];
        if (channels_.meaning == VarianceMeaning::OfSample) v = n >= 1 ? v / n : NAN;
        if (channels_.meaning == VarianceMeaning::SecondMoment)
            v = n >= 2 ? (v - first[c] * first[c]) / (n - 1) : NAN;
        if (v < 0) ++doubts.negative;
        if (!(v >= 0) || !std::isfinite(v)) {  // no variance of anything
            ++doubts.unknown;
            return {kUnknownVariance, kUnknownVariance, kUnknownVariance};
        }
        result[c] = v;
    }
    if (!channels_.xyz) return result;
    Triple rgb{};
    for (std::size_t c = 0; c < 3; ++c) {
        double deviation = 0;
        for (std::size_t k = 0; k < 3; ++k) deviation += kRgbOfXyz[c][k] * std::sqrt(result[k]);
        rgb[c] = deviation * deviation;
    }
    return rgb;
}

SampleBand MomentRows::read(int y, int rows, const std::vector<std::string>& channels) const {
    checkRows(path(), header_, y, rows);
    images_->read(y, rows);
    SampleBand band{header_.data.x, y, header_.data.width, rows, {0}, {}, {}};
    for (const auto& channel : header_.channels) band.channels.push_back(channel.name);
    band.values.resize(header_.channels.size());
    const auto width = static_cast<std::size_t>(band.width);
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        const int row = y + static_cast<int>(p / width);
        Doubts& doubts = doubts_[static_cast<std::size_t>(row - header_.data.y)];
        if (p % width == 0) doubts = {};
        const Triple mean = triple(channels_.mean, p);
        const Triple v = variance(p, doubts);
        const bool finite = std::isfinite(mean[0]) && std::isfinite(mean[1]) && std::isfinite(mean[2]);
        const bool halves = output_.halves && v[0] >= 0 && finite;
        const double sign = halves ? signOf(output_.seed, band.x + static_cast<int>(p % width), row) : 0;
        for (int half = 0; half < (halves ? 2 : 1); ++half) {
            Triple value = mean;
            for (std::size_t c = 0; c < 3; ++c) {
                if (halves) value[c] += (half == 0 ? sign : -sign) * std::sqrt(v[c]);
                band.values[colour_[c]].push_back(static_cast<float>(value[c]));
                band.values[variance_[c]].push_back(static_cast<float>(halves ? 2 * v[c] : v[c]));
            }
            for (std::size_t i = 0; i < radiance_.size(); ++i) {
                const auto& further = channels_.radiance[i];
                double part = images_->value(further.channel, p);
                if (const auto c = static_cast<std::size_t>(further.colour); c < 3 && mean[c] != 0)
                    part *= value[c] / mean[c];
                band.values[radiance_[i]].push_back(static_cast<float>(part));
            }
            for (std::size_t i = 0; i < features_.size(); ++i) {
                float feature = images_->value(channels_.features[i].second, p);
                if (channels_.features[i].first == "Z") cleanDepth(feature);
                band.values[features_[i]].push_back(feature);
            }
            if (output_.halves) band.values[replicate_].push_back(static_cast<float>(half));
        }
        band.offsets.push_back(band.values[colour_[0]].size());
    }
    roundToStored(band, header_);
    return selectChannels(std::move(band), channels, path());
}

ImportReport MomentRows::report() const {
    ImportReport report = report_;
    Doubts doubts;
    for (const Doubts& row : doubts_) {
        doubts.unknown += row.unknown;
        doubts.negative += row.negative;
    }
    auto& notes = report.notes;
    if (output_.halves)
        notes.push_back(
            "Two samples a pixel, made of mean and variance: artificial halves whose errors are "
            "uncorrelated. Their mean is the image's.");
    else
        notes.push_back("One sample a pixel: the image's value, with its variance.");
    if (channels_.xyz)
        notes.push_back(
            "Variances of X, Y, Z became those of R, G, B (Rec. 709) as if their errors were perfectly "
            "correlated.");
    if (doubts.negative > 0)
        notes.push_back(std::to_string(doubts.negative) +
                        " variances are negative: they count as not known.");
    if (doubts.unknown > 0)
        notes.push_back(std::to_string(doubts.unknown) +
                        " pixels have no usable variance: they are one sample of unknown variance (-1).");
    report.missing = missingChannels(header_);
    report.missing.push_back({"single samples",
                              "fireflies can only be told from neighbouring pixels, and a "
                              "variance estimated from few samples is itself uncertain"});
    return report;
}

void writeSamples(const SampleSource& source, const std::string& dump, const Progress& progress) {
    const DumpHeader& header = source.header();
    const std::size_t row = static_cast<std::size_t>(header.data.width) * header.channels.size() * 2;
    const int bandRows = static_cast<int>(std::clamp<std::size_t>(kWrittenValues / row, 1, kWrittenRows));
    DumpWriter writer(dump, header);
    for (int done = 0; done < header.data.height;) {
        const int rows = std::min(bandRows, header.data.height - done);
        writer.write(source.read(header.data.y + done, rows));
        done += rows;
        if (progress) progress(done, header.data.height);
    }
    writer.close();
}

}  // namespace vlx
