#include "man_page.h"

#include <algorithm>
#include <cctype>
#include <sstream>

#include "help_formatter.h"

namespace vlx {

namespace {

// Text that roff takes as it is: no escapes, no requests at a line's start, hyphens that can be copied.
std::string escaped(const std::string& text) {
    std::string result;
    bool lineStart = true;
    for (const char c : text) {
        if (lineStart && (c == '.' || c == '\'')) result += "\\&";
        if (c == '\\')
            result += "\\e";
        else if (c == '-')
            result += "\\-";
        else
            result += c;
        lineStart = c == '\n';
    }
    return result;
}

std::string upper(std::string text) {
    std::transform(text.begin(), text.end(), text.begin(),
                   [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
    return text;
}

std::string paragraphs(const std::string& text) {
    std::string result;
    std::istringstream lines(escaped(wrapped(text, 1000000)));
    for (std::string line; std::getline(lines, line);)
        if (!line.empty()) result += (result.empty() ? "" : ".PP\n") + line + "\n";
    return result;
}

// As it stands: examples.
std::string verbatim(const std::string& text) {
    return text.empty() ? "" : ".PP\n.nf\n" + escaped(text) + "\n.fi\n";
}

std::string optionText(const CLI::Option& option) {
    std::string text =
        ".TP\n\\fB" +
        escaped(option.get_positional() ? option.get_name(true) : option.get_name(false, true)) + "\\fR";
    if (!option.get_option_text().empty())
        text += " " + escaped(option.get_option_text());
    else if (option.get_type_size() != 0 && !option.get_type_name().empty() && !option.get_positional())
        text += " \\fI" + escaped(option.get_type_name()) + "\\fR";
    std::string description = option.get_description();
    if (!option.get_default_str().empty()) description += " (default: " + option.get_default_str() + ")";
    return text + "\n" + escaped(wrapped(description, 1000000)) + "\n";
}

std::vector<const CLI::Option*> shownOptions(const CLI::App& app) {
    std::vector<const CLI::Option*> shown;
    for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; }))
        if (!option->get_group().empty()) shown.push_back(option);
    std::stable_partition(shown.begin(), shown.end(),
                          [](const CLI::Option* option) { return option->get_positional(); });
    return shown;
}

// Without those in `above`: the tool's own, which its commands repeat.
std::string optionsText(const CLI::App& app, const CLI::App* above = nullptr) {
    std::string text;
    for (const CLI::Option* option : shownOptions(app))
        if (option->get_positional() || above == nullptr ||
            above->get_option_no_throw(option->get_name()) == nullptr)
            text += optionText(*option);
    return text;
}

std::string synopsis(const CLI::App& app, const std::string& name) {
    std::string text = "\\fB" + escaped(name) + "\\fR";
    for (const CLI::Option* option : shownOptions(app))
        if (option->get_positional())
            text += " \\fI" + escaped(option->get_name(true)) + "\\fR" +
                    (option->get_items_expected_max() > 1 ? "..." : "");
    text += " [\\fIOPTIONS\\fR]";
    return text;
}

std::vector<const CLI::App*> commandsOf(const CLI::App& app) {
    return app.get_subcommands([](const CLI::App*) { return true; });
}

std::string firstSentence(const std::string& text) {
    const std::string line = wrapped(text, 1000000);
    return line.substr(0, std::min(line.find(". "), line.find_last_not_of(".\n") + 1));
}

}  // namespace

std::string manPage(const CLI::App& app, const std::string& version) {
    const std::string name = app.get_name();
    std::string title = upper(name);
    std::replace(title.begin(), title.end(), ' ', '-');
    std::string text = ".TH " + escaped(title) + " 1 \"\" \"Variolux " + version + "\"\n";
    text += ".SH NAME\n" + escaped(name) + " \\- " + escaped(firstSentence(app.get_description())) + "\n";
    text += ".SH SYNOPSIS\n";
    const auto commands = commandsOf(app);
    if (commands.empty()) text += synopsis(app, name) + "\n";
    for (const CLI::App* command : commands)
        text += synopsis(*command, name + " " + command->get_name()) + "\n.br\n";
    text += ".SH DESCRIPTION\n" + paragraphs(app.get_description());
    if (const std::string options = optionsText(app); !options.empty()) text += ".SH OPTIONS\n" + options;
    if (!commands.empty()) text += ".SH COMMANDS\n";
    for (const CLI::App* command : commands)
        text += ".SS " + escaped(name + " " + command->get_name()) + "\n" +
                paragraphs(command->get_description()) + optionsText(*command, &app) +
                verbatim(command->get_footer());
    if (!app.get_footer().empty()) text += ".SH NOTES\n" + verbatim(app.get_footer());
    return text;
}

}  // namespace vlx
