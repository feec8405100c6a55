#pragma once

#include "render/plan/effect_set.h"

#ifdef VARIOLUX_COUNTS_NOTHING
#error "a source of vlx_render_uncounted includes what counts: move it to vlx_render (CMakeLists.txt)"
#endif
#ifdef VARIOLUX_COUNT_EFFECTS
#include <atomic>
#endif

namespace vlx::render {

#ifdef VARIOLUX_COUNT_EFFECTS
/// How often each effect's code ran. Only in the library built for the tests of plans.
inline std::array<std::atomic<std::uint64_t>, kEffects> effectCounters{};

inline void countEffect(Effect effect) {
    effectCounters[static_cast<std::size_t>(effect)].fetch_add(1, std::memory_order_relaxed);
}
#else
inline void countEffect(Effect) {}
#endif

}  // namespace vlx::render
