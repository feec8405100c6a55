#pragma once

#include <cstdint>
#include <functional>

namespace vlx {

/// Told of work done so far out of a total, in units of the caller's choice; called from any thread, often.
/// Empty when nobody listens. The tools draw it (tools/progress_bar.h); the library never prints.
using Progress = std::function<void(std::int64_t done, std::int64_t total)>;

}  // namespace vlx
