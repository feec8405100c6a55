#pragma once

#include <cstdint>
#include <string>

namespace vlx {

/// What a command did and what it cost.
struct ProcessRun {
    int exitCode = 0;          ///< -signal when a signal ended it; 127: the shell did not find the program
    double seconds = 0;        ///< wall time from start to end
    double userSeconds = 0;    ///< processor time of it and all processes that it waited for
    double systemSeconds = 0;  ///< likewise, in the kernel
    /// Resident memory of the largest of these processes; never less than what this process holds at the
    /// start, which Linux counts too.
    std::int64_t peakBytes = 0;
    std::string out;  ///< standard output
    std::string err;  ///< the last 4 KiB of standard error

    double cpuSeconds() const { return userSeconds + systemSeconds; }
};

/// Runs `command` with /bin/sh -c in the present folder, without standard input, and waits for its end. Times
/// and memory are the kernel's own account (wait4). The command is a process group of its own; it gets
/// SIGTERM if this process dies. Throws Error when no process can be started, and when the output exceeds 64
/// MiB.
ProcessRun runCommand(const std::string& command);

/// Sends SIGTERM to the command that runCommand() waits for, if there is one, and all that it started. For a
/// program's signal handler: async-signal-safe.
void endRunningCommand() noexcept;

/// The text as one word of a shell command: itself if it is harmless, else in single quotes.
std::string shellQuoted(const std::string& text);

}  // namespace vlx
