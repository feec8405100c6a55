#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace vlx {

/// What a command did and what it cost.
struct ProcessRun {
    int exitCode = 0;          ///< -signal when a signal ended it; 127: the program was not found
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

/// Runs the program words[0], found in PATH, with the other words as its arguments, in the present folder,
/// without standard input, and waits for its end. Times
/// and memory are the kernel's own account (wait4). The command is a process group of its own; it gets
/// SIGTERM if this process dies. Throws Error when no process can be started, and when the output exceeds 64
/// MiB.
ProcessRun runProgram(const std::vector<std::string>& words);

/// The same of a text for /bin/sh -c.
ProcessRun runCommand(const std::string& command);

/// Sends SIGTERM to the command that is waited for, if there is one, and all that it started. For a
/// program's signal handler: async-signal-safe.
void endRunningCommand() noexcept;

/// The text as one word of a shell command: itself if it is harmless, else in single quotes.
std::string shellQuoted(const std::string& text);

}  // namespace vlx
