#include "render/film/append.h"

#include <algorithm>
#include <cmath>

#include "dump/append.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx::render {
namespace {

bool sameMatrix(const std::optional<std::vector<float>>& a, const std::optional<std::vector<float>>& b) {
    if (!a || !b) return true;  // nothing to compare
    return std::ranges::equal(*a, *b,
                              [](float x, float y) { return std::abs(x - y) <= 1e-4f * (1 + std::abs(x)); });
}

std::string pictureIn(const DumpHeader& header) {
    const auto found = header.extra.find(kPictureAttribute);
    return found == header.extra.end() ? std::string() : found->second;
}

/// What of two pictures is not the same, in words; nothing where one is not known.
std::string differences(const std::string& earlier, const std::string& traced) {
    const auto was = split(earlier, ';'), is = split(traced, ';');
    if (was.size() != is.size()) return {};
    std::vector<std::string> words;
    for (std::size_t i = 0; i < was.size(); ++i)
        if (was[i] != is[i])
            words.push_back(was[i].substr(was[i].find_first_not_of(' ')) + ", not " +
                            is[i].substr(std::min(is[i].find(": "), is[i].size() - 2) + 2));
    return listed(words, "; ");
}

}  // namespace

EarlierDump::EarlierDump(const std::string& path) : reader_(path) {
    // Features may have been left out where they do not vary.
    for (const std::string name : {"R", "G", "B", "A", "sample.x", "sample.y"})
        if (findChannel(header(), name) < 0)
            throw Error(path, "expected a dump of vlx-trace, found none of its channel " + name);
}

std::uint64_t EarlierDump::samples() const { return samplesOf(reader_); }

std::optional<std::uint32_t> EarlierDump::freeReplicate() const {
    if (!hasReplicates()) return {};
    return vlx::freeReplicate(reader_);
}

void EarlierDump::checkSameView(const DumpHeader& traced) const {
    const DumpHeader& own = header();
    if (own.data != traced.data || own.display != traced.display)
        throw Error(reader_.path(), "expected a picture of " + windowText(traced.data) + " in " +
                                        windowText(traced.display) + ", found " + windowText(own.data) +
                                        " in " + windowText(own.display));
    if (!sameMatrix(own.worldToCamera, traced.worldToCamera) ||
        !sameMatrix(own.worldToNDC, traced.worldToNDC))
        throw Error(reader_.path(), "expected the view of the camera that is traced, found another one");
    const std::string others = differences(pictureIn(own), pictureIn(traced));
    if (!others.empty())
        throw Error(reader_.path(), "expected samples of the picture that is traced, found others: " +
                                        others + "; trace it anew without --append");
}

SampleBand EarlierDump::before(const SampleBand& added) const {
    return joined(reader_.read(added.y, added.height, added.channels), added);
}

}  // namespace vlx::render
