#include "variolux/dump/half_samples.h"

#include <algorithm>
#include <set>

namespace vlx {

namespace {

constexpr const char* kReplicate = "sample.replicate";
constexpr int kRowsAtOnce = 16;

}  // namespace

bool hasReplicates(const SampleSource& source) {
    if (findChannel(source.header(), kReplicate) < 0) return false;
    std::set<std::uint32_t> found;
    const Window& w = source.header().data;
    for (int y = w.y; y < w.y + w.height && found.size() < 2; y += kRowsAtOnce) {
        const SampleBand band = source.read(y, std::min(kRowsAtOnce, w.y + w.height - y), {kReplicate});
        for (const float v : band.values[0]) found.insert(replicateNumber(v).value());
    }
    return found.size() > 1;
}

HalfSamples::HalfSamples(const SampleSource& source, bool replicates, int parity)
    : source_(source),
      header_(source.header()),
      replicates_(replicates),
      parity_(static_cast<unsigned>(parity)) {
    header_.independentHalves = false;
}

SampleBand HalfSamples::read(int y, int rows, const std::vector<std::string>& channels) const {
    std::vector<std::string> wanted = channels;
    if (wanted.empty())
        for (const DumpChannel& channel : header_.channels) wanted.push_back(channel.name);
    const std::size_t count = wanted.size();
    const std::size_t replicate =
        static_cast<std::size_t>(std::find(wanted.begin(), wanted.end(), kReplicate) - wanted.begin());
    if (replicates_ && replicate == count) wanted.emplace_back(kReplicate);
    const SampleBand all = source_.read(y, rows, wanted);
    SampleBand kept{all.x, all.y, all.width, all.height, {0}, {}, {}};
    kept.channels.assign(wanted.begin(), wanted.begin() + static_cast<std::ptrdiff_t>(count));
    kept.values.resize(count);
    for (std::size_t p = 0; p < all.pixels(); ++p) {
        for (std::size_t s = all.offsets[p]; s < all.offsets[p + 1]; ++s) {
            const std::size_t number =
                replicates_ ? replicateNumber(all.values[replicate][s]).value() : s - all.offsets[p];
            if (number % 2 != parity_) continue;
            for (std::size_t c = 0; c < count; ++c) kept.values[c].push_back(all.values[c][s]);
        }
        kept.offsets.push_back(count > 0 ? kept.values[0].size() : 0);
    }
    return kept;
}

}  // namespace vlx
