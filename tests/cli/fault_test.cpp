// Tools that are ended from outside, at any time: no file that is not whole has a final name, and the next
// run completes. VLX_KILLS in the environment says how many times each tool is ended (5; with
// sanitizers 1).

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <thread>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

namespace fs = std::filesystem;

const std::string kDump = VLX_TESTDATA "/dumps/tungsten_cornell.exr";

int kills() {
    const char* text = std::getenv("VLX_KILLS");
#ifdef VARIOLUX_SANITIZED
    constexpr int kUsual = 1;
#else
    constexpr int kUsual = 5;
#endif
    return text == nullptr ? kUsual : std::atoi(text);
}

// Reads all of a dump or image; the message when it is not whole.
std::string damage(const std::string& path, bool dump) {
    try {
        if (dump) {
            const DumpReader reader(path);
            const Window window = reader.header().data;
            for (int row = 0; row < window.height; ++row) reader.read(window.y + row, 1);
        } else {
            readImage(path);
        }
    } catch (const Error& error) {
        return error.what();
    }
    return {};
}

struct Job {
    std::string name;
    std::string tool;
    std::vector<std::string> arguments;  // without the output
    bool dump = true;                    // what comes out
};

class Fault : public testing::Test {
  protected:
    Fault() {
        for (int i = 0; i < 24; ++i) {
            Image image({0, 0, 400, 300}, {"R", "G", "B"});
            for (std::size_t k = 0; k < image.pixels.size(); ++k)
                image.pixels[k] = static_cast<float>((k * 7919 + static_cast<std::size_t>(i)) % 1009);
            images_.push_back(inputs_ / ("seed" + std::to_string(i) + ".exr"));
            writeImage(images_.back(), image);
        }
        Job stack{"stack", "vlx-pack", {"stack"}};
        stack.arguments.insert(stack.arguments.end(), images_.begin(), images_.end());
        Job merge{"merge", "vlx-pack", {"merge"}, false};
        for (int i = 0; i < 6; ++i) {
            Image band({0, 200 * i, 1200, 200}, {"R", "G", "B"});
            band.display = {0, 0, 1200, 1200};
            merge.arguments.push_back(inputs_ / ("band" + std::to_string(i) + ".exr"));
            writeImage(merge.arguments.back(), band);
        }
        jobs_ = {
            stack,
            merge,
            {"krige", "vlx-krige", {kDump, "--quiet"}, false},
            {"trace", "vlx-trace", {VLX_TESTDATA "/scenes/interior.glb", "--width", "48", "--spp", "4"}}};
    }

    // Starts the job, ends it by `signal` somewhere in its course, returns its wait status.
    static int runAndEnd(const Job& job, const std::string& output, int signal,
                         std::chrono::microseconds after) {
        const std::string program = std::string(VLX_BIN) + "/" + job.tool;
        std::vector<std::string> arguments = {program};
        arguments.insert(arguments.end(), job.arguments.begin(), job.arguments.end());
        arguments.insert(arguments.end(), {"-o", output});
        std::vector<char*> argv;
        for (std::string& argument : arguments) argv.push_back(argument.data());
        argv.push_back(nullptr);
        const pid_t child = ::fork();
        if (child == 0) {
            ::freopen("/dev/null", "w", stdout);
            ::freopen("/dev/null", "w", stderr);
            ::execv(program.c_str(), argv.data());
            ::_exit(127);
        }
        std::this_thread::sleep_for(after);
        ::kill(child, signal);
        int status = 0;
        ::waitpid(child, &status, 0);
        return status;
    }

    // Ends each job many times. `check` looks at each end.
    template <class Check>
    void endAll(int signal, const Check& check) {
        std::mt19937 random(static_cast<unsigned>(signal));
        for (const Job& job : jobs_) {
            SCOPED_TRACE(job.name);
            const TemporaryFolder folder;
            const std::string output = folder / "out.exr";
            const auto start = std::chrono::steady_clock::now();
            std::vector<std::string> arguments = job.arguments;
            arguments.insert(arguments.end(), {"-o", output});
            ASSERT_EQ(runTool(job.tool, arguments).exitCode, 0);
            const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(
                std::chrono::steady_clock::now() - start);
            ASSERT_EQ(damage(output, job.dump), "");
            fs::remove(output);
            int ended = 0;
            for (int i = 0; i < kills(); ++i) {
                const int status = runAndEnd(job, output, signal,
                                             std::chrono::microseconds(static_cast<std::int64_t>(
                                                 static_cast<double>(whole.count()) * 1.1 *
                                                 std::generate_canonical<double, 32>(random))));
                if (WIFSIGNALED(status))
                    ++ended;
                else
                    EXPECT_EQ(WEXITSTATUS(status), 0);
                if (WIFSIGNALED(status)) {
                    EXPECT_EQ(WTERMSIG(status), signal);
                }
                if (fs::exists(output)) {
                    EXPECT_EQ(damage(output, job.dump), "");
                }
                check(folder, output);
                fs::remove(output);
            }
            RecordProperty("ended_" + job.name, ended);
            EXPECT_EQ(runTool(job.tool, arguments).exitCode, 0) << "a new run completes";
            EXPECT_EQ(damage(output, job.dump), "");
        }
    }

    const TemporaryFolder inputs_;
    std::vector<std::string> images_;
    std::vector<Job> jobs_;
};

TEST_F(Fault, KilledToolsLeaveNoFileThatIsNotWhole) {
    endAll(SIGKILL, [](const TemporaryFolder&, const std::string&) {});
}

TEST_F(Fault, TerminatedToolsLeaveNothingAtAll) {
    for (const int signal : {SIGTERM, SIGINT})
        endAll(signal, [](const TemporaryFolder& folder, const std::string& output) {
            EXPECT_EQ(folder.entries(), fs::exists(output) ? 1 : 0) << "hidden files are left";
        });
}

// A full disk, a folder that takes no files, a disk that is missing.
TEST_F(Fault, DisksThatRefuse) {
    for (const Job& job : jobs_) {
        SCOPED_TRACE(job.name);
        const TemporaryFolder folder;
        const auto outcome = [&](const std::string& output, const RunOptions& options) {
            std::vector<std::string> arguments = job.arguments;
            arguments.insert(arguments.end(), {"-o", output});
            const ToolRun run = runTool(job.tool, arguments, options);
            EXPECT_EQ(run.exitCode, 1) << run.err;
            EXPECT_NE(run.err.find(output), std::string::npos) << run.err;
        };
        for (const int bytes : {400, 8000})  // less, and more, than a stream buffers
            outcome(folder / "out.exr", {.fileSizeLimit = bytes});
        outcome(folder / "none/out.exr", {});
        outcome("/proc/out.exr", {});
        EXPECT_EQ(folder.entries(), 0);
    }
}

}  // namespace
}  // namespace vlx
