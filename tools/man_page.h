#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vlx {

/// The manual page of a tool, in roff (section 1), from its command line's definitions: options and commands
/// with their options, footers as they are, exit codes. `app` keeps nothing of it.
/// Not by help2man, which finds 13 of the 72 options and arguments of vlx-pack; CLI11 2.1 makes no pages.
std::string manPage(const CLI::App& app, const std::string& version);

}  // namespace vlx
