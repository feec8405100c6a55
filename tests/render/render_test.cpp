#include "render/film/render.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "../base/temporary_folder.h"
#include "render/pilot/choose_integrator.h"
#include "test_scene.h"
#include "variolux/base/parallel.h"
#include "variolux/dump/reader.h"

namespace vlx::render {
namespace {

/// A room with glass, a coincident pair of surfaces, a veil and a lens: whatever could depend on the threads.
Scene room() {
    TestScene t;
    t.box(t.material(TestScene::matte({0.7f, 0.6f, 0.5f})), {-2, 0, -2}, {2, 3, 2});
    t.sphere(t.material(TestScene::glass(1.5f, 0)), {-0.6f, 0.7f, 0}, 0.6f);
    Material veil = TestScene::matte({0.3f, 0.8f, 0.3f});
    veil.alphaMode = AlphaMode::Blend;
    veil.opacity = 0.5f;
    t.quad(t.material(veil), {0.2f, 0.2f, 0.5f}, {1.4f, 0.2f, 0.5f}, {1.4f, 1.6f, 0.5f}, {0.2f, 1.6f, 0.5f});
    for (const Rgb& c : {Rgb{1, 0, 0}, Rgb{0, 0, 1}})
        t.quad(t.material(TestScene::matte(c)), {-1.9f, 0.01f, 1.9f}, {1.9f, 0.01f, 1.9f},
               {1.9f, 0.01f, -1.9f}, {-1.9f, 0.01f, -1.9f});
    t.quad(t.material(TestScene::emitter(Rgb(8))), {-0.5f, 2.9f, -0.5f}, {0.5f, 2.9f, -0.5f},
           {0.5f, 2.9f, 0.5f}, {-0.5f, 2.9f, 0.5f});
    t.camera({0, 1.2f, 1.9f}, {0, 1, 0}, 1.2f);
    t.scene().cameras[0].lensRadius = 0.05f;
    t.scene().cameras[0].focusDistance = 2;
    return t.finish();
}

RenderOptions small(bool hierarchical) {
    RenderOptions options;
    options.width = 37;
    options.height = 22;
    options.spp = 6;
    options.hierarchical = hierarchical;
    options.refinement.levels = 3;
    options.refinement.tolerance = 0.2;
    options.seed = 5;
    return options;
}

/// Everything in a dump but the time it took.
SampleBand samplesOf(const std::string& path) {
    const DumpReader reader(path);
    return reader.read(reader.header().data.y, reader.header().data.height);
}

TEST(RenderDump, IsTheSameForAnyNumberOfThreads) {
    const TemporaryFolder folder;
    const Scene scene = room();
    for (const bool hierarchical : {false, true}) {
        std::vector<SampleBand> bands;
        for (const int threads : {1, 2, 8}) {
            const ThreadLimit limit(threads);
            const Accelerator accelerator(scene);
            const std::string path = folder / ("t" + std::to_string(threads) + ".exr");
            renderDump(scene, accelerator, path, small(hierarchical));
            bands.push_back(samplesOf(path));
        }
        for (std::size_t i = 1; i < bands.size(); ++i) {
            EXPECT_EQ(bands[i].offsets, bands[0].offsets);
            EXPECT_EQ(bands[i].values, bands[0].values);
        }
    }
}

TEST(RenderDump, AnotherSeedIsOtherNoise) {
    const TemporaryFolder folder;
    const Scene scene = room();
    const Accelerator accelerator(scene);
    RenderOptions options = small(false);
    renderDump(scene, accelerator, folder / "a.exr", options);
    options.seed = 6;
    renderDump(scene, accelerator, folder / "b.exr", options);
    const SampleBand a = samplesOf(folder / "a.exr"), b = samplesOf(folder / "b.exr");
    const auto r = static_cast<std::size_t>(a.channel("R"));
    EXPECT_NE(a.values[r], b.values[r]);
}

TEST(RenderDump, ACropIsThatPartOfThePicture) {
    const TemporaryFolder folder;
    const Scene scene = room();
    const Accelerator accelerator(scene);
    RenderOptions options = small(false);
    renderDump(scene, accelerator, folder / "whole.exr", options);
    options.crop = Window{5, 3, 9, 11};
    renderDump(scene, accelerator, folder / "crop.exr", options);
    const DumpReader reader(folder / "crop.exr");
    EXPECT_EQ(reader.header().data, *options.crop);
    EXPECT_EQ(reader.header().display, (Window{0, 0, 37, 22}));
    const SampleBand whole = samplesOf(folder / "whole.exr"), crop = samplesOf(folder / "crop.exr");
    for (int y = 0; y < 11; ++y) {
        for (int x = 0; x < 9; ++x) {
            const auto p = static_cast<std::size_t>(y * 9 + x),
                       q = static_cast<std::size_t>((y + 3) * 37 + x + 5);
            ASSERT_EQ(crop.offsets[p + 1] - crop.offsets[p], 6u);
            for (std::size_t c = 0; c < crop.values.size(); ++c)
                for (std::size_t s = 0; s < 6; ++s)
                    ASSERT_EQ(crop.values[c][crop.offsets[p] + s], whole.values[c][whole.offsets[q] + s]);
        }
    }
}

TEST(RenderDump, HeaderSaysWhatWasDone) {
    const TemporaryFolder folder;
    const Scene scene = room();
    const Accelerator accelerator(scene);
    RenderOptions options = small(false);
    options.version = "1.2.3";
    const RenderReport report = renderDump(scene, accelerator, folder / "d.exr", options);
    EXPECT_EQ(report.samples, 37u * 22 * 6);
    EXPECT_EQ(report.nonFinite, 0u);
    const DumpReader reader(folder / "d.exr");
    const DumpHeader& h = reader.header();
    EXPECT_EQ(h.renderer, "vlx-trace 1.2.3");
    EXPECT_EQ(h.scene, "test");
    EXPECT_EQ(h.pixelFilter, "box");
    EXPECT_EQ(h.seed, 5);
    EXPECT_EQ(h.samples, 6);
    EXPECT_EQ(h.effects,
              (std::vector<std::string>{"diffuse", "mirror", "transmission", "alpha", "emissive_meshes",
                                        "depth_of_field", "indirect", "caustics"}));
    ASSERT_TRUE(h.worldToCamera && h.worldToNDC && h.renderSeconds);
    EXPECT_EQ(findChannel(h, "sample.replicate"), -1);
    EXPECT_EQ(h.channels.size(), 13u);
}

TEST(RenderDump, FeaturesAreInRange) {
    const TemporaryFolder folder;
    const Scene scene = room();
    const Accelerator accelerator(scene);
    renderDump(scene, accelerator, folder / "d.exr", small(false));
    const SampleBand band = samplesOf(folder / "d.exr");
    const auto channel = [&](const char* name) -> const std::vector<float>& {
        return band.values[static_cast<std::size_t>(band.channel(name))];
    };
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        for (std::uint64_t s = band.offsets[p]; s < band.offsets[p + 1]; ++s) {
            EXPECT_EQ(std::floor(channel("sample.x")[s]), static_cast<float>(p % 37));
            EXPECT_EQ(std::floor(channel("sample.y")[s]), static_cast<float>(p / 37));
            EXPECT_GE(channel("R")[s], 0);
            EXPECT_EQ(channel("A")[s], 1);  // a closed room
            EXPECT_GT(channel("Z")[s], 0);
            EXPECT_LE(channel("albedo.G")[s], 1.01f);
            const Vec3 n{channel("N.X")[s], channel("N.Y")[s], channel("N.Z")[s]};
            EXPECT_NEAR(length(n), 1, 2e-3f);
        }
    }
}

TEST(RenderDump, ReplicatesAreWritten) {
    const TemporaryFolder folder;
    const Scene scene = room();
    const Accelerator accelerator(scene);
    RenderOptions options = small(false);
    options.replicates = 3;
    renderDump(scene, accelerator, folder / "d.exr", options);
    const SampleBand band = samplesOf(folder / "d.exr");
    const int c = band.channel("sample.replicate");
    ASSERT_GE(c, 0);
    const auto& r = band.values[static_cast<std::size_t>(c)];
    EXPECT_EQ(std::vector<float>(r.begin(), r.begin() + 6), (std::vector<float>{0, 0, 1, 1, 2, 2}));
}

TEST(RenderOptions, ValidateNamesWhatIsWrong) {
    const Scene scene = room();
    RenderOptions options;
    EXPECT_EQ(options.validate(scene), std::nullopt);
    options.crop = Window{500, 0, 13, 4};
    EXPECT_NE(options.validate(scene).value_or("").find("crop"), std::string::npos);
    options = {};
    options.replicates = 5;
    EXPECT_NE(options.validate(scene).value_or("").find("replicates"), std::string::npos);
    options = {};
    options.camera = 1;
    EXPECT_NE(options.validate(scene).value_or("").find("camera"), std::string::npos);
}

RenderOptions bidirectional() {
    RenderOptions options = small(false);
    options.integrator = IntegratorKind::Bidirectional;
    return options;
}

TEST(RenderDumpBidirectional, IsTheSameForAnyNumberOfThreads) {
    const TemporaryFolder folder;
    const Scene scene = room();
    std::vector<SampleBand> bands;
    for (const int threads : {1, 2, 8}) {
        const ThreadLimit limit(threads);
        const Accelerator accelerator(scene);
        renderDump(scene, accelerator, folder / "a.exr", bidirectional());
        bands.push_back(samplesOf(folder / "a.exr"));
    }
    EXPECT_EQ(DumpReader(folder / "a.exr").header().splatReplicates, 6);
    for (std::size_t i = 1; i < bands.size(); ++i) EXPECT_EQ(bands[i].values, bands[0].values);
}

/// Mean luminance of a window, and its standard error, from replicates.
std::pair<double, double> meanOf(const std::string& path, const Window& window) {
    const DumpReader reader(path);
    const SampleBand band = reader.read(window.y, window.height, {"R", "G", "B", "sample.replicate"});
    std::map<float, double> sums;
    for (std::size_t p = 0; p < band.pixels(); ++p) {
        const int x = band.x + static_cast<int>(p % static_cast<std::size_t>(band.width));
        if (x < window.x || x >= window.x + window.width) continue;
        for (auto i = band.offsets[p]; i < band.offsets[p + 1]; ++i)
            sums[band.values[3][i]] += luminance({band.values[0][i], band.values[1][i], band.values[2][i]});
    }
    double mean = 0, squares = 0;
    const auto n = static_cast<double>(sums.size());
    for (const auto& [replicate, sum] : sums) {
        const double v = sum * n / static_cast<double>(window.pixels()) / reader.header().samples.value();
        mean += v / n;
        squares += v * v / n;
    }
    return {mean, std::sqrt((squares - mean * mean) / (n - 1))};
}

TEST(RenderDumpBidirectional, CropsAndPicturesOfBothIntegratorsAgree) {
    const TemporaryFolder folder;
    const Scene scene = room();
    const Accelerator accelerator(scene);
    RenderOptions options = bidirectional();
    options.spp = 32;
    renderDump(scene, accelerator, folder / "both.exr", options);
    const Window crop{7, 3, 12, 9};
    options.crop = crop;
    options.seed = 8;
    options.spp = 64;
    renderDump(scene, accelerator, folder / "crop.exr", options);
    options.integrator = IntegratorKind::Path;
    options.replicates = 32;
    options.seed = 9;
    renderDump(scene, accelerator, folder / "path.exr", options);
    const auto [path, pathError] = meanOf(folder / "path.exr", crop);
    for (const char* name : {"both.exr", "crop.exr"}) {
        const auto [mean, error] = meanOf(folder / name, crop);
        EXPECT_NEAR(mean, path, 4 * std::hypot(error, pathError)) << name;  // one false alarm in 3,000
        EXPECT_LT(error, 0.1 * mean);
    }
}

TEST(RenderDumpBidirectional, SaysWhatItCannotDo) {
    const Scene scene = room();
    const auto fault = [&](auto change) {
        RenderOptions options = bidirectional();
        change(options);
        return options.validate(scene).value_or("");
    };
    EXPECT_EQ(fault([](RenderOptions&) {}), "");
    EXPECT_NE(fault([](RenderOptions& o) { o.hierarchical = true; }).find("hierarchical"), std::string::npos);
    EXPECT_NE(fault([](RenderOptions& o) {
                  o.band = {1, 3};
              }).find("--integrator path"),
              std::string::npos)
        << "bands would lack each other's splats";
    EXPECT_NE(fault([](RenderOptions& o) { o.spp = 67; }).find("divisor"), std::string::npos);
    EXPECT_NE(fault([](RenderOptions& o) { o.spp = o.replicates = 65; }).find("at most 64"),
              std::string::npos);
    EXPECT_NE(fault([](RenderOptions& o) { o.path.leftOut.set(Effect::Caustics); }).find("caustics"),
              std::string::npos);
}

IntegratorChoice choiceFor(const Scene& scene, double samples) {
    RenderOptions options;
    options.width = options.height = 64;
    const Plan plan = planEffects(scene, {0, 64, 64, 12, {}});
    options.follow(plan);
    const Accelerator accelerator(scene);
    const IntegratorChoice a = chooseIntegrator(scene, accelerator, options, samples);
    const IntegratorChoice b = chooseIntegrator(scene, accelerator, options, samples);
    EXPECT_EQ(a.reason, b.reason);
    return a;
}

TEST(ChooseIntegrator, FollowsLightThroughGlassWherePathsMissIt) {
    for (const bool glass : {true, false}) {
        TestScene t;
        t.quad(t.material(TestScene::matte(Rgb(0.7f))), {-4, 0, 4}, {4, 0, 4}, {4, 0, -4}, {-4, 0, -4});
        t.sphere(t.material(glass ? TestScene::glass(1.5f, 0) : TestScene::matte(Rgb(0.5f))), {0, 0.75f, 0},
                 0.5f, 16);
        Light l;
        l.type = LightType::Sphere;
        l.intensity = Rgb(10);
        l.position = {-1.4f, 2.6f, -0.8f};
        l.radius = 0.04f;
        t.light(l);
        t.camera({0, 2.6f, 4.4f}, {0, 0.3f, 0}, 0.7f);
        const Scene scene = t.finish();
        const IntegratorChoice choice = choiceFor(scene, 1e6);
        EXPECT_EQ(choice.chosen, glass ? IntegratorKind::Bidirectional : IntegratorKind::Path)
            << choice.reason;
        EXPECT_EQ(choice.tried, glass) << choice.reason;
        EXPECT_EQ(choiceFor(scene, 100).chosen, IntegratorKind::Path);
    }
}

TEST(ChooseIntegrator, WithoutLightsIsPath) {
    TestScene t;
    t.box(t.material(TestScene::matte(Rgb(0.5f))), {-1, -1, -1}, {1, 1, 1});
    t.camera({0, 0, 0.5f}, {0, 0, 0}, 1);
    const IntegratorChoice choice = choiceFor(t.finish(), 1e6);
    EXPECT_EQ(choice.chosen, IntegratorKind::Path);
    EXPECT_NE(choice.reason.find("no lights"), std::string::npos);
}

}  // namespace
}  // namespace vlx::render
