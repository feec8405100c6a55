#include "import/stack/doubts.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "variolux/base/text.h"

namespace vlx {

namespace {

constexpr std::int64_t kLeastTelling = 100;
constexpr double kMostAgreeing = 0.75;
constexpr float kMostHalf = 65504;

std::uint32_t bitsOf(float value) { return std::bit_cast<std::uint32_t>(value); }

std::size_t channelOf(const SampleBand& band, const std::string& name) {
    return static_cast<std::size_t>(band.channel(name));
}

}  // namespace

FeatureAgreement::FeatureAgreement(const SampleBand& band, std::size_t images) : images_(images) {
    for (const char* name : {"albedo.R", "albedo.G", "albedo.B", "N.X", "N.Y", "N.Z", "Z"})
        if (band.channel(name) >= 0) channels_.push_back(channelOf(band, name));
}

void FeatureAgreement::add(const SampleBand& band) {
    if (images_ < 2) return;
    const auto width = static_cast<std::size_t>(band.width);
    const auto differ = [&](std::size_t a, std::size_t b) {
        return std::ranges::any_of(
            channels_, [&](std::size_t c) { return bitsOf(band.values[c][a]) != bitsOf(band.values[c][b]); });
    };
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        const std::size_t col = p % width, at = p * images_;
        if (col == 0 || col + 1 == width || !differ(at, at - images_) || !differ(at, at + images_)) continue;
        ++telling_;
        bool agree = true;
        for (std::size_t i = 1; i < images_ && agree; ++i) agree = !differ(at, at + i);
        agreeing_ += agree ? 1 : 0;
    }
}

std::vector<std::string> FeatureAgreement::notes(bool cycles) const {
    const double share =
        static_cast<double>(agreeing_) / static_cast<double>(std::max<std::int64_t>(telling_, 1));
    if (telling_ < kLeastTelling || share < kMostAgreeing) return {};
    return {"WARNING: albedo, normal and depth of all images agree in " + formatted("%.0f %%", 100 * share) +
            " of the pixels where they vary: all samples are at the pixels' centres, edges are stair steps "
            "and the error map is sure of them. " +
            (cycles ? "Give image i (from 0) the sample offset 1 + i * samples (Cycles: "
                      "scene.cycles.sample_offset) and all the same seed."
                    : "Let the renderer spread its samples over the pixel.")};
}

HalfLimit::HalfLimit(FlatImages& images, const StackPlan& plan) {
    const auto isLight = [&](const std::string& name) {
        return name == "R" || name == "G" || name == "B" ||
               std::ranges::any_of(plan.radiance, [&](const std::string& layer) {
                   return name == layer || name.starts_with(layer + ".");
               });
    };
    for (const StackChannel& channel : plan.channels)
        if (isLight(channel.channel.name))
            for (const std::string& source : channel.recipe.sum)
                for (std::size_t i = 0; i < images.size(); ++i)
                    if (images.type(i, channelFor(images.channels(i), source).name) == "half") {
                        channels_.push_back(images.take(i, source));
                        channels_.back().factor = 1;
                    }
}

void HalfLimit::add(const FlatImages& images, std::size_t pixels) {
    for (const FlatChannel& channel : channels_)
        for (std::size_t p = 0; p < pixels; ++p)
            if (std::abs(images.value(channel, p)) >= kMostHalf) ++count_;
}

std::vector<std::string> HalfLimit::notes() const {
    if (count_ == 0) return {};
    return {"WARNING: " + std::to_string(count_) +
            " values are 65504 or infinite, the limit of half floats: light beyond it is lost. Write 32-bit "
            "files (Blender: Color Depth, Float (Full)), or lower the exposure."};
}

void Duplicates::add(const SampleBand& before, const SampleBand& band, std::size_t images) {
    const auto begin = [&](std::size_t p) { return static_cast<std::size_t>(before.offsets[p]); };
    std::vector<std::pair<std::size_t, std::size_t>> channels;  // of the dump, of the images
    for (const char* name : {"R", "G", "B"})
        channels.emplace_back(channelOf(before, name), channelOf(band, name));
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        const std::size_t count = begin(p + 1) - begin(p);
        if (count == 0) continue;
        if (first_) {
            candidates_.assign(images, {});
            for (auto& ofImage : candidates_)
                for (std::size_t k = 0; k < count; ++k) ofImage.push_back(k);
            first_ = false;
        }
        for (std::size_t i = 0; i < images; ++i)
            std::erase_if(candidates_[i], [&](std::uint64_t k) {
                return k >= count || std::ranges::any_of(channels, [&](const auto& pair) {
                           return bitsOf(before.values[pair.first][begin(p) + k]) !=
                                  bitsOf(band.values[pair.second][p * images + i]);
                       });
            });
    }
}

std::vector<std::string> Duplicates::notes(const FlatImages& images, const std::string& dump) const {
    std::vector<std::string> notes;
    for (std::size_t i = 0; i < candidates_.size(); ++i)
        if (!candidates_[i].empty())
            notes.push_back("WARNING: " + images.path(i) + " is in " + dump +
                            " already: rendered with the same seed and sample offset? Errors will be "
                            "underestimated.");
    return notes;
}

LightSum::LightSum(const SampleBand& band, const Names& parts) {
    for (const std::string c : {"R", "G", "B"}) {
        colours_.push_back(channelOf(band, c));
        auto& ofColour = parts_.emplace_back();
        for (const std::string& part : parts)
            if (band.channel(part + "." + c) >= 0) ofColour.push_back(channelOf(band, part + "." + c));
    }
}

void LightSum::add(const SampleBand& band) {
    for (std::size_t c = 0; c < colours_.size(); ++c)
        for (std::size_t s = 0; s < band.samples(); ++s) {
            const double light = band.values[colours_[c]][s];
            double sum = 0;
            for (const std::size_t part : parts_[c]) sum += band.values[part][s];
            if (!std::isfinite(light) || !std::isfinite(sum)) continue;
            light_ += light;
            size_ += std::abs(light);
            lacking_ += light - sum;
            difference_ += std::abs(light - sum);
        }
}

double LightSum::difference() const { return size_ > 0 ? difference_ / size_ : 0; }

double LightSum::missing() const { return light_ > 0 ? lacking_ / light_ : 0; }

}  // namespace vlx
