#include "render/light/light_tree.h"

#include <gtest/gtest.h>

#include "render/light/light_sampler.h"
#include "test_scene.h"

namespace vlx::render {
namespace {

/// Lights of all kinds all over the place.
std::vector<LightCandidate> manyLights(int n) {
    std::vector<LightCandidate> lights;
    for (int i = 0; i < n; ++i) {
        const auto u = [&](int k) { return static_cast<float>(hashOf(i, k) % 10000) / 10000; };
        LightCandidate c;
        c.position = {20 * u(0) - 10, 4 * u(1), 20 * u(2) - 10};
        c.strength = 0.1f + u(3) * u(3) * 5;
        c.type = i % 7 == 0 ? LightType::Mesh : i % 7 == 1 ? LightType::Sphere : LightType::Point;
        c.radius = c.type == LightType::Point ? 0 : 0.3f * u(4);
        c.area = 0.5f * u(5);
        lights.push_back(c);
    }
    lights[3].type = LightType::Directional;
    lights[3].direction = {0, -1, 0};
    lights[5].type = LightType::Environment;
    return lights;
}

TEST(LightTree, ProbabilitiesAreThoseOfItsChoicesAndSumToOneAtMost) {
    const auto lights = manyLights(300);
    const LightTree tree(lights);
    for (const Vec3& normal : {Vec3{0, 1, 0}, Vec3{1, 0, 0}, Vec3{0, -1, 0}}) {
        const Receiver receiver{{0.3f, 0.5f, -0.2f}, normal, false};
        double total = 0;
        for (std::size_t i = 0; i < lights.size(); ++i) {
            const float p = tree.probability(lights, receiver, i);
            if (lightImportance(receiver, lights[i]) > 0) {
                EXPECT_GT(p, 0) << i;
            }
            total += p;
        }
        EXPECT_LE(total, 1 + 1e-4);
        EXPECT_GT(total, 0.5);
        for (int k = 0; k < 2000; ++k) {
            const auto c = tree.choose(lights, receiver, (static_cast<float>(k) + 0.5f) / 2000);
            if (c.probability == 0) continue;
            ASSERT_LT(c.light, lights.size());
            EXPECT_NEAR(c.probability, tree.probability(lights, receiver, c.light),
                        1e-5f * c.probability + 1e-9f);
        }
    }
}

TEST(LightTree, ChoosesAsOftenAsItSays) {
    const auto lights = manyLights(64);
    const LightTree tree(lights);
    const Receiver receiver{{0.3f, 0.5f, -0.2f}, {0, 1, 0}, false};
    std::vector<int> counts(lights.size());
    constexpr int n = 200000;
    for (int k = 0; k < n; ++k) {
        const auto c = tree.choose(lights, receiver, (static_cast<float>(k) + 0.5f) / n);
        if (c.probability > 0) ++counts[c.light];
    }
    for (std::size_t i = 0; i < lights.size(); ++i)
        EXPECT_NEAR(counts[i] / static_cast<double>(n), tree.probability(lights, receiver, i), 1e-3) << i;
}

TEST(LightImportance, OfFourReceiversIsThatOfEachBitForBit) {
    auto lights = manyLights(64);
    lights[8].type = LightType::Spot;
    lights[8].direction = normalized(Vec3{0.2f, -1, 0.1f});
    lights[8].coneScale = 3;
    lights[8].coneOffset = -2;
    lights[8].coneStep = 1;
    const Vec3 lamp = lights[0].position;
    const std::array<Receiver, 4> receivers = {
        Receiver{{0.3f, 0.5f, -0.2f}, normalized(Vec3{0.3f, 1, 0.1f}), false},
        Receiver{{0.3f, 0.5f, -0.2f}, normalized(Vec3{0.3f, 1, 0.1f}), true},
        Receiver{{-7, 0.1f, 2}, normalized(Vec3{0.3f, -1, 0.1f}), false}, Receiver{lamp, {0, 1, 0}, false}};
    const ReceiverOf<Lanes> four = {vectorsOf([&](std::size_t i) { return receivers[i].position; }),
                                    vectorsOf([&](std::size_t i) { return receivers[i].normal; }),
                                    maskOf([&](std::size_t i) { return receivers[i].bothSides; })};
    for (const LightCandidate& light : lights) {
        const Lanes found = lightImportance(four, light);
        for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(found[i], lightImportance(receivers[i], light)) << i;
    }
}

/// A floor under 10^4 small lamps, and what lies under one point of it in closed form.
struct LampField {
    Scene scene;
    double radiance = 0;
    double deviationByPower = 0;  ///< of a sample that chooses its lamp by power alone
};

LampField lampField() {
    constexpr int n = 10000, side = 100;
    TestScene t;
    t.quad(t.material(TestScene::matte(Rgb(1))), {-90, 0, 90}, {90, 0, 90}, {90, 0, -90}, {-90, 0, -90});
    double sum = 0, squares = 0, power = 0;
    for (int i = 0; i < n; ++i) {
        Light light;
        light.position = {0.7f * static_cast<float>(i % side - side / 2) + 0.1f, 0.5f,
                          0.7f * static_cast<float>(i / side - side / 2)};
        light.intensity = Rgb(0.05f + 0.01f * static_cast<float>(i % 13));
        t.light(light);
        const Vec3 to = light.position - Vec3{0.2f, 0, 0.1f};
        const double part = light.intensity.x * to.y / length(to) / lengthSquared(to) * kInvPi;
        sum += part;
        squares += part * part / light.intensity.x;
        power += light.intensity.x;
    }
    return {t.finish(), sum, std::sqrt(squares * power - sum * sum)};
}

TEST(ManyLights, TenThousandAreSummedWithLittleNoise) {
    const LampField field = lampField();
    constexpr int n = 20000;
    const Estimate e = estimate(field.scene, {{0.2f, 1, 0.1f}, {0, -1, 0}}, n);
    EXPECT_NEAR(e.mean[0], field.radiance, 4 * e.error[0]);
    EXPECT_LT(10 * e.error[0] * std::sqrt(n), field.deviationByPower);
}

TEST(ManyLights, MeshLightsFoundByChanceShareTheirWeight) {
    std::vector<Estimate> results;
    for (const Strategy strategy : {Strategy::Mis, Strategy::LightsOnly, Strategy::BsdfOnly}) {
        TestScene t;
        t.quad(t.material(TestScene::matte(Rgb(0.8f))), {-9, 0, 9}, {9, 0, 9}, {9, 0, -9}, {-9, 0, -9});
        const auto glow = t.material(TestScene::emitter(Rgb(3)));
        for (int i = 0; i < 64; ++i) {
            const float x = static_cast<float>(i % 8) - 4, z = static_cast<float>(i / 8) - 4;
            t.quad(glow, {x, 1, z}, {x + 0.5f, 1, z}, {x + 0.5f, 1, z + 0.5f}, {x, 1, z + 0.5f});
        }
        PathOptions options;
        options.strategy = strategy;
        options.maxBounces = 1;
        results.push_back(estimate(t.finish(), {{0.8f, 0.5f, 0.8f}, {0, -1, 0}}, 40000, options));
    }
    for (const Estimate& e : results)
        EXPECT_NEAR(e.mean[0], results[0].mean[0], 4 * std::hypot(e.error[0], results[0].error[0]));
}

}  // namespace
}  // namespace vlx::render
