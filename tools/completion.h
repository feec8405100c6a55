#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vlx {

/// Completion of a tool's options, their choices and its commands for bash, from its command line's
/// definitions. A command with a main function of its own, named "TOOL COMMAND", makes a part to be put after
/// its tool's.
std::string bashCompletion(const CLI::App& app);

}  // namespace vlx
