#include <algorithm>
#include <cmath>

#include "import/channel_presets.h"
#include "import/moments.h"
#include "import/origins.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

// Compares what the difference of the halves says about the variance of their mean with what was given.
struct Agreement {
    double measured = 0;
    double given = 0;

    void add(double a, double b, double variance) {
        const double square = (a - b) * (a - b) / 4;
        if (!std::isfinite(square) || !(variance >= 0) || !std::isfinite(variance)) return;
        measured += square;
        given += variance;
    }
    std::string text() const {
        const double ratio = given > 0 ? measured / given : 0;
        std::string note = "The buffers differ by " + formatted("%.2g", ratio) +
                           " times what the variance says (1 is expected, over all pixels).";
        if (!(ratio > 1.0 / 3 && ratio < 3))
            note = "WARNING: " + note + " Is it the variance of the mean of both?";
        return note;
    }
};

// A channel of the dump: from each buffer, or from one image for both.
struct Taken {
    std::string name;
    FlatChannel of[2];
};

}  // namespace

ImportReport importBuffers(const std::string& a, const std::string& b, const std::string& dump,
                           const BufferOptions& options, const Progress& progress) {
    std::vector<std::string> paths = {a, b};
    Companions companions(options.with);
    companions.appendTo(paths);
    FlatImages images(paths);
    Origins origins;
    StackOptions naming;
    naming.map = options.map;
    for (const auto& [channel, name] : chooseStackMap(a, images.channels(0), naming).map)
        origins[channel] = {0, name};
    companions.enterInto(origins, images);
    const bool known = origins.contains("variance.R");

    ImportReport report;
    describe(images, origins, 2, report);
    DumpHeader header;
    header.data = images.data();
    header.display = images.display();
    header.channels = dumpChannels(report.mapped, true);
    header.compression = options.compression;
    header.renderer = options.renderer.empty() ? images.text(0, "Software") : options.renderer;

    std::vector<Taken> taken;
    for (const auto& channel : header.channels) {
        if (channel.name == "sample.replicate") continue;
        const Origin& origin = origins.at(channel.name);
        Taken& entry = taken.emplace_back(Taken{channel.name, {}});
        for (std::size_t half = 0; half < 2; ++half)
            entry.of[half] = images.take(origin.image < 2 ? half : origin.image, origin.channel);
    }

    Agreement agreement;
    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);
    const int bandRows = images.bandRows(header.channels.size() * 2);
    for (int row = 0; row < header.data.height;) {
        const int rows = std::min(bandRows, header.data.height - row);
        images.read(header.data.y + row, rows);
        SampleBand band{header.data.x, header.data.y + row, header.data.width, rows, {}, {}, {}};
        for (std::size_t p = 0; p <= band.pixels(); ++p) band.offsets.push_back(2 * p);
        std::size_t next = 0;
        for (const auto& channel : header.channels) {
            band.channels.push_back(channel.name);
            auto& values = band.values.emplace_back();
            const bool replicate = channel.name == "sample.replicate";
            for (std::size_t p = 0; p < band.pixels(); ++p)
                for (std::size_t half = 0; half < 2; ++half) {
                    float value =
                        replicate ? static_cast<float>(half) : images.value(taken[next].of[half], p);
                    if (channel.name == "Z") cleanDepth(value);
                    if (channel.name.starts_with("variance."))
                        value = std::isfinite(value) ? 2 * std::max(value, 0.0f) : kUnknownVariance;
                    values.push_back(value);
                }
            if (!replicate) ++next;
        }
        if (known)
            for (const char* c : {"R", "G", "B"}) {
                const auto& colour = band.values[static_cast<std::size_t>(band.channel(c))];
                const auto& variance =
                    band.values[static_cast<std::size_t>(band.channel(std::string("variance.") + c))];
                for (std::size_t i = 0; i < colour.size(); i += 2)
                    agreement.add(colour[i], colour[i + 1], variance[i] < 0 ? NAN : variance[i] / 2);
            }
        writer.write(std::move(band));
        row += rows;
        if (progress) progress(row, header.data.height);
    }
    writer.close();

    report.notes.push_back("Each buffer is one sample a pixel and one replicate.");
    if (known) {
        report.notes.push_back(
            "The variance is taken as that of the mean of both: each buffer has twice it.");
        report.notes.push_back(agreement.text());
    }
    if (images.hash(0) == images.hash(1))
        report.notes.push_back("WARNING: " + b + " is identical to " + a +
                               ": they are not two halves. Errors will be underestimated.");
    report.missing = missingChannels(header);
    if (!known)
        report.missing.push_back({"variances",
                                  "two values a pixel say little about its noise: it is mostly "
                                  "estimated from neighbouring pixels"});
    return report;
}

}  // namespace vlx
