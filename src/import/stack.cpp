#include "import/stack.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <optional>

#include "dump/append.h"
#include "import/stack/doubts.h"
#include "import/stack/earlier.h"
#include "import/stack/headers.h"
#include "import/stack/notes.h"
#include "import/stack/pass_file.h"
#include "import/stack/plan.h"
#include "import/stack/rendered.h"
#include "import/stack/samples.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"
#include "variolux/dump/writer.h"

namespace vlx {

namespace {

double sumOf(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

DumpHeader headerOf(const FlatImages& images, const StackPlan& plan, const std::vector<double>& samples,
                    const StackOptions& options) {
    DumpHeader header;
    header.data = images.data();
    header.display = images.display();
    for (const StackChannel& channel : plan.channels) header.channels.push_back(channel.channel);
    header.compression = options.compression;
    header.renderer = options.renderer.empty() ? rendererOf(images, plan.layer) : options.renderer;
    header.samples = static_cast<double>(images.size());
    if (std::ranges::find(samples, 0.0) == samples.end())  // the mean, where they differ
        header.averaged = sumOf(samples) / static_cast<double>(samples.size());
    return header;
}

// Rows are packed by sixteen: bands that cut them are unpacked twice. Wide pictures of many images have to.
int wholeChunks(int rows) {
    constexpr int kChunk = 16;
    return rows < kChunk / 2 ? rows : (rows + kChunk - 1) / kChunk * kChunk;
}

// What neither the dump nor the file of --passes has.
std::vector<std::string> ignoredChannels(const Names& names, const StackPlan& plan, bool allPasses) {
    if (allPasses) return {};
    Names taken, ignored;
    for (const StackChannel& channel : plan.channels) {
        for (const std::string& source : channel.recipe.sum) taken.push_back(channelFor(names, source).name);
        if (!channel.recipe.times.empty()) taken.push_back(channel.recipe.times);
    }
    for (const std::string& name : names)
        if (!contains(taken, name)) ignored.push_back(name);
    return ignored;
}

// Light groups and contributions, against all of the light.
class Sums {
  public:
    void add(const SampleBand& band, const StackPlan& plan) {
        Names parts;
        for (const Contribution& part : plan.contributions) parts.push_back(part.name);
        if (!groups_ && !plan.groups.empty()) groups_.emplace(band, plan.groups);
        if (!contributions_ && !parts.empty()) contributions_.emplace(band, parts);
        if (groups_) groups_->add(band);
        if (contributions_) contributions_->add(band);
    }

    void note(const StackOptions& options, const StackPlan& plan, const Names& names, bool half,
              std::vector<std::string>& notes) const {
        if (groups_)
            noteSum("Light groups", *groups_, half, " Put all lights, the world and what glows into groups.",
                    notes);
        else if (options.groups)
            notes.push_back("The images have no light groups: none are kept.");
        const Names missing = missingContributions(names, plan.layer);
        if (contributions_)
            noteSum("Contributions", *contributions_, half,
                    missing.empty() ? "" : " Passes that are not there: " + listed(missing) + ".", notes);
        else if (!options.passes.empty())
            notes.push_back("The images have no contributions to keep as radiance; for these turn on " +
                            listed(missing) + ".");
    }

  private:
    std::optional<LightSum> groups_, contributions_;
};

void noteIdentical(const FlatImages& images, std::vector<std::string>& notes) {
    std::map<std::uint64_t, std::string> seen;
    for (std::size_t i = 0; i < images.size(); ++i) {
        const auto [same, isNew] = seen.emplace(images.hash(i), images.path(i));
        if (!isNew)
            notes.push_back("WARNING: " + images.path(i) + " is identical to " + same->second +
                            ": rendered with the same seed? Errors will be underestimated.");
    }
}

template <class Doubt, class... Arguments>
void note(std::vector<std::string>& notes, const Doubt& doubt, const Arguments&... arguments) {
    const std::vector<std::string> more = doubt.notes(arguments...);
    notes.insert(notes.end(), more.begin(), more.end());
}

}  // namespace

ImportReport stackImages(const std::vector<std::string>& images, const std::string& dump,
                         const StackOptions& options, const Progress& progress) {
    if (images.empty()) throw Error(dump, "expected images to make a dump of, found none");
    FlatImages sources(images);
    const StackPlan plan = planStack(images.front(), sources.channels(0), options);
    const std::vector<double> samples = samplesOfImages(sources, plan.layer);

    DumpHeader header = headerOf(sources, plan, samples, options);
    const double averaged = header.averaged;
    std::optional<EarlierStack> earlier;
    if (!options.append.empty()) earlier.emplace(options.append, header).enterInto(header);
    StackedSamples stacked(sources, plan, earlier ? earlier->firstReplicate() : 0);
    RenderedPixels rendered(sources, plan, options.keepEmpty);
    HalfLimit halfLimit(sources, plan);
    std::optional<PassFile> passes;
    if (!options.passes.empty())
        passes.emplace(options.passes, sources, plan, sumOf(samples), options.inputs);
    setInputs(header, options.inputs);
    DumpWriter writer(dump, header);

    std::optional<FeatureAgreement> agreement;
    Sums sums;
    Duplicates duplicates;
    const std::size_t read = std::max(header.channels.size(), passes ? sources.channels(0).size() : 0);
    const int bandRows = wholeChunks(sources.bandRows(read * images.size()));
    for (int row = 0; row < header.data.height;) {
        const int rows = std::min(bandRows, header.data.height - row);
        sources.read(header.data.y + row, rows);
        SampleBand band = stacked.band(row, rows);
        if (!agreement) agreement.emplace(band, images.size());
        agreement->add(band);
        halfLimit.add(sources, band.pixels());
        sums.add(band, plan);
        if (passes) passes->write(rows);
        const std::vector<char> keep = rendered.of(sources, band);
        if (earlier) {
            const SampleBand before = earlier->samples().read(band.y, rows, band.channels);
            duplicates.add(before, band, images.size());
            writer.write(joined(before, withoutEmpty(std::move(band), keep, images.size())));
        } else {
            writer.write(withoutEmpty(std::move(band), keep, images.size()));
        }
        row += rows;
        if (progress) progress(row, header.data.height);
    }
    writer.close();
    if (passes) passes->close();

    ImportReport report;
    report.mapped = plan.mapped;
    report.ignored = ignoredChannels(sources.channels(0), plan, passes.has_value());
    report.missing = missingChannels(header);
    auto& notes = report.notes;
    noteSamples(samples, notes);
    if (!earlier) {  // else said when that was made
        if (!report.mapped.contains("sample.x"))
            notes.push_back("The images say nothing about positions within pixels: none are written.");
        if (stacked.misses() > 0)
            notes.push_back(std::to_string(stacked.misses()) +
                            " samples had a depth that is negative, not finite, or 1e9 and more (nothing "
                            "hit): their Z is 0.");
        noteMotion(report.mapped, stacked.motionless(), notes);
        notePreset(plan, notes);
    }
    sums.note(options, plan, sources.channels(0), halfLimit.anyHalf(), notes);
    if (passes) note(notes, *passes, earlier.has_value());
    noteRadiance(plan, notes);
    if (earlier) {
        note(notes, *earlier, images.size(), averaged);
        note(notes, duplicates, sources, options.append);
    }
    note(notes, rendered);
    note(notes, halfLimit);
    note(notes, *agreement, plan.preset == StackPreset::Cycles);
    noteIdentical(sources, notes);
    return report;
}

}  // namespace vlx
