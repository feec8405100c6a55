#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "variolux/base/window.h"

namespace vlx {

/// Memory of this machine, or less where this process may take less (ulimit -v).
std::uint64_t availableMemory();

/// What this process holds now, as the kernel counts it; 0 where it does not tell.
std::uint64_t residentMemory();

/// Throws Error, naming `path`, when `bytes` for `what` are more than there are. Systems promise more memory
/// than they have, and end the process that takes it.
void requireMemory(std::string_view path, std::uint64_t bytes, std::string_view what);

/// A limit that `bytes` keep, for messages: "64M". It is 2 MB more, as what a process holds before it begins
/// is not the same in every run: who takes the advice is not refused again.
std::string memoryLimitFor(std::uint64_t bytes);

/// Of an image of floats.
inline std::uint64_t imageBytes(const Window& window, std::size_t channels) {
    return static_cast<std::uint64_t>(window.pixels()) * channels * sizeof(float);
}

}  // namespace vlx
