#include "help_formatter.h"

#include <sstream>

namespace vlx {

namespace {

constexpr std::size_t kColumns = 80;

}  // namespace

std::string wrapped(const std::string& text, std::size_t columns) {
    std::string result;
    std::size_t used = 0;
    bool newParagraph = false;
    std::istringstream lines(text);
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        bool blank = true;
        for (std::string word; words >> word; blank = false) {
            if (newParagraph) {
                result += "\n\n";
                used = 0;
                newParagraph = false;
            } else if (used > 0 && used + 1 + word.size() > columns) {
                result += '\n';
                used = 0;
            } else if (used > 0) {
                result += ' ';
                ++used;
            }
            result += word;
            used += word.size();
        }
        newParagraph = newParagraph || (blank && !result.empty());
    }
    return result;
}

std::string HelpFormatter::make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const {
    return CLI::detail::find_and_replace(Formatter::make_help(app, std::move(name), mode), "\n\n\n", "\n\n");
}

std::string HelpFormatter::make_description(const CLI::App* app) const {
    const std::string text = app->get_description();
    return text.empty() ? text : wrapped(text, kColumns) + "\n\n";
}

std::string HelpFormatter::make_subcommand(const CLI::App* command) const {
    std::ostringstream text;
    CLI::detail::format_help(text, command->get_display_name(true),
                             wrapped(command->get_description(), kColumns - get_column_width()),
                             get_column_width());
    return text.str();
}

std::string HelpFormatter::make_option_opts(const CLI::Option* option) const {
    if (!option->get_option_text().empty()) return " " + option->get_option_text();
    if (option->get_type_size() == 0 || option->get_positional()) return {};
    return " " + option->get_type_name();
}

std::string HelpFormatter::make_option_desc(const CLI::Option* option) const {
    std::string text = option->get_description();
    if (!option->get_default_str().empty()) text += " (default: " + option->get_default_str() + ")";
    std::string needs;
    for (const CLI::Option* other : option->get_needs())
        needs += (needs.empty() ? "" : ", ") + other->get_name();
    if (!needs.empty()) text += " (needs " + needs + ")";
    return wrapped(text, kColumns - get_column_width());
}

}  // namespace vlx
