#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace vlx {

/// CLI11's help, set for a terminal of 80 columns: descriptions are wrapped, one blank line stands between
/// groups, and an option's default and needs are said in words behind its description.
class HelpFormatter : public CLI::Formatter {
  public:
    HelpFormatter() { column_width(28); }

    std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override;
    std::string make_description(const CLI::App* app) const override;
    std::string make_subcommand(const CLI::App* command) const override;
    std::string make_option_opts(const CLI::Option* option) const override;
    std::string make_option_desc(const CLI::Option* option) const override;
};

/// Sets `text` in lines of at most `columns` characters, broken at spaces. A blank line separates
/// paragraphs; other line ends of the text count as spaces.
std::string wrapped(const std::string& text, std::size_t columns);

}  // namespace vlx
