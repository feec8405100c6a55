#include "render/scene/camera.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "render/math/sampling.h"
#include "render/scene/camera_placement.h"
#include "test_scene.h"
#include "variolux/base/hash.h"

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

Camera flatCamera(float height) {
    Camera camera = cameraAt({1, 2, 3}, {4, -1, 0}, 1);
    camera.orthographicHeight = height;
    return camera;
}

TEST(OrthographicView, RaysAreParallelAndSpanTheHeight) {
    Camera camera = cameraAt({0, 0, 5}, {0, 0, 0}, 1);
    camera.orthographicHeight = 4;
    const View view(camera, 200, 100);
    EXPECT_TRUE(view.parallel());
    for (const auto& [x, y] : {std::pair{0.f, 0.f}, std::pair{200.f, 100.f}, std::pair{50.f, 75.f}}) {
        const Ray ray = view.ray(x, y, {});
        EXPECT_EQ(ray.direction, (Vec3{0, 0, -1}));
        EXPECT_NEAR(length(ray.origin - Vec3{x / 25 - 4, 2 - y / 25, 5}), 0, 1e-6f);
    }
}

TEST(OrthographicView, ProjectsItsOwnRays) {
    for (const float lens : {0.f, 0.3f}) {
        Camera camera = flatCamera(4);
        camera.lensRadius = lens;
        camera.focusDistance = 5;
        const View view(camera, 320, 200);
        for (int i = 0; i < 20; ++i) {
            const auto u = [&](int k) { return unitFloat(static_cast<std::uint32_t>(hashOf(i, k))); };
            const Vec2 onLens{u(0), u(1)};
            const float x = 320 * u(2), y = 200 * u(3), way = 1 + 9 * u(4);
            const Ray ray = view.ray(x, y, onLens);
            const Vec3 point = ray.origin + ray.direction * way;
            const View::Projection p = view.project(point, onLens);
            EXPECT_NEAR(p.x, x, 1e-3f);
            EXPECT_NEAR(p.y, y, 1e-3f);
            EXPECT_NEAR(length(p.origin - ray.origin), 0, 1e-5f);
            // The density is that of pixels on a surface across the ray, found by moving on it.
            const Frame across(ray.direction);
            const View::Projection a = view.project(point + across.tangent * 0.1f, onLens);
            const View::Projection b = view.project(point + across.bitangent * 0.1f, onLens);
            const float pixels = std::abs((a.x - p.x) * (b.y - p.y) - (a.y - p.y) * (b.x - p.x));
            EXPECT_NEAR(p.density, pixels / 0.01f, 0.01f * p.density);
            EXPECT_EQ(view.project(ray.origin - ray.direction, onLens).density, 0);
            if (lens == 0) continue;
            // In focus where the pinhole's ray is.
            const Ray focused = View(flatCamera(4), 320, 200).ray(x, y, {});
            const Vec3 focus = focused.origin + focused.direction * 5;
            const Vec3 offAxis = cross(focus - ray.origin, ray.direction);
            EXPECT_NEAR(length(offAxis), 0, 1e-4f);
        }
    }
}

TEST(OrthographicView, MatricesProjectPointsToWhereTheirRaysStart) {
    const View view(flatCamera(4), 320, 200);
    for (const auto& [x, y] : {std::pair{10.f, 20.f}, std::pair{300.f, 150.f}}) {
        const Ray ray = view.ray(x, y, {});
        const Vec3 ndc = project(ray.origin + ray.direction * 7.f, view.worldToNdc());
        EXPECT_NEAR(ndc.x, 2 * x / 320 - 1, 1e-5f);
        EXPECT_NEAR(ndc.y, 1 - 2 * y / 200, 1e-5f);
    }
}

TEST(LookingAt, PutsTheTargetInTheMiddleAndUpUp) {
    for (const Vec3& target : {Vec3{4, 1, -2}, Vec3{1, 2, -3}, Vec3{1, 9, 3}, Vec3{1, -9, 3}}) {
        const Vec3 eye{1, 2, 3};
        const Transform t = lookingAt(eye, target);
        EXPECT_NEAR(t.determinant(), 1, 1e-12);
        EXPECT_EQ(t.point({0, 0, 0}), eye);
        EXPECT_NEAR(length(t.vector({0, 0, -1}) - normalized(target - eye)), 0, 1e-6f);
        EXPECT_NEAR(t.vector({1, 0, 0}).y, 0, 1e-6f);
        EXPECT_GE(t.vector({0, 1, 0}).y, -1e-6f);
    }
    // Straight up and down: as the camera tilts there from looking along -z.
    EXPECT_NEAR(length(lookingAt({0, 0, 0}, {0, -1, 0}).vector({0, 1, 0}) - Vec3{0, 0, -1}), 0, 1e-6f);
    EXPECT_NEAR(length(lookingAt({0, 0, 0}, {0, 1, 0}).vector({0, 1, 0}) - Vec3{0, 0, 1}), 0, 1e-6f);
    const Vec3 almost = lookingAt({0, 0, 0}, {0, -1, -1e-3f}).vector({0, 1, 0});
    EXPECT_NEAR(length(almost - Vec3{0, 0, -1}), 0, 2e-3f);
}

TEST(TurnTowards, FollowsAMovingCameraAndTellsWhereItCannot) {
    Camera camera = cameraAt({0, 0, 5}, {0, 0, 0}, 1);
    Transform later = camera.toWorld;
    later.m[0][3] = 3;
    camera.motion.places = {camera.toWorld, later};
    EXPECT_TRUE(turnTowards(camera, {0, 1, 0}));
    EXPECT_EQ(camera.motion.places[1].point({0, 0, 0}), (Vec3{3, 0, 5}));
    EXPECT_NEAR(length(camera.motion.places[1].vector({0, 0, -1}) - normalized(Vec3{-3, 1, -5})), 0, 1e-6f);
    EXPECT_FALSE(turnTowards(camera, {3, 0, 5}));
}

/// Boxes of any shape and place, pictures of any aspect: all corners are in the picture, two opposite sides
/// are touched but for the margin, and there is as much room on the left as on the right.
TEST(Framed, HoldsTheBoxExactly) {
    int tight = 0;
    for (int i = 0; i < 200; ++i) {
        const auto u = [&](int k) {
            return static_cast<double>(unitFloat(static_cast<std::uint32_t>(hashOf(i, k, 3))));
        };
        const double size = std::pow(10, 6 * u(0) - 3);
        const auto extent = [&](int k) { return static_cast<float>(u(k) < 0.2 ? 0 : size * u(k + 9)); };
        Vec3 low{static_cast<float>(size * u(1)), static_cast<float>(size * u(2)),
                 static_cast<float>(-size * u(3))};
        const Vec3 side{extent(4), extent(5), extent(6)};
        if (maxComponent(side) == 0) continue;
        const double aspect = std::pow(4, 2 * u(7) - 1);
        const auto degrees = static_cast<float>(5 + 120 * u(8));
        const Viewpoint v = framed(low, low + side, aspect, degrees);
        EXPECT_EQ(v.verticalDegrees, degrees);
        Camera camera;
        camera.toWorld = lookingAt(v.position, v.target);
        const auto toCamera = camera.toWorld.inverse();
        const double tangent = std::tan(static_cast<double>(degrees) * std::numbers::pi / 360);
        double distance = 1e30;
        std::array<double, 4> most{-9, -9, -9, -9};  // of the picture's half: left, right, bottom, top
        for (unsigned int c = 0; c < 8; ++c) {
            const Vec3 p = toCamera->point({low.x + ((c & 1u) ? side.x : 0), low.y + ((c & 2u) ? side.y : 0),
                                            low.z + ((c & 4u) ? side.z : 0)});
            ASSERT_LT(p.z, 0);
            distance = std::min(distance, -static_cast<double>(p.z));
            const double x = p.x / -static_cast<double>(p.z) / (tangent * aspect);
            const double y = p.y / -static_cast<double>(p.z) / tangent;
            most = {std::max(most[0], -x), std::max(most[1], x), std::max(most[2], -y), std::max(most[3], y)};
        }
        const double edge = 1 - 2 * kFrameMargin;
        for (const double m : most) {
            EXPECT_LE(m, edge + 1e-3) << i;
        }
        const double least = kLeastDistance * static_cast<double>(length(side));
        EXPECT_GE(distance, least * 0.999) << i;
        // From the right of the front, from above.
        const Vec3 from = normalized(v.position - v.target);
        EXPECT_NEAR(from.x, from.z, 1e-3f);
        EXPECT_NEAR(from.y, std::sin(kPi / 8), 1e-3f);
        if (distance < least * 1.001) continue;
        ++tight;
        const bool wide = std::max(most[0], most[1]) > std::max(most[2], most[3]);
        EXPECT_NEAR(std::ranges::max(most), edge, 1e-3) << i;
        EXPECT_NEAR(most[wide ? 0 : 2], most[wide ? 1 : 3], 2e-3) << i;
    }
    EXPECT_GT(tight, 120);
}

}  // namespace
}  // namespace vlx::render
