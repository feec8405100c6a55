#include "variolux/base/memory.h"

#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>

#include "variolux/base/error.h"

namespace vlx {

std::uint64_t availableMemory() {
    const auto machine = static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) *
                         static_cast<std::uint64_t>(::sysconf(_SC_PAGE_SIZE));
    rlimit limit{};
    if (::getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return machine;
    return std::min<std::uint64_t>(machine, limit.rlim_cur);
}

std::uint64_t residentMemory() {
    std::ifstream file("/proc/self/statm");
    std::uint64_t whole = 0, resident = 0;
    if (!(file >> whole >> resident)) return 0;
    return resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGE_SIZE));
}

std::string memoryLimitFor(std::uint64_t bytes) {
    constexpr std::uint64_t kVaries = 2'000'000;
    return std::to_string((bytes + kVaries + 999'999) / 1'000'000) + "M";
}

void requireMemory(std::string_view path, std::uint64_t bytes, std::string_view what) {
    const std::uint64_t available = availableMemory();
    if (bytes > available)
        throw Error(path, "expected to need at most the " + std::to_string(available / 1'000'000) +
                              " MB of memory that there are, found " + std::to_string(bytes / 1'000'000) +
                              " MB for " + std::string(what));
}

}  // namespace vlx
