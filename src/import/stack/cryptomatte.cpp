#include "import/stack/cryptomatte.h"

#include <algorithm>
#include <bit>

namespace vlx {

Cryptomatte::Cryptomatte(FlatImages& images, const std::string& name) {
    const std::vector<std::string>& all = images.channels(0);
    for (int layer = 0; layer < 100; ++layer) {
        const std::string number = std::to_string(layer);
        const std::string prefix = name + std::string(2 - number.size(), '0') + number + ".";
        for (const auto& rank : {std::array{"r", "g"}, {"b", "a"}, {"R", "G"}, {"B", "A"}})
            if (contains(all, prefix + rank[0]) && contains(all, prefix + rank[1]))
                names_.insert(names_.end(), {prefix + rank[0], prefix + rank[1]});
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
        auto& ofImage = taken_.emplace_back();
        for (const std::string& channel : names_) ofImage.push_back(images.take(i, channel));
    }
}

float Cryptomatte::merge(const FlatImages& images, std::size_t pixel, float* out) const {
    struct Rank {
        float id;
        double coverage;
    };
    std::vector<Rank> ranks;
    for (const auto& ofImage : taken_)
        for (std::size_t r = 0; r + 1 < ofImage.size(); r += 2) {
            const float id = images.value(ofImage[r], pixel);
            const float coverage = images.value(ofImage[r + 1], pixel);
            if (!(coverage > 0)) continue;
            const auto same = std::ranges::find_if(ranks, [&](const Rank& rank) {
                return std::bit_cast<std::uint32_t>(rank.id) == std::bit_cast<std::uint32_t>(id);
            });
            if (same == ranks.end())
                ranks.push_back({id, coverage});
            else
                same->coverage += coverage;
        }
    std::ranges::stable_sort(ranks, std::greater(), &Rank::coverage);
    const auto count = static_cast<double>(taken_.size());
    double left = 0;
    for (std::size_t r = names_.size() / 2; r < ranks.size(); ++r) left += ranks[r].coverage / count;
    ranks.resize(names_.size() / 2, {0, 0});
    for (const Rank& rank : ranks) {
        *out++ = rank.id;
        *out++ = static_cast<float>(rank.coverage / count);
    }
    return static_cast<float>(left);
}

}  // namespace vlx
