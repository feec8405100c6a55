#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <vector>

#include "import/import.h"

namespace vlx {

/// A subcommand of vlx-pack: run when it was the one asked for.
struct PackCommand {
    CLI::App* app = nullptr;
    std::function<int()> run;
};

/// Adds the commands that make dumps of other renderers' files: stack, buffers, moments, bcd, sbmc.
void addImportCommands(CLI::App& app, std::vector<PackCommand>& commands);

/// One of them.
void addStackCommand(CLI::App& app, std::vector<PackCommand>& commands);

/// Adds the option --compression of a dump to be written.
void addCompression(CLI::App& app, DumpCompression& compression);

}  // namespace vlx
