#include "import/stack/samples.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "variolux/base/parallel.h"

namespace vlx {

namespace {

constexpr char kReplicate[] = "sample.replicate";

// Cycles writes the motion of surfaces, and leaves 0 where a camera ray meets none: of a sky that a moving
// camera sees that is wrong, of what else it may be (a pane before it) not known either. Returns of how many
// samples.
std::int64_t forgetMotionOfMisses(SampleBand& band) {
    std::vector<std::vector<float>*> motion;
    for (const std::string_view name : kMotionChannels)
        if (const int c = band.channel(std::string(name)); c >= 0)
            motion.push_back(&band.values[static_cast<std::size_t>(c)]);
    const int depth = band.channel("Z");
    if (motion.empty() || depth < 0) return 0;
    std::int64_t count = 0;
    for (std::size_t s = 0; s < band.samples(); ++s) {
        const auto still = [&](const auto* values) { return (*values)[s] == 0 || std::isnan((*values)[s]); };
        if (band.values[static_cast<std::size_t>(depth)][s] != 0 ||
            !std::all_of(motion.begin(), motion.end(), still))
            continue;
        for (auto* values : motion) (*values)[s] = std::numeric_limits<float>::quiet_NaN();
        ++count;
    }
    return count;
}

}  // namespace

StackedSamples::StackedSamples(FlatImages& images, const StackPlan& plan, std::uint32_t firstReplicate)
    : images_(images), plan_(plan), firstReplicate_(firstReplicate) {
    for (const StackChannel& channel : plan.channels) {
        channels_.emplace_back();
        if (!channel.recipe.sum.empty()) channels_.back() = takeFromAll(images, channel.recipe);
    }
}

SampleBand StackedSamples::band(int row, int rows) {
    const Window window = images_.data();
    const std::size_t count = images_.size();
    SampleBand band;
    band.x = window.x;
    band.y = window.y + row;
    band.width = window.width;
    band.height = rows;
    for (std::size_t p = 0; p <= band.pixels(); ++p) band.offsets.push_back(p * count);
    for (const StackChannel& channel : plan_.channels) band.channels.push_back(channel.channel.name);
    band.values.resize(band.channels.size());
    parallelFor(0, static_cast<std::int64_t>(band.channels.size()), [&](std::int64_t number) {
        const auto c = static_cast<std::size_t>(number);
        auto& values = band.values[c];
        values.reserve(band.samples());
        for (std::size_t p = 0; p < band.pixels(); ++p)
            for (std::size_t i = 0; i < count; ++i)
                values.push_back(band.channels[c] == kReplicate ? static_cast<float>(firstReplicate_ + i)
                                 : channels_[c].empty()         ? std::numeric_limits<float>::quiet_NaN()
                                                                : channels_[c][i].value(images_, p));
    });
    if (const int depth = band.channel("Z"); depth >= 0)
        for (float& z : band.values[static_cast<std::size_t>(depth)]) misses_ += cleanDepth(z) ? 1 : 0;
    if (plan_.preset == StackPreset::Cycles) motionless_ += forgetMotionOfMisses(band);
    return band;
}

SampleBand withoutEmpty(SampleBand band, const std::vector<char>& rendered, std::size_t images) {
    if (std::ranges::find(rendered, 0) == rendered.end()) return band;
    for (auto& values : band.values) {
        auto to = values.begin();
        for (std::size_t p = 0; p < rendered.size(); ++p)
            if (rendered[p] != 0)
                to = std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(p * images), images, to);
        values.erase(to, values.end());
    }
    for (std::size_t p = 0; p < rendered.size(); ++p)
        band.offsets[p + 1] = band.offsets[p] + (rendered[p] != 0 ? images : 0);
    return band;
}

}  // namespace vlx
