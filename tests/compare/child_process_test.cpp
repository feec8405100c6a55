#include "process/child_process.h"

#include <gtest/gtest.h>
#include <pthread.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "variolux/base/error.h"

namespace vlx {
namespace {

TEST(RunCommand, CollectsOutputAndExitCode) {
    const ProcessRun run = runCommand("echo one; echo two >&2; exit 3");
    EXPECT_EQ(run.exitCode, 3);
    EXPECT_EQ(run.out, "one\n");
    EXPECT_EQ(run.err, "two\n");
    EXPECT_GT(run.seconds, 0);
    EXPECT_EQ(runCommand("/nowhere/at/all 2>/dev/null").exitCode, 127);
    EXPECT_EQ(runCommand("kill -9 $$").exitCode, -9);
    EXPECT_EQ(runCommand("cat").exitCode, 0);  // standard input is empty
}

TEST(RunCommand, FullPipesDoNotBlock) {
    const ProcessRun run =
        runCommand("head -c 1000000 /dev/zero; head -c 1000000 /dev/zero >&2; echo end >&2");
    EXPECT_EQ(run.exitCode, 0);
    EXPECT_EQ(run.out.size(), 1000000u);
    EXPECT_EQ(run.err.size(), 4096u);
    EXPECT_TRUE(run.err.ends_with("end\n"));
}

// A signal while nothing is to be read: what poll() said before it must not be taken for news, or the one
// pipe is waited for while the other one is full.
TEST(RunCommand, SignalsDoNotBlock) {
    struct sigaction action {};
    struct sigaction before {};
    action.sa_handler = [](int) {};  // without SA_RESTART
    ::sigaction(SIGUSR1, &action, &before);
    const pthread_t self = ::pthread_self();
    std::thread signals([self] {
        std::this_thread::sleep_for(std::chrono::milliseconds(300));
        ::pthread_kill(self, SIGUSR1);
    });
    const ProcessRun run = runCommand("echo one; sleep 0.6; head -c 1000000 /dev/zero >&2; echo two");
    EXPECT_EQ(run.out, "one\ntwo\n");
    signals.join();
    ::sigaction(SIGUSR1, &before, nullptr);
}

TEST(RunCommand, CountsProcessorTimeAndMemoryOfAllProcesses) {
    const ProcessRun idle = runCommand("sleep 0.3");
    EXPECT_GE(idle.seconds, 0.3);
    EXPECT_LT(idle.cpuSeconds(), 0.2);
    // tail must keep what it will print: 100 MB, in a child of the shell.
    const ProcessRun large = runCommand("head -c 100000000 /dev/zero | tail -c 100000000 | wc -c");
    EXPECT_EQ(large.out, "100000000\n");
    EXPECT_GT(large.peakBytes, 100000000);
    EXPECT_GT(large.cpuSeconds(), 0);
}

TEST(ShellQuoted, IsOneWord) {
    for (const std::string text :
         {"plain", "", "two words", "it's", "a$b", "`x`", "*", "a\\b", "-n", "new\nline", "\"q\""})
        EXPECT_EQ(runCommand("printf %s " + shellQuoted(text)).out, text);
    EXPECT_EQ(shellQuoted("/tmp/a-b_c.exr"), "/tmp/a-b_c.exr");
}

}  // namespace
}  // namespace vlx
