#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace vlx {

/// What a tool did.
struct ToolRun {
    int exitCode;  ///< -signal when a signal ended it
    std::string out;
    std::string err;
};

struct RunOptions {
    std::optional<std::uint64_t> fileSizeLimit = {};  ///< bytes a file may grow to: stands for a full disk
    std::optional<std::uint64_t> memoryBytes = {};    ///< of address space
    std::optional<std::uint64_t> cpuSeconds = {};     ///< after which it counts as hanging
};

/// Runs a program of this build, for example runTool("vlx-compare", {"--version"}), or of this path, without
/// a shell and without standard input, and waits for its end.
ToolRun runTool(const std::string& tool, const std::vector<std::string>& arguments,
                const RunOptions& options = {});

}  // namespace vlx
