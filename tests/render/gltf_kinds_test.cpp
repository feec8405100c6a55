// Pictures of the files that tests/scenes/make_gltf_kinds.py writes, compared with what it says they show.

#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <nlohmann/json.hpp>

#include "render/film/region_sampling.h"
#include "render/film/render.h"
#include "render/integrator/integrator.h"
#include "render/plan/plan.h"
#include "render/scene/accelerator.h"
#include "render/scene/camera_placement.h"
#include "render/scene/scene_loader.h"

namespace vlx::render {
namespace {

constexpr int kSide = 32;
constexpr int kSpp = 16;
using Picture = std::vector<Rgb>;

nlohmann::ordered_json& kinds() {
    static nlohmann::ordered_json all =
        nlohmann::ordered_json::parse(std::ifstream(VLX_GLTF_KINDS "/kinds.json"));
    return all;
}

/// The camera that vlx-trace makes where there is none.
void placeCamera(Scene& scene) {
    if (!scene.cameras.empty()) return;
    const Viewpoint view = framed(scene.boundsMin, scene.boundsMax, 1);
    Camera& camera = scene.cameras.emplace_back();
    camera.verticalFov = view.verticalDegrees * (kPi / 180);
    camera.toWorld = lookingAt(view.position, view.target);
}

/// The plain mean, as vlx-trace takes it.
Picture trace(Scene scene, IntegratorKind kind) {
    placeCamera(scene);
    const std::size_t camera = scene.activeCamera;
    RenderOptions options;
    const Plan plan = planEffects(scene, {camera, kSide, kSide, options.path.maxBounces, {}});
    applyPlan(scene, plan);
    options.follow(plan);
    const Accelerator accelerator(scene, options.path.effects);
    const auto integrator =
        makeIntegrator(kind, scene, accelerator, View(scene.cameras[camera], kSide, kSide),
                       {0, 0, kSide, kSide}, options.path);
    Picture picture(kSide * kSide);
    std::vector<Splat> splats;
    sampleUniformly({0, 0, kSide, kSide}, kSpp, 1, 5, [&](const CameraSample& s) {
        const Rgb v = integrator->trace(s, splats).radiance;
        picture[static_cast<std::size_t>(s.row * kSide + s.column)] += v * (1.f / kSpp);
        return v;
    });
    for (const Splat& splat : splats) {
        const auto at = static_cast<std::size_t>(splat.y) * kSide + static_cast<std::size_t>(splat.x);
        picture[at] += splat.radiance * (1.f / (kSpp * kSide * kSide));  // each speaks for all pixels
    }
    return picture;
}

/// What lies in a rectangle, unless a later one lies on top of it.
struct Region {
    std::vector<std::size_t> pixels;
    nlohmann::ordered_json rgb;
    double tolerance;
    bool mean;
};

std::vector<Region> regionsOf(const nlohmann::ordered_json& list) {
    std::vector<std::size_t> owner(kSide * kSide, 0);
    std::vector<Region> regions;
    for (const auto& r : list) {
        const std::array<int, 4> box = r["box"];
        for (int y = box[1]; y < box[3]; ++y)
            for (int x = box[0]; x < box[2]; ++x)
                owner[static_cast<std::size_t>(y * kSide + x)] = regions.size();
        regions.push_back({{}, r["rgb"], r["tolerance"], r["mean"]});
    }
    for (std::size_t i = 0; i < owner.size() && !regions.empty(); ++i) regions[owner[i]].pixels.push_back(i);
    return regions;
}

void expectShown(const Picture& picture, const nlohmann::ordered_json& list) {
    for (const Region& region : regionsOf(list)) {
        if (region.rgb.is_null() || region.pixels.empty()) continue;
        const std::array<double, 3> wanted = region.rgb;
        std::array<double, 3> mean{};
        for (const std::size_t i : region.pixels) {
            const std::array<double, 3> found{picture[i].x, picture[i].y, picture[i].z};
            for (std::size_t c = 0; c < 3; ++c) {
                mean[c] += found[c] / static_cast<double>(region.pixels.size());
                if (region.mean) continue;
                ASSERT_NEAR(found[c], wanted[c], region.tolerance)
                    << "channel " << c << " at column " << i % kSide << ", row " << i / kSide;
            }
        }
        for (std::size_t c = 0; c < 3 && region.mean; ++c)
            EXPECT_NEAR(mean[c], wanted[c], region.tolerance) << "mean of channel " << c;
    }
}

class EachKind : public testing::TestWithParam<std::string> {};

TEST_P(EachKind, ShowsWhatItMust) {
    for (const auto& how : kinds()[GetParam()]) {
        Shutter shutter;
        if (how.contains("shutter")) shutter = {how["shutter"][0], how["shutter"][1]};
        const std::string variant = how.value("variant", "");
        SCOPED_TRACE("shutter " + how.value("shutter", nlohmann::ordered_json()).dump() + " variant " +
                     variant);
        EnvironmentOptions environment;
        if (how.contains("environment")) {
            const std::array<float, 3> all = how["environment"];
            environment.constant = Rgb{all[0], all[1], all[2]};
        }
        const Scene scene =
            loadScene(VLX_GLTF_KINDS "/" + GetParam() + ".gltf", environment, shutter, {.variant = variant});
        for (const IntegratorKind integrator : {IntegratorKind::Path, IntegratorKind::Bidirectional})
            expectShown(trace(scene, integrator), how["regions"]);
    }
}

std::vector<std::string> names() {
    std::vector<std::string> list;
    for (const auto& [name, pictures] : kinds().items()) list.push_back(name);
    return list;
}

INSTANTIATE_TEST_SUITE_P(Kinds, EachKind, testing::ValuesIn(names()),
                         [](const auto& name) { return name.param; });

}  // namespace
}  // namespace vlx::render
