#include "render/film/append.h"

#include <gtest/gtest.h>

#include <numeric>

#include "../base/temporary_folder.h"
#include "render/film/render.h"
#include "render/pilot/pilot.h"
#include "test_scene.h"
#include "variolux/base/error.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"

namespace vlx::render {
namespace {

Scene room() {
    TestScene t;
    t.box(t.material(TestScene::matte({0.7f, 0.6f, 0.5f})), {-2, 0, -2}, {2, 3, 2});
    t.quad(t.material(TestScene::emitter(Rgb(8))), {-0.5f, 2.9f, -0.5f}, {0.5f, 2.9f, -0.5f},
           {0.5f, 2.9f, 0.5f}, {-0.5f, 2.9f, 0.5f});
    t.camera({0, 1.2f, 1.9f}, {0, 1, 0}, 1.2f);
    return t.finish();
}

RenderOptions small() {
    RenderOptions options;
    options.width = 21;
    options.height = 18;
    options.spp = 4;
    return options;
}

SampleBand samplesOf(const std::string& path) {
    const DumpReader reader(path);
    return reader.read(reader.header().data.y, reader.header().data.height);
}

class Appending : public testing::Test {
  protected:
    void map(const std::function<float(int, int)>& density, const std::string& channel = "sampling.density") {
        Image image({0, 0, 21, 18}, {channel});
        for (int y = 0; y < 18; ++y)
            for (int x = 0; x < 21; ++x) *image.at(x, y) = density(x, y);
        writeImage(folder / "map.exr", image);
    }
    void render(const std::string& name, const RenderOptions& options) {
        renderDump(scene, accelerator, folder / name, options);
    }

    TemporaryFolder folder;
    Scene scene = room();
    Accelerator accelerator{scene};
};

TEST_F(Appending, KeepsWhatWasThereAndAddsOtherSamples) {
    render("old.exr", small());
    const EarlierDump earlier(folder / "old.exr");
    RenderOptions options = small();
    options.spp = 3;
    options.earlier = &earlier;
    render("both.exr", options);
    const SampleBand old = samplesOf(folder / "old.exr"), both = samplesOf(folder / "both.exr");
    const DumpReader reader(folder / "both.exr");
    EXPECT_EQ(reader.header().samples, 7);
    for (std::size_t p = 0; p < old.pixels(); ++p) {
        ASSERT_EQ(both.offsets[p + 1] - both.offsets[p], 7u);
        for (std::size_t c = 0; c < old.values.size(); ++c)
            for (std::size_t s = 0; s < 4; ++s)
                ASSERT_EQ(both.values[c][both.offsets[p] + s], old.values[c][old.offsets[p] + s]);
    }
    // The new samples lie elsewhere, also when more are added to the sum.
    const EarlierDump again(folder / "both.exr");
    options.earlier = &again;
    render("more.exr", options);
    const SampleBand more = samplesOf(folder / "more.exr");
    const auto x = static_cast<std::size_t>(more.channel("sample.x"));
    for (std::size_t p = 0; p < more.pixels(); ++p) {
        const auto begin = more.values[x].begin() + static_cast<std::ptrdiff_t>(more.offsets[p]);
        std::vector<float> at(begin, begin + 10);
        std::ranges::sort(at);
        EXPECT_EQ(std::ranges::adjacent_find(at), at.end()) << p;
    }
}

TEST_F(Appending, HalvesStayIndependentWhereTheyWere) {
    RenderOptions options = small();
    render("old.exr", options);
    EXPECT_TRUE(DumpReader(folder / "old.exr").header().independentHalves);
    const EarlierDump earlier(folder / "old.exr");
    options.spp = 3;
    options.earlier = &earlier;
    render("both.exr", options);
    EXPECT_TRUE(DumpReader(folder / "both.exr").header().independentHalves);
    for (const bool hierarchical : {true, false}) {
        RenderOptions other = small();
        other.hierarchical = hierarchical;
        other.replicates = hierarchical ? 1 : 2;
        render("other.exr", other);
        EXPECT_FALSE(DumpReader(folder / "other.exr").header().independentHalves);
        std::filesystem::remove(folder / "other.exr");
    }
}

TEST_F(Appending, NewSamplesAreAReplicateOfTheirOwn) {
    RenderOptions options = small();
    options.replicates = 2;
    render("old.exr", options);
    const EarlierDump earlier(folder / "old.exr");
    EXPECT_EQ(earlier.freeReplicate(), 2u);
    options = small();
    options.spp = 2;
    options.earlier = &earlier;
    render("both.exr", options);
    const SampleBand both = samplesOf(folder / "both.exr");
    const auto& r = both.values[static_cast<std::size_t>(both.channel("sample.replicate"))];
    EXPECT_EQ(std::vector<float>(r.begin(), r.begin() + 6), (std::vector<float>{0, 0, 1, 1, 2, 2}));
}

TEST_F(Appending, AMapSaysWhereTheSamplesGo) {
    map([](int x, int) { return x < 7 ? 0.f : x < 14 ? 1.f : 5.f; });
    const SampleMap where(folder / "map.exr", {0, 0, 21, 18}, {0, 0, 21, 18});
    RenderOptions options = small();
    options.spp = 5;
    options.map = &where;
    std::vector<SampleBand> bands;
    for (const int threads : {1, 3}) {
        const ThreadLimit limit(threads);
        render("mapped.exr", options);
        bands.push_back(samplesOf(folder / "mapped.exr"));
        std::filesystem::remove(folder / "mapped.exr");
    }
    EXPECT_EQ(bands[0].offsets, bands[1].offsets);
    EXPECT_EQ(bands[0].values, bands[1].values);
    for (std::size_t p = 0; p < bands[0].pixels(); ++p) {
        const double wanted = p % 21 < 7 ? 0 : p % 21 < 14 ? 2.5 : 12.5;
        const auto n = static_cast<double>(bands[0].offsets[p + 1] - bands[0].offsets[p]);
        EXPECT_LT(std::abs(n - wanted), 1) << p;
    }
    EXPECT_NEAR(static_cast<double>(bands[0].samples()), 5 * 21 * 18, 40);
}

// The samples that a band gets, where they depend on the whole picture: of a map, and added to a dump.
TEST_F(Appending, BandsAreTheRowsOfTheWhole) {
    map([](int x, int y) { return static_cast<float>((x + 3 * y) % 5); });
    const SampleMap map(folder / "map.exr", {0, 0, 21, 18}, {0, 0, 21, 18});
    RenderOptions options = small();
    options.replicates = 2;
    render("old.exr", options);
    const EarlierDump earlier(folder / "old.exr");
    RenderOptions more = small();
    more.map = &map;
    more.earlier = &earlier;
    for (RenderOptions of : {options, more}) {
        render("whole.exr", of);
        const SampleBand whole = samplesOf(folder / "whole.exr");
        std::vector<std::uint64_t> offsets = {0};
        std::vector<std::vector<float>> values(whole.values.size());
        for (int i = 0; i < 4; ++i) {  // at rows 4, 9, 13: not those of regions
            of.band = {i, 4};
            render("band.exr", of);
            const DumpReader reader(folder / "band.exr");
            EXPECT_EQ(reader.header().samples, DumpReader(folder / "whole.exr").header().samples);
            const SampleBand band = samplesOf(folder / "band.exr");
            const std::uint64_t before = offsets.back();
            for (std::size_t p = 1; p < band.offsets.size(); ++p) offsets.push_back(before + band.offsets[p]);
            for (std::size_t c = 0; c < values.size(); ++c)
                values[c].insert(values[c].end(), band.values[c].begin(), band.values[c].end());
        }
        EXPECT_EQ(offsets, whole.offsets);
        EXPECT_EQ(values, whole.values);
    }
    RenderOptions tooMany = small();
    tooMany.band = {0, 19};
    EXPECT_THROW(render("band.exr", tooMany), Error);
}

TEST_F(Appending, BadMapsAndDumpsAreErrorsThatSayWhatWasFound) {
    const Window whole{0, 0, 21, 18};
    const auto message = [&](const Window& window, const Window& picture = {0, 0, 21, 18}) -> std::string {
        try {
            const SampleMap m(folder / "map.exr", picture, window);
        } catch (const Error& e) {
            return e.what();
        }
        return "no error";
    };
    map([](int x, int) { return x == 4 ? -1.f : 1.f; });
    EXPECT_NE(message(whole).find("column 4, row 0"), std::string::npos) << message(whole);
    map([](int, int) { return 0.f; });
    EXPECT_NE(message(whole).find("found none"), std::string::npos);
    map([](int, int) { return 1.f; }, "Y");
    EXPECT_EQ(message(whole), "no error");
    EXPECT_NE(message({0, 0, 22, 18}).find("expected 22 x 18"), std::string::npos) << message({0, 0, 22, 18});
    EXPECT_EQ(message({2, 3, 4, 5}), "no error");
    EXPECT_NE(message({0, 0, 4, 4}, {0, 0, 4, 4}).find("found one with 21 x 18"), std::string::npos)
        << message({0, 0, 4, 4}, {0, 0, 4, 4});
    writeImage(folder / "map.exr", Image(whole, {"R", "G", "B"}));
    EXPECT_NE(message(whole).find("found R, G, B"), std::string::npos) << message(whole);

    render("old.exr", small());
    const EarlierDump earlier(folder / "old.exr");
    RenderOptions options = small();
    options.earlier = &earlier;
    options.width = 22;
    EXPECT_THROW(render("bad.exr", options), Error);
    options = small();
    options.earlier = &earlier;
    scene.cameras[0].toWorld.m[0][3] += 0.5;
    EXPECT_THROW(render("bad.exr", options), Error);
    EXPECT_THROW(EarlierDump(folder / "map.exr"), Error);
    EXPECT_FALSE(std::filesystem::exists(folder / "bad.exr"));
    options.hierarchical = true;
    EXPECT_TRUE(options.validate(scene));
}

TEST_F(Appending, ThePilotKnowsTheErrorOfTheMean) {
    RenderOptions options = small();
    const PilotMeasure pilot = pilotMeasure(scene, accelerator, options, 0);
    EXPECT_GT(pilot.secondsPerSample, 0);
    options.spp = 1024;
    render("truth.exr", options);
    const Image t = readImage(folder / "truth.exr");
    // Two renderings of few samples differ by twice the variance of each.
    options.spp = 2;
    constexpr int kPairs = 8;
    double error = 0;
    for (int pair = 0; pair < kPairs; ++pair) {
        options.seed = 1 + 2 * static_cast<std::uint64_t>(pair);
        render("a.exr", options);
        ++options.seed;
        render("b.exr", options);
        const Image a = readImage(folder / "a.exr"), b = readImage(folder / "b.exr");
        for (int y = 0; y < 18; ++y)
            for (int x = 0; x < 21; ++x)
                for (const char* name : {"R", "G", "B"}) {
                    const auto at = [&](const Image& i) { return i.at(x, y)[i.channel(name)]; };
                    error += std::pow(at(a) - at(b), 2) / 2 / (at(t) * at(t) + 0.01) / (3 * 21 * 18 * kPairs);
                }
    }
    // Of both a few bright pixels are most: they are known to a factor. The pilot's is less, as a bright
    // sample is part of the mean of 16 that its variance is divided by.
    EXPECT_LT(error, 4 * pilot.relativeVariance / 2);
    EXPECT_GT(error, 0.2 * pilot.relativeVariance / 2);
}

}  // namespace
}  // namespace vlx::render
