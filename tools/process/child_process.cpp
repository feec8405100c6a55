#include "process/child_process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>

#include "variolux/base/error.h"

namespace vlx {

namespace {

constexpr std::size_t kMostOutput = std::size_t{64} << 20;
constexpr std::size_t kErrorTail = 4096;

std::atomic<pid_t> runningGroup{0};
static_assert(std::atomic<pid_t>::is_always_lock_free);

/// A file descriptor, closed with it.
class Descriptor {
  public:
    explicit Descriptor(int fd = -1) : fd_(fd) {}
    ~Descriptor() { reset(); }
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    int get() const { return fd_; }
    void reset(int fd = -1) {
        if (fd_ >= 0) ::close(fd_);
        fd_ = fd;
    }

  private:
    int fd_;
};

struct Pipe {
    Descriptor readEnd, writeEnd;
    Pipe() {
        std::array<int, 2> ends{};
        if (::pipe2(ends.data(), O_CLOEXEC) != 0)
            throw Error("", std::string("cannot make a pipe: ") + std::strerror(errno));
        readEnd.reset(ends[0]);
        writeEnd.reset(ends[1]);
    }
};

/// Reads both pipes to their ends; too much output is left unread.
bool collect(const Pipe& out, const Pipe& err, ProcessRun& run) {
    std::array<pollfd, 2> waiting{pollfd{out.readEnd.get(), POLLIN, 0}, pollfd{err.readEnd.get(), POLLIN, 0}};
    std::array<char, 65536> buffer{};
    while (waiting[0].fd >= 0 || waiting[1].fd >= 0) {
        if (::poll(waiting.data(), waiting.size(), -1) < 0) {
            if (errno == EINTR) continue;  // revents are those of the call before
            return false;
        }
        for (std::size_t i = 0; i < waiting.size(); ++i) {
            if (waiting[i].fd < 0 || waiting[i].revents == 0) continue;
            const ssize_t count = ::read(waiting[i].fd, buffer.data(), buffer.size());
            if (count < 0 && errno == EINTR) continue;
            if (count <= 0) {
                waiting[i].fd = -1;
                continue;
            }
            std::string& text = i == 0 ? run.out : run.err;
            text.append(buffer.data(), static_cast<std::size_t>(count));
            if (i == 1 && text.size() > kErrorTail) text.erase(0, text.size() - kErrorTail);
            if (text.size() > kMostOutput) return false;
        }
    }
    return true;
}

double secondsOf(const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ProcessRun runProgram(const std::vector<std::string>& words) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    Pipe out, err;
    const Descriptor nothing(::open("/dev/null", O_RDONLY | O_CLOEXEC));
    const pid_t parent = ::getpid();
    const auto start = std::chrono::steady_clock::now();
    const pid_t child = ::fork();
    if (child < 0) throw Error("", std::string("cannot start a process: ") + std::strerror(errno));
    if (child == 0) {  // only async-signal-safe calls from here: other threads' locks are not ours
        ::setpgid(0, 0);
        ::prctl(PR_SET_PDEATHSIG, SIGTERM);
        if (::getppid() != parent) ::_exit(126);
        ::dup2(nothing.get(), 0);
        ::dup2(out.writeEnd.get(), 1);
        ::dup2(err.writeEnd.get(), 2);
        ::signal(SIGXFSZ, SIG_DFL);
        ::execvp(arguments[0], arguments.data());
        ::_exit(127);
    }
    ::setpgid(child, child);  // here too: whoever comes first
    runningGroup = child;
    out.writeEnd.reset();
    err.writeEnd.reset();
    ProcessRun run;
    const bool complete = collect(out, err, run);
    if (!complete) ::kill(-child, SIGTERM);
    out.readEnd.reset();
    int status = 0;
    rusage usage{};
    while (::wait4(child, &status, 0, &usage) < 0)
        if (errno != EINTR)
            throw Error("", std::string("cannot wait for a process: ") + std::strerror(errno));
    runningGroup = 0;
    run.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!complete) throw Error(words.back(), "expected at most 64 MiB of output");
    run.exitCode = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    run.userSeconds = secondsOf(usage.ru_utime);
    run.systemSeconds = secondsOf(usage.ru_stime);
    run.peakBytes = std::int64_t{usage.ru_maxrss} * 1024;
    return run;
}

ProcessRun runCommand(const std::string& command) { return runProgram({"/bin/sh", "-c", command}); }

void endRunningCommand() noexcept {
    if (const pid_t group = runningGroup) ::kill(-group, SIGTERM);
}

std::string shellQuoted(const std::string& text) {
    const auto harmless = [](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
               std::strchr("/._-+=,:@%", c) != nullptr;
    };
    if (!text.empty() && std::all_of(text.begin(), text.end(), harmless)) return text;
    std::string quoted = "'";
    for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

}  // namespace vlx
