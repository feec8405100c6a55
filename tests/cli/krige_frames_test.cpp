// vlx-krige --frames --temporal: frames that add to each other, as files come, go and change.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"

namespace vlx {
namespace {

namespace fs = std::filesystem;

const std::string kScene = VLX_TESTDATA "/scenes/interior.glb";

/// Five frames of 40 x 24 pixels from a camera that stands still.
class KrigeFrames : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        traced = std::make_unique<TemporaryFolder>();
        ASSERT_EQ(runTool("vlx-trace", {kScene, "--width", "40", "--height", "24", "--spp", "4", "-q", "-o",
                                        *traced / "s_##.exr", "--frames", "1-5"})
                      .exitCode,
                  0);
    }
    static void TearDownTestSuite() { traced.reset(); }

    KrigeFrames() {
        for (const int frame : {1, 2, 3, 4, 5}) fs::copy_file(name("s", frame, *traced), name("s", frame));
    }

    std::string name(const std::string& what, int frame) const { return name(what, frame, folder_); }
    static std::string name(const std::string& what, int frame, const TemporaryFolder& folder) {
        return folder / (what + "_0" + std::to_string(frame) + ".exr");
    }
    ToolRun krige(const std::string& out, const std::string& frames, std::vector<std::string> more = {},
                  const std::string& temporal = "2") const {
        more.insert(more.begin(), {folder_ / "s_##.exr", "-o", folder_ / (out + "_##.exr"), "--frames",
                                   frames, "--temporal", temporal});
        return runTool("vlx-krige", more);
    }
    std::vector<float> pixels(const std::string& out, int frame) const {
        return readImage(name(out, frame)).pixels;
    }

    static std::unique_ptr<TemporaryFolder> traced;
    TemporaryFolder folder_;
};

std::unique_ptr<TemporaryFolder> KrigeFrames::traced;

TEST_F(KrigeFrames, PixelsDoNotDependOnHowFramesAreSharedOut) {
    const ToolRun run = krige("a", "1-5");
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.err.find("4 of 4 frames around it are there"), std::string::npos) << run.err;
    ASSERT_EQ(krige("b", "3", {"-q", "--threads", "1"}).exitCode, 0);
    EXPECT_EQ(pixels("b", 3), pixels("a", 3));
    ASSERT_EQ(krige("b", "5,1", {"-q"}).exitCode, 0);
    EXPECT_EQ(pixels("b", 1), pixels("a", 1));
    ASSERT_EQ(krige("top", "3", {"-q", "--band", "1/2"}).exitCode, 0);
    const std::vector<float> top = pixels("top", 3);
    std::vector<float> whole = pixels("a", 3);
    ASSERT_EQ(top.size(), whole.size() / 2);
    whole.resize(top.size());
    EXPECT_EQ(top, whole);
}

TEST_F(KrigeFrames, AFrameThatComesLaterOrBecomesAnotherIsNoticed) {
    fs::rename(name("s", 4), folder_ / "later.exr");
    const ToolRun without = krige("a", "3-5");
    EXPECT_EQ(without.exitCode, 1);
    EXPECT_NE(without.err.find("1 of 3 frames failed: 4"), std::string::npos) << without.err;
    EXPECT_NE(without.err.find("2 of 4 frames around it are there"), std::string::npos) << without.err;
    EXPECT_FALSE(fs::exists(name("a", 4)));
    const std::vector<float> two = pixels("a", 3);

    fs::rename(folder_ / "later.exr", name("s", 4));
    ASSERT_EQ(krige("a", "3-5", {"-q"}).exitCode, 0);
    const std::vector<float> four = pixels("a", 3);
    EXPECT_NE(four, two);

    fs::copy_file(name("s", 1), name("s", 5), fs::copy_options::overwrite_existing);
    ASSERT_EQ(krige("a", "3", {"-q"}).exitCode, 0);
    EXPECT_NE(pixels("a", 3), four);
}

TEST_F(KrigeFrames, WhatCannotAddToAFrameIsSaid) {
    ASSERT_EQ(runTool("vlx-trace", {kScene, "--width", "20", "--height", "12", "--spp", "4", "-q", "-o",
                                    folder_ / "s_##.exr", "--frames", "5", "--overwrite"})
                  .exitCode,
              0);
    const ToolRun small = krige("a", "3-4", {}, "1");
    EXPECT_EQ(small.exitCode, 1);
    EXPECT_NE(small.err.find("frame 4: " + name("s", 5) + ": expected 40 x 24 pixels at (0, 0), found 20 x"),
              std::string::npos)
        << small.err;
    EXPECT_NE(small.err.find("--temporal 0"), std::string::npos) << small.err;
    EXPECT_TRUE(fs::exists(name("a", 3)));
    EXPECT_FALSE(fs::exists(name("a", 4)));

    std::ofstream(name("s", 5)) << "nothing";
    const ToolRun broken = krige("a", "4");
    EXPECT_EQ(broken.exitCode, 1);
    EXPECT_NE(broken.err.find(name("s", 5)), std::string::npos) << broken.err;

    const ToolRun memory = krige("b", "2", {"--max-memory", "1M"}, "1");
    EXPECT_EQ(memory.exitCode, 1);
    EXPECT_NE(memory.err.find("3 frames of this size"), std::string::npos) << memory.err;
    EXPECT_FALSE(fs::exists(name("b", 2)));
}

TEST_F(KrigeFrames, WithoutFramesNothingAdds) {
    const ToolRun run = runTool("vlx-krige", {name("s", 1), "-o", folder_ / "a.exr", "--temporal", "2"});
    EXPECT_EQ(run.exitCode, 2);
    EXPECT_NE(run.err.find("--temporal goes with --frames"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(folder_ / "a.exr"));
}

}  // namespace
}  // namespace vlx
