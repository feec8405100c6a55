#include "moment_rows.h"

#include <algorithm>
#include <cmath>

#include "channel_presets.h"
#include "variolux/base/hash.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

using Triple = std::array<double, 3>;

constexpr double kUnknown = -1;

// Rec. 709 primaries, D65.
constexpr double kRgbOfXyz[3][3] = {{3.2404542, -1.5371385, -0.4985314},
                                    {-0.9692660, 1.8760108, 0.0415560},
                                    {0.0556434, -0.2040259, 1.0572252}};

// +1 or -1, as a coin falls for each (seed, pixel).
double signOf(std::uint64_t seed, int x, int y) { return (hashOf(seed, x, y) >> 63) == 0 ? 1 : -1; }

// Reads what the pixels of the images hold.
class Pixels {
  public:
    explicit Pixels(const MomentSource& source) : source_(source) {}

    Triple mean(std::size_t pixel) const { return triple(source_.mean, pixel); }

    // Of the mean; kUnknown where there is none.
    Triple variance(std::size_t pixel) {
        const Triple given = triple(source_.variance, pixel);
        const Triple first = triple(source_.first ? *source_.first : source_.mean, pixel);
        const double n = source_.count ? source_.images->value(*source_.count, pixel) : source_.samples;
        Triple result{};
        for (std::size_t c = 0; c < 3; ++c) {
            double v = given[c];
            if (source_.meaning == VarianceMeaning::OfSample) v = n >= 1 ? v / n : NAN;
            if (source_.meaning == VarianceMeaning::SecondMoment)
                v = n >= 2 ? (v - first[c] * first[c]) / (n - 1) : NAN;
            if (!std::isfinite(v)) {
                ++unknown;
                return {kUnknown, kUnknown, kUnknown};
            }
            if (v < 0) ++negative;
            result[c] = std::max(v, 0.0);
        }
        return source_.xyz ? ofRgb(result) : result;
    }

    std::int64_t unknown = 0;   // pixels
    std::int64_t negative = 0;  // values

  private:
    Triple triple(const std::array<FlatChannel, 3>& channels, std::size_t pixel) const {
        Triple values{};
        for (std::size_t c = 0; c < 3; ++c) values[c] = source_.images->value(channels[c], pixel);
        return values;
    }

    static Triple ofRgb(const Triple& xyz) {
        Triple rgb{};
        for (std::size_t c = 0; c < 3; ++c) {
            double deviation = 0;
            for (std::size_t k = 0; k < 3; ++k) deviation += kRgbOfXyz[c][k] * std::sqrt(xyz[k]);
            rgb[c] = deviation * deviation;
        }
        return rgb;
    }

    const MomentSource& source_;
};

}  // namespace

void writeMoments(const MomentSource& source, const MomentOutput& output, ImportReport& report,
                  const Progress& progress) {
    FlatImages& images = *source.images;
    ChannelMap map = {{"R", ""},          {"G", ""},          {"B", ""},
                      {"variance.R", ""}, {"variance.G", ""}, {"variance.B", ""}};
    for (const auto& [name, channel] : source.features) map[name] = "";
    DumpHeader header;
    header.data = images.data();
    header.display = images.display();
    header.channels = dumpChannels(map, output.halves);
    header.compression = output.compression;
    header.renderer = output.renderer;
    if (source.samples > 0) header.samples = source.samples;

    const auto indexOf = [&](const std::string& name) {
        return static_cast<std::size_t>(findChannel(header, name));
    };
    std::array<std::size_t, 3> colour{}, variance{};
    for (std::size_t c = 0; c < 3; ++c) {
        colour[c] = indexOf(std::string(1, "RGB"[c]));
        variance[c] = indexOf(std::string("variance.") + "RGB"[c]);
    }

    Pixels pixels(source);
    DumpWriter writer(output.path, header);
    const int bandRows = images.bandRows(header.channels.size() * 3);
    for (int row = 0; row < header.data.height;) {
        const int rows = std::min(bandRows, header.data.height - row);
        images.read(header.data.y + row, rows);
        SampleBand band{header.data.x, header.data.y + row, header.data.width, rows, {0}, {}, {}};
        for (const auto& channel : header.channels) band.channels.push_back(channel.name);
        band.values.resize(header.channels.size());
        for (std::size_t p = 0; p < band.pixels(); ++p) {
            const Triple mean = pixels.mean(p);
            const Triple v = pixels.variance(p);
            const bool halves = output.halves && v[0] >= 0;
            const auto width = static_cast<std::size_t>(band.width);
            const double sign = halves ? signOf(output.seed, band.x + static_cast<int>(p % width),
                                                band.y + static_cast<int>(p / width))
                                       : 0;
            for (int half = 0; half < (halves ? 2 : 1); ++half) {
                for (std::size_t c = 0; c < 3; ++c) {
                    const double off = halves ? (half == 0 ? sign : -sign) * std::sqrt(v[c]) : 0;
                    band.values[colour[c]].push_back(static_cast<float>(mean[c] + off));
                    band.values[variance[c]].push_back(static_cast<float>(halves ? 2 * v[c] : v[c]));
                }
                for (const auto& [name, channel] : source.features) {
                    float value = images.value(channel, p);
                    if (name == "Z") cleanDepth(value);
                    band.values[indexOf(name)].push_back(value);
                }
                if (output.halves)
                    band.values[indexOf("sample.replicate")].push_back(static_cast<float>(half));
            }
            band.offsets.push_back(band.values[colour[0]].size());
        }
        writer.write(std::move(band));
        row += rows;
        if (progress) progress(row, header.data.height);
    }
    writer.close();

    auto& notes = report.notes;
    if (output.halves)
        notes.push_back(
            "Two samples a pixel, made of mean and variance: artificial halves whose errors are "
            "uncorrelated. "
            "Their mean is the image's.");
    else
        notes.push_back("One sample a pixel: the image's value, with its variance.");
    if (source.xyz)
        notes.push_back(
            "Variances of X, Y, Z became those of R, G, B (Rec. 709) as if their errors were perfectly "
            "correlated.");
    if (pixels.negative > 0)
        notes.push_back(std::to_string(pixels.negative) + " negative variances count as 0.");
    if (pixels.unknown > 0)
        notes.push_back(std::to_string(pixels.unknown) +
                        " pixels have no usable variance: they are one sample of unknown variance (-1).");
    report.missing = missingChannels(header);
    report.missing.push_back({"single samples",
                              "fireflies can only be told from neighbouring pixels, and a "
                              "variance estimated from few samples is itself uncertain"});
}

}  // namespace vlx
