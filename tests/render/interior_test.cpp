#include <gtest/gtest.h>

#include <array>

#include "render/film/region_sampling.h"
#include "render/integrator/integrator.h"
#include "render/scene/accelerator.h"
#include "render/scene/scene_loader.h"
#include "variolux/base/image_io.h"
#include "variolux/base/parallel.h"

namespace vlx::render {
namespace {

/// The demo room by its default camera, the plain mean of `spp` samples.
Image render(const Scene& scene, const Accelerator& accelerator, int size, int spp) {
    const View view(scene.cameras[scene.activeCamera], size, size);
    const auto integrator =
        makeIntegrator(IntegratorKind::Path, scene, accelerator, view, {0, 0, size, size}, {});
    Image image({0, 0, size, size}, {"R", "G", "B"});
    parallelFor(0, size, [&](std::int64_t row) {
        const int y = static_cast<int>(row);
        std::vector<Splat> splats;
        sampleUniformly({0, y, size, 1}, spp, 1, 17, [&](const CameraSample& s) {
            const Rgb v = integrator->trace(s, splats).radiance;
            float* p = image.at(s.column, s.row);
            p[0] += v.x / static_cast<float>(spp);
            p[1] += v.y / static_cast<float>(spp);
            p[2] += v.z / static_cast<float>(spp);
            return v;
        });
    });
    return image;
}

struct Comparison {
    std::array<double, 3> ratio{};  ///< of the means
    double relMse = 0;
};

Comparison compare(const Image& image, const Image& reference) {
    Comparison c;
    std::array<double, 3> sum{}, wanted{};
    for (std::size_t i = 0; i < image.pixels.size(); ++i) {
        const double x = image.pixels[i], r = reference.pixels[i];
        sum[i % 3] += x;
        wanted[i % 3] += r;
        c.relMse += (x - r) * (x - r) / (r * r + 0.01) / static_cast<double>(image.pixels.size());
    }
    for (std::size_t k = 0; k < 3; ++k) c.ratio[k] = sum[k] / wanted[k];
    return c;
}

/// Against Cycles: another renderer, with another surface model (Disney's: nothing is taken off the diffuse
/// part for the reflection above it, rough surfaces shine at grazing angles, coats count a quarter) and other
/// edges of the spot's cone. At 256 samples the noise of the image's mean is about 0.3 %.
TEST(Interior, AgreesWithCycles) {
    const Scene scene = loadScene(VLX_TESTDATA "/scenes/interior.glb");
    EXPECT_EQ(scene.triangleCount(), 82572u);
    EXPECT_EQ(scene.lights.size(), 6u);
    EXPECT_EQ(scene.cameras.size(), 3u);
    EXPECT_EQ(scene.cameras[scene.activeCamera].name, "cam_main");
    const Accelerator accelerator(scene);
    const Image reference = readImage(VLX_TESTDATA "/scenes/interior_cycles_64.exr");
#ifdef VARIOLUX_SANITIZED
    const Comparison few = compare(render(scene, accelerator, 64, 4), reference);
    for (const double r : few.ratio) EXPECT_NEAR(r, 1, 0.15);
#else
    const Comparison c4 = compare(render(scene, accelerator, 64, 4), reference);
    const Comparison c16 = compare(render(scene, accelerator, 64, 16), reference);
    const Comparison c64 = compare(render(scene, accelerator, 64, 64), reference);
    const Comparison c256 = compare(render(scene, accelerator, 64, 256), reference);
    const double mean = (c256.ratio[0] + c256.ratio[1] + c256.ratio[2]) / 3;
    EXPECT_NEAR(mean, 1, 0.03);
    // 1/spp towards the floor that the models' difference sets.
    const double floor = 0.008;
    EXPECT_NEAR((c4.relMse - floor) / (c16.relMse - floor), 4, 2);
    EXPECT_NEAR((c16.relMse - floor) / (c64.relMse - floor), 4, 2);
    EXPECT_NEAR((c64.relMse - floor) / (c256.relMse - floor), 4, 2);
    EXPECT_LT(c256.relMse, 0.05);
    RecordProperty("relMse", std::to_string(c4.relMse) + " " + std::to_string(c16.relMse) + " " +
                                 std::to_string(c64.relMse) + " " + std::to_string(c256.relMse));
    RecordProperty("mean", std::to_string(mean));
#endif
}

}  // namespace
}  // namespace vlx::render
