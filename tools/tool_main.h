#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace vlx {

/// Exit codes of every tool. A tool ended by SIGINT, SIGTERM or SIGHUP removes its unfinished files and ends
/// by that signal: shells show 128 + its number (130, 143, 129).
enum ExitCode : int {
    kDone = 0,
    kFailed = 1,    ///< run-time failure: a file, the disk, memory
    kBadUsage = 2,  ///< the command line
    kPassed = 3,    ///< a comparison passed its threshold
};

/// The main function of a tool: adds --version, --log, --quiet, --help-man and --completion (and the exit
/// codes to the help's end) to `app`, catches signals, parses the command line, calls `run`, and turns what
/// goes wrong into a message on stderr and an exit code. `run` returns an ExitCode; it may throw vlx::Error
/// (exit 1) or CLI::ValidationError (options that do not fit together: exit 2).
///
///     int main(int argc, char** argv) {
///         CLI::App app("What the tool does", "vlx-something");
///         Options options;
///         bind(app, options);
///         return vlx::runTool(argc, argv, app, [&] { return run(options); });
///     }
int runTool(int argc, char** argv, CLI::App& app, const std::function<int()>& run);

/// What a signal that ends the tool is to do besides removing unfinished files; async-signal-safe.
void onEndingSignal(void (*action)() noexcept);

/// A line on standard error, above a progress bar: nothing when --quiet was given, a record
/// {"event":"message","message":...} with --log json.
void say(const std::string& text);
/// The same for what is wrong, also when --quiet was given.
void warn(const std::string& text);
/// Whether --quiet was given: a tool then prints errors and what its other options ask for, nothing else.
bool isQuiet();

/// For check() of options whose value is a real number: only finite ones of the range pass (NaN passes
/// CLI11's own checks). Bad usage says what was expected and found.
CLI::Validator finiteWithin(double low, double high);
CLI::Validator finitePositive();
CLI::Validator finiteNonNegative();

/// A file, and the option or what else it is named by.
struct NamedFile {
    std::string option;
    std::string path;
};

/// Throws CLI::ValidationError (exit 2) when an output is the same file as an input or as another output,
/// whatever they are called (./a.exr, symbolic and hard links): one of them would be lost. Empty names are no
/// files.
void checkOutputs(const std::vector<NamedFile>& outputs, const std::vector<std::string>& inputs);

/// The same of a single output, --output, whose name must end with .exr.
void checkOutputName(const std::string& output, const std::vector<std::string>& inputs);

/// Options that only some modes of a program read, modes in the user's words: "--method krige".
struct OptionUse {
    std::vector<std::string> options;
    std::vector<std::string> modes;
};

/// Throws CLI::ValidationError (exit 2), naming the option and the modes, when one was given that none of the
/// modes `at hand` reads: silence would let the user believe that it did something.
void checkOptionUse(const CLI::App& app, const std::vector<OptionUse>& uses,
                    const std::vector<std::string>& atHand);

/// Binds an option whose value is one of a few names. Anything else is bad usage, with the names listed.
template <class Enum>
CLI::Option* addChoice(CLI::App& app, const std::string& flag, Enum& value,
                       const std::vector<std::pair<std::string, Enum>>& names, const std::string& help) {
    std::string all, current;
    for (const auto& [name, meaning] : names) {
        all += (all.empty() ? "" : "|") + name;
        if (meaning == value) current = name;
    }
    const auto choose = [flag, &value, names, all](const std::string& text) {
        for (const auto& [name, meaning] : names)
            if (name == text) {
                value = meaning;
                return;
            }
        throw CLI::ValidationError(flag, "expected one of " + all + ", found '" + text + "'");
    };
    return app.add_option_function<std::string>(flag, choose, help)->type_name(all)->default_str(current);
}

}  // namespace vlx
