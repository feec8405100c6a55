// Every tool on files that are wrong: no crash, no hang, no more memory than they are worth, exit code 1, and
// a message that names the file. And on numbers that are none: exit code 2, whatever the files.

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <set>

#include "malformed_files.h"
#include "run_tool.h"
#include "temporary_folder.h"

namespace vlx {
namespace {

struct Command {
    std::string tool;
    std::vector<std::string> before, after;  // the file's name goes between them
};

std::vector<Command> commandsFor(MalformedKind kind, const std::string& out) {
    switch (kind) {
        case MalformedKind::Dump:
            return {{"vlx-pack", {"info"}, {}},
                    {"vlx-pack", {"subset"}, {"-o", out, "--samples", "1"}},
                    {"vlx-krige", {}, {"-o", out}}};
        case MalformedKind::Image:
            return {{"vlx-pack", {"stack"}, {"-o", out}},
                    {"vlx-pack", {"moments"}, {"-o", out, "--preset", "plain", "--variance-is", "mean"}},
                    {"vlx-pack", {"merge"}, {"-o", out, "--crop"}},
                    {"vlx-krige", {}, {"-o", out, "--map", "Z=R"}}};
        case MalformedKind::BcdRaw:
            return {{"vlx-pack", {"bcd"}, {"-o", out}}};
        case MalformedKind::Sbmc:
            return {{"vlx-pack", {"sbmc"}, {"-o", out}}};
        default:
            return {{"vlx-trace", {}, {"-o", out, "--width", "8", "--spp", "1"}}};
    }
}

TEST(MalformedFiles, ThereAreTwoHundredFiles) {
    const auto files = malformedFiles();
    EXPECT_GE(files.size(), 200u);
    RecordProperty("files", static_cast<int>(files.size()));
    std::set<std::string> names;
    for (const MalformedFile& file : files) EXPECT_TRUE(names.insert(file.name).second) << file.name;
}

// A tool starts slowly: each file meets one command of its kind, in turn; all with VLX_ALL_TOOLS in the
// environment.
class Malformed : public testing::TestWithParam<MalformedKind> {};

TEST_P(Malformed, FilesEndInAMessage) {
    RunOptions limits;
    limits.cpuSeconds = 20;
#ifndef VARIOLUX_SANITIZED
    limits.memoryBytes = std::uint64_t{2} << 30;
#endif
    const TemporaryFolder folder;
    std::size_t turn = 0;
    for (const MalformedFile& file : malformedFiles()) {
        if (file.kind != GetParam()) continue;
        const std::string path = folder / (file.kind == MalformedKind::Gltf ? "bad.gltf" : "bad.exr");
        std::ofstream(path, std::ios::binary)
            .write(reinterpret_cast<const char*>(file.bytes.data()),
                   static_cast<std::streamsize>(file.bytes.size()));
        const auto all = commandsFor(file.kind, folder / "out.exr");
        std::vector<Command> commands = {all[turn++ % all.size()]};
        if (std::getenv("VLX_ALL_TOOLS") != nullptr) commands = all;
        for (const Command& command : commands) {
            if (file.name == "image that is a dump" && command.before != std::vector<std::string>{"stack"} &&
                command.before != std::vector<std::string>{"moments"})
                continue;  // fine, or bad usage
            std::vector<std::string> arguments = command.before;
            arguments.push_back(path);
            arguments.insert(arguments.end(), command.after.begin(), command.after.end());
            const ToolRun run = runTool(command.tool, arguments, limits);
            const std::string what = command.tool + " " +
                                     (command.before.empty() ? "" : command.before.front()) + " on a " +
                                     file.name;
            EXPECT_EQ(run.exitCode, 1) << what << "\n" << run.err;
            EXPECT_NE(run.err.find(path + ": "), std::string::npos) << what << "\n" << run.err;
            EXPECT_EQ(run.err.find("internal error"), std::string::npos) << what << "\n" << run.err;
            EXPECT_EQ(folder.entries(), 1) << what << " left something";
        }
        std::filesystem::remove(path);
        std::filesystem::remove(folder / "out.exr");
    }
}

TEST(NumbersThatAreNotFinite, AreBadUsageOfEveryOption) {
    struct Numbers {
        std::string tool;
        std::vector<std::string> before;
        std::vector<std::string> options;
        std::string form = "#";  // of the value: # is the number
    };
    const std::vector<std::string> in = {"none.exr", "-o", "out.exr"}, scene = {"none.glb", "-o", "out.exr"};
    const auto with = [](std::vector<std::string> all, const std::vector<std::string>& more) {
        all.insert(all.end(), more.begin(), more.end());
        return all;
    };
    const std::vector<Numbers> all = {
        {"vlx-krige", in, {"--strength", "--scale", "--samples", "--threads"}},
        {"vlx-krige", with(in, {"--fireflies", "clamp"}), {"--clamp"}},
        {"vlx-krige", with(in, {"--method", "gaussian"}), {"--sigma"}},
        {"vlx-krige", with(in, {"--method", "paper"}), {"--region"}},
        {"vlx-krige", in, {"--max-memory"}, "#G"},
        {"vlx-trace", scene, {"--width", "--height", "--spp", "--time", "--target-error", "--replicates"}},
        {"vlx-trace", scene, {"--seed", "--max-bounces", "--threads"}},
        {"vlx-trace", with(scene, {"--hierarchical"}), {"--tolerance"}},
        {"vlx-trace", with(scene, {"--frames", "1"}), {"--fps"}},
        {"vlx-trace", scene, {"--env-constant"}, "1,1,#"},
        {"vlx-trace", scene, {"--shutter"}, "0,#"},
        {"vlx-trace", scene, {"--shutter"}, "#,1"},
        {"vlx-trace", scene, {"--crop"}, "0,0,1,#"},
        {"vlx-compare", {"none.exr", "none.exr"}, {"--threads"}},
        {"vlx-compare", {"none.exr", "none.exr", "--pictures", "out"}, {"--exposure"}},
        {"vlx-compare", {"none.exr", "none.exr", "--pictures", "out"}, {"--crop"}, "0,0,1,#"},
        {"vlx-compare", {"none.exr", "none.exr"}, {"--fail-above"}, "mse=#"},
        {"vlx-compare", {"none.exr", "none.exr"}, {"--fail-below"}, "psnr=#"},
        {"vlx-compare", {"sequence", "none_#.exr", "none_#.exr"}, {"--threads", "--frames"}},
        {"vlx-compare", {"sweep", "none.glb", "-o", "out"}, {"--hierarchical", "--trace-seconds", "--spp"}},
        {"vlx-compare", {"sweep", "none.glb", "-o", "out"}, {"--seeds", "--width", "--detail-spp"}},
        {"vlx-compare", {"sweep", "none.glb", "-o", "out"}, {"--target"}, "relmse=#"},
        {"vlx-pack", with({"moments"}, in), {"--samples"}},
        {"vlx-pack", {"bcd", "none.exr", "none.exr", "-o", "out.exr"}, {"--samples"}},
        {"vlx-pack", with({"subset"}, in), {"--samples", "--part"}}};
    for (const Numbers& numbers : all)
        for (const std::string& option : numbers.options)
            for (const char* number : {"nan", "inf"}) {
                std::vector<std::string> arguments = numbers.before;
                std::string value = numbers.form;
                arguments.push_back(option + "=" + value.replace(value.find('#'), 1, number));
                const ToolRun run = runTool(numbers.tool, arguments);
                const std::string what = numbers.tool + " " + arguments.back();
                EXPECT_EQ(run.exitCode, 2) << what << "\n" << run.err;
                EXPECT_NE(run.err.find(option), std::string::npos) << what << "\n" << run.err;
            }
}

std::string kindName(const testing::TestParamInfo<MalformedKind>& kind) {
    constexpr const char* names[] = {"Dump", "Image", "BcdRaw", "Sbmc", "Gltf"};
    return names[static_cast<int>(kind.param)];
}

INSTANTIATE_TEST_SUITE_P(Kinds, Malformed,
                         testing::Values(MalformedKind::Dump, MalformedKind::Image, MalformedKind::BcdRaw,
                                         MalformedKind::Sbmc, MalformedKind::Gltf),
                         kindName);

}  // namespace
}  // namespace vlx
