// What vlx-krige says about options and inputs that are not what they seem.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <random>

#include "run_tool.h"
#include "temporary_folder.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/writer.h"

namespace vlx {
namespace {

namespace fs = std::filesystem;

const std::string kDump = VLX_TESTDATA "/dumps/tungsten_cornell.exr";

class Input : public testing::Test {
  protected:
    using Arguments = std::vector<std::string>;

    ToolRun krige(Arguments arguments) const {
        arguments.insert(arguments.end(), {"-o", folder / "out.exr", "--overwrite"});
        return runTool("vlx-krige", arguments);
    }
    void ends(const Arguments& arguments, int code, const std::string& text) const {
        const ToolRun run = krige(arguments);
        std::string line;
        for (const std::string& argument : arguments) line += " " + argument;
        EXPECT_EQ(run.exitCode, code) << line << "\n" << run.err;
        EXPECT_NE(run.err.find(text), std::string::npos) << line << "\n" << run.err;
        EXPECT_EQ(fs::exists(folder / "out.exr"), code == 0) << line;
        fs::remove(folder / "out.exr");
    }

    const TemporaryFolder folder;
};

// Every option with every method: read, or named as bad usage, together with the methods that read it.
TEST_F(Input, OptionsThatTheMethodDoesNotReadAreBadUsage) {
    const std::vector<std::pair<Arguments, std::string>> options = {
        {{"--quality", "draft"}, "krige"},
        {{"--fireflies", "keep"}, "krige"},
        {{"--fireflies", "clamp", "--clamp", "10"}, "krige"},
        {{"--strength", "0.5"}, "krige"},
        {{"--feature", "N.X", "--no-features"}, "krige"},
        {{"--radiance", "albedo"}, "krige"},
        {{"--scale", "2"}, "krige"},
        {{"--filter", "box"}, "krige"},
        {{"--band", "1/2"}, "krige"},
        {{"--no-features"}, "krige"},
        {{"--max-memory", "4G"}, "krige"},
        {{"--sampling-map", folder / "map.exr"}, "krige paper mean"},
        {{"--sigma", "2"}, "gaussian"},
        {{"--region", "8"}, "paper"},
        {{"--whole-image"}, "paper"},
        {{"--no-colour-distance"}, "paper"},
        {{"--diagnostics"}, "krige paper"},
        {{"--diagnostics", "--inspect", "101,121"}, "krige paper"},
        {{"--positions", "raster"}, "paper"}};
    for (const std::string method : {"krige", "paper", "mean", "gaussian"})
        for (const auto& [given, readers] : options) {
            if (readers.find(method) != std::string::npos) continue;
            Arguments arguments = {kDump, "--method", method};
            arguments.insert(arguments.end(), given.begin(), given.end());
            ends(arguments, 2, given.front() + " goes with --");
        }
    const std::string map = folder / "map.exr";
    for (const Arguments& read : {Arguments{"krige",
                                            "--quality",
                                            "draft",
                                            "--fireflies",
                                            "clamp",
                                            "--clamp",
                                            "10",
                                            "--strength",
                                            "0.5",
                                            "--no-features",
                                            "--feature",
                                            "N.X",
                                            "--radiance",
                                            "albedo",
                                            "--scale",
                                            "2",
                                            "--filter",
                                            "gaussian",
                                            "--positions",
                                            "raster",
                                            "--sampling-map",
                                            map},
                                  {"krige", "--band", "1/2", "--max-memory", "4G", "--layers-are-samples"},
                                  {"krige", "--diagnostics", "--inspect", "101,121"},
                                  {"paper", "--region", "8", "--no-colour-distance", "--diagnostics",
                                   "--inspect", "101,121", "--positions", "raster", "--sampling-map", map},
                                  {"paper", "--whole-image"},
                                  {"mean", "--sampling-map", map, "--json"},
                                  {"gaussian", "--sigma", "2", "--threads", "1"}}) {
        Arguments arguments = {kDump, "--method"};
        arguments.insert(arguments.end(), read.begin(), read.end());
        ends(arguments, 0, "");
    }
    ends({kDump, "--method", "paper", "--quality", "high"}, 2, "--quality goes with --method krige");
    ends({kDump, "--method", "gaussian", "--sampling-map", folder / "map.exr"}, 2,
         "--sampling-map goes with --method krige, --method paper or --method mean");
    ends({kDump, "--clamp", "3"}, 2, "--clamp goes with --fireflies clamp");
    ends({kDump, "--method", "paper", "--inspect", "101,121"}, 2, "--inspect goes with --diagnostics");
    ends({kDump, "--template", kDump, "--drop-layers"}, 2, "--template");
    ends({kDump, "--json", "--log", "openjd"}, 2, "both write standard output");
}

TEST_F(Input, OneFileUnderTwoNamesIsNoTwoOutputs) {
    const std::string out = folder / "out.exr";
    fs::copy_file(kDump, folder / "dump.exr");
    fs::create_hard_link(folder / "dump.exr", folder / "hard.exr");
    fs::create_symlink("out.exr", folder / "soft.exr");
    fs::create_symlink(folder / ".", folder / "here");
    for (const char* map : {"./out.exr", "soft.exr", "here/out.exr"})
        ends({kDump, "--sampling-map", folder / map}, 2,
             "--sampling-map: expected another file than that of --output");
    ends({folder / "dump.exr", "--sampling-map", folder / "hard.exr"}, 2,
         "expected another file than the input");
    fs::create_symlink("out.exr.json", folder / "json.exr");
    ends({kDump, "--method", "paper", "--diagnostics", "--sampling-map", folder / "json.exr"}, 2,
         "--diagnostics");
    // Input and output.
    for (const char* name : {"hard.exr", "here/dump.exr"}) {
        const ToolRun run = runTool("vlx-krige", {folder / "dump.exr", "-o", folder / name});
        EXPECT_EQ(run.exitCode, 2) << name;
        EXPECT_NE(run.err.find("expected another file than the input"), std::string::npos) << run.err;
    }
    EXPECT_EQ(fs::file_size(folder / "dump.exr"), fs::file_size(kDump));
}

TEST_F(Input, InspectedPixelsAreInThePicture) {
    for (const char* pixel : {"0,0", "100,140", "99,120", "2000000000,-5"})
        ends({kDump, "--method", "paper", "--diagnostics", "--inspect", pixel}, 2,
             "--inspect: expected a pixel of the picture, columns 100 to 119 and rows 120 to 139, found " +
                 std::string(pixel));
}

// 16 x 16 pixels of 4 samples.
void writeSamples(const std::string& path, const std::vector<std::string>& further,
                  const std::function<std::vector<float>(int x, int y, int s, float u, float v)>& valuesOf) {
    std::mt19937 random(1);
    std::uniform_real_distribution<float> unit;
    DumpHeader header;
    header.data = header.display = {0, 0, 16, 16};
    SampleBand band{0, 0, 16, 16, {0}, {"R", "G", "B"}, {}};
    band.channels.insert(band.channels.end(), further.begin(), further.end());
    for (const std::string& channel : band.channels) header.channels.push_back({channel});
    band.values.resize(band.channels.size());
    for (int p = 0; p < 256; ++p) {
        for (int s = 0; s < 4; ++s) {
            for (std::size_t c = 0; c < 3; ++c) band.values[c].push_back(unit(random));
            const float u = unit(random), v = unit(random);
            const std::vector<float> values = valuesOf(p % 16, p / 16, s, u, v);
            for (std::size_t c = 0; c < values.size(); ++c) band.values[3 + c].push_back(values[c]);
        }
        band.offsets.push_back(band.values[0].size());
    }
    DumpWriter writer(path, header);
    writer.write(std::move(band));
    writer.close();
}

TEST_F(Input, PositionsElsewhereAreToldWhereTheyAreUsed) {
    const std::string relative = folder / "relative.exr", right = folder / "right.exr";
    writeSamples(relative, {"sample.x", "sample.y"}, [](int, int, int, float u, float v) {
        return std::vector<float>{u, v};
    });
    writeSamples(right, {"sample.x", "sample.y"}, [](int x, int y, int, float u, float v) {
        return std::vector<float>{static_cast<float>(x) + u, static_cast<float>(y) + v};
    });
    for (const Arguments& uses : {Arguments{"--scale", "2"},
                                  {"--method", "paper"},
                                  {"--filter", "gaussian"},
                                  {"--scale", "2", "--json"}}) {
        Arguments arguments = {relative};
        arguments.insert(arguments.end(), uses.begin(), uses.end());
        ends(arguments, 0,
             "relative.exr: WARNING: positions of 1020 samples (99.6 %) lie outside their pixels");
        ends(arguments, 0, "they look relative to the pixel, 0 to 1");
        arguments.front() = right;
        EXPECT_EQ(krige(arguments).err.find("positions"), std::string::npos) << uses.front();
    }
    EXPECT_EQ(krige({relative}).err.find("positions"), std::string::npos) << "nothing uses them";
    // Said what they are, they are the same samples.
    const ToolRun said = krige({relative, "--scale", "2", "--positions", "relative"});
    EXPECT_EQ(said.err.find("positions"), std::string::npos) << said.err;
    const Image repaired = readImage(folder / "out.exr");
    krige({right, "--scale", "2"});
    EXPECT_EQ(repaired.pixels, readImage(folder / "out.exr").pixels);
    fs::remove(folder / "out.exr");
    ends({kDump, "--scale", "2", "--positions", "polar"}, 2, "--positions: expected one of raster|");
    writeSamples(folder / "none.exr", {}, [](int, int, int, float, float) { return std::vector<float>{}; });
    ends({folder / "none.exr", "--scale", "2"}, 1, "--scale");
}

TEST_F(Input, LayersAreNotAveraged) {
    const std::string layered = folder / "layered.exr";
    writeSamples(layered, {"A", "Z", "ZBack"}, [](int, int, int s, float u, float) {
        const float z = static_cast<float>(s) + u;
        return std::vector<float>{s == 3 ? 1.f : 0.5f, z, z + 0.1f};
    });
    ends({layered}, 1,
         "layered.exr: expected samples of the camera, found layers to be composited (channel ZBack");
    ends({layered, "--method", "mean"}, 1, "--layers-are-samples");
    EXPECT_EQ(krige({layered, "--layers-are-samples"}).exitCode, 0);
    fs::remove(folder / "out.exr");
    writeSamples(layered, {"A", "Z"}, [](int, int, int s, float u, float) {
        return std::vector<float>{s == 3 ? 1.f : 0.5f, static_cast<float>(s) + u};
    });
    ends({layered}, 1, "Z that grows from sample to sample");
}

TEST_F(Input, MessagesNameTheOptionThatHelps) {
    const auto write = [&](const char* name, const std::vector<std::string>& channels) {
        Image image({0, 0, 12, 9}, channels);
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            image.pixels[i] = 0.1f + 0.01f * static_cast<float>(i * 7919 % 13);
        writeImage(folder / name, image);
        return folder / name;
    };
    const std::string arnold = write("arnold.exr", {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    ends({arnold}, 1, "taken for Arnold's (--preset arnold)");
    ends({arnold}, 1, "(--samples N)");
    ends({arnold}, 1, "(--variance-is mean)");
    ends({arnold, "--samples", "4"}, 0, "");
    ends({arnold, "--variance-is", "mean"}, 0, "taken for Arnold's");
    ends({arnold, "--variance-is", "mean", "--map", "R=2*G"}, 2, "--map: expected R without a factor");
    ends({arnold, "--variance-is", "mean", "--map", "R=2*G", "--drop-layers"}, 0, "");
    const std::string unknown = write("unknown.exr", {"R", "G", "B", "var.R", "var.G", "var.B"});
    ends({unknown}, 1, "--variance-is sample, mean or second-moment");
    ends({write("depth.exr", {"Z"})}, 1, "--map R=CHANNEL");
    ends({write("plain.exr", {"R", "G", "B"})}, 1, "--map variance.R=CHANNEL");

    const std::string alone = write("alone.exr", {"Y"});
    ends({alone}, 1, "--map variance.R=CHANNEL, .G and .B likewise, of luminance one for all three");
    EXPECT_NE(
        runTool("vlx-pack", {"bcd", alone, alone, "-o", folder / "bcd.exr"}).err.find("vlx-pack moments"),
        std::string::npos);

    // Of one colour, by itself and with the mapping that was asked for.
    const std::string luminance = write("luminance.exr", {"Y", "variance.Y"});
    Arguments mapped = {luminance, "--variance-is", "mean"};
    ends(mapped, 0, "R from Y");
    krige(mapped);
    const Image byItself = readImage(folder / "out.exr");
    for (const std::string c : {"R", "G", "B"})
        mapped.insert(mapped.end(), {"--map", c + "=Y", "--map", "variance." + c + "=variance.Y"});
    ends(mapped, 0, "with Y denoised");
    krige(mapped);
    const Image image = readImage(folder / "out.exr");
    EXPECT_EQ(image.pixels, byItself.pixels);
    for (const char* channel : {"Y", "variance.Y", "stddev.R"})
        EXPECT_GE(image.channel(channel), 0) << channel;
    EXPECT_EQ(image.channel("R"), -1) << "a luminance image as before";
    const Image before = readImage(luminance);
    int changed = 0;
    for (int row = 0; row < 9; ++row)
        for (int col = 0; col < 12; ++col)
            changed += image.at(col, row)[image.channel("Y")] != before.at(col, row)[before.channel("Y")];
    EXPECT_GT(changed, 50);
    mapped.push_back("--drop-layers");
    krige(mapped);
    EXPECT_GE(readImage(folder / "out.exr").channel("R"), 0);
}

TEST_F(Input, ReplicatesThatAreNoNumbersAreRefused) {
    writeSamples(folder / "nan.exr", {"sample.replicate"}, [](int x, int y, int s, float, float) {
        return std::vector<float>{x == 3 && y == 9 ? -1.f : static_cast<float>(s)};
    });
    ends({folder / "nan.exr"}, 1,
         "expected whole numbers from 0 to 2^32-1 in channel sample.replicate, found -1.000000 in pixel (3, "
         "9)");
}

TEST_F(Input, RadianceWhoseSquaresAreNoFloatsIsRefused) {
    DumpHeader header;
    header.data = header.display = {0, 0, 12, 9};
    header.channels = {{"R"}, {"G"}, {"B"}};
    SampleBand band{0, 0, 12, 9, {0}, {"R", "G", "B"}, {}};
    band.values.assign(3, std::vector<float>(4 * 12 * 9, 1e20f));
    for (std::size_t p = 1; p <= 12 * 9; ++p) band.offsets.push_back(4 * p);
    DumpWriter writer(folder / "bright.exr", header);
    writer.write(band);
    writer.close();
    ends({folder / "bright.exr"}, 1, "expected radiance up to 2^50");
    ends({folder / "bright.exr", "--method", "mean"}, 0, "");
    Image image({0, 0, 12, 9}, {"R", "G", "B", "variance.R", "variance.G", "variance.B"});
    std::fill(image.pixels.begin(), image.pixels.end(), 1e18f);
    writeImage(folder / "flat.exr", image);
    std::vector<std::string> flat = {folder / "flat.exr", "--variance-is", "mean", "--drop-layers"};
    ends(flat, 1, "--map R=1e-12*R (G, B likewise, variance.R=1e-24*variance.R)");
    for (const char* c : {"R", "G", "B"}) {
        flat.insert(flat.end(), {"--map", std::string(c) + "=1e-12*" + c});
        flat.insert(flat.end(), {"--map", std::string("variance.") + c + "=1e-24*variance." + c});
    }
    ends(flat, 0, "");
}

}  // namespace
}  // namespace vlx
