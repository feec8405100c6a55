#include "variolux/base/image_io.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "base/image_library.h"
#include "temporary_folder.h"
#include "variolux/base/error.h"

namespace vlx {
namespace {

TEST(ImageIo, ExrKeepsValuesWindowsAndChannelNames) {
    const TemporaryFolder folder;
    Image image(Window{-3, 5, 7, 4}, {"R", "G", "B", "stddev.R"});
    image.display = Window{0, 0, 20, 10};
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = 1e-3f * static_cast<float>(i) - 0.01f;
    writeImage(folder / "a.exr", image);
    const Image back = readImage(folder / "a.exr");
    EXPECT_EQ(back.data, image.data);
    EXPECT_EQ(back.display, image.display);
    EXPECT_EQ(back.channels, image.channels);
    EXPECT_EQ(back.pixels, image.pixels);
    EXPECT_EQ(folder.entries(), 1);
}

TEST(ImageIo, CompressionIsKeptUnderEveryNameOfOpenExr) {
    const TemporaryFolder folder;
    const Image image(Window{0, 0, 7, 4}, {"R", "G", "B"});
    ImageWriteOptions options;
    options.compression = "rle";
    for (const std::string name : {"a.exr", "a.EXR", "a.sxr", "a.mxr"}) {
        writeImage(folder / name, image, options);
        std::string fault;
        const auto file = imageLibrary().open(folder / name, fault);
        ASSERT_TRUE(file) << fault;
        EXPECT_EQ(file->info().text("compression"), "rle") << name;
    }
}

TEST(ImageIo, PngStoresValuesAsTheyAre) {
    const TemporaryFolder folder;
    Image image(Window{0, 0, 2, 1}, {"R", "G", "B"});
    image.pixels = {0.0f, 0.5f, 1.0f, 2.0f, -1.0f, 0.25f};
    writeImage(folder / "a.png", image);
    const Image back = readImage(folder / "a.png");
    const std::vector<float> expected = {0.0f, 0.5f, 1.0f, 1.0f, 0.0f, 0.25f};
    for (std::size_t i = 0; i < expected.size(); ++i)
        EXPECT_NEAR(back.pixels[i], expected[i], 0.5f / 255 + 1e-6f);
}

TEST(ImageIo, OtherFormatsArriveWhole) {
    const TemporaryFolder folder;
    Image image(Window{0, 0, 40, 30}, {"R", "G", "B"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i) image.pixels[i] = static_cast<float>(i % 200) / 255;
    for (const std::string name : {"a.png", "a.tif", "a.hdr", "a.ppm", "a.bmp"}) {
        writeImage(folder / name, image);
        const Image back = readImage(folder / name);
        ASSERT_EQ(back.data, image.data) << name;
        for (std::size_t i = 0; i < image.pixels.size(); ++i)
            ASSERT_NEAR(back.pixels[i], image.pixels[i], 0.02f) << name;
    }
}

// A limit on the size of files stands for a full disk; libjpeg would have ended the program.
TEST(ImageIo, FullDiskIsAnErrorInEveryFormat) {
    const TemporaryFolder folder;
    Image image(Window{0, 0, 200, 100}, {"R", "G", "B"});
    for (std::size_t i = 0; i < image.pixels.size(); ++i)
        image.pixels[i] = static_cast<float>(i * 2654435761u % 1009) / 1009;
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit before{};
    ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
    const rlimit limit{1000, before.rlim_max};
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
    for (const std::string name : {"a.exr", "a.png", "a.jpg", "a.tif", "a.hdr", "a.ppm"})
        EXPECT_THROW(writeImage(folder / name, image), Error) << name;
    ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &before), 0);
    EXPECT_EQ(folder.entries(), 0);
}

TEST(ImageIo, BadFilesAreErrorsThatNameTheFile) {
    const TemporaryFolder folder;
    std::ofstream(folder / "text.exr") << "this is no image";
    for (const std::string name : {"missing.exr", "text.exr"}) {
        try {
            readImage(folder / name);
            FAIL() << name;
        } catch (const Error& error) {
            EXPECT_NE(std::string(error.what()).find(name), std::string::npos);
        }
    }
    EXPECT_THROW(writeImage(folder / "a.nosuchformat", Image(Window{0, 0, 1, 1}, {"R"})), Error);
    EXPECT_EQ(folder.entries(), 1);
}

// Memory is limited by what is in a file, not by what its header says.
TEST(ImageIo, HugeClaimsOfSmallFilesAreRefused) {
    const TemporaryFolder folder;
    ImageWriteOptions options;
    options.compression = "none";
    writeImage(folder / "a.exr", Image({0, 0, 4, 4}, {"R", "G", "B"}), options);
    std::string bytes = contentsOf(folder / "a.exr");
    for (const std::string name : {"dataWindow", "displayWindow"}) {
        const std::size_t at = bytes.find(name + '\0' + "box2i");
        ASSERT_NE(at, std::string::npos);
        const std::int32_t last = 19'999;
        for (const std::size_t corner : {8, 12})
            bytes.replace(at + name.size() + 11 + corner, 4, reinterpret_cast<const char*>(&last), 4);
    }
    // Room for the table of rows, so that the file can be opened.
    bytes.resize(bytes.size() + 8 * 20'000);
    std::ofstream(folder / "a.exr", std::ios::binary) << bytes;
    try {
        readImage(folder / "a.exr");
        FAIL();
    } catch (const Error& error) {
        EXPECT_NE(std::string(error.what()).find("bytes can hold"), std::string::npos) << error.what();
    }
}

TEST(LinearToSrgb, MeetsTheStandardsValues) {
    EXPECT_EQ(linearToSrgb(-1.0f), 0.0f);
    EXPECT_EQ(linearToSrgb(2.0f), 1.0f);
    EXPECT_NEAR(linearToSrgb(0.0031308f), 0.04045f, 1e-5f);
    EXPECT_NEAR(linearToSrgb(0.214041f), 0.5f, 1e-5f);  // IEC 61966-2-1
}

// Headers alone tell: nothing is taken for what they claim.
TEST(ImageIo, HugeWindowsAreToldWithTheirSize) {
    const TemporaryFolder folder;
    const std::string path = folder / "huge.exr";
    writeImage(path, Image({0, 0, 4, 4}, {"R", "G", "B"}));
    std::string bytes = contentsOf(path);
    const auto messageOf = [](const std::string& file) {
        try {
            readImage(file);
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("no error");
    };
    const auto messageOfWindow = [&](std::int32_t width, std::int32_t height) {
        for (const std::string name : {"dataWindow", "displayWindow"}) {
            const std::string attribute = name + std::string("\0box2i\0", 7);
            const std::int32_t corner[2] = {width - 1, height - 1};
            std::memcpy(bytes.data() + bytes.find(attribute) + attribute.size() + 12, corner, sizeof corner);
        }
        std::ofstream(path, std::ios::binary) << bytes;
        return messageOf(path);
    };
    for (const auto& [width, height] :
         {std::pair{1 << 29, 1 << 29}, {1 << 29, 2}, {2, 1 << 29}, {1 << 20, 1 << 20}}) {
        const std::string message = messageOfWindow(width, height);
        EXPECT_NE(
            message.find("claims " + std::to_string(width) + " x " + std::to_string(height) + " pixels"),
            std::string::npos)
            << message;
        EXPECT_NE(message.find("huge.exr: truncated or damaged"), std::string::npos) << message;
    }
    EXPECT_NE(messageOfWindow(1 << 30, 1 << 30).find("1073741823"), std::string::npos);
    // Products that no 64 bits hold.
    std::ofstream(folder / "huge.pfm") << "PF\n2147483647 2147483647\n-1\n";
    EXPECT_NE(messageOf(folder / "huge.pfm").find("2147483647 x 2147483647 pixels"), std::string::npos);
}

}  // namespace
}  // namespace vlx
