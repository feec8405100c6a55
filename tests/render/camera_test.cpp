#include "render/scene/camera.h"

#include <gtest/gtest.h>

#include <array>

#include "test_scene.h"

namespace vlx::render {
namespace {

Camera cameraAt(const Vec3& eye, const Vec3& target, float fov) {
    TestScene t;
    t.camera(eye, target, fov);
    return t.scene().cameras[0];
}

/// p M with row vectors, divided by w.
Vec3 project(const Vec3& p, const std::vector<float>& m) {
    std::array<float, 4> out{};
    const std::array<float, 4> in{p.x, p.y, p.z, 1};
    for (std::size_t j = 0; j < 4; ++j)
        for (std::size_t i = 0; i < 4; ++i) out[j] += in[i] * m[i * 4 + j];
    return Vec3{out[0], out[1], out[2]} / out[3];
}

TEST(View, CornersOfThePictureSpanTheFieldOfView) {
    const View view(cameraAt({0, 0, 0}, {0, 0, -1}, kPi / 2), 200, 100);
    const Ray centre = view.ray(100, 50, {});
    EXPECT_NEAR(centre.direction.z, -1, 1e-6f);
    // Vertical half angle 45 degrees; twice that tangent horizontally.
    const Vec3 top = view.ray(100, 0, {}).direction, right = view.ray(200, 50, {}).direction;
    EXPECT_NEAR(top.y / -top.z, 1, 1e-6f);
    EXPECT_NEAR(right.x / -right.z, 2, 1e-6f);
    EXPECT_NEAR(length(top), 1, 1e-6f);
}

TEST(View, PinholeRaysStartAtTheEye) {
    const View view(cameraAt({1, 2, 3}, {4, 2, 3}, 0.7f), 64, 64);
    EXPECT_FALSE(view.hasLens());
    EXPECT_EQ(view.ray(3, 60, {0.9f, 0.1f}).origin, (Vec3{1, 2, 3}));
    EXPECT_NEAR(view.ray(32, 32, {}).direction.x, 1, 1e-6f);
}

TEST(View, LensRaysOfAPixelMeetInTheFocusPlaneAndFillTheLens) {
    Camera camera = cameraAt({0, 0, 0}, {0, 0, -1}, 1);
    camera.lensRadius = 0.1f;
    camera.focusDistance = 4;
    const View view(camera, 100, 100);
    const Ray pinhole = View(cameraAt({0, 0, 0}, {0, 0, -1}, 1), 100, 100).ray(20, 70, {});
    const Vec3 focus = pinhole.direction * (4 / -pinhole.direction.z);
    float widest = 0;
    for (int i = 0; i < 100; ++i) {
        const Vec2 u{static_cast<float>(i % 10) / 10, static_cast<float>(i / 10) / 10};
        const Ray ray = view.ray(20, 70, u);
        EXPECT_NEAR(ray.origin.z, 0, 1e-6f);
        EXPECT_LE(length(ray.origin), 0.1f * 1.00001f);
        widest = std::max(widest, length(ray.origin));
        const Vec3 p = ray.origin + ray.direction * ((-4 - ray.origin.z) / ray.direction.z);
        EXPECT_NEAR(length(p - focus), 0, 1e-5f);
    }
    EXPECT_GT(widest, 0.09f);
}

TEST(View, MatricesProjectPointsToWhereTheirRaysStart) {
    const View view(cameraAt({1, 2, 3}, {4, -1, 0}, 0.9f), 320, 200);
    for (const auto& [x, y] : {std::pair{10.f, 20.f}, std::pair{300.f, 150.f}, std::pair{160.f, 100.f}}) {
        const Ray ray = view.ray(x, y, {});
        const Vec3 p = ray.origin + ray.direction * 7.f;
        const Vec3 ndc = project(p, view.worldToNdc());
        EXPECT_NEAR(ndc.x, 2 * x / 320 - 1, 1e-5f);
        EXPECT_NEAR(ndc.y, 1 - 2 * y / 200, 1e-5f);
        const Vec3 local = project(p, view.worldToCamera());
        EXPECT_NEAR(length(local), 7, 1e-5f);
        EXPECT_LT(local.z, 0);
    }
}

}  // namespace
}  // namespace vlx::render
