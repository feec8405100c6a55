#include "render/plan/effect_set.h"

#include "variolux/base/text.h"

namespace vlx::render {

std::optional<Effect> effectNamed(std::string_view name) {
    for (std::size_t i = 0; i < kEffects; ++i)
        if (kEffectNames[i] == name) return static_cast<Effect>(i);
    return std::nullopt;
}

std::optional<EffectRequest> parseEffects(std::string_view text, std::string& broken) {
    EffectRequest request;
    bool first = true;
    for (const std::string& words : split(text, ',')) {
        const std::string_view word = words;
        if (first && (word == "auto" || word == "all")) {
            request.all = word == "all";
        } else if (!first && !request.all && word.starts_with('-') && effectNamed(word.substr(1))) {
            request.without.set(*effectNamed(word.substr(1)));
        } else {
            broken =
                "expected auto, all, or auto,-NAME with an effect's name, found '" + std::string(word) + "'";
            return std::nullopt;
        }
        first = false;
    }
    return request;
}

}  // namespace vlx::render
