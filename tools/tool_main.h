#pragma once

#include <CLI/CLI.hpp>
#include <functional>

namespace vlx {

/// Exit codes of every tool.
enum ExitCode : int {
    kDone = 0,
    kFailed = 1,    ///< run-time failure: a file, the disk, memory
    kBadUsage = 2,  ///< the command line
    kPassed = 3,    ///< a comparison passed its threshold
};

/// The main function of a tool: adds --version to `app`, parses the command line, calls `run`, and turns what
/// goes wrong into a message on stderr and an exit code. `run` returns an ExitCode; it may throw vlx::Error
/// (exit 1) or CLI::ValidationError (options that do not fit together: exit 2).
///
///     int main(int argc, char** argv) {
///         CLI::App app("What the tool does", "vlx-something");
///         Options options;
///         bind(app, options);
///         return vlx::runTool(argc, argv, app, [&] { return run(options); });
///     }
int runTool(int argc, char** argv, CLI::App& app, const std::function<int()>& run);

}  // namespace vlx
