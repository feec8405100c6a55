#include "render.h"

#include <gtest/gtest.h>

#include <cmath>

#include "../base/temporary_folder.h"
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

}  // namespace
}  // namespace vlx::render
