#include <gtest/gtest.h>

#include <functional>

#include "render/film/region_sampling.h"
#include "render/integrator/integrator.h"
#include "test_scene.h"
#include "variolux/base/hash.h"

/// White surfaces whose shading normals differ from their triangles' are as bright as their white
/// surroundings: what a lobe about the shading normal would send into the surface must not be lost.
namespace vlx::render {
namespace {

constexpr int kSide = 24;  // pixels
#ifdef VARIOLUX_SANITIZED
constexpr int kBlocks = 8, kSamples = 2;
constexpr double kMeanError = 0.05;
constexpr double kSigmas = 20;  // beside kPixelError; errors of 8 blocks of 2 samples have long tails
#else
constexpr int kBlocks = 8, kSamples = 16;  // samples in each block
constexpr double kMeanError = 0.01;
constexpr double kSigmas = 6;  // beside kPixelError; the seeds are fixed
#endif
constexpr double kPixelError = 0.1;  // noise apart

/// Mean and standard error, from blocks of samples, of the pixels that the object covers altogether.
struct Pixel {
    double mean = 0;
    double error = 0;
};

std::vector<Pixel> rendered(const Scene& scene, IntegratorKind kind) {
    const Accelerator accelerator(scene);
    const View view(scene.cameras[0], kSide, kSide);
    PathOptions options;
    options.maxBounces = 100;
    const auto integrator = makeIntegrator(kind, scene, accelerator, view, {0, 0, kSide, kSide}, options);
    std::vector<Pixel> pixels(kSide * kSide);
    std::vector<char> covered(pixels.size(), 1);
    for (int block = 0; block < kBlocks; ++block) {
        std::vector<double> sum(pixels.size(), 0);
        std::vector<Splat> splats;
        for (std::size_t pixel = 0; pixel < sum.size(); ++pixel)
            for (int i = 0; i < kSamples; ++i) {
                const PathSample s = integrator->trace(
                    sampleInPixel(static_cast<int>(pixel % kSide), static_cast<int>(pixel / kSide),
                                  hashOf(block, pixel, 3), static_cast<std::uint32_t>(i)),
                    splats);
                sum[pixel] += s.radiance.y;
                covered[pixel] = covered[pixel] && s.hit;
            }
        for (const Splat& s : splats)
            sum[static_cast<std::size_t>(s.y) * kSide + static_cast<std::size_t>(s.x)] +=
                s.radiance.y / (kSide * kSide);
        for (std::size_t i = 0; i < sum.size(); ++i) {
            pixels[i].mean += sum[i] / (kSamples * kBlocks);
            pixels[i].error += sum[i] * sum[i] / (kSamples * kSamples * kBlocks);  // until all are known
        }
    }
    std::vector<Pixel> object;
    for (std::size_t i = 0; i < pixels.size(); ++i) {
        const Pixel& p = pixels[i];
        if (covered[i])
            object.push_back({p.mean, std::sqrt(std::max(0.0, p.error - p.mean * p.mean) / (kBlocks - 1))});
    }
    return object;
}

struct Finish {
    const char* name;
    Material material;
};

/// White materials of every kind of lobe.
std::vector<Finish> finishes() {
    const auto of = [](float metallic, float roughness) {
        Material m = TestScene::matte({1, 1, 1});
        m.specular = 1;
        m.metallic = metallic;
        m.roughness = roughness;
        return m;
    };
    const auto coated = [&](float roughness) {
        Material m = of(0, 0.6f);
        m.clearcoat = 1;
        m.clearcoatRoughness = roughness;
        return m;
    };
    Material sheen = of(0, 0.5f);
    sheen.sheenColour = Rgb(0.8f);
    sheen.sheenRoughness = 0.4f;
    return {{"mirror", of(1, 0)},
            {"rough metal", of(1, 0.2f)},
            {"rougher metal", of(1, 0.6f)},
            {"roughest metal", of(1, 1)},
            {"glossy", of(0, 0.2f)},
            {"polished", of(0, 0)},
            {"matte", TestScene::matte({1, 1, 1})},
            {"coated", coated(0)},
            {"roughly coated", coated(0.3f)},
            {"sheen", sheen},
            {"glass", TestScene::glass(1.5f, 0)},
            {"rough glass", TestScene::glass(1.5f, 0.3f)}};
}

void expectWhite(const std::function<void(TestScene&, std::uint32_t material)>& object,
                 const std::function<void(Material&)>& change = {}, bool glass = true) {
    for (auto& [name, material] : finishes()) {
        if (material.transmission > 0 && !glass) continue;
        for (const auto kind : {IntegratorKind::Path, IntegratorKind::Bidirectional}) {
            SCOPED_TRACE(std::string(name) + (kind == IntegratorKind::Path ? ", path" : ", bidirectional"));
            TestScene t;
            Material m = material;
            if (change) change(m);
            object(t, t.material(m));
            t.environment(Environment(Rgb(1)));
            const std::vector<Pixel> pixels = rendered(t.finish(), kind);
            ASSERT_GT(pixels.size(), 20u);
            double sum = 0;
            for (const Pixel& p : pixels) {
                sum += p.mean;
                ASSERT_NEAR(p.mean, 1, kPixelError + kSigmas * p.error);
            }
            EXPECT_NEAR(sum / static_cast<double>(pixels.size()), 1, kMeanError);
        }
    }
}

TEST(FurnaceOfShadingNormals, SmoothSphereOfFewTriangles) {
    expectWhite([](TestScene& t, std::uint32_t m) {
        t.sphere(m, {0, 0, 0}, 1, 4);
        t.camera({0, 0, 5}, {0, 0, 0}, 0.41f);
    });
}

/// A map of waves, its normals tilted by up to `tilt` in all directions.
TextureRef waves(TestScene& t, float tilt) {
    constexpr int n = 16;
    std::vector<float> texels;
    for (int y = 0; y < n; ++y)
        for (int x = 0; x < n; ++x) {
            const auto at = [](int i) { return std::sin(2 * kPi * (static_cast<float>(i) + 0.5f) / n); };
            const float r = std::tan(tilt) * std::numbers::sqrt2_v<float> / 2;
            const Vec3 v = normalized(Vec3{r * at(x), r * at(y), 1});
            texels.insert(texels.end(), {0.5f + 0.5f * v.x, 0.5f + 0.5f * v.y, 0.5f + 0.5f * v.z, 1});
        }
    t.scene().textures.emplace_back(n, n, texels, ColourSpace::Linear);
    TextureRef ref;
    ref.texture = static_cast<int>(t.scene().textures.size()) - 1;
    return ref;
}

TEST(FurnaceOfShadingNormals, NormalMappedPlaneFromSeveralAngles) {
    for (const float degrees : {0.f, 45.f, 75.f, 85.f}) {
        SCOPED_TRACE(degrees);
        const float angle = degrees * kPi / 180;
        expectWhite(
            [&](TestScene& t, std::uint32_t m) {
                t.scene().materials[m].normalTexture = waves(t, 60 * kPi / 180);
                t.quad(m, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
                t.camera(Vec3{0, -std::sin(angle), std::cos(angle)} * 8, {0, 0, 0}, 0.2f);
            },
            {}, false);
    }
}

}  // namespace
}  // namespace vlx::render
