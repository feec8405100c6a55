#include <algorithm>

#include "import/bcd.h"
#include "import/channel_presets.h"
#include "import/moment_rows.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

std::string binName(std::size_t number) { return formatted("Bin_%04.0f", static_cast<double>(number)); }

}  // namespace

ImportReport importBcdStatistics(const std::string& image, const std::string& covariance,
                                 const std::string& histogram, const std::string& dump,
                                 const BcdOptions& options, const Progress& progress) {
    std::vector<std::string> paths = {image, covariance};
    if (!histogram.empty()) paths.push_back(histogram);
    auto opened = std::make_unique<FlatImages>(paths);
    FlatImages& images = *opened;

    ImportReport report;
    MomentChannels source;
    source.meaning = VarianceMeaning::OfSample;
    source.samples = options.samples;
    const auto colours = findTriple(images.channels(0), {""});
    if (!colours)
        throw Error(image,
                    "expected an image of R, G and B, as BCD has them, found " + listed(images.channels(0)) +
                        " (vlx-pack moments takes images of luminance, and names others: --map R=CHANNEL)");
    for (std::size_t c = 0; c < 3; ++c) {
        const std::string colour(1, "RGB"[c]);
        source.mean[c] = images.take(0, (*colours)[c]);
        source.variance[c] = images.take(1, binName(c));
        report.mapped[colour] = (*colours)[c];
        report.mapped["variance." + colour] = covariance + " " + binName(c);
    }
    for (const auto& name : images.channels(0))
        if (std::find(colours->begin(), colours->end(), name) == colours->end())
            report.ignored.push_back(name);
    report.ignored.push_back("covariances between colours");
    if (!histogram.empty()) {
        std::size_t bins = 0;
        while (contains(images.channels(2), binName(bins))) ++bins;
        if (bins < 4)
            throw Error(histogram,
                        "expected a histogram of three colours and the number of samples: channels "
                        "Bin_0000, Bin_0001 and on; found " +
                            listed(images.channels(2)));
        source.count = images.take(2, binName(bins - 1));
        report.ignored.push_back("the histogram of " + std::to_string((bins - 1) / 3) + " bins");
        report.notes.push_back("The number of samples of each pixel comes from " + binName(bins - 1) +
                               " of the histogram.");
    } else if (!(options.samples >= 1)) {
        throw Error(covariance,
                    "expected the number of samples a pixel (--samples N), or a third file, the histogram "
                    "that has it");
    }
    report.notes.push_back("The covariances are those of single samples.");
    const MomentRows samples(
        std::move(opened), std::move(source),
        {options.renderer, options.halves, options.seed, options.compression, options.inputs},
        std::move(report));
    writeSamples(samples, dump, progress);
    return samples.report();
}

}  // namespace vlx
