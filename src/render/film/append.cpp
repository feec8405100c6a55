#include "render/film/append.h"

#include <algorithm>
#include <cmath>

#include "variolux/base/error.h"

namespace vlx::render {
namespace {

bool sameMatrix(const std::optional<std::vector<float>>& a, const std::optional<std::vector<float>>& b) {
    if (!a || !b) return true;  // nothing to compare
    return std::ranges::equal(*a, *b,
                              [](float x, float y) { return std::abs(x - y) <= 1e-4f * (1 + std::abs(x)); });
}

}  // namespace

EarlierDump::EarlierDump(const std::string& path) : reader_(path) {
    // Features may have been left out where they do not vary.
    for (const std::string name : {"R", "G", "B", "A", "sample.x", "sample.y"})
        if (findChannel(header(), name) < 0)
            throw Error(path, "expected a dump of vlx-trace, found none of its channel " + name);
}

std::uint64_t EarlierDump::samples() const {
    std::uint64_t total = 0;
    const Window& w = header().data;
    for (int y = w.y; y < w.y + w.height; ++y)
        for (const std::uint32_t n : reader_.counts(y, 1)) total += n;
    return total;
}

std::optional<std::uint32_t> EarlierDump::freeReplicate() const {
    if (!hasReplicates()) return {};
    constexpr int kRows = 16;
    std::uint32_t next = 0;
    const Window& w = header().data;
    for (int y = w.y; y < w.y + w.height; y += kRows) {
        const SampleBand band = reader_.read(y, std::min(kRows, w.y + w.height - y), {"sample.replicate"});
        for (const float v : band.values[0]) next = std::max(next, replicateNumber(v).value() + 1);
    }
    return next;
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
}

SampleBand EarlierDump::before(const SampleBand& added) const {
    const SampleBand old = reader_.read(added.y, added.height, added.channels);
    SampleBand both;
    both.x = added.x;
    both.y = added.y;
    both.width = added.width;
    both.height = added.height;
    both.channels = added.channels;
    both.offsets.assign(added.pixels() + 1, 0);
    for (std::size_t p = 0; p <= added.pixels(); ++p) both.offsets[p] = old.offsets[p] + added.offsets[p];
    for (std::size_t c = 0; c < added.values.size(); ++c) {
        std::vector<float>& out = both.values.emplace_back();
        out.reserve(both.samples());
        const auto take = [&](const SampleBand& from, std::size_t p) {
            const auto begin = from.values[c].begin();
            out.insert(out.end(), begin + static_cast<std::ptrdiff_t>(from.offsets[p]),
                       begin + static_cast<std::ptrdiff_t>(from.offsets[p + 1]));
        };
        for (std::size_t p = 0; p < added.pixels(); ++p) {
            take(old, p);
            take(added, p);
        }
    }
    return both;
}

}  // namespace vlx::render
