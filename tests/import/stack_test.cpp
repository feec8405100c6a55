#include "import/stack.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kStacked{4, -3, 7, 41};

// Value of a channel of image `image` in a pixel: all different, exact in half.
float valueOf(int image, int channel, int col, int row) {
    return static_cast<float>((image * 5 + channel * 11 + col * 3 + row) % 64) / 8.0f;
}

std::vector<std::string> writeImages(const TemporaryFolder& folder, int count,
                                     const std::vector<std::string>& channels) {
    std::vector<std::string> paths;
    for (int i = 0; i < count; ++i) {
        Image image(kStacked, channels);
        image.display = {0, 0, 20, 50};
        for (int row = 0; row < kStacked.height; ++row)
            for (int col = 0; col < kStacked.width; ++col)
                for (int c = 0; c < image.channelCount(); ++c)
                    image.at(col, row)[c] = valueOf(i, c, col, row);
        ImageWriteOptions options;
        options.attributes["Software"] = "Some Renderer 1.0";
        paths.push_back(folder / ("s" + std::to_string(i) + ".exr"));
        writeImage(paths.back(), image, options);
    }
    return paths;
}

const std::vector<std::string> kCycles = {
    "L.Combined.R",         "L.Combined.G",         "L.Combined.B",         "L.Combined.A",
    "L.Denoising Albedo.R", "L.Denoising Albedo.G", "L.Denoising Albedo.B", "L.Denoising Depth.Z",
    "L.Denoising Normal.X", "L.Denoising Normal.Y", "L.Denoising Normal.Z", "L.Mist.Z",
    "M.Combined.R"};

TEST(Stack, CyclesImagesBecomeSamples) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder, 5, kCycles);
    const ImportReport report = stackImages(images, folder / "dump.exr", {});

    const DumpReader reader(folder / "dump.exr");
    EXPECT_EQ(reader.header().data, kStacked);
    EXPECT_EQ(reader.header().display, (Window{0, 0, 20, 50}));
    EXPECT_EQ(reader.header().renderer, "Some Renderer 1.0");
    EXPECT_EQ(reader.header().samples, 5.0);
    const std::vector<std::string> names = {"R",        "G", "B",   "A",   "albedo.R", "albedo.G",
                                            "albedo.B", "Z", "N.X", "N.Y", "N.Z",      "sample.replicate"};
    EXPECT_EQ(reader.header().channels.size(), names.size());
    const SampleBand band = reader.read(kStacked.y, kStacked.height, names);
    ASSERT_EQ(band.samples(), band.pixels() * 5);
    for (std::size_t p = 0; p < band.pixels(); ++p)
        for (std::size_t i = 0; i < 5; ++i) {
            ASSERT_EQ(band.offsets[p], p * 5);
            const int col = static_cast<int>(p) % kStacked.width, row = static_cast<int>(p) / kStacked.width;
            for (std::size_t c = 0; c < 11; ++c)
                ASSERT_EQ(band.values[c][p * 5 + i],
                          valueOf(static_cast<int>(i), static_cast<int>(c), col, row));
            ASSERT_EQ(band.values[11][p * 5 + i], static_cast<float>(i));
        }
    EXPECT_EQ(report.mapped.at("R"), "L.Combined.R");
    EXPECT_EQ(report.mapped.at("Z"), "L.Denoising Depth.Z");
    EXPECT_EQ(report.ignored, (std::vector<std::string>{"L.Mist.Z", "M.Combined.R"}));
}

TEST(Stack, CyclesVectorsBecomeMotion) {
    const TemporaryFolder folder;
    std::vector<std::string> channels = kCycles;
    for (const char* c : {"X", "Y", "Z", "W"}) channels.push_back(std::string("L.Vector.") + c);
    const auto images = writeImages(folder, 3, channels);
    const ImportReport report = stackImages(images, folder / "dump.exr", {});
    EXPECT_EQ(report.mapped.at("motion.y"), "-1*L.Vector.Y");
    EXPECT_EQ(report.ignored, (std::vector<std::string>{"L.Mist.Z", "M.Combined.R"}));
    const SampleBand band =
        DumpReader(folder / "dump.exr")
            .read(kStacked.y, 1, {"motion.x", "motion.y", "motionNext.x", "motionNext.y"});
    const float signs[] = {1, -1, -1, 1};
    for (std::size_t s = 0; s < band.samples(); ++s)
        for (std::size_t k = 0; k < 4; ++k)
            ASSERT_EQ(band.values[k][s], signs[k] * valueOf(static_cast<int>(s % 3), 13 + static_cast<int>(k),
                                                            static_cast<int>(s / 3), 0));
}

TEST(Stack, MotionOfWhatCyclesDidNotHitIsNotKnown) {
    const TemporaryFolder folder;
    const std::vector<std::string> channels = {"L.Combined.R", "L.Combined.G", "L.Combined.B", "L.Depth.Z",
                                               "L.Vector.X",   "L.Vector.Y",   "L.Vector.Z",   "L.Vector.W"};
    std::vector<std::string> images;
    // Sky; a pane before the sky, which has no depth but moves; a wall that stands still.
    for (const auto& [z, x] : {std::pair{1e10f, 0.0f}, {0.0f, 2.0f}, {3.0f, 0.0f}}) {
        Image image({0, 0, 1, 1}, channels);
        image.at(0, 0)[3] = z;
        image.at(0, 0)[4] = x;
        images.push_back(folder / ("z" + std::to_string(images.size()) + ".exr"));
        writeImage(images.back(), image);
    }
    const ImportReport report = stackImages(images, folder / "dump.exr", {});
    const SampleBand band = DumpReader(folder / "dump.exr").read(0, 1, {"motion.x", "motionNext.y"});
    for (const auto& values : band.values) {
        EXPECT_TRUE(std::isnan(values[0]));
        EXPECT_FALSE(std::isnan(values[1]));
        EXPECT_EQ(values[2], 0);
    }
    EXPECT_EQ(band.values[0][1], 2);
    EXPECT_TRUE(std::any_of(report.notes.begin(), report.notes.end(), [](const std::string& note) {
        return note.starts_with("The motion of 1 samples is not known");
    }));
}

TEST(Stack, AFactorScalesWhatIsMapped) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder, 2, {"R", "G", "B", "flow.x", "flow.y", "2*flow.x"});
    StackOptions options;
    options.map = {{"motion.x", "-0.5*flow.x"}, {"motion.y", "-1*flow.y"}, {"same", "2*flow.x"}};
    const ImportReport report = stackImages(images, folder / "dump.exr", options);
    EXPECT_EQ(report.mapped.at("motion.x"), "-0.5*flow.x");
    EXPECT_TRUE(report.ignored.empty());
    const SampleBand band =
        DumpReader(folder / "dump.exr").read(kStacked.y, 1, {"motion.x", "motion.y", "same"});
    for (std::size_t s = 0; s < band.samples(); ++s) {
        const int image = static_cast<int>(s % 2), col = static_cast<int>(s / 2);
        ASSERT_EQ(band.values[0][s], -0.5f * valueOf(image, 3, col, 0));
        ASSERT_EQ(band.values[1][s], -valueOf(image, 4, col, 0));
        ASSERT_EQ(band.values[2][s], valueOf(image, 5, col, 0));  // a channel of this very name
    }
    options.map = {{"motion.x", "-1*wind"}};
    EXPECT_NE(errorOf([&] {
                  stackImages(images, folder / "dump.exr", options);
              }).find("expected a channel wind, found R, G, B"),
              std::string::npos);
}

TEST(Stack, MotionIsThereWholeOrNotAtAll) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder, 2, {"R", "G", "B", "motion.x", "motion.y"});
    const ImportReport report = stackImages(images, folder / "dump.exr", {});
    const SampleBand band =
        DumpReader(folder / "dump.exr")
            .read(kStacked.y, 1, {"motion.x", "motion.y", "motionNext.x", "motionNext.y"});
    for (std::size_t s = 0; s < band.samples(); ++s) {
        ASSERT_EQ(band.values[0][s], valueOf(static_cast<int>(s % 2), 3, static_cast<int>(s / 2), 0));
        ASSERT_TRUE(std::isnan(band.values[2][s]) && std::isnan(band.values[3][s]));
    }
    EXPECT_TRUE(std::any_of(report.notes.begin(), report.notes.end(), [](const std::string& note) {
        return note.starts_with("The images say nothing about motionNext.x, motionNext.y");
    }));
}

TEST(Stack, MapGoesBeforeThePreset) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder, 2, kCycles);
    StackOptions options;
    options.map = {{"R", "L.Mist.Z"}, {"fog", "L.Mist.Z"}};
    options.renderer = "mine";
    options.compression = DumpCompression::Rle;
    stackImages(images, folder / "dump.exr", options);
    const DumpReader reader(folder / "dump.exr");
    EXPECT_EQ(reader.header().renderer, "mine");
    EXPECT_EQ(reader.header().compression, DumpCompression::Rle);
    const SampleBand band = reader.read(kStacked.y, 1, {"R", "fog", "G"});
    EXPECT_EQ(band.values[0][1], valueOf(1, 11, 0, 0));
    EXPECT_EQ(band.values[1][1], valueOf(1, 11, 0, 0));
    EXPECT_EQ(band.values[2][1], valueOf(1, 1, 0, 0));
}

TEST(Stack, PlainNames) {
    const TemporaryFolder folder;
    const auto images = writeImages(folder, 3, {"R", "G", "B", "N.X", "sample.x", "sample.y", "other"});
    const ImportReport report = stackImages(images, folder / "dump.exr", {});
    EXPECT_EQ(report.mapped.size(), 6u);
    EXPECT_EQ(report.ignored, std::vector<std::string>{"other"});
    const SampleBand band = DumpReader(folder / "dump.exr").read(kStacked.y + 40, 1, {"sample.y"});
    EXPECT_EQ(band.values[0][2], valueOf(2, 5, 0, 40));
}

TEST(Stack, DepthOfMissesBecomesZero) {
    const TemporaryFolder folder;
    std::vector<std::string> images;
    const float infinity = std::numeric_limits<float>::infinity();
    for (const float z : {1e10f, infinity, NAN, -1.0f, 3.5f, 0.0f}) {
        Image image({0, 0, 1, 1}, {"R", "G", "B", "A", "Z"});
        image.at(0, 0)[3] = 0.5f;
        image.at(0, 0)[4] = z;
        images.push_back(folder / ("z" + std::to_string(images.size()) + ".exr"));
        writeImage(images.back(), image);
    }
    const ImportReport report = stackImages(images, folder / "dump.exr", {});
    const SampleBand band = DumpReader(folder / "dump.exr").read(0, 1, {"Z", "A"});
    EXPECT_EQ(band.values[0], (std::vector<float>{0, 0, 0, 0, 3.5f, 0}));
    EXPECT_EQ(band.values[1], std::vector<float>(6, 0.5f));
    bool told = false;
    for (const auto& note : report.notes)
        told = told || note.find("4 samples had a depth") != std::string::npos;
    EXPECT_TRUE(told);
}

TEST(Stack, TellsOfIdenticalImages) {
    const TemporaryFolder folder;
    auto images = writeImages(folder, 3, {"R", "G", "B"});
    const auto warned = [&] {
        for (const auto& note : stackImages(images, folder / "dump.exr", {}).notes)
            if (note.find("identical") != std::string::npos) return true;
        return false;
    };
    EXPECT_FALSE(warned());
    images.push_back(images[1]);
    EXPECT_TRUE(warned());
}

TEST(Stack, ManyImages) {
    const TemporaryFolder folder;
    const auto few = writeImages(folder, 4, {"R", "G", "B"});
    std::vector<std::string> images;
    for (int i = 0; i < 230; ++i) images.push_back(few[static_cast<std::size_t>(i % 4)]);
    stackImages(images, folder / "dump.exr", {});
    const SampleBand band =
        DumpReader(folder / "dump.exr").read(kStacked.y + 40, 1, {"G", "sample.replicate"});
    ASSERT_EQ(band.samples(), 230u * 7u);
    EXPECT_EQ(band.values[0][229], valueOf(229 % 4, 1, 0, 40));
    EXPECT_EQ(band.values[1][229], 229.0f);
}

TEST(Stack, MisfitsAreErrorsThatNameTheFile) {
    const TemporaryFolder folder;
    auto images = writeImages(folder, 2, kCycles);
    const auto message = [&](const StackOptions& options) {
        return errorOf([&] { stackImages(images, folder / "dump.exr", options); });
    };
    const auto expectIn = [&](const std::string& text, const StackOptions& options) {
        const std::string found = message(options);
        EXPECT_NE(found.find(text), std::string::npos) << found;
        EXPECT_EQ(folder.entries(), static_cast<int>(std::min<std::size_t>(images.size(), 3)));
    };
    expectIn("s0.exr: found nothing to take as R", {StackPreset::Plain, {}, {}, {}});
    expectIn("no such channel", {StackPreset::Auto, {{"R", "no such channel"}}, {}, {}});
    expectIn("sample.replicate cannot be mapped",
             {StackPreset::Auto, {{"sample.replicate", "L.Mist.Z"}}, {}, {}});

    Image other({0, 0, 7, 41}, kCycles);
    images.push_back(folder / "other.exr");
    writeImage(images.back(), other);
    expectIn("other.exr: expected the windows of the first image", {});
    writeImage(images.back(), Image(kStacked, {"L.Combined.R"}));
    images.back() = folder / "missing.exr";
    expectIn("missing.exr: expected an image, found no such file", {});
    images.clear();
    EXPECT_NE(message({}), "");

    const auto plain = writeImages(folder, 2, {"R", "G", "B"});
    EXPECT_NE(errorOf([&] {
                  stackImages(plain, folder / "d.exr", {StackPreset::Cycles, {}, {}, {}});
              })
                  .find("expected a channel L.Combined.R of some layer L, as --preset cycles says, found the "
                        "layers R, G, B"),
              std::string::npos);
}

TEST(Stack, ADumpIsNotAnImage) {
    const TemporaryFolder folder;
    EXPECT_NE(errorOf([&] {
                  stackImages({VLX_TESTDATA "/dumps/tungsten_cornell.exr"}, folder / "d.exr", {});
              }).find("deep"),
              std::string::npos);
    EXPECT_EQ(folder.entries(), 0);
}

TEST(Stack, LayersOfRadianceAreKept) {
    const TemporaryFolder folder;
    std::vector<std::string> channels = kCycles;
    for (const char* c : {"R", "G", "B", "A"}) channels.push_back(std::string("L.DiffDir.") + c);
    const auto images = writeImages(folder, 3, channels);
    StackOptions options;
    options.radiance = {"L.DiffDir", "M.Combined.R"};
    const ImportReport report = stackImages(images, folder / "dump.exr", options);
    EXPECT_EQ(report.ignored, (std::vector<std::string>{"L.DiffDir.A", "L.Mist.Z"}));
    const SampleBand band =
        DumpReader(folder / "dump.exr").read(kStacked.y, 1, {"L.DiffDir.G", "M.Combined.R"});
    for (std::size_t i = 0; i < band.samples(); ++i) {
        const int image = static_cast<int>(i % 3), col = static_cast<int>(i / 3);
        ASSERT_EQ(band.values[0][i], valueOf(image, 14, col, 0));
        ASSERT_EQ(band.values[1][i], valueOf(image, 12, col, 0));
    }
    options.radiance = {"L.GlossDir"};
    EXPECT_NE(errorOf([&] {
                  stackImages(images, folder / "dump.exr", options);
              }).find("layer L.GlossDir for --radiance, found L.Combined.R"),
              std::string::npos);
}

}  // namespace
}  // namespace vlx
