// Every tool on files that are wrong: no crash, no hang, no more memory than they are worth, exit code 1, and
// a message that names the file.

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
