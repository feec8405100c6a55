#include "edit/info.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "../base/temporary_folder.h"
#include "../dump/test_dumps.h"

namespace vlx {
namespace {

bool lacks(const DumpInfo& info, const std::string& what) {
    for (const auto& part : info.missing)
        if (part.what.find(what) != std::string::npos) return true;
    return false;
}

// Every sample finite, whatever makeDump drew.
void tame(TestDump& dump) {
    for (auto& values : dump.all.values)
        for (float& value : values)
            if (!std::isfinite(value)) value = 0.25f;
}

TEST(DumpInfo, CountsWhatThereIs) {
    const TemporaryFolder folder;
    TestDump dump = makeDump({2, 3, 10, 37}, standardChannels(), [](int col, int row) {
        return row == 36 && col == 9 ? 50 : col == 4 ? 0 : 2;
    });
    tame(dump);
    dump.all.values[0][3] = NAN;
    dump.all.values[1][3] = NAN;
    dump.all.values[2][7] = -std::numeric_limits<float>::infinity();
    dump.all.values[4][9] = NAN;  // not a radiance
    dump.header.pixelFilter = "box";
    writeDump(folder / "a.exr", dump);
    std::int64_t last = 0, total = 0;
    const DumpInfo info = inspectDump(folder / "a.exr", [&](std::int64_t done, std::int64_t all) {
        EXPECT_GT(done, last);
        last = done;
        total = all;
    });
    EXPECT_EQ(last, total);
    EXPECT_EQ(info.samples, 37u * 18u + 48u);
    EXPECT_EQ(info.minSamples, 0u);
    EXPECT_EQ(info.maxSamples, 50u);
    EXPECT_DOUBLE_EQ(info.meanSamples, (37 * 18 + 48) / 370.0);
    EXPECT_EQ(info.emptyPixels, 37u);
    EXPECT_EQ(info.nonFiniteSamples, 2u);
    EXPECT_EQ(info.rawBytes, info.samples * (6 * 4 + 7 * 2 + 4));
    EXPECT_EQ(info.fileBytes, fileBytes(folder / "a.exr").size());
    ASSERT_EQ(info.missing.size(), 1u);
    EXPECT_TRUE(lacks(info, "37 pixels"));
}

TEST(DumpInfo, NamesWhatIsMissing) {
    const TemporaryFolder folder;
    TestDump dump = makeDump({0, 0, 4, 4},
                             {{"R", ChannelType::Float},
                              {"G", ChannelType::Float},
                              {"B", ChannelType::Float},
                              {"sample.x", ChannelType::Float}},
                             [](int, int) { return 1; });
    writeDump(folder / "a.exr", dump);
    const DumpInfo info = inspectDump(folder / "a.exr");
    for (const char* what : {"sample.x", "albedo", "normals", "distance", "hit flag", "replicates",
                             "pixel filter", "second sample"})
        EXPECT_TRUE(lacks(info, what)) << what;
    for (const auto& part : info.missing) EXPECT_NE(toText(info).find(part.cost), std::string::npos);
}

TEST(DumpInfo, MeasuresMotion) {
    const TemporaryFolder folder;
    std::vector<DumpChannel> channels = standardChannels();
    for (const std::string_view name : kMotionChannels)
        channels.push_back({std::string(name), ChannelType::Float});
    TestDump dump = makeDump({10, 0, 5, 2}, channels, [](int, int) { return 1; });
    tame(dump);
    dump.header.display = {0, 0, 20, 10};
    const auto channel = [&](std::string_view name) -> std::vector<float>& {
        return dump.all.values[static_cast<std::size_t>(dump.all.channel(name))];
    };
    for (std::size_t p = 0; p < 10; ++p) {
        channel("sample.x")[p] = 10.25f + static_cast<float>(p % 5);
        channel("sample.y")[p] = 0.75f + static_cast<float>(p / 5);
        channel("motion.x")[p] = p < 3 ? 0 : 3;  // of the second row's, two leave by the right in the end
        channel("motion.y")[p] = p < 3 ? 0 : 4;
        channel("motionNext.x")[p] = p < 6 ? NAN : -1;
        channel("motionNext.y")[p] = -1;
    }
    channel("motion.x")[9] = 6;
    channel("motion.y")[9] = 8;
    writeDump(folder / "a.exr", dump);
    const DumpInfo info = inspectDump(folder / "a.exr");
    ASSERT_TRUE(info.motion);
    const MotionReport &before = (*info.motion)[0], &next = (*info.motion)[1];
    EXPECT_EQ(before.samples, 10u);
    EXPECT_EQ(before.known, 10u);
    EXPECT_EQ(before.still, 3u);
    EXPECT_EQ(before.leaving, 1u);
    EXPECT_EQ(before.median, 5);
    EXPECT_EQ(before.largest, 10);
    EXPECT_EQ(doubtOf(before), "");
    EXPECT_EQ(next.known, 4u);
    EXPECT_EQ(next.leaving, 0u);
    EXPECT_NEAR(next.median, std::sqrt(2.0), 0.01 * std::sqrt(2.0));
    EXPECT_NE(doubtOf(next), "");
    const std::string text = toText(info);
    EXPECT_NE(text.find("known of 100 % of the samples; of those 30 % do not move, 10 % leave the picture; 5 "
                        "pixels (median), 10 (most)"),
              std::string::npos)
        << text;
    EXPECT_NE(text.find(doubtOf(next)), std::string::npos) << text;
    const auto json = nlohmann::json::parse(toJson(info));
    EXPECT_EQ(json["motion"]["before"]["largest"], 10);
    EXPECT_EQ(json["motion"]["next"]["known"], 4);
    EXPECT_EQ(json["motion"]["next"]["warning"], doubtOf(next));

    dump = makeDump({0, 0, 2, 2}, {channels.begin(), channels.end() - 1}, [](int, int) { return 1; });
    writeDump(folder / "b.exr", dump);
    EXPECT_FALSE(inspectDump(folder / "b.exr").motion) << "all four or none";
    EXPECT_EQ(toText(inspectDump(folder / "b.exr")).find("leave the picture"), std::string::npos);
}

TEST(DumpInfo, JsonSaysTheSame) {
    const TemporaryFolder folder;
    TestDump dump = makeDump({-1, 2, 3, 2}, standardChannels(), [](int, int) { return 4; });
    tame(dump);
    dump.header.display = {0, 0, 30, 20};
    dump.header.renderer = "a \"quoted\" renderer";
    dump.header.effects = {"depth of field"};
    dump.header.seed = 77;
    dump.header.samples = 4;
    dump.header.renderSeconds = 1.5;
    dump.header.extra["owner"] = "someone";
    writeDump(folder / "a.exr", dump);
    const DumpInfo info = inspectDump(folder / "a.exr");
    const auto json = nlohmann::json::parse(toJson(info));
    EXPECT_EQ(json["renderer"], "a \"quoted\" renderer");
    EXPECT_EQ(json["dataWindow"]["x"], -1);
    EXPECT_EQ(json["displayWindow"]["width"], 30);
    EXPECT_EQ(json["samples"]["total"], 24);
    EXPECT_EQ(json["samples"]["mean"], 4.0);
    EXPECT_EQ(json["samples"]["emptyPixels"], 0);
    EXPECT_EQ(json["seed"], 77);
    EXPECT_EQ(json["renderSeconds"], 1.5);
    EXPECT_EQ(json["samplesAskedFor"], 4.0);
    EXPECT_EQ(json["effects"][0], "depth of field");
    EXPECT_EQ(json["attributes"]["owner"], "someone");
    EXPECT_EQ(json["channels"].size(), 14u);
    EXPECT_EQ(json["compression"], "zips");
    ASSERT_EQ(json["missing"].size(), 1u);
    EXPECT_EQ(json["missing"][0]["what"], info.missing[0].what);
    EXPECT_FALSE(json["missing"][0]["cost"].get<std::string>().empty());
}

}  // namespace
}  // namespace vlx
