#pragma once

#include <CLI/CLI.hpp>
#include <set>
#include <string>
#include <vector>

#include "import/import.h"

namespace vlx {

/// What every importer has: an output, how it is written, and the report on standard output.
struct ImportCommand {
    std::string dump;
    std::string renderer;
    DumpCompression compression = DumpCompression::Zips;
    bool overwrite = false;
    const CLI::App* commandLine = nullptr;
    std::string inputs;  ///< what the dump says that it is made of

    void bindOutput(CLI::App& app);
    /// Whether the dump is there and made of these files, which `fileOptions` name.
    bool finished(const std::set<std::string>& fileOptions, const std::vector<std::string>& files);
    int print(const ImportReport& report, const std::string& what) const;
};

/// --radiance of the importers that keep it.
void bindRadiance(CLI::App& app, std::vector<std::string>& radiance);

}  // namespace vlx
