#include "completion.h"

#include <algorithm>
#include <cctype>
#include <sstream>

namespace vlx {

namespace {

std::string functionName(std::string name) {
    for (char& c : name)
        if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
    return "_" + name;
}

// All names of an option, separated: "-o|--output".
std::string names(const CLI::Option& option, const char* separator) {
    std::string all;
    for (const std::string& name : option.get_snames())
        all += (all.empty() ? "-" : separator + std::string("-")) + name;
    for (const std::string& name : option.get_lnames())
        all += (all.empty() ? "--" : separator + std::string("--")) + name;
    return all;
}

// "none rle zips" of the type name none|rle|zips; capitals stand for what is free.
std::string choices(const CLI::Option& option) {
    const std::string type = option.get_type_name();
    if (type.find('|') == std::string::npos) return {};
    std::string words;
    std::istringstream parts(type);
    for (std::string part; std::getline(parts, part, '|');)
        if (std::none_of(part.begin(), part.end(), [](unsigned char c) { return std::isupper(c) != 0; }))
            words += (words.empty() ? "" : " ") + part;
    return words;
}

std::string function(const CLI::App& app, const std::string& name) {
    std::string options, cases;
    for (const CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) {
        if (option->get_positional() || option->get_group().empty()) continue;
        options += (options.empty() ? "" : " ") + names(*option, " ");
        if (option->get_items_expected_max() == 0) continue;  // a flag
        const std::string words = choices(*option);
        cases += "        " + names(*option, "|") + ") ";
        cases += words.empty() ? "return ;;\n"  // a file or a number: readline's own completion
                               : "COMPREPLY=($(compgen -W '" + words + "' -- \"$current\")); return ;;\n";
    }
    const std::string self = functionName(name);
    const bool tool = name.find(' ') == std::string::npos;  // else a command
    std::string text =
        self + "() {\n    local commands= current=\"${COMP_WORDS[COMP_CWORD]}\"\n    COMPREPLY=()\n";
    if (tool)
        text += R"(    if [ "$COMP_CWORD" -eq 1 ]; then
        commands=$(compgen -A function )" +
                self + R"(_)
    elif declare -F ")" +
                self + R"(_${COMP_WORDS[1]}" >/dev/null; then
        ")" + self +
                R"(_${COMP_WORDS[1]}"
        return
    fi
)";
    text += "    case \"${COMP_WORDS[COMP_CWORD - 1]}\" in\n" + cases + "    esac\n";
    text += "    if [[ $current == -* ]]; then\n        COMPREPLY=($(compgen -W '" + options +
            "' -- \"$current\"))\n";
    if (tool)
        text += "    elif [ -n \"$commands\" ]; then\n        COMPREPLY=($(compgen -W \"${commands//" + self +
                "_/}\" -- \"$current\"))\n";
    return text + "    fi\n}\n";
}

}  // namespace

std::string bashCompletion(const CLI::App& app) {
    const std::string name = app.get_name();
    std::string text = function(app, name);
    for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
        text += function(*command, name + " " + command->get_name());
    if (name.find(' ') == std::string::npos)
        text += "complete -o default -F " + functionName(name) + " " + name + "\n";
    return text;
}

}  // namespace vlx
