// Importers of samples: BCD's raw files, SBMC's tiles, sequences, and the presets of stacks.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>

#include "../base/temporary_folder.h"
#include "../dump/renderer_files.h"
#include "../dump/test_dumps.h"
#include "import/bcd.h"
#include "import/sbmc.h"
#include "import/stack.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

TEST(ImportBcdRaw, SamplesKeepTheirPlaces) {
    const TemporaryFolder folder;
    for (const int channels : {3, 4}) {
        BcdRaw raw;
        raw.width = 7;
        raw.height = 40;
        raw.channels = channels;
        raw.value = [](int x, int y, int s, int c) {
            return static_cast<float>(x + 10 * y + 1000 * s) + 0.25f * static_cast<float>(c);
        };
        writeBytes(folder / "a.raw", bcdRawBytes(raw));
        const ImportReport report = importBcdRaw(folder / "a.raw", folder / "a.exr", {});
        EXPECT_EQ(anyContains(report.ignored, "fourth"), channels == 4);
        EXPECT_FALSE(report.missing.empty());

        const DumpReader dump(folder / "a.exr");
        EXPECT_EQ(dump.header().data, (Window{0, 0, 7, 40}));
        EXPECT_EQ(dump.header().samples, 3.0);
        const SampleBand band = dump.read(0, 40, {"R", "G", "B"});
        ASSERT_EQ(band.samples(), 7u * 40 * 3);
        std::size_t i = 0;
        for (int y = 0; y < 40; ++y)
            for (int x = 0; x < 7; ++x)
                for (int s = 0; s < 3; ++s, ++i)
                    for (int c = 0; c < 3; ++c)
                        ASSERT_EQ(band.values[static_cast<std::size_t>(c)][i], raw.value(x, y, s, c));
    }
}

TEST(ImportBcdRaw, HeadersThatLieAreErrors) {
    const TemporaryFolder folder;
    const auto outcome = [&](const FileBytes& bytes) {
        writeBytes(folder / "a.raw", bytes);
        return errorOf([&] { importBcdRaw(folder / "a.raw", folder / "a.exr", {}); });
    };
    FileBytes bytes = bcdRawBytes({});
    EXPECT_NE(outcome({bytes.begin(), bytes.end() - 1}).find("expected 4 rows of 180 bytes"),
              std::string::npos);
    EXPECT_NE(outcome({bytes.begin(), bytes.begin() + 19}).find("19 bytes"), std::string::npos);
    for (const std::size_t field : {4u, 8u, 12u, 16u})
        for (const int value : {0, -1, 2147483647, 6}) {
            FileBytes lying = bytes;
            std::memcpy(lying.data() + field, &value, 4);
            EXPECT_NE(outcome(lying), "") << field << " " << value;
        }
    EXPECT_EQ(folder.entries(), 1) << "no dump may be left";
}

float sbmcValue(int sample, int feature, int x, int y) {
    switch (feature) {
        case 0:
            return 0.25f;  // dx
        case 1:
            return 0.75f;  // dy
        case 17:
            return x == 3 ? -1.0f : 5.0f;  // depth_first
        case 20:
            return x == 3 ? 0.0f : 1.0f;  // hasHit
        default:
            return static_cast<float>(feature) + static_cast<float>(x) / 8 + static_cast<float>(y) / 64 +
                   static_cast<float>(sample) / 512;
    }
}

std::vector<std::string> writeTiles(const TemporaryFolder& folder, SbmcTileFile tile,
                                    const std::vector<std::pair<int, int>>& corners) {
    std::vector<std::string> paths;
    tile.value = sbmcValue;
    for (const auto& [x, y] : corners) {
        tile.x = x;
        tile.y = y;
        paths.push_back(folder / ("tile_" + std::to_string(x) + "_" + std::to_string(y) + ".bin"));
        writeBytes(paths.back(), sbmcTileBytes(tile));
    }
    return paths;
}

TEST(ImportSbmc, TilesInAnyOrderMakeThePicture) {
    for (const int version : {20181212, 20190401}) {
        const TemporaryFolder folder;
        SbmcTileFile tile;
        tile.version = version;
        const auto tiles = writeTiles(folder, tile, {{4, 4}, {0, 4}, {4, 0}, {0, 0}});
        const ImportReport report = importSbmc(tiles, folder / "a.exr", {});
        EXPECT_EQ(report.mapped.at("R"), "diffuse_r + specular_r");
        EXPECT_TRUE(anyContains(report.ignored, "probabilities"));

        const DumpReader dump(folder / "a.exr");
        EXPECT_EQ(dump.header().data, (Window{0, 0, 8, 8}));
        EXPECT_EQ(dump.header().display, (Window{0, 0, 8, 8}));
        const std::vector<std::string> names = {"R",        "G",        "B",        "A",  "Z",
                                                "sample.x", "sample.y", "albedo.R", "N.X"};
        const SampleBand band = dump.read(0, 8, names);
        ASSERT_EQ(band.samples(), 128u);
        std::size_t i = 0;
        for (int y = 0; y < 8; ++y)
            for (int x = 0; x < 8; ++x)
                for (int s = 0; s < 2; ++s, ++i) {
                    for (int c = 0; c < 3; ++c)
                        ASSERT_EQ(band.values[static_cast<std::size_t>(c)][i],
                                  sbmcValue(s, 5 + c, x, y) + sbmcValue(s, 8 + c, x, y));
                    ASSERT_EQ(band.values[3][i], x == 3 ? 0 : 1);
                    ASSERT_EQ(band.values[4][i], x == 3 ? 0 : 5);
                    ASSERT_EQ(band.values[5][i], static_cast<float>(x) + 0.25f);
                    ASSERT_EQ(band.values[6][i], static_cast<float>(y) + 0.75f);
                    ASSERT_NEAR(band.values[7][i], sbmcValue(s, 24, x, y), 0.01);  // HALF
                    ASSERT_NEAR(band.values[8][i], sbmcValue(s, 14, x, y), 0.01);
                }
    }
}

TEST(ImportSbmc, PartsOfThePictureAreACrop) {
    const TemporaryFolder folder;
    SbmcTileFile tile;
    tile.width = 10;  // the last tiles reach over the picture's border
    const auto tiles = writeTiles(folder, tile, {{4, 4}, {8, 4}});
    importSbmc(tiles, folder / "a.exr", {});
    const DumpReader dump(folder / "a.exr");
    EXPECT_EQ(dump.header().data, (Window{4, 4, 6, 4}));
    EXPECT_EQ(dump.header().display, (Window{0, 0, 10, 8}));
    EXPECT_EQ(dump.read(5, 1, {"sample.x"}).values[0].back(), 9.25f);
}

TEST(ImportSbmc, GapsOverlapsAndOtherPicturesAreErrors) {
    const TemporaryFolder folder;
    const auto outcome = [&](const std::vector<std::string>& tiles) {
        return errorOf([&] { importSbmc(tiles, folder / "a.exr", {}); });
    };
    SbmcTileFile tile;
    const auto tiles = writeTiles(folder, tile, {{0, 0}, {4, 0}, {0, 4}, {4, 4}, {2, 0}, {0, 6}});
    EXPECT_NE(outcome({tiles[0], tiles[1], tiles[2]}).find("some are missing"), std::string::npos);
    EXPECT_NE(outcome({tiles[0], tiles[4]}).find("overlap"), std::string::npos);
    EXPECT_NE(outcome({tiles[0], tiles[5]}).find("overlap, or some are missing"), std::string::npos);
    EXPECT_NE(outcome({tiles[0], tiles[0]}).find("overlap"), std::string::npos);
    tile.width = 12;
    const auto other = writeTiles(folder, tile, {{8, 0}});
    EXPECT_NE(outcome({tiles[0], other[0]}).find("same picture"), std::string::npos);
}

TEST(ImportSbmc, EveryTruncationIsAnError) {
    const TemporaryFolder folder;
    SbmcTileFile tile;
    tile.tileSize = 2;
    const FileBytes bytes = sbmcTileBytes(tile);
    for (std::size_t size = 0; size < bytes.size(); size += 3) {
        writeBytes(folder / "a.bin", {bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)});
        EXPECT_NE(errorOf([&] { importSbmc({folder / "a.bin"}, folder / "a.exr", {}); }), "") << size;
    }
}

TEST(ImportSequence, NumbersInOrderAndNothingElse) {
    const TemporaryFolder folder;
    for (const char* name : {"s_0010.exr", "s_0002.exr", "s_12345.exr", "s_01234.exr", "s_12.exr",
                             "s_abcd.exr", "s_0003.png", "t_0004.exr"})
        writeBytes(folder / name, {1});
    EXPECT_EQ(expandSequences({folder / "s_####.exr", folder / "other.exr"}),
              (std::vector<std::string>{folder / "s_0002.exr", folder / "s_0010.exr", folder / "s_12345.exr",
                                        folder / "other.exr"}));
    EXPECT_NE(errorOf([&] { expandSequences({folder / "u_####.exr"}); }).find("u_####.exr: expected files"),
              std::string::npos);
}

TEST(ImportStack, KnowsPbrtAndMitsubaByTheirChannels) {
    const TemporaryFolder folder;
    const auto value = [](int channel, int x, int y) { return static_cast<float>(channel * 8 + x + y); };
    writeImage(folder / "pbrt.exr", imageOf({0, 0, 3, 2}, pbrtChannels(), value));
    const ImportReport pbrt = stackImages({folder / "pbrt.exr"}, folder / "a.exr", {});
    EXPECT_EQ(pbrt.mapped.at("albedo.G"), "Albedo.G");
    EXPECT_EQ(pbrt.mapped.at("N.Z"), "Ns.Z");
    EXPECT_FALSE(pbrt.mapped.contains("Z"));
    EXPECT_TRUE(anyContains(pbrt.notes, "--map Z=P.Z"));
    EXPECT_TRUE(anyContains(pbrt.ignored, "dzdx"));

    writeImage(folder / "mitsuba.exr", imageOf({0, 0, 3, 2},
                                               {"R", "G", "B", "A", "alb.R", "alb.G", "alb.B", "nn.X", "nn.Y",
                                                "nn.Z", "dd.y.T", "uv.U", "uv.V"},
                                               value));
    const ImportReport mitsuba = stackImages({folder / "mitsuba.exr"}, folder / "b.exr", {});
    EXPECT_EQ(mitsuba.mapped.at("R"), "R");
    EXPECT_EQ(mitsuba.mapped.at("A"), "A");
    EXPECT_EQ(mitsuba.mapped.at("albedo.R"), "alb.R");
    EXPECT_EQ(mitsuba.mapped.at("N.Y"), "nn.Y");
    EXPECT_EQ(mitsuba.mapped.at("Z"), "dd.y.T");

    // Without the film's own channels: those of the nested integrator.
    writeImage(folder / "nested.exr", imageOf({0, 0, 3, 2},
                                              {"albedo.R", "albedo.G", "albedo.B", "my_image.R", "my_image.G",
                                               "my_image.B", "my_image.A", "dd.T"},
                                              value));
    const ImportReport nested = stackImages({folder / "nested.exr"}, folder / "c.exr", {});
    EXPECT_EQ(nested.mapped.at("G"), "my_image.G");
    EXPECT_EQ(nested.mapped.at("A"), "my_image.A");
}

}  // namespace
}  // namespace vlx
