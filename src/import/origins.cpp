#include "import/origins.h"

#include <algorithm>

#include "import/channel_presets.h"
#include "variolux/base/error.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

Three threeOf(const FlatImages& images, std::size_t image) {
    const Names& names = images.channels(image);
    if (const auto found = findTriple(names, {""})) return *found;
    if (names.size() >= 3) return {names[0], names[1], names[2]};
    return {names[0], names[0], names[0]};
}

}  // namespace

Companions::Companions(const CompanionImages& with) {
    for (const auto& [what, path] : {std::pair{"variance", &with.variance},
                                     {"albedo", &with.albedo},
                                     {"N", &with.normal},
                                     {"Z", &with.depth}})
        if (!path->empty()) paths_.emplace_back(what, *path);
}

void Companions::appendTo(std::vector<std::string>& images) {
    first_ = images.size();
    for (const auto& [what, path] : paths_) images.push_back(path);
}

std::optional<std::size_t> Companions::image(const std::string& what) const {
    for (std::size_t i = 0; i < paths_.size(); ++i)
        if (paths_[i].first == what) return first_ + i;
    return std::nullopt;
}

void Companions::enterInto(Origins& origins, const FlatImages& images) const {
    for (const auto& [what, ends] : {std::pair{"variance", "RGB"}, {"albedo", "RGB"}, {"N", "XYZ"}})
        if (const auto number = image(what)) {
            const Three channels = threeOf(images, *number);
            for (std::size_t c = 0; c < 3; ++c)
                origins[std::string(what) + "." + ends[c]] = {*number, channels[c]};
        }
    if (const auto number = image("Z")) origins["Z"] = {*number, images.channels(*number).front()};
}

void describe(const FlatImages& images, const Origins& origins, std::size_t own, ImportReport& report) {
    for (const auto& [name, origin] : origins)
        report.mapped[name] =
            origin.image < own ? origin.channel : images.path(origin.image) + " " + origin.channel;
    const Names& names = images.channels(0);
    for (const auto& name : names)
        if (std::none_of(origins.begin(), origins.end(), [&](const auto& entry) {
                return entry.second.image < own && channelFor(names, entry.second.channel).name == name;
            }))
            report.ignored.push_back(name);
}

void require(const FlatImages& images, const Origins& origins, const std::string& channel,
             const std::string& advice) {
    if (!origins.contains(channel))
        throw Error(images.path(0), "found nothing to take as " + channel + " (" + advice +
                                        "); the image has " + listed(images.channels(0)));
}

std::array<FlatChannel, 3> takeThree(FlatImages& images, const Origins& origins, const Three& channels) {
    std::array<FlatChannel, 3> taken;
    for (std::size_t c = 0; c < 3; ++c) {
        const Origin& origin = origins.at(channels[c]);
        taken[c] = images.take(origin.image, origin.channel);
    }
    return taken;
}

}  // namespace vlx
