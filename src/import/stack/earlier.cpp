#include "import/stack/earlier.h"

#include "dump/append.h"
#include "variolux/base/error.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/text.h"

namespace vlx {

EarlierStack::EarlierStack(const std::string& path, const DumpHeader& added) : reader_(path) {
    const DumpHeader& own = reader_.header();
    if (own.data != added.data || own.display != added.display)
        throw Error(path, "expected a dump of the images' view, " + windowText(added.data) + " in " +
                              windowText(added.display) + ", found " + windowText(own.data) + " in " +
                              windowText(own.display));
    std::vector<std::string> lacking, beyond;
    for (const DumpChannel& channel : added.channels)
        if (findChannel(own, channel.name) < 0) lacking.push_back(channel.name);
    for (const DumpChannel& channel : own.channels)
        if (findChannel(added, channel.name) < 0) beyond.push_back(channel.name);
    if (!lacking.empty() || !beyond.empty())
        throw Error(path, "expected the channels of the images, found" +
                              (lacking.empty() ? "" : " none of their " + listed(lacking)) +
                              (lacking.empty() || beyond.empty() ? "" : ", and") +
                              (beyond.empty() ? "" : " besides them " + listed(beyond)) +
                              ": images of the same passes, stacked with the options of the first time "
                              "(--preset, --map, --radiance, --groups, --passes), have the same");
    firstReplicate_ = freeReplicate(reader_);
}

double EarlierStack::meanSamples() const {
    return static_cast<double>(samplesOf(reader_)) / static_cast<double>(reader_.header().data.pixels());
}

void EarlierStack::enterInto(DumpHeader& header) const {
    const DumpHeader& own = reader_.header();
    const double before = meanSamples();
    const double added = header.samples.value_or(0);
    header.averaged = (own.averaged * before + header.averaged * added) / (before + added);
    header.samples = own.samples.value_or(before) + added;
    if (!own.renderer.empty()) header.renderer = own.renderer;
    header.scene = own.scene;
    header.pixelFilter = own.pixelFilter;
    header.effects = own.effects;
    header.seed = own.seed;
    header.worldToCamera = own.worldToCamera;
    header.worldToNDC = own.worldToNDC;
    header.replicatesShare = own.replicatesShare || own.splatReplicates > 0;
    header.extra = own.extra;
    header.extra.erase(kInputsAttribute);
}

std::vector<std::string> EarlierStack::notes(std::size_t images, double averaged) const {
    const DumpHeader& own = reader_.header();
    const double before = own.samples.value_or(meanSamples());
    std::vector<std::string> notes = {"They are added to the " + formatted("%.4g", before) +
                                      (before == 1 ? " sample" : " samples") + " a pixel of " +
                                      reader_.path() + ", which makes " +
                                      formatted("%.4g", before + static_cast<double>(images)) +
                                      "; replicates go on from " + std::to_string(firstReplicate_) + "."};
    if (own.averaged != averaged)
        notes.push_back("WARNING: samples of " + reader_.path() + " are means of " +
                        formatted("%g", own.averaged) + " of the renderer's, those of the images of " +
                        formatted("%g", averaged) + ", but count alike: render images of equally many.");
    return notes;
}

}  // namespace vlx
