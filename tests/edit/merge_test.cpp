#include "edit/merge.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"
#include "variolux/base/fingerprint.h"
#include "variolux/base/image_io.h"
#include "variolux/dump/reader.h"

namespace vlx {
namespace {

constexpr Window kWindow{2, -4, 23, 45};

TestDump wholeDump() {
    TestDump dump = makeDump(kWindow, mixedChannels(), [](int col, int row) { return (col * 5 + row) % 4; });
    dump.header.display = kWindow;
    dump.header.scene = "room.glb";
    dump.header.renderer = "Some renderer";
    dump.header.seed = 7;
    dump.header.renderSeconds = 4;
    return dump;
}

// The columns and rows of `part`, in raster coordinates.
TestDump partOf(const TestDump& whole, const Window& part) {
    TestDump out;
    out.header = whole.header;
    out.header.data = part;
    out.header.renderSeconds = 1;
    out.all = {part.x, part.y, part.width, part.height, {0}, whole.all.channels, {}};
    out.all.values.resize(whole.all.values.size());
    for (int y = part.y; y < part.y + part.height; ++y)
        for (int x = part.x; x < part.x + part.width; ++x) {
            const auto p = static_cast<std::size_t>((y - kWindow.y) * kWindow.width + x - kWindow.x);
            for (std::uint64_t i = whole.all.offsets[p]; i < whole.all.offsets[p + 1]; ++i)
                for (std::size_t c = 0; c < out.all.values.size(); ++c)
                    out.all.values[c].push_back(whole.all.values[c][static_cast<std::size_t>(i)]);
            out.all.offsets.push_back(out.all.values[0].size());
        }
    return out;
}

struct Parts {
    Parts() : whole(wholeDump()) {
        writeDump(folder / "whole.exr", whole);
        for (int i = 0; i < 4; ++i) {  // 45 rows in 4 bands
            const int begin = 45 * i / 4, end = 45 * (i + 1) / 4;
            write({2, -4 + begin, 23, end - begin}, bands);
        }
        for (int y = 0; y < 45; y += 20)
            for (int x = 0; x < 23; x += 10)
                write({2 + x, -4 + y, std::min(10, 23 - x), std::min(20, 45 - y)}, tiles);
    }
    void write(const Window& window, std::vector<std::string>& to) {
        TestDump part = partOf(whole, window);
        part.header.renderSeconds = 4.0 / (&to == &bands ? 4 : 9);
        to.push_back(folder / ("part" + std::to_string(bands.size() + tiles.size()) + ".exr"));
        writeDump(to.back(), part);
    }
    std::string merge(const std::vector<std::string>& parts, const MergeOptions& options = {}) {
        return errorOf([&] { mergeParts(parts, folder / "merged.exr", options); });
    }

    const TemporaryFolder folder;
    TestDump whole;
    std::vector<std::string> bands, tiles;
};

TEST(Merge, BandsAndTilesOfADumpBecomeItsBytes) {
    Parts parts;
    const std::string merged = parts.folder / "merged.exr";
    for (auto files : {parts.bands, parts.tiles}) {
        const MergeReport report = mergeParts(files, merged);
        EXPECT_TRUE(report.dump);
        EXPECT_EQ(report.data, kWindow);
        const auto bytes = fileBytes(merged);
        EXPECT_NEAR(*DumpReader(merged).header().renderSeconds, 4, 1e-9);
        if (files.size() == 4) {
            EXPECT_EQ(bytes, fileBytes(parts.folder / "whole.exr"));
        }
        expectSame(DumpReader(parts.folder / "whole.exr").read(kWindow.y, kWindow.height),
                   DumpReader(merged).read(kWindow.y, kWindow.height));
        std::rotate(files.begin(), files.begin() + 2, files.end());
        mergeParts(files, merged);
        EXPECT_EQ(fileBytes(merged), bytes) << "another order";
    }
}

TEST(Merge, MissingPartsAreNamed) {
    Parts parts;
    auto files = parts.bands;
    files.erase(files.begin() + 1);
    EXPECT_NE(parts.merge(files).find("merged.exr: no part holds rows 7 to 17, columns 2 to 24"),
              std::string::npos)
        << parts.merge(files);
    files = parts.bands;
    files.pop_back();  // the last one: the picture says that there is more
    EXPECT_NE(parts.merge(files).find("no part holds rows 29 to 40"), std::string::npos)
        << parts.merge(files);
    mergeParts(files, parts.folder / "crop.exr", {.crop = true});
    EXPECT_EQ(DumpReader(parts.folder / "crop.exr").header().data, (Window{2, -4, 23, 33}));
    files = parts.tiles;
    files.erase(files.begin() + 4);
    EXPECT_NE(parts.merge(files).find("columns 12 to 21"), std::string::npos) << parts.merge(files);
    EXPECT_NE(parts.merge(files, {.crop = true}).find("no part holds"), std::string::npos);
}

TEST(Merge, OverlapsAndOtherPicturesAreNamed) {
    Parts parts;
    auto files = parts.bands;
    files.push_back(parts.tiles.front());
    EXPECT_NE(parts.merge(files).find("overlaps"), std::string::npos);
    EXPECT_NE(parts.merge({parts.bands[0], parts.bands[0]}).find("overlaps"), std::string::npos);

    const auto other = [&](const auto& change) {
        TestDump part = partOf(parts.whole, {2, -4, 23, 11});
        change(part.header);
        writeDump(parts.folder / "other.exr", part);
        auto changed = parts.bands;
        changed[0] = parts.folder / "other.exr";
        std::rotate(changed.begin(), changed.begin() + 1, changed.end());
        return parts.merge(changed);
    };
    const std::string message = other([](DumpHeader& header) { header.scene = "other.glb"; });
    EXPECT_NE(message.find("other.exr: expected scene 'room.glb' as in "), std::string::npos) << message;
    EXPECT_NE(message.find("found 'other.glb': not parts of one picture"), std::string::npos) << message;
    EXPECT_NE(other([](DumpHeader& header) { header.seed = 8; }).find("seed 7"), std::string::npos);
    EXPECT_NE(other([](DumpHeader& header) { header.display.width = 40; }).find("a picture of"),
              std::string::npos);
    EXPECT_NE(other([](DumpHeader& header) {
                  header.worldToNDC = std::vector<float>(16, 1.0f);
              }).find("worldToNDC"),
              std::string::npos);
    EXPECT_NE(parts.merge({parts.bands[0], parts.folder / "none.exr"}).find("No such file"),
              std::string::npos);
}

TEST(Merge, FlatImagesKeepTypesWindowsAndAttributes) {
    const TemporaryFolder folder;
    Image whole(kWindow, {"R", "G", "B", "stddev.R"});
    whole.display = {0, -4, 30, 45};
    for (std::size_t i = 0; i < whole.pixels.size(); ++i) whole.pixels[i] = static_cast<float>(i % 977) / 16;
    for (const bool half : {false, true}) {
        ImageWriteOptions options;
        options.half = half;
        options.compression = "piz";
        options.attributes["Software"] = "vlx-krige";
        writeImage(folder / "whole.exr", whole, options);
        std::vector<std::string> parts;
        for (const auto& [y, rows] : {std::pair{20, 21}, {-4, 24}}) {
            Image part({kWindow.x, y, kWindow.width, rows}, whole.channels);
            part.display = whole.display;
            std::copy_n(whole.at(0, y - kWindow.y), part.pixels.size(), part.pixels.begin());
            parts.push_back(folder / ("p" + std::to_string(y) + ".exr"));
            writeImage(parts.back(), part, options);
        }
        EXPECT_NE(errorOf([&] { mergeParts(parts, folder / "m.exr"); }).find("columns 0 to 1"),
                  std::string::npos);
        const MergeReport report = mergeParts(parts, folder / "m.exr", {.crop = true});
        EXPECT_FALSE(report.dump);
        const Image merged = readImage(folder / "m.exr");
        EXPECT_EQ(merged.data, kWindow);
        EXPECT_EQ(merged.display, whole.display);
        EXPECT_EQ(merged.channels, whole.channels);
        EXPECT_EQ(merged.pixels, readImage(folder / "whole.exr").pixels);
        std::filesystem::remove(folder / "m.exr");
    }
    writeImage(folder / "other.exr", Image({0, 0, 4, 4}, {"R"}));
    EXPECT_NE(errorOf([&] {
                  mergeParts({folder / "whole.exr", folder / "other.exr"}, folder / "m.exr");
              }).find("not parts of one picture"),
              std::string::npos);
    Parts dumps;
    EXPECT_NE(errorOf([&] {
                  mergeParts({folder / "whole.exr", dumps.bands[0]}, folder / "m.exr");
              }).find("expected a flat image like"),
              std::string::npos);
}

// A run that is told what its inputs are may be skipped: only all bands are the whole.
TEST(Merge, OnlyAllTheBandsOfARunAreTheWhole) {
    Parts parts;
    for (int i = 0; i < 4; ++i) {
        TestDump part = partOf(parts.whole, bandOf(kWindow, {i, 4}));
        part.header.extra[kInputsAttribute] = inputsOfBand("run", {i, 4});
        writeDump(parts.bands[static_cast<std::size_t>(i)], part);
    }
    const std::vector<std::string>& b = parts.bands;
    EXPECT_EQ(wholeInputs({b[2], b[0], b[3], b[1]}), "run");
    EXPECT_EQ(wholeInputs({b[0], b[1], b[2]}), "");
    EXPECT_EQ(wholeInputs({b[0], b[1], b[2], b[2]}), "");
    EXPECT_EQ(wholeInputs({b[0], b[1], b[2], parts.tiles[0]}), "");
}

}  // namespace
}  // namespace vlx
