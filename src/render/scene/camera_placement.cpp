#include "render/scene/camera_placement.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

namespace vlx::render {
namespace {

/// Floats would round directions of cameras that are far away.
using Triple = std::array<double, 3>;

Triple triple(const Vec3& v) { return {v.x, v.y, v.z}; }

double dotted(const Triple& a, const Triple& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

Triple crossed(const Triple& a, const Triple& b) {
    return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

Triple scaled(const Triple& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }

Triple unit(const Triple& a) { return scaled(a, 1 / std::sqrt(dotted(a, a))); }

/// A camera's axes: right, up and back.
std::array<Triple, 3> axesOf(const Triple& back) {
    const bool steep = std::hypot(back[0], back[2]) < 1e-6;
    const Triple up = steep ? Triple{0, 0, back[1] > 0 ? -1.0 : 1.0} : Triple{0, 1, 0};
    const Triple right = unit(crossed(up, back));
    return {right, crossed(back, right), back};
}

/// Where a camera sees points just so, between two opposite sides of its picture: along its axis, towards it,
/// and across.
struct Fit {
    double along, across;
};

/// `slope`: of what it sees, across over along.
Fit fitted(const std::array<double, 8>& across, const std::array<double, 8>& along, double slope) {
    double most = -std::numeric_limits<double>::infinity(), least = most;
    for (std::size_t i = 0; i < across.size(); ++i) {
        most = std::max(most, across[i] + slope * along[i]);
        least = std::max(least, -across[i] + slope * along[i]);
    }
    return {(most + least) / (2 * slope), (most - least) / 2};
}

}  // namespace

Transform lookingAt(const Vec3& position, const Vec3& target) {
    const Triple eye = triple(position), at = triple(target);
    const auto axes = axesOf(unit({eye[0] - at[0], eye[1] - at[1], eye[2] - at[2]}));
    Transform t;
    for (std::size_t i = 0; i < 3; ++i) t.m[i] = {axes[0][i], axes[1][i], axes[2][i], eye[i]};
    return t;
}

bool turnTowards(Camera& camera, const Vec3& target) {
    bool elsewhere = true;
    const auto turn = [&](Transform& place) {
        const Vec3 eye = place.point({0, 0, 0});
        if (eye == target)
            elsewhere = false;
        else
            place = lookingAt(eye, target);
    };
    turn(camera.toWorld);
    std::ranges::for_each(camera.motion.places, turn);
    if (camera.course) {
        std::ranges::for_each(camera.course->before.places, turn);
        std::ranges::for_each(camera.course->after.places, turn);
    }
    return elsewhere;
}

Viewpoint framed(const Vec3& low, const Vec3& high, double aspect, float verticalDegrees) {
    constexpr double kTurn = std::numbers::pi / 4, kRise = std::numbers::pi / 8;
    const auto axes =
        axesOf({std::cos(kRise) * std::sin(kTurn), std::sin(kRise), std::cos(kRise) * std::cos(kTurn)});
    const Triple from = triple(low), to = triple(high);
    std::array<std::array<double, 8>, 3> corners{};  // in the camera's axes
    for (std::size_t i = 0; i < 8; ++i) {
        const Triple p{(i & 1u) ? to[0] : from[0], (i & 2u) ? to[1] : from[1], (i & 4u) ? to[2] : from[2]};
        for (std::size_t axis = 0; axis < 3; ++axis) corners[axis][i] = dotted(p, axes[axis]);
    }
    const double slope =
        (1 - 2 * kFrameMargin) * std::tan(static_cast<double>(verticalDegrees) * std::numbers::pi / 360);
    const Fit x = fitted(corners[0], corners[2], slope * aspect), y = fitted(corners[1], corners[2], slope);
    const Triple middle = scaled({from[0] + to[0], from[1] + to[1], from[2] + to[2]}, 0.5);
    const auto placed = [&](double along) {
        const auto at = [&](std::size_t i) {
            return static_cast<float>(axes[0][i] * x.across + axes[1][i] * y.across + axes[2][i] * along);
        };
        return Vec3{at(0), at(1), at(2)};
    };
    const Vec3 extent = high - low;
    const double nearest =
        std::ranges::max(corners[2]) + kLeastDistance * static_cast<double>(length(extent));
    return {placed(std::max({x.along, y.along, nearest})), placed(dotted(middle, axes[2])), verticalDegrees};
}

}  // namespace vlx::render
