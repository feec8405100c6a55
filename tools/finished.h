#pragma once

#include <CLI/CLI.hpp>
#include <set>
#include <string>
#include <vector>

#include "variolux/base/fingerprint.h"

/// A run that finds its work finished skips it.
namespace vlx {

/// Of the program (its name and what is in its own file: one that was built anew from other sources does its
/// work anew, a copy does not) and every option of its command line but those that change no pixel
/// (--threads,
/// --log, --json, ...), the names of outputs, --band and --frames, and `files`: options that name input
/// files, which count by what is in them, through addFile(). An option that is not given counts by its
/// default.
Fingerprint fingerprintOf(const CLI::App& app, const std::set<std::string>& files);

/// The same of a command whose result depends on its options and on what is in `files`, which `fileOptions`
/// name.
Fingerprint fingerprintOf(const CLI::App& app, const std::set<std::string>& fileOptions,
                          const std::vector<std::string>& files);

/// areMadeOf(); if so, it is said on standard error, unless the run is quiet.
bool isFinished(const std::vector<std::string>& outputs, const std::string& inputs);

/// Adds the option --overwrite.
void addOverwrite(CLI::App& app, bool& overwrite);

}  // namespace vlx
