#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "process/child_process.h"

/// The texts of a sweep's commands, and what they print.
namespace vlx {

/// The text with {name} replaced by what `places` has for the name; other braces stay.
std::string filled(std::string text, const std::map<std::string, std::string>& places);

std::string firstWord(const std::string& command);

/// Which scripts and other files a command names: a change of theirs changes its results.
std::string namedFiles(const std::string& command);

std::string numberText(double value);

/// What a program of ours printed with --json: one report, of frames one each.
std::vector<nlohmann::ordered_json> reportsOf(const ProcessRun& run, const std::string& command);
nlohmann::ordered_json reportOf(const ProcessRun& run, const std::string& command);

/// Wall seconds of the parts of its time, as it reports them; "other" is the rest.
std::map<std::string, double> stagesOf(const ProcessRun& run);

/// Its exit code and the last line of what it said.
std::string failureOf(const ProcessRun& run);

}  // namespace vlx
