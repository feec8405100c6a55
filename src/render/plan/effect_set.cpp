#include "render/plan/effect_set.h"

namespace vlx::render {

std::optional<Effect> effectNamed(std::string_view name) {
    for (std::size_t i = 0; i < kEffects; ++i)
        if (kEffectNames[i] == name) return static_cast<Effect>(i);
    return std::nullopt;
}

}  // namespace vlx::render
