#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"

namespace vlx {
namespace {

const std::string kDump = VLX_TESTDATA "/dumps/tungsten_cornell.exr";  // 20 x 20 pixels, 8 samples each
const std::string kScene = VLX_TESTDATA "/scenes/interior.glb";

ToolRun sweep(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "sweep");
    return runTool("vlx-compare", arguments);
}

std::vector<nlohmann::json> records(const std::string& folder) {
    std::vector<nlohmann::json> result;
    std::istringstream lines(contentsOf(folder + "/results.jsonl"));
    for (std::string line; std::getline(lines, line);) result.push_back(nlohmann::json::parse(line));
    return result;
}

/// A reference of the dump's window: its own average, which is good enough to measure against here.
std::string makeReference(const TemporaryFolder& folder) {
    const std::string path = folder / "reference.exr";
    EXPECT_EQ(runTool("vlx-krige", {kDump, "-o", path, "--method", "mean"}).exitCode, 0);
    return path;
}

TEST(VlxCompareSweep, OfADumpThenAgainThenInterrupted) {
    const TemporaryFolder folder;
    const std::string reference = makeReference(folder), out = folder / "out";
    const std::vector<std::string> arguments = {kDump,
                                                "-o",
                                                out,
                                                "--reference",
                                                reference,
                                                "--spp",
                                                "2,4",
                                                "--seeds",
                                                "2",
                                                "--inspect",
                                                "4",
                                                "--vary",
                                                "paper --region 3",
                                                "--trace-seconds",
                                                "8",
                                                "--methods",
                                                "mean,gaussian,paper"};
    const ToolRun first = sweep(arguments);
    ASSERT_EQ(first.exitCode, 0) << first.err;
    EXPECT_NE(first.out.find("0 of "), std::string::npos) << first.out;

    // 2 samplings x 2 repetitions, each with 3 methods; the variation at 2 samples; an inspection.
    const auto all = records(out);
    ASSERT_EQ(all.size(), 4u + 12u + 2u + 1u);
    std::set<std::string> keys;
    for (const auto& r : all) {
        keys.insert(r["key"]);
        EXPECT_EQ(r["failure"], "") << r;
        if (r["kind"] == "sampling")
            EXPECT_DOUBLE_EQ(r["seconds"], r["setting"].get<double>());  // a share of 8 s for 8 samples
        else
            EXPECT_GT(r["peakBytes"].get<double>(), 1e6) << r;
        if (r["kind"] == "image") {
            EXPECT_GT(r["values"]["relmse"].get<double>(), 0) << r;
            EXPECT_EQ(r["values"].contains("sigma"), r["method"] == "gaussian");
            EXPECT_EQ(r.contains("reliability"), r["method"] != "gaussian");
            EXPECT_EQ(r["values"].contains("exact_pixels"), r["method"] != "gaussian");
            EXPECT_GT(r["values"]["floor"].get<double>(), 0);  // of the reference's own stddev
            EXPECT_GT(r["stages"]["other"].get<double>(), 0);
        }
    }
    EXPECT_EQ(keys.size(), all.size());
    const std::string csv = contentsOf(out + "/results.csv");
    EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), static_cast<long>(all.size()) + 1);
    const std::string report = contentsOf(out + "/report.html");
    EXPECT_GT(report.size(), 50000u);
    EXPECT_NE(report.find("\"inspection\":"), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(out + "/scratch"));

    // Again: nothing is run.
    const std::string before = contentsOf(out + "/results.jsonl");
    const ToolRun again = sweep(arguments);
    ASSERT_EQ(again.exitCode, 0) << again.err;
    EXPECT_NE(again.out.find("19 of 19 results were there already"), std::string::npos) << again.out;
    EXPECT_EQ(contentsOf(out + "/results.jsonl"), before);

    // The last line was being written when the machine died: that run alone is repeated, and its dump.
    std::filesystem::resize_file(out + "/results.jsonl", before.size() - 30);
    const ToolRun resumed = sweep(arguments);
    ASSERT_EQ(resumed.exitCode, 0) << resumed.err;
    EXPECT_NE(resumed.out.find("17 of 19 results were there already"), std::string::npos) << resumed.out;
    EXPECT_TRUE(contentsOf(out + "/results.jsonl")
                    .starts_with(before.substr(0, before.rfind('\n', before.size() - 31))));

    // A kept image that is gone is made again.
    for (const auto& entry : std::filesystem::directory_iterator(out + "/images"))
        if (entry.path().extension() == ".exr") {
            std::filesystem::remove(entry.path());
            break;
        }
    const ToolRun remade = sweep(arguments);
    EXPECT_NE(remade.out.find("17 of 19 results were there already"), std::string::npos) << remade.out;

    // Another reference: samplings hold, images do not.
    Image other = readImage(reference);
    other.pixels[0] += 1;
    writeImage(reference, other);
    const ToolRun changed = sweep(arguments);
    ASSERT_EQ(changed.exitCode, 0) << changed.err;
    EXPECT_NE(changed.out.find("0 of 19 results were there already"), std::string::npos) << changed.out;

    std::vector<std::string> anew = arguments;
    anew.emplace_back("--overwrite");
    const ToolRun overwritten = sweep(anew);
    ASSERT_EQ(overwritten.exitCode, 0) << overwritten.err;
    EXPECT_TRUE(overwritten.out.find("\n0 of 19 results were there already") != std::string::npos)
        << overwritten.out;
    EXPECT_EQ(records(out).size(), 19u);
}

TEST(VlxCompareSweep, KilledSweepGoesOn) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    std::vector<std::string> arguments = {kDump, "-o",        out, "--spp",     "4",         "--seeds",
                                          "1",   "--inspect", "0", "--no-vary", "--methods", "mean,paper"};
    auto killed = arguments;
    // The method's shell kills the sweep that started it.
    killed.insert(killed.end(), {"--external", "killer=kill -9 $PPID; echo {input} {output}"});
    EXPECT_EQ(sweep(killed).exitCode, -9);
    ASSERT_EQ(records(out).size(), 3u);
    const ToolRun resumed = sweep(arguments);
    ASSERT_EQ(resumed.exitCode, 0) << resumed.err;
    EXPECT_NE(resumed.out.find("3 of 3 results were there already"), std::string::npos) << resumed.out;
}

TEST(VlxCompareSweep, OfASceneWithTarget) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const ToolRun run = sweep({kScene,
                               "-o",
                               out,
                               "--width",
                               "16",
                               "--height",
                               "12",
                               "--spp",
                               "2,8",
                               "--hierarchical",
                               "0.5",
                               "--seeds",
                               "2",
                               "--methods",
                               "mean,paper",
                               "--no-vary",
                               "--trace-options",
                               "--max-bounces 2",
                               "--target",
                               "predicted_relmse=1e6",
                               "-q"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.err, "");
    // The answer is two commands that can be run.
    std::istringstream lines(run.out);
    std::string comment, trace, image;
    std::getline(lines, comment);
    std::getline(lines, trace);
    std::getline(lines, image);
    EXPECT_TRUE(comment.starts_with("# predicted_relmse <= 1e+06")) << comment;
    EXPECT_TRUE(trace.starts_with("vlx-trace ")) << trace;
    EXPECT_NE(trace.find("--max-bounces 2"), std::string::npos);
    EXPECT_TRUE(image.starts_with("vlx-krige samples.exr -o image.exr ")) << image;

    std::set<std::string> commands;
    int samplings = 0;
    for (const auto& r : records(out))
        if (r["kind"] == "sampling") {
            ++samplings;
            commands.insert(r["command"]);
            EXPECT_GT(r["stages"]["trace"].get<double>(), 0);
            EXPECT_GT(r["samplesPerPixel"].get<double>(), 0.9);
        }
    EXPECT_EQ(samplings, 6);
    EXPECT_EQ(commands.size(), 6u);  // a seed each
    EXPECT_EQ(sweep({kScene, "-o", out, "--width", "16", "--height", "12", "--spp", "2", "--seeds", "1",
                     "--methods", "mean", "--no-vary", "--trace-options", "--max-bounces 2", "--target",
                     "predicted_relmse=1e-9", "-q"})
                  .exitCode,
              3);
}

TEST(VlxCompareSweep, WithoutMethodsOnlySamples) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const ToolRun run = sweep({kScene, "-o", out, "--width", "16", "--height", "12", "--spp", "2,4",
                               "--seeds", "1", "--methods", "none", "--json", "-q"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.out, contentsOf(out + "/results.jsonl"));
    const auto all = records(out);
    ASSERT_EQ(all.size(), 2u);
    for (const auto& r : all) {
        EXPECT_EQ(r["kind"], "sampling");
        EXPECT_GT(r["values"]["trace_cpu_seconds"].get<double>(), 0);
        EXPECT_LE(r["values"]["trace_cpu_seconds"].get<double>(), r["cpuSeconds"].get<double>());
    }
    EXPECT_FALSE(std::filesystem::exists(out + "/report.html"));  // nothing to show
}

TEST(VlxCompareSweep, FailingMethodIsShownFailing) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const std::vector<std::string> arguments = {
        kDump,        "-o",
        out,          "--spp",
        "8",          "--seeds",
        "1",          "--methods",
        "mean",       "--no-vary",
        "--external", "broken=echo no licence >&2; exit 4; {input} {output}",
        "--external", "wrong=echo not expected: --regio >&2; echo Run --help >&2; exit 2; {input} {output}",
        "--external", "silent=true {input} {output}",
        "--external", "copy=cp {input} {output}"};
    const ToolRun run = sweep(arguments);
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.out.find("failed: exit code 4: no licence"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("--regio"), std::string::npos) << run.out;
    EXPECT_NE(contentsOf(out + "/report.html").find("no licence"), std::string::npos);
    // Failures are tried again, the rest is not.
    const ToolRun again = sweep(arguments);
    EXPECT_EQ(again.exitCode, 1);
    EXPECT_NE(again.out.find("2 of 6 results were there already"), std::string::npos) << again.out;
}

TEST(VlxCompareSweep, ReportedStagesAndPlacesOfAnExternalMethod) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    const ToolRun run =
        sweep({kDump, "-o", out, "--spp", "2", "--seeds", "1", "--methods", "mean", "--no-vary", "--external",
               "staged=cp {input} {output}; echo '{\"seconds\": {\"predict\": 0.25}, \"spp\": {spp}}'"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto all = records(out);
    ASSERT_EQ(all.size(), 3u);
    EXPECT_EQ(all[2]["method"], "staged");
    EXPECT_EQ(all[2]["stages"]["predict"], 0.25);
    EXPECT_NE(all[2]["command"].get<std::string>().find("\"spp\": 2}"), std::string::npos) << all[2];
    EXPECT_TRUE(all[1]["stages"].contains("read"));
}

TEST(VlxCompareSweep, AnExternalMethodIsAssessedWithoutAReference) {
    const TemporaryFolder folder;
    const std::string out = folder / "out", calls = folder / "calls";
    const ToolRun run =
        sweep({kDump, "-o", out, "--spp", "8", "--seeds", "1", "--methods", "mean", "--no-vary", "--external",
               "copy=echo {input} >> " + calls + "; cp {input} {output}", "--target", "predicted_relmse=9"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto all = records(out);
    ASSERT_EQ(all.size(), 3u);
    // Its image is the first part of the dump, the plain average, whose error map says as much.
    const auto mean = all[1]["values"], copy = all[2]["values"];
    EXPECT_NEAR(copy["predicted_relmse"].get<double>() / mean["predicted_relmse"].get<double>(), 1, 0.5);
    EXPECT_LT(copy["assessed_low"].get<double>(), copy["predicted_relmse"].get<double>());
    EXPECT_GT(copy["assessed_high"].get<double>(), copy["predicted_relmse"].get<double>());
    const std::string inputs = contentsOf(calls);
    EXPECT_EQ(std::count(inputs.begin(), inputs.end(), '\n'), 3) << inputs;  // all, even, odd
    EXPECT_FALSE(std::filesystem::exists(out + "/scratch"));
}

TEST(VlxCompareSweep, BadInputIsToldBeforeAnythingIsRun) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    Image small({0, 0, 4, 4}, {"R", "G", "B"});
    writeImage(folder / "small.exr", small);
    std::ofstream(folder / "text.txt") << "text";
    const auto expectFailure = [&](std::vector<std::string> arguments, const std::string& text) {
        arguments.insert(arguments.end(), {"-o", out});
        const ToolRun run = sweep(arguments);
        EXPECT_EQ(run.exitCode, 1) << text;
        EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
        EXPECT_FALSE(std::filesystem::exists(out + "/results.jsonl")) << text;
    };
    expectFailure({kDump, "--reference", folder / "small.exr"},
                  "expected the dump's 20 x 20 pixels at (100, 120), found 4 x 4");
    expectFailure({kScene, "--reference", folder / "small.exr", "--width", "8"},
                  "expected a reference of 8 x 4 pixels, found 4 x 4");
    expectFailure({kDump, "--reference", folder / "none.exr"}, "none.exr");
    expectFailure({folder / "none.exr"}, "none.exr: expected a file that can be read");
    expectFailure({folder / "text.txt"}, "expected a scene (.glb, .gltf) or a sample dump (.exr)");
    expectFailure({folder / "small.exr"}, "small.exr");
    expectFailure({kDump, "--spp", "9"}, "expected at least 9 samples in every pixel, found 8");
    expectFailure({kDump, "--spp", "2,4", "--detail-spp", "8"}, "expected details of one of the ladder's");
    expectFailure({kDump, "--external", "mine=no-such-program {input} {output}"},
                  "no-such-program: expected a program that the shell finds");
}

TEST(VlxCompareSweep, DamagedResultsAreNotOverwritten) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "out");
    std::ofstream(folder / "out/results.jsonl") << "something else\n";
    const ToolRun run = sweep({kDump, "-o", folder / "out", "--methods", "mean", "--no-vary"});
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find("results.jsonl: expected a line that a sweep wrote"), std::string::npos)
        << run.err;
    EXPECT_EQ(contentsOf(folder / "out/results.jsonl"), "something else\n");
}

TEST(VlxCompareSweep, FolderHoldsOneSweepAtATime) {
    const TemporaryFolder folder;
    std::filesystem::create_directory(folder / "out");
    const int held = ::open((folder / "out/results.jsonl").c_str(), O_RDWR | O_CREAT, 0600);
    ASSERT_EQ(::flock(held, LOCK_EX), 0);
    const ToolRun run = sweep({kDump, "-o", folder / "out", "--methods", "mean", "--no-vary"});
    ::close(held);
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find("another sweep is working in this folder"), std::string::npos) << run.err;
}

TEST(VlxCompareSweep, BadUsageIsExitTwo) {
    const TemporaryFolder folder;
    const std::string out = folder / "out";
    for (const std::vector<std::string>& arguments :
         {std::vector<std::string>{},
          {kDump},
          {"-o", out},
          {kDump, "-o"},
          {kDump, "-o", out, "--methods", "magic"},
          {kDump, "-o", out, "--seeds", "0"},
          {kDump, "-o", out, "--spp", "0"},
          {kDump, "-o", out, "--spp", "x"},
          {kDump, "-o", out, "--external", "x"},
          {kDump, "-o", out, "--external", "x=run {input}"},
          {kDump, "-o", out, "--external", "mean=run {input} {output}"},
          {kDump, "-o", out, "--vary", "paper"},
          {kDump, "-o", out, "--vary", "magic --x 1"},
          {kDump, "-o", out, "--vary", "paper --region 2", "--no-vary"},
          {kDump, "-o", out, "--target", "relmse"},
          {kDump, "-o", out, "--target", "relmse=0.1"},  // no reference
          {kDump, "-o", out, "--target", "magic=1"},
          {kDump, "-o", out, "--crop", "1,2,3"},
          {kDump, "-o", out, "--trace-seconds", "0"},
          {kScene, "-o", out, "--trace-seconds", "1"},
          {kDump, "-o", out, "--hierarchical", "0.1"},
          {kDump, "-o", out, "--width", "10"},
          {kDump, "-o", out, "--trace-options", "--max-bounces 1"},
          {kDump, "-o", out, "--methods", "mean,mean"},
          {kDump, "-o", out, "--methods", "mean,none"},
          {kDump, "-o", out, "--nonsense"}}) {
        const ToolRun run = sweep(arguments);
        std::string line;
        for (const auto& argument : arguments) line += " " + argument;
        EXPECT_EQ(run.exitCode, 2) << line << "\n" << run.err;
        EXPECT_TRUE(run.err.starts_with("vlx-compare sweep: ")) << line << "\n" << run.err;
    }
    EXPECT_EQ(folder.entries(), 0);
    EXPECT_EQ(sweep({"--help"}).exitCode, 0);
}

TEST(VlxCompareSweep, EndsWhatItStartedWhenItIsEnded) {
    const TemporaryFolder folder;
    const std::string pids = folder / "pids";
    const std::string program = std::string(VLX_BIN) + "/vlx-compare";
    const std::string slow = "slow=: {input} {output}; sleep 100 & echo $! $$ > " + pids + ".part; mv " +
                             pids + ".part " + pids + "; wait";
    const pid_t child = ::fork();
    if (child == 0) {
        ::execl(program.c_str(), program.c_str(), "sweep", kDump.c_str(), "-o", (folder / "out").c_str(),
                "--methods", "mean", "--no-vary", "--spp", "2", "--trace-seconds", "1", "-q", "--external",
                slow.c_str(), nullptr);
        ::_exit(127);
    }
    const auto eventually = [](const auto& condition) {
        for (int i = 0; i < 3000 && !condition(); ++i) ::usleep(10'000);
        return condition();
    };
    ASSERT_TRUE(eventually([&] { return std::filesystem::exists(pids); }));
    ::kill(child, SIGTERM);
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM) << status;
    std::ifstream file(pids);
    for (pid_t started = 0; file >> started;)
        EXPECT_TRUE(eventually([&] {
            std::ifstream state("/proc/" + std::to_string(started) + "/stat");
            std::string text;
            return !std::getline(state, text) || text.find(") Z") != std::string::npos;
        })) << started
            << " is still there";
}

}  // namespace
}  // namespace vlx
