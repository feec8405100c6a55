#include "tool_main.h"

#include <malloc.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <sstream>

#include "completion.h"
#include "help_formatter.h"
#include "man_page.h"
#include "progress_bar.h"
#include "variolux/base/error.h"
#include "variolux/base/output_file.h"
#include "variolux/base/parallel.h"
#include "variolux/base/text.h"

namespace vlx {

namespace {

/// Rows of samples are read and let go a hundred times: what is let go stays with the process, which would
/// otherwise be given new pages, all zeros, each time (half of all page faults).
void keepMemory() {
#ifdef __GLIBC__
    mallopt(M_MMAP_THRESHOLD, 16 << 20);
    mallopt(M_TRIM_THRESHOLD, 64 << 20);
#endif
}

bool quietAsked = false;
void (*endingAction)() noexcept = nullptr;

constexpr char kExitCodes[] =
    "Exit codes: 0 done; 1 failure at run time (a file, the disk, memory); 2 bad usage; 3 a comparison "
    "passed "
    "its threshold. Ended by a signal, it leaves no unfinished files.";

// Thrown by --help-man and --completion instead of a run.
struct Printed {
    std::string text;
};

// Leaves no unfinished files, then ends as the signal would have ended it.
extern "C" void endBySignal(int number) {
    removeUnfinishedFiles();
    if (endingAction != nullptr) endingAction();
    std::signal(number, SIG_DFL);
    std::raise(number);
}

void catchSignals() {
    for (const int number : {SIGINT, SIGTERM, SIGHUP}) {
        struct sigaction before {};
        ::sigaction(number, nullptr, &before);
        if (before.sa_handler == SIG_IGN) continue;  // nohup, background jobs
        struct sigaction action {};
        action.sa_handler = endBySignal;
        ::sigemptyset(&action.sa_mask);
        ::sigaction(number, &action, nullptr);
    }
}

void printRecord(const nlohmann::ordered_json& record) {
    std::fputs((record.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n").c_str(),
               stderr);
}

// The end of a run, for programs.
void logEnd(int code, const std::string& message) {
    if (logFormat() == LogFormat::OpenJd && code != kDone && !message.empty()) {
        std::string line = message;
        for (char& c : line)
            if (c == '\n') c = ' ';
        std::printf("openjd_fail: %s\n", line.c_str());
        std::fflush(stdout);
    }
    if (logFormat() != LogFormat::Json) return;
    nlohmann::ordered_json record = {
        {"event", "end"}, {"exitCode", code}, {"peakMemoryMB", std::round(peakMegabytes())}};
    if (!message.empty()) record["message"] = message;
    printRecord(record);
}

int fail(const CLI::App& app, const std::string& text) {
    const std::string message = printable(text, "\n");
    if (logFormat() != LogFormat::Json)
        std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), message.c_str());
    logEnd(kFailed, message);
    return kFailed;
}

int badUsage(const CLI::App& app, const std::string& message) {
    std::fprintf(stderr, "%s: %s\nRun %s --help for the options.\n", app.get_name().c_str(), message.c_str(),
                 app.get_name().c_str());
    return kBadUsage;
}

// Where a name leads that need not exist yet, through symbolic links.
std::filesystem::path resolved(std::filesystem::path path) {
    std::error_code failed;
    for (int links = 0; links < 40 && std::filesystem::is_symlink(path, failed); ++links)
        path = path.parent_path() / std::filesystem::read_symlink(path, failed);
    return std::filesystem::weakly_canonical(std::filesystem::absolute(path, failed), failed);
}

bool sameFile(const std::string& a, const std::string& b) {
    if (a.empty() || b.empty()) return false;
    std::error_code ignored;
    return std::filesystem::equivalent(a, b, ignored) || resolved(a) == resolved(b);
}

std::vector<CLI::App*> allOf(CLI::App& app) {
    std::vector<CLI::App*> all = {&app};
    for (CLI::App* const command : app.get_subcommands([](CLI::App*) { return true; }))
        for (CLI::App* const inner : allOf(*command)) all.push_back(inner);
    return all;
}

// Options that every tool and command has.
void addCommonOptions(CLI::App& app, LogFormat& format) {
    for (CLI::App* const command : allOf(app)) {
        addChoice(
            *command, "--log", format,
            {{"text", LogFormat::Text}, {"json", LogFormat::Json}, {"openjd", LogFormat::OpenJd}},
            "Progress for people, as lines of JSON on standard error, or as Open Job Description's lines on "
            "standard output");
        command->add_flag("-q,--quiet", quietAsked,
                          "Print nothing but errors and what other options ask for");
        command->add_flag_callback("--help-man", [&app] { throw Printed{manPage(app, VARIOLUX_VERSION)}; })
            ->group("");
        command->add_flag_callback("--completion", [&app] { throw Printed{bashCompletion(app)}; })->group("");
    }
    const std::string footer = app.get_footer();
    app.footer(footer + (footer.empty() ? "" : "\n\n") + wrapped(kExitCodes, 80));
}

CLI::Validator finite(const std::string& expected, const std::string& description,
                      const std::function<bool(double)>& within) {
    const auto check = [expected, within](const std::string& text) {
        double value = 0;
        const bool valid = CLI::detail::lexical_cast(text, value) && std::isfinite(value) && within(value);
        return valid ? std::string() : "expected " + expected + ", found '" + text + "'";
    };
    return {check, description};
}

void setFormatter(CLI::App& app, const std::shared_ptr<CLI::FormatterBase>& formatter) {
    app.formatter(formatter);
    for (CLI::App* const command : app.get_subcommands([](CLI::App*) { return true; }))
        setFormatter(*command, formatter);
}

// Lines of both would mix on standard output.
void checkOneOwnerOfOutput(CLI::App& app, LogFormat format) {
    if (format != LogFormat::OpenJd) return;
    for (CLI::App* const command : allOf(app)) {
        const CLI::Option* json = command->get_option_no_throw("--json");
        if (command->parsed() && json != nullptr && json->count() > 0)
            throw CLI::ValidationError(
                "--json", "expected not with --log openjd: both write standard output; use --log json");
    }
}

int runToEnd(int argc, char** argv, CLI::App& app, const std::function<int()>& run) {
    // A file size limit must end in an error message and a clean folder, like a full disk, not in a signal.
    std::signal(SIGXFSZ, SIG_IGN);
    catchSignals();
    LogFormat format = LogFormat::Text;
    addCommonOptions(app, format);
    app.set_version_flag("--version", "Variolux " VARIOLUX_VERSION, "Print the version and exit");
    setFormatter(app, std::make_shared<HelpFormatter>());
    try {
        app.parse(argc, argv);
        checkOneOwnerOfOutput(app, format);
        setLogFormat(format);
        hideProgressBars(quietAsked);
        const int code = run();
        // Results on stdout that did not get there are a failure too.
        std::cout.flush();
        if (!std::cout || std::fflush(stdout) != 0) return fail(app, "standard output cannot be written");
        logEnd(code, {});
        return code;
    } catch (const Printed& page) {
        std::fputs(page.text.c_str(), stdout);
        return std::fflush(stdout) == 0 ? kDone : kFailed;
    } catch (const CLI::ParseError& error) {
        if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
        return badUsage(app, error.what());
    } catch (const Error& error) {
        return fail(app, error.what());
    } catch (const std::bad_alloc&) {
        return fail(app, "out of memory");
    } catch (const std::exception& error) {
        return fail(app, std::string("internal error: ") + error.what());
    }
}

}  // namespace

int runTool(int argc, char** argv, CLI::App& app, const std::function<int()>& run) {
    keepMemory();
    const int code = runToEnd(argc, argv, app, run);
    endThreads();
    return code;
}

void onEndingSignal(void (*action)() noexcept) { endingAction = action; }

bool isQuiet() { return quietAsked; }

void say(const std::string& text) {
    if (!quietAsked) warn(text);
}

void warn(const std::string& text) {
    eraseProgressBar();
    if (logFormat() == LogFormat::Json)
        printRecord({{"event", "message"}, {"message", text}});
    else
        std::fprintf(stderr, "%s\n", printable(text, "\n").c_str());
}

CLI::Validator finiteWithin(double low, double high) {
    std::ostringstream range, description;
    range << "a number of " << low << " to " << high;
    description << "FLOAT in [" << low << " - " << high << "]";
    return finite(range.str(), description.str(), [=](double x) { return low <= x && x <= high; });
}

CLI::Validator finitePositive() {
    return finite("a finite number above 0", "POSITIVE", [](double x) { return x > 0; });
}

CLI::Validator finiteNonNegative() {
    return finite("a finite number, 0 or above", "NONNEGATIVE", [](double x) { return x >= 0; });
}

void checkOutputs(const std::vector<NamedFile>& outputs, const std::vector<std::string>& inputs) {
    for (std::size_t i = 0; i < outputs.size(); ++i) {
        for (const std::string& input : inputs)
            if (sameFile(outputs[i].path, input))
                throw CLI::ValidationError(outputs[i].option,
                                           "expected another file than the input '" + input + "'");
        for (std::size_t j = 0; j < i; ++j)
            if (sameFile(outputs[i].path, outputs[j].path))
                throw CLI::ValidationError(outputs[i].option, "expected another file than that of " +
                                                                  outputs[j].option + ", found '" +
                                                                  outputs[i].path + "'");
    }
}

void checkOutputName(const std::string& output, const std::vector<std::string>& inputs) {
    if (std::filesystem::path(output).extension() != ".exr")
        throw CLI::ValidationError("--output", "expected a name that ends with .exr, found '" + output + "'");
    checkOutputs({{"--output", output}}, inputs);
}

void checkOptionUse(const CLI::App& app, const std::vector<OptionUse>& uses,
                    const std::vector<std::string>& atHand) {
    for (const OptionUse& use : uses) {
        const bool read = std::ranges::any_of(use.modes, [&](const std::string& mode) {
            return std::ranges::find(atHand, mode) != atHand.end();
        });
        for (const std::string& option : use.options) {
            if (read || app.get_option(option)->count() == 0) continue;
            std::string modes;
            for (std::size_t i = 0; i < use.modes.size(); ++i)
                modes += (i == 0 ? "" : i + 1 == use.modes.size() ? " or " : ", ") + use.modes[i];
            throw CLI::ValidationError(option + " goes with " + modes + ": here nothing reads it");
        }
    }
}

}  // namespace vlx
