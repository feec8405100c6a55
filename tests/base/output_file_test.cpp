#include "variolux/base/output_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "temporary_folder.h"
#include "variolux/base/error.h"

namespace vlx {
namespace {

namespace fs = std::filesystem;

TEST(OutputFile, AppearsOnlyWhenCommitted) {
    const TemporaryFolder folder;
    {
        OutputFile file(folder / "a.exr");
        std::ofstream(file.temporaryPath()) << "whole";
        EXPECT_FALSE(fs::exists(folder / "a.exr"));
        EXPECT_EQ(fs::path(file.temporaryPath()).extension(), ".exr");
        file.commit();
    }
    EXPECT_EQ(fs::file_size(folder / "a.exr"), 5u);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(OutputFile, UncommittedLeavesNothingAndKeepsTheOldFile) {
    const TemporaryFolder folder;
    std::ofstream(folder / "a.exr") << "old";
    {
        OutputFile file(folder / "a.exr");
        std::ofstream(file.temporaryPath()) << "half";
    }
    EXPECT_EQ(fs::file_size(folder / "a.exr"), 3u);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(OutputFile, WritesTextWholeOrNotAtAll) {
    const TemporaryFolder folder;
    writeFile(folder / "a.json", "old and longer");
    {
        const OutputFile file(folder / "a.json");
        file.write("new, never finished");
    }
    EXPECT_EQ(std::filesystem::file_size(folder / "a.json"), 14u);
    writeFile(folder / "a.json", std::string_view("n\0w", 3));
    EXPECT_EQ(std::filesystem::file_size(folder / "a.json"), 3u);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(OutputFile, DoesNotReplaceADevice) { EXPECT_THROW(OutputFile("/dev/null"), Error); }

// In a process of its own: afterwards no file can be written.
TEST(OutputFileDeathTest, RemovesWhatIsUnfinishedAtTheEnd) {
    const TemporaryFolder folder;
    const auto end = [&] {
        OutputFile whole(folder / "whole.exr"), unfinished(folder / "unfinished.exr");
        std::ofstream(whole.temporaryPath()) << "whole";
        std::ofstream(unfinished.temporaryPath()) << "half";
        whole.commit();
        removeUnfinishedFiles();
        bool refused = false;
        try {
            OutputFile late(folder / "late.exr");
        } catch (const Error&) {
            refused = true;
        }
        ::_exit(refused ? 7 : 1);
    };
    EXPECT_EXIT(end(), testing::ExitedWithCode(7), "");
    EXPECT_EQ(folder.entries(), 1);
    EXPECT_TRUE(fs::exists(folder / "whole.exr"));
}

TEST(OutputFile, MissingFolderIsAnErrorThatNamesTheFile) {
    const TemporaryFolder folder;
    try {
        OutputFile file(folder / "no/a.exr");
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("no/a.exr"), std::string::npos);
    }
}

}  // namespace
}  // namespace vlx
