// vlx-compare sweep of frames.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "run_tool.h"
#include "temporary_folder.h"

namespace vlx {
namespace {

using Json = nlohmann::json;

const std::string kRoom = VLX_TESTDATA "/scenes/interior.glb";

ToolRun sweepRoom(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"sweep", kRoom});
    return runTool("vlx-compare", arguments);
}

TEST(VlxCompareSweepFrames, ErrorsAreMeansOverFrames) {
    const TemporaryFolder folder;
    const std::string out = folder / "out", calls = folder / "calls", reference = folder / "ref_####.exr";
    ASSERT_EQ(runTool("vlx-trace", {kRoom, "-o", reference, "--frames", "1-3", "--width", "16", "--height",
                                    "12", "--spp", "16", "--seed", "7", "-q"})
                  .exitCode,
              0);
    const std::vector<std::string> arguments = {"-o",
                                                out,
                                                "--frames",
                                                "2,1,3",
                                                "--reference",
                                                reference,
                                                "--spp",
                                                "2",
                                                "--seeds",
                                                "1",
                                                "--no-vary",
                                                "--json",
                                                "-q",
                                                "--methods",
                                                "mean,gaussian,krige-temporal",
                                                "--external",
                                                "copy=echo {output} >> " + calls + "; cp {input} {output}"};
    const ToolRun run = sweepRoom(arguments);
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_EQ(run.err, "");
    std::vector<Json> records;
    std::istringstream lines(run.out);
    for (std::string line; std::getline(lines, line);) records.push_back(Json::parse(line));
    ASSERT_EQ(records.size(), 5u);
    EXPECT_EQ(records[0]["samplesPerPixel"], 2);
    EXPECT_NE(records[0]["command"].get<std::string>().find(" -o samples_####.exr "), std::string::npos);

    // Another program is run frame by frame.
    const std::string called = contentsOf(calls);
    EXPECT_EQ(std::count(called.begin(), called.end(), '\n'), 3) << called;
    EXPECT_NEAR(records[4]["values"]["relmse"], records[1]["values"]["relmse"], 1e-12);

    for (std::size_t i = 1; i < records.size(); ++i) {
        const Json &record = records[i], &values = record["values"];
        const ToolRun compared =
            runTool("vlx-compare", {"sequence", reference, out + "/" + record["file"].get<std::string>(),
                                    "--frames", "1-3", "--json"});
        ASSERT_EQ(compared.exitCode, 0) << compared.err;
        const Json sequence = Json::parse(compared.out)["sequences"][0];
        double rmse = 0;
        for (const Json& frame : sequence["frames"]) rmse += frame["metrics"]["rmse"].get<double>() / 3;
        EXPECT_NEAR(values["rmse"], rmse, 1e-9 * rmse);
        EXPECT_NEAR(values["relmse"], sequence["relmse"]["value"], 1e-9);
        EXPECT_EQ(values["flicker"], sequence["flicker"]["value"]);
        if (record["method"] != "gaussian" && record["method"] != "copy") {
            EXPECT_EQ(record["reliability"]["values"], 3 * 16 * 12 * 3) << record;
            EXPECT_EQ(record["command"].get<std::string>().substr(0, 52),
                      "vlx-krige samples_####.exr -o image_####.exr --threa");
        }
    }
    EXPECT_TRUE(records[3]["stages"].contains("other frames")) << records[3];
    EXPECT_NE(contentsOf(out + "/report.html").find("\"shownFrame\":\"2\""), std::string::npos);
    EXPECT_FALSE(std::filesystem::exists(out + "/scratch"));

    // Again nothing is run, but for what has lost a frame.
    EXPECT_EQ(sweepRoom(arguments).out, run.out);
    std::string lost = records[2]["file"];
    lost.replace(lost.find('#'), 4, "0003");
    ASSERT_TRUE(std::filesystem::remove(out + "/" + lost));
    ASSERT_EQ(sweepRoom(arguments).exitCode, 0);
    EXPECT_TRUE(std::filesystem::exists(out + "/" + lost));
    EXPECT_EQ(contentsOf(calls), called);
}

TEST(VlxCompareSweepFrames, AFailingFrameFailsTheMethod) {
    const TemporaryFolder folder;
    const ToolRun run = sweepRoom(
        {"-o", folder / "out", "--frames", "1-3", "--width", "8", "--height", "8", "--spp", "1", "--seeds",
         "1", "--no-vary", "--methods", "none", "-q", "--external",
         "second=case {output} in *_0002.exr) echo no licence >&2; exit 4;; *) echo {input};; esac"});
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find("exit code 4: no licence"), std::string::npos) << run.err;
}

TEST(VlxCompareSweepFrames, WhatIsWrongIsSaid) {
    const TemporaryFolder folder;
    const auto expectError = [&](std::vector<std::string> arguments, int code, const std::string& text) {
        arguments.insert(arguments.end(), {"-o", folder / "out"});
        const ToolRun run = sweepRoom(arguments);
        EXPECT_EQ(run.exitCode, code) << run.err;
        EXPECT_NE(run.err.find(text), std::string::npos) << run.err;
    };
    expectError({"--frames", "one"}, 2, "--frames: expected frames such as 1-100x2");
    expectError({"--frames", "1-2", "--reference", "ref.exr"}, 2, "--reference: with --frames expected ####");
    expectError({"--frames", "1-2", "--inspect", "4"}, 2, "--inspect");
    expectError({"--methods", "krige-temporal"}, 2, "'krige-temporal' goes with --frames");
    expectError({"--frames", "1-2", "--reference", folder / "ref_#.exr"}, 1, "ref_1.exr");
    const ToolRun dump = runTool("vlx-compare", {"sweep", VLX_TESTDATA "/dumps/tungsten_cornell.exr", "-o",
                                                 folder / "out", "--frames", "1"});
    EXPECT_EQ(dump.exitCode, 2);
    EXPECT_NE(dump.err.find("--frames goes with a scene"), std::string::npos) << dump.err;
    EXPECT_EQ(folder.entries(), 0);
}

}  // namespace
}  // namespace vlx
