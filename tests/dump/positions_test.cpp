// What samples are: where they say to be, which replicate they belong to, and whether they are samples at
// all.

#include "variolux/dump/positions.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <random>

#include "../base/temporary_folder.h"
#include "edit/info.h"
#include "edit/subset.h"
#include "test_dumps.h"
#include "variolux/dump/layers.h"
#include "variolux/dump/reader.h"
#include "variolux/dump/sample_buffer.h"

namespace vlx {
namespace {

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
constexpr Window kData{10, -6, 24, 18}, kDisplay{-2, -10, 64, 48};

// A dump whose samples' channels are functions of the pixel and of numbers in 0..1.
using ValuesOf = std::function<std::vector<float>(double x, double y, double u, double v)>;
TestDump dumpOf(const std::vector<std::string>& channels, int samples, const ValuesOf& values) {
    std::mt19937 random(7);
    std::uniform_real_distribution<double> unit;
    TestDump dump;
    dump.header.data = kData;
    dump.header.display = kDisplay;
    dump.all = {kData.x, kData.y, kData.width, kData.height, {0}, {"R", "G", "B"}, {}};
    dump.all.channels.insert(dump.all.channels.end(), channels.begin(), channels.end());
    for (const std::string& channel : dump.all.channels) dump.header.channels.push_back({channel});
    dump.all.values.resize(dump.all.channels.size());
    for (int y = kData.y; y < kData.y + kData.height; ++y)
        for (int x = kData.x; x < kData.x + kData.width; ++x) {
            for (int s = 0; s < samples; ++s) {
                for (std::size_t c = 0; c < 3; ++c) dump.all.values[c].push_back(0.5f);
                const double u = unit(random), v = unit(random);
                const auto further = values(x, y, u, v);
                for (std::size_t c = 0; c < further.size(); ++c) dump.all.values[3 + c].push_back(further[c]);
            }
            dump.all.offsets.push_back(dump.all.values[0].size());
        }
    return dump;
}

PositionReport reportOf(const TestDump& dump) {
    PositionCheck check(dump.header);
    check.add(dump.all);
    return check.report();
}

using PositionOf = std::function<std::pair<double, double>(double x, double y, double u, double v)>;
TestDump positionsOf(const PositionOf& position) {
    return dumpOf({"sample.x", "sample.y"}, 4, [&](double x, double y, double u, double v) {
        const auto [px, py] = position(x, y, u, v);
        return std::vector<float>{static_cast<float>(px), static_cast<float>(py)};
    });
}

TEST(Positions, InTheirPixelsAreNotSpokenOf) {
    const PositionReport report =
        reportOf(positionsOf([](double x, double y, double u, double v) { return std::pair(x + u, y + v); }));
    EXPECT_EQ(report.samples, 24u * 18 * 4);
    EXPECT_EQ(report.outside, 0u);
    EXPECT_EQ(toText(report), "");
    // On a pixel's border, where rounding puts them.
    EXPECT_EQ(
        reportOf(positionsOf([](double x, double y, double, double) { return std::pair(x + 1, y); })).outside,
        0u);
}

TEST(Positions, OfKnownConventionsAreRecognisedAndCanBeRead) {
    using enum PositionConvention;
    const double w = kDisplay.width, h = kDisplay.height, x0 = kDisplay.x, y0 = kDisplay.y;
    const std::vector<std::pair<PositionConvention, PositionOf>> forms = {
        {Flipped,
         [=](double x, double y, double u, double v) { return std::pair(x + u, 2 * y0 + h - y - v); }},
        {Corner,
         [](double x, double y, double u, double v) { return std::pair(x + u - kData.x, y + v - kData.y); }},
        {Centre, [](double x, double y, double u, double v) { return std::pair(x + u - 0.5, y + v - 0.5); }},
        {Relative, [](double, double, double u, double v) { return std::pair(u, v); }},
        {RelativeCentre, [](double, double, double u, double v) { return std::pair(u - 0.5, v - 0.5); }},
        {Normalised, [=](double x, double y, double u,
                         double v) { return std::pair((x + u - x0) / w, (y + v - y0) / h); }},
        {NormalisedFlipped, [=](double x, double y, double u,
                                double v) { return std::pair((x + u - x0) / w, 1 - (y + v - y0) / h); }},
        {Ndc, [=](double x, double y, double u, double v) {
             return std::pair(2 * (x + u - x0) / w - 1, 1 - 2 * (y + v - y0) / h);
         }}};
    EXPECT_EQ(forms.size() + 1, positionConventions().size());
    for (const auto& [convention, position] : forms) {
        const TestDump dump = positionsOf(position);
        const PositionReport report = reportOf(dump);
        const auto& name = positionConventions()[static_cast<std::size_t>(convention)];
        EXPECT_EQ(name.convention, convention);
        ASSERT_TRUE(report.likely) << name.name;
        EXPECT_EQ(*report.likely, convention) << name.name;
        EXPECT_NE(toText(report).find(name.words), std::string::npos) << toText(report);
        const SampleBuffer buffer(dump.header, dump.all);
        const PositionedSamples repaired(buffer, convention, false);
        repaired.read(kData.y, kData.height, {"sample.x", "sample.y"});
        EXPECT_EQ(repaired.report().outside, 0u) << name.name;
    }
}

TEST(Positions, ElsewhereAreCountedWithoutAClaim) {
    std::mt19937 random(3);
    std::normal_distribution<double> gauss(0, 0.7);
    const PositionReport wide = reportOf(positionsOf([&](double x, double y, double, double) {
        return std::pair(x + 0.5 + gauss(random), y + 0.5 + gauss(random));
    }));
    EXPECT_GT(wide.outside, wide.samples / 2);
    EXPECT_FALSE(wide.likely);
    EXPECT_FALSE(wide.shift);
    EXPECT_NE(toText(wide).find("wider than a pixel"), std::string::npos);

    const PositionReport shifted = reportOf(positionsOf(
        [](double x, double y, double u, double v) { return std::pair(x + u + 5, y + v - 1.5); }));
    ASSERT_TRUE(shifted.shift);
    EXPECT_NEAR(shifted.shift->first, 5, 0.03);
    EXPECT_NEAR(shifted.shift->second, -1.5, 0.03);
    EXPECT_NE(toText(shifted).find("shifted by (5, -1.5)"), std::string::npos) << toText(shifted);

    const PositionReport some = reportOf(positionsOf([](double x, double y, double u, double v) {
        return u < 0.1 ? std::pair<double, double>(kNaN, kNaN) : std::pair(x + u, y + v);
    }));
    EXPECT_GT(some.notFinite, 0u);
    EXPECT_EQ(some.outside, 0u);
    EXPECT_NE(toText(some).find(std::to_string(some.notFinite) + " samples"), std::string::npos);
    const PositionReport none =
        reportOf(positionsOf([](double, double, double, double) { return std::pair(kNaN, kNaN); }));
    EXPECT_EQ(none.notFinite, none.samples);
}

TEST(Positions, AreCheckedOnceAndOnlyGivenWhereAskedFor) {
    const TestDump dump = positionsOf([](double, double, double u, double v) { return std::pair(u, v); });
    const SampleBuffer buffer(dump.header, dump.all);
    const PositionedSamples always(buffer, PositionConvention::Raster, true);
    for (int twice = 0; twice < 2; ++twice)
        expectSame(buffer.read(kData.y, 5, {"G", "R"}), always.read(kData.y, 5, {"G", "R"}));
    EXPECT_EQ(always.report().samples, 24u * 5 * 4);
    always.read(kData.y, 8, {"R"});
    EXPECT_EQ(always.report().samples, 24u * 8 * 4) << "rows of which some were read before";
    const PositionedSamples whereRead(buffer, PositionConvention::Raster, false);
    whereRead.read(kData.y, 5, {"R"});
    EXPECT_EQ(whereRead.report().samples, 0u);
    EXPECT_EQ(toText(whereRead.report()), "");
}

std::string layersOf(const TestDump& dump) { return layersFoundBy(SampleBuffer(dump.header, dump.all)); }

TEST(Layers, AreToldFromSamplesOfTheCamera) {
    int layer = 0;
    const ValuesOf ordered = [&](double, double, double u, double) {
        layer = (layer + 1) % 3;
        return std::vector<float>{static_cast<float>(layer == 2 ? 1 : 0.2 + 0.5 * u),
                                  static_cast<float>(layer + u)};
    };
    const ValuesOf anyOrder = [](double, double, double u, double v) {
        return std::vector<float>{static_cast<float>(u), static_cast<float>(3 + v)};
    };
    const ValuesOf hits = [&](double, double, double u, double) {
        layer = (layer + 1) % 3;
        return std::vector<float>{1.f, static_cast<float>(layer + u)};
    };
    layer = 2;
    EXPECT_NE(layersOf(dumpOf({"A", "Z"}, 3, ordered)).find("Z that grows"), std::string::npos);
    EXPECT_EQ(layersOf(dumpOf({"A", "Z"}, 3, anyOrder)), "");
    layer = 2;
    EXPECT_EQ(layersOf(dumpOf({"A", "Z"}, 3, hits)), "") << "sorted, but each hit counts whole";
    EXPECT_EQ(layersOf(dumpOf({"A", "Z"}, 1, anyOrder)), "");
    EXPECT_NE(layersOf(dumpOf({"Z", "ZBack"}, 2, anyOrder)).find("ZBack"), std::string::npos);
    for (const auto& further : {std::vector<std::string>{"sample.x", "sample.y"}, {"sample.replicate"}}) {
        std::vector<std::string> channels = {"A", "Z", "ZBack"};
        channels.insert(channels.end(), further.begin(), further.end());
        EXPECT_EQ(layersOf(dumpOf(channels, 2,
                                  [&](double, double, double, double) {
                                      return std::vector<float>(channels.size(), 0.f);
                                  })),
                  "")
            << "samples of a renderer";
    }
}

TEST(Info, SaysWhereSamplesAreAndThatLayersAreNone) {
    const TemporaryFolder folder;
    writeDump(folder / "a.exr",
              positionsOf([](double, double, double u, double v) { return std::pair(u, v); }));
    DumpInfo info = inspectDump(folder / "a.exr");
    EXPECT_EQ(info.positions.likely, PositionConvention::Relative);
    EXPECT_NE(toText(info).find("relative to the pixel"), std::string::npos) << toText(info);
    EXPECT_NE(toJson(info).find("relative to the pixel"), std::string::npos);
    writeDump(folder / "b.exr", dumpOf({"A", "Z", "ZBack"}, 2, [](double, double, double u, double) {
                  return std::vector<float>{0.5f, static_cast<float>(u), static_cast<float>(u + 1)};
              }));
    info = inspectDump(folder / "b.exr");
    EXPECT_NE(toText(info).find("ZBack, where a layer ends"), std::string::npos) << toText(info);
    EXPECT_EQ(info.positions.samples, 0u);
}

TEST(Replicates, ThatAreNoNumbersAreRefusedWithTheirPixel) {
    for (const float value : {0.f, 1.f, 16777216.f, 4294967040.f})
        EXPECT_EQ(replicateNumber(value), static_cast<std::uint32_t>(value));
    const TemporaryFolder folder;
    for (const float broken : {kNaN, -1.f, 0.5f, 4294967296.f, std::numeric_limits<float>::infinity()}) {
        EXPECT_EQ(replicateNumber(broken), std::nullopt) << broken;
        TestDump dump = dumpOf({"sample.replicate"}, 2, [](double, double, double u, double) {
            return std::vector<float>{u < 0.5 ? 0.f : 1.f};
        });
        writeDump(folder / "a.exr", dump);
        EXPECT_EQ(inspectDump(folder / "a.exr").replicates, 2u);
        dump.all.values[3][2 * (24 * 2 + 5) + 1] = broken;
        writeDump(folder / "a.exr", dump);
        for (const std::function<void()>& reads :
             {std::function<void()>([&] { inspectDump(folder / "a.exr"); }),
              std::function<void()>([&] { subsetDump(folder / "a.exr", folder / "b.exr", {}); }),
              std::function<void()>([&] { DumpReader(folder / "a.exr").read(kData.y + 2, 1); }),
              std::function<void()>([&] { SampleBuffer(dump.header, dump.all); })})
            EXPECT_NE(errorOf(reads).find("channel sample.replicate, found "), std::string::npos);
        EXPECT_NE(errorOf([&] { inspectDump(folder / "a.exr"); }).find("in pixel (15, -4)"),
                  std::string::npos);
        EXPECT_EQ(DumpReader(folder / "a.exr").read(kData.y + 3, 4).height, 4) << "other rows";
    }
}

}  // namespace
}  // namespace vlx
