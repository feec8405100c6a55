#include "run_tool.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>

namespace vlx {

namespace {

std::string contents(std::FILE* file) {
    std::string text;
    std::rewind(file);
    char buffer[4096];
    for (std::size_t got; (got = std::fread(buffer, 1, sizeof buffer, file)) > 0;) text.append(buffer, got);
    std::fclose(file);
    return text;
}

}  // namespace

ToolRun runTool(const std::string& tool, const std::vector<std::string>& arguments,
                const RunOptions& options) {
    const std::string program = tool.starts_with('/') ? tool : std::string(VLX_BIN) + "/" + tool;
    std::vector<char*> argv = {const_cast<char*>(program.c_str())};
    for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
    argv.push_back(nullptr);
    std::FILE* const out = std::tmpfile();
    std::FILE* const err = std::tmpfile();
    if (!out || !err) {
        ADD_FAILURE() << "cannot make temporary files";
        return {-1, {}, {}};
    }
    const pid_t child = ::fork();
    if (child == 0) {
        ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
        ::dup2(::fileno(out), STDOUT_FILENO);
        ::dup2(::fileno(err), STDERR_FILENO);
        const auto limit = [](decltype(RLIMIT_CPU) what, const std::optional<std::uint64_t>& most) {
            if (!most) return;
            const rlimit both{*most, *most};
            ::setrlimit(what, &both);
        };
        limit(RLIMIT_FSIZE, options.fileSizeLimit);
        limit(RLIMIT_AS, options.memoryBytes);
        limit(RLIMIT_CPU, options.cpuSeconds);
        ::execv(program.c_str(), argv.data());
        ::_exit(127);
    }
    int status = 0;
    ::waitpid(child, &status, 0);
    const int code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    if (code == 127) ADD_FAILURE() << "cannot run " << program;
    return {code, contents(out), contents(err)};
}

}  // namespace vlx
