#include "tool_main.h"

#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <new>

#include "help_formatter.h"
#include "variolux/base/error.h"

namespace vlx {

namespace {

int fail(const CLI::App& app, std::string message) {
    // Messages quote names out of files, which may hold what a terminal would obey.
    for (char& c : message)
        if ((static_cast<unsigned char>(c) < 32 && c != '\n') || c == 127) c = '?';
    std::fprintf(stderr, "%s: %s\n", app.get_name().c_str(), message.c_str());
    return kFailed;
}

int badUsage(const CLI::App& app, const std::string& message) {
    std::fprintf(stderr, "%s: %s\nRun %s --help for the options.\n", app.get_name().c_str(), message.c_str(),
                 app.get_name().c_str());
    return kBadUsage;
}

void setFormatter(CLI::App& app, const std::shared_ptr<CLI::FormatterBase>& formatter) {
    app.formatter(formatter);
    for (CLI::App* const command : app.get_subcommands([](CLI::App*) { return true; }))
        setFormatter(*command, formatter);
}

}  // namespace

int runTool(int argc, char** argv, CLI::App& app, const std::function<int()>& run) {
    // A file size limit must end in an error message and a clean folder, like a full disk, not in a signal.
    std::signal(SIGXFSZ, SIG_IGN);
    app.set_version_flag("--version", "Variolux " VARIOLUX_VERSION, "Print the version and exit");
    setFormatter(app, std::make_shared<HelpFormatter>());
    try {
        app.parse(argc, argv);
        const int code = run();
        // Results on stdout that did not get there are a failure too.
        std::cout.flush();
        if (!std::cout || std::fflush(stdout) != 0) return fail(app, "standard output cannot be written");
        return code;
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

void checkOutputName(const std::string& output, const std::vector<std::string>& inputs) {
    if (std::filesystem::path(output).extension() != ".exr")
        throw CLI::ValidationError("--output", "expected a name that ends with .exr, found '" + output + "'");
    std::error_code ignored;
    for (const std::string& input : inputs)
        if (std::filesystem::equivalent(input, output, ignored))
            throw CLI::ValidationError("--output", "expected another file than the input '" + input + "'");
}

}  // namespace vlx
