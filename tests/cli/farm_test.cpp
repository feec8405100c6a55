// Work in parts, on farms: bands, frames, finished work, memory limits, many processes at once.

#include <gtest/gtest.h>
#include <sys/mount.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <memory>
#include <thread>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/hash.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/writer.h"

namespace vlx {
namespace {

namespace fs = std::filesystem;

const std::string kScene = VLX_TESTDATA "/scenes/interior.glb";
const std::string kDump = VLX_TESTDATA "/dumps/tungsten_cornell.exr";

using Arguments = std::vector<std::string>;

Arguments operator+(Arguments a, const Arguments& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

void expectDone(const std::string& tool, const Arguments& arguments) {
    const ToolRun run = runTool(tool, arguments);
    ASSERT_EQ(run.exitCode, 0) << tool << ": " << run.err;
}

void expectSameDump(const std::string& a, const std::string& b) {
    const DumpReader first(a), second(b);
    const Window window = first.header().data;
    ASSERT_EQ(second.header().data, window);
    EXPECT_EQ(second.header().display, first.header().display);
    EXPECT_EQ(second.header().extra, first.header().extra);
    EXPECT_EQ(second.header().seed, first.header().seed);
    EXPECT_EQ(second.header().samples, first.header().samples);
    const SampleBand x = first.read(window.y, window.height), y = second.read(window.y, window.height);
    EXPECT_EQ(x.offsets, y.offsets);
    EXPECT_EQ(x.values, y.values);
}

/// A picture of 23 rows, sampled hierarchically: the borders of three bands, at rows 7 and 15, cut regions of
/// 4 x 4 pixels that are refined as a whole.
class Bands : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        folder = std::make_unique<TemporaryFolder>();
        for (int i = 1; i <= 3; ++i) {
            bands.push_back(*folder / ("band" + std::to_string(i) + ".exr"));
            expectDone("vlx-trace",
                       picture + Arguments{"-o", bands.back(), "--band", std::to_string(i) + "/3"});
        }
    }
    static void TearDownTestSuite() { folder.reset(); }

    static ToolRun merge(const Arguments& parts, const std::string& output) {
        return runTool("vlx-pack", Arguments{"merge"} + parts + Arguments{"-o", output});
    }

    static inline std::unique_ptr<TemporaryFolder> folder;
    static inline Arguments bands;
    static inline const Arguments picture = {kScene, "--width",        "18",          "--height",
                                             "23",   "--hierarchical", "--tolerance", "0.3"};
};

const std::string kFinished = "is finished (same inputs and parameters), skipped";

TEST_F(Bands, MergedAreTheWholeAndCountAsIt) {
    const std::string whole = *folder / "whole.exr", merged = *folder / "merged.exr";
    EXPECT_EQ(DumpReader(bands[1]).header().data, (Window{0, 7, 18, 8}));
    expectDone("vlx-trace", picture + Arguments{"-o", whole});
    ASSERT_EQ(merge(bands, merged).exitCode, 0);
    expectSameDump(whole, merged);
    EXPECT_NE(merge(bands, merged).err.find(kFinished), std::string::npos);
    EXPECT_NE(runTool("vlx-trace", picture + Arguments{"-o", merged}).err.find(kFinished), std::string::npos);
    // A crop is not the whole.
    expectDone("vlx-pack", {"merge", "--crop", bands[0], "-o", merged, "--overwrite"});
    EXPECT_EQ(runTool("vlx-trace", picture + Arguments{"-o", merged}).err.find(kFinished), std::string::npos);
}

TEST_F(Bands, ThatDoNotMakeAPictureAreNamed) {
    const std::string out = *folder / "out.exr", other = *folder / "other.exr";
    ToolRun run = merge({bands[0], bands[2]}, out);
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find("no part holds rows 7 to 14"), std::string::npos) << run.err;
    // The same view and header, but other light: only the hash of the inputs tells.
    expectDone("vlx-trace", picture + Arguments{"-o", other, "--band", "2/3", "--max-bounces", "2"});
    run = merge({bands[0], other, bands[2]}, out);
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find(other + ": expected a band of the run"), std::string::npos) << run.err;
    EXPECT_FALSE(fs::exists(out));
}

TEST_F(Bands, WithoutACommonNumberOfSamplesAreBadUsage) {
    for (const Arguments& wrong : {Arguments{"--time", "1"}, {"--target-error", "0.1"}}) {
        const ToolRun run =
            runTool("vlx-trace", Arguments{kScene, "-o", *folder / "a.exr", "--band", "1/2"} + wrong);
        EXPECT_EQ(run.exitCode, 2);
        EXPECT_NE(run.err.find(wrong.front()), std::string::npos) << run.err;
    }
}

class Finished : public testing::Test {
  protected:
    /// Whether the run did its work, by the file that it would have replaced.
    bool works(const std::string& tool, const Arguments& arguments, const std::string& output) {
        const auto identity = [&] {
            return fs::exists(output) ? fs::last_write_time(output) : fs::file_time_type();
        };
        const auto before = identity();
        const ToolRun run = runTool(tool, arguments);
        EXPECT_EQ(run.exitCode, 0) << run.err;
        const bool said =
            run.err.find("is finished (same inputs and parameters), skipped") != std::string::npos;
        EXPECT_EQ(said, identity() == before) << run.err;
        return !said;
    }
    const TemporaryFolder folder;
};

TEST_F(Finished, TracesAreSkippedUntilSomethingChanges) {
    const std::string scene = folder / "room.glb", out = folder / "out.exr";
    fs::copy_file(kScene, scene);
    const Arguments command = {scene, "-o", out, "--width", "8", "--spp", "1"};
    EXPECT_TRUE(works("vlx-trace", command, out));
    EXPECT_FALSE(works("vlx-trace", command + Arguments{"--threads", "1", "--seed", "0"}, out)) << "defaults";
    EXPECT_TRUE(works("vlx-trace", command + Arguments{"--overwrite"}, out));
    EXPECT_TRUE(works("vlx-trace", command + Arguments{"--seed", "1"}, out));
    std::ofstream(scene, std::ios::app) << "    ";  // behind the end that its header states
    const Arguments changed = command + Arguments{"--seed", "1"};
    EXPECT_TRUE(works("vlx-trace", changed, out)) << "another input";
    const ToolRun run = runTool("vlx-trace", changed + Arguments{"-q", "--json"});
    EXPECT_EQ(run.err, "");
    EXPECT_NE(run.out.find("\"skipped\": true"), std::string::npos) << run.out;
}

// What counts is what the program does: a copy does the same, one that was built anew may not.
TEST_F(Finished, AnotherProgramDoesTheWorkAnew) {
    const std::string out = folder / "out.exr", copy = folder / "vlx-krige";
    const Arguments command = {kDump, "-o", out, "--method", "mean"};
    fs::copy_file(VLX_BIN "/vlx-krige", copy);
    EXPECT_TRUE(works("vlx-krige", command, out));
    EXPECT_FALSE(works(copy, command, out));
    std::ofstream(copy, std::ios::app) << "other code";
    EXPECT_TRUE(works(copy, command, out));
}

TEST_F(Finished, CommandsOfVlxPackToo) {
    const std::string out = folder / "out.exr", image = folder / "image.exr";
    Image flat({0, 0, 6, 5}, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    writeImage(image, flat);
    for (const Arguments& command : {Arguments{"stack", image, image, "-o", out},
                                     {"buffers", image, image, "-o", out},
                                     {"moments", image, "-o", out, "--variance-is", "mean"},
                                     {"sample", image, "-o", out},
                                     {"subset", kDump, "-o", out, "--samples", "2"},
                                     {"merge", kDump, "-o", out, "--crop"}}) {
        EXPECT_TRUE(works("vlx-pack", command, out)) << command.front();
        EXPECT_FALSE(works("vlx-pack", command, out)) << command.front();
        EXPECT_TRUE(works("vlx-pack", command + Arguments{"--overwrite"}, out)) << command.front();
    }
    flat.pixels.front() = 1;
    writeImage(image, flat);
    const Arguments stack = {"stack", image, image, "-o", out};
    EXPECT_TRUE(works("vlx-pack", stack, out));
    flat.pixels.front() = 2;
    writeImage(image, flat);
    EXPECT_TRUE(works("vlx-pack", stack, out)) << "another input";
}

TEST_F(Finished, ImagesNeedAllTheirOutputs) {
    const std::string out = folder / "out.exr", map = folder / "map.exr";
    const Arguments command = {kDump, "-o", out, "--method", "mean", "--sampling-map", map};
    EXPECT_TRUE(works("vlx-krige", command, out));
    EXPECT_FALSE(works("vlx-krige", command, out));
    fs::remove(map);
    EXPECT_TRUE(works("vlx-krige", command, out));
    // Scaled to the picture's mean: of bands it would be another map.
    const ToolRun band =
        runTool("vlx-krige", {kDump, "-o", out, "--sampling-map", map, "--band", "1/2", "--overwrite"});
    EXPECT_EQ(band.exitCode, 2);
    EXPECT_NE(band.err.find("--band goes without --sampling-map"), std::string::npos) << band.err;
    const Arguments paper = {kDump, "-o", out, "--method", "paper", "--diagnostics"};
    EXPECT_TRUE(works("vlx-krige", paper, out));
    fs::remove(out + ".json");
    EXPECT_TRUE(works("vlx-krige", paper, out));
}

TEST(Frames, AreMadeOneByOneAndAFailureLeavesTheOthers) {
    const TemporaryFolder folder;
    const Arguments trace = {kScene, "--width", "8", "--height", "6", "--spp", "1", "--seed", "3"};
    expectDone("vlx-trace", trace + Arguments{"-o", folder / "s_####.exr", "--frames", "2-4,12"});
    EXPECT_EQ(folder.entries(), 4);
    EXPECT_TRUE(fs::exists(folder / "s_0012.exr"));
    EXPECT_NE(DumpReader(folder / "s_0002.exr").header().seed,
              DumpReader(folder / "s_0003.exr").header().seed);
    // One frame alone is the same.
    expectDone("vlx-trace", trace + Arguments{"-o", folder / "t_##.exr", "--frames", "3"});
    expectSameDump(folder / "s_0003.exr", folder / "t_03.exr");

    std::ofstream(folder / "s_0003.exr") << "nothing";
    const ToolRun run =
        runTool("vlx-krige", {folder / "s_####.exr", "-o", folder / "k_####.exr", "--frames", "2-5"});
    EXPECT_EQ(run.exitCode, 1);
    EXPECT_NE(run.err.find("2 of 4 frames failed: 3, 5"), std::string::npos) << run.err;
    EXPECT_NE(run.err.find("frame 3: " + (folder / "s_0003.exr")), std::string::npos) << run.err;
    for (const char* name : {"k_0002.exr", "k_0004.exr"}) EXPECT_TRUE(fs::exists(folder / name)) << name;
    EXPECT_FALSE(fs::exists(folder / "k_0003.exr"));
}

TEST(Frames, WithoutAPlaceForTheirNumberAreBadUsage) {
    const TemporaryFolder folder;
    EXPECT_EQ(runTool("vlx-trace", {kScene, "-o", folder / "a.exr", "--frames", "1-2"}).exitCode, 2);
    EXPECT_EQ(runTool("vlx-krige", {kDump, "-o", folder / "a_####.exr", "--frames", "1-2"}).exitCode, 2);
    EXPECT_EQ(folder.entries(), 0);
}

/// A wide dump of `spp` samples a pixel.
void writeWide(const std::string& path, int width, int height, int spp) {
    DumpHeader header;
    header.data = header.display = {0, 0, width, height};
    header.channels = standardChannels();
    header.channels.pop_back();
    DumpWriter writer(path, header);
    for (int y = 0; y < height; ++y) {
        SampleBand band{0, y, width, 1, {0}, {}, {}};
        for (int x = 0; x < width; ++x)
            band.offsets.push_back(band.offsets.back() + static_cast<unsigned>(spp));
        for (std::size_t c = 0; c < header.channels.size(); ++c) {
            band.channels.push_back(header.channels[c].name);
            auto& values = band.values.emplace_back(band.samples());
            for (std::size_t i = 0; i < values.size(); ++i)
                values[i] = static_cast<float>(hashOf(i, c, y) >> 40) * 0x1p-24f;
        }
        writer.write(std::move(band));
    }
    writer.close();
}

struct Measured {
    int exitCode = -1;
    std::uint64_t peakBytes = 0;
};

/// vlx-krige, started and not waited for.
pid_t start(Arguments arguments, const std::string& errors) {
    const std::string program = std::string(VLX_BIN) + "/vlx-krige";
    arguments.insert(arguments.begin(), program);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    const pid_t child = ::fork();
    if (child != 0) return child;
    if (::freopen(errors.c_str(), "w", stderr) == nullptr) ::_exit(126);
    ::execv(program.c_str(), argv.data());
    ::_exit(127);
}

Measured finish(pid_t child) {
    int status = 0;
    rusage usage{};
    ::wait4(child, &status, 0, &usage);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, static_cast<std::uint64_t>(usage.ru_maxrss) * 1024};
}

#ifndef VARIOLUX_SANITIZED  // sanitizers take memory of their own
TEST(MaxMemory, IsKeptAndTheImageIsTheSame) {
    const TemporaryFolder folder;
    const std::string dump = folder / "wide.exr", errors = folder / "errors";
    writeWide(dump, 800, 16, 64);
    const Arguments command = {dump, "--quality", "draft", "--threads", "2", "-q"};
    const Measured free = finish(start(command + Arguments{"-o", folder / "free.exr"}, errors));
    ASSERT_EQ(free.exitCode, 0) << contentsOf(errors);
    // The least that would do is what the refusal says.
    const Measured refused =
        finish(start(command + Arguments{"-o", folder / "none.exr", "--max-memory", "20M"}, errors));
    EXPECT_EQ(refused.exitCode, 1);
    const std::string message = contentsOf(errors);
    const std::size_t at = message.find("at least ");
    ASSERT_NE(at, std::string::npos) << message;
    EXPECT_FALSE(fs::exists(folder / "none.exr"));
    const std::uint64_t least = std::stoull(message.substr(at + 9));
    const Measured tight = finish(
        start(command + Arguments{"-o", folder / "tight.exr", "--max-memory", std::to_string(least) + "M"},
              errors));
    ASSERT_EQ(tight.exitCode, 0) << contentsOf(errors);
    EXPECT_LE(tight.peakBytes, least * 1'000'000);
    EXPECT_LT(tight.peakBytes, free.peakBytes);
    EXPECT_LT(least * 1'000'000, free.peakBytes) << "no limit is refused that is kept without one";
    EXPECT_EQ(readImage(folder / "tight.exr").pixels, readImage(folder / "free.exr").pixels);
}

// What a small file claims takes no more than what is in it: of one row, no rows above and below are kept.
TEST(Memory, OfASingleWideRowIsThatOfTheRow) {
    const TemporaryFolder folder;
    const std::string dump = folder / "wide.exr", errors = folder / "errors";
    writeWide(dump, 60'000, 1, 0);
    const Measured run = finish(start({dump, "-o", folder / "out.exr", "-q"}, errors));
    ASSERT_EQ(run.exitCode, 0) << contentsOf(errors);
    EXPECT_LT(run.peakBytes, 400'000'000u);

    // A limit is kept also where it is too small: what cannot be is told before memory is taken.
    writeWide(dump, 20'000, 200, 0);
    const Measured refused = finish(start({dump, "-o", folder / "none.exr", "--max-memory", "400M"}, errors));
    EXPECT_EQ(refused.exitCode, 1);
    EXPECT_NE(contentsOf(errors).find("expected a memory limit of at least"), std::string::npos);
    EXPECT_LT(refused.peakBytes, 400'000'000u);
}

TEST(Load, ThirtyTwoProcessesAtOnceFinishWithinTheirLimits) {
    const TemporaryFolder folder;
    const std::string errors = folder / "errors";
    constexpr std::uint64_t kLimit = 250;
    const Arguments command = {kDump,       "--quality", "draft",        "-q",
                               "--threads", "2",         "--max-memory", std::to_string(kLimit) + "M"};
    std::vector<pid_t> children;
    for (int i = 0; i < 32; ++i)
        children.push_back(start(command + Arguments{"-o", folder / (std::to_string(i) + ".exr")}, errors));
    std::uint64_t sum = 0;
    for (const pid_t child : children) {
        const Measured one = finish(child);
        EXPECT_EQ(one.exitCode, 0) << contentsOf(errors);
        EXPECT_LE(one.peakBytes, kLimit * 1'000'000);
        sum += one.peakBytes;
    }
    EXPECT_LE(sum, 32 * kLimit * 1'000'000);
    const Image first = readImage(folder / "0.exr");
    for (int i = 1; i < 32; ++i)
        EXPECT_EQ(readImage(folder / (std::to_string(i) + ".exr")).pixels, first.pixels) << i;
}
#endif

/// A disk of 256 KB; root only.
class SmallDisk {
  public:
    explicit SmallDisk(std::string folder) : folder_(std::move(folder)) {
        fs::create_directory(folder_);
        mounted_ = ::mount("tmpfs", folder_.c_str(), "tmpfs", 0, "size=256k") == 0;
    }
    ~SmallDisk() {
        if (mounted_) ::umount2(folder_.c_str(), MNT_DETACH);
    }
    SmallDisk(const SmallDisk&) = delete;
    SmallDisk& operator=(const SmallDisk&) = delete;
    bool mounted() const { return mounted_; }

  private:
    std::string folder_;
    bool mounted_ = false;
};

// Full in the midst of the work.
TEST(FullDisk, IsSaidAndLeavesNothing) {
    const TemporaryFolder folder;
    const std::string disk = folder / "disk";
    const SmallDisk small(disk);
    if (!small.mounted()) GTEST_SKIP() << "needs root to mount a small disk";
    const Arguments trace = {kScene, "--width", "96", "--spp", "4", "-o", disk + "/a.exr"};
    Arguments stack = {"stack", "-o", disk + "/b.exr"};
    for (int i = 0; i < 4; ++i) {
        Image image({0, 0, 200, 200}, {"R", "G", "B"});
        for (std::size_t k = 0; k < image.pixels.size(); ++k)
            image.pixels[k] = static_cast<float>(k * 2654435761u % 1000003 + static_cast<std::size_t>(i));
        stack.push_back(folder / ("s" + std::to_string(i) + ".exr"));
        writeImage(stack.back(), image);
    }
    const std::string wide = folder / "wide.exr";
    writeWide(wide, 150, 150, 2);
    struct Job {
        std::string tool;
        Arguments arguments;
    };
    for (const Job& job : {Job{"vlx-trace", trace},
                           {"vlx-pack", stack},
                           {"vlx-krige", {wide, "--method", "mean", "-o", disk + "/c.exr"}},
                           {"vlx-pack", {"merge", wide, "-o", disk + "/d.exr"}}}) {
        const ToolRun run = runTool(job.tool, job.arguments);
        EXPECT_EQ(run.exitCode, 1) << job.tool << run.err;
        EXPECT_NE(run.err.find(disk), std::string::npos) << run.err;
        EXPECT_TRUE(fs::is_empty(disk)) << job.tool << " left something";
    }
}

// The dump becomes another one while it is kriged: cut short in place, as careless copies do, or replaced.
TEST(Replaced, DumpsAreAnErrorAndNoImage) {
    const TemporaryFolder folder;
    const std::string dump = folder / "wide.exr", errors = folder / "errors", out = folder / "out.exr";
    for (const bool cut : {true, false}) {
        writeWide(dump, 200, 120, 4);
        const pid_t child = start({dump, "-o", out, "--quality", "draft", "--threads", "1", "-q"}, errors);
        // Its image is begun: the dump is open.
        for (int i = 0; i < 3000 && folder.entries() < 3; ++i)
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        std::this_thread::sleep_for(std::chrono::milliseconds(50));
        if (cut)
            fs::resize_file(dump, 5000);
        else
            writeWide(dump, 200, 120, 1);
        EXPECT_EQ(finish(child).exitCode, 1);
        EXPECT_NE(contentsOf(errors).find(dump), std::string::npos) << contentsOf(errors);
        if (!cut) {
            EXPECT_NE(contentsOf(errors).find("changed while it was read"), std::string::npos)
                << contentsOf(errors);
        }
        EXPECT_FALSE(fs::exists(out));
    }
}

}  // namespace
}  // namespace vlx
