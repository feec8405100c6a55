#include "variolux/dump/cropped_samples.h"

#include "variolux/base/error.h"

namespace vlx {

CroppedSamples::CroppedSamples(const SampleSource& source, const Window& part)
    : source_(source), header_(source.header()) {
    const Window& of = source.header().data;
    if (part.width < 1 || part.height < 1 || !of.contains(part.x, part.y) ||
        !of.contains(part.x + (part.width - 1), part.y + (part.height - 1)))
        throw Error(source.path(), "expected a part of " + windowText(of) + ", found " + windowText(part));
    header_.data = part;
}

SampleBand CroppedSamples::read(int y, int rows, const std::vector<std::string>& channels) const {
    const Window& part = header_.data;
    if (rows < 1 || y < part.y || y + rows > part.y + part.height)
        throw Error(path(), "expected rows of " + windowText(part) + ", found " + std::to_string(rows) +
                                " from " + std::to_string(y));
    const SampleBand all = source_.read(y, rows, channels);
    SampleBand kept{part.x, y, part.width, rows, {0}, all.channels, {}};
    kept.values.resize(all.values.size());
    const auto skipped = static_cast<std::size_t>(part.x - all.x);
    for (int row = 0; row < rows; ++row) {
        const std::size_t first =
            static_cast<std::size_t>(row) * static_cast<std::size_t>(all.width) + skipped;
        const std::uint64_t begin = all.offsets[first],
                            end = all.offsets[first + static_cast<std::size_t>(part.width)];
        const std::uint64_t before = kept.offsets.back();
        for (std::size_t c = 0; c < kept.values.size(); ++c)
            kept.values[c].insert(kept.values[c].end(),
                                  all.values[c].begin() + static_cast<std::ptrdiff_t>(begin),
                                  all.values[c].begin() + static_cast<std::ptrdiff_t>(end));
        for (int x = 1; x <= part.width; ++x)
            kept.offsets.push_back(before + all.offsets[first + static_cast<std::size_t>(x)] - begin);
    }
    return kept;
}

}  // namespace vlx
