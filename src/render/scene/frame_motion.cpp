#include "render/scene/frame_motion.h"

#include <algorithm>
#include <cmath>

#include "render/scene/scene.h"
#include "render/surface/surface.h"

namespace vlx::render {
namespace {

constexpr Vec2 kMiddleOfLens{0.5f, 0.5f};

Camera inNeighbour(Camera camera, Motion Course::*frame) {
    if (!camera.course) return camera;
    camera.motion = (*camera.course).*frame;
    camera.toWorld = camera.motion.at(0.5f);
    return camera;
}

/// A point of this frame's world, and where the neighbours have it.
struct TracedPoint {
    Vec3 own, before, after;
};

TracedPoint tracedPoint(const Scene& scene, const Ray& ray, const Hit& hit, float time) {
    Vec3 held, own;
    std::int32_t course = -1;
    if (hit.light >= 0) {
        held = own = ray.origin + ray.direction * hit.distance;
        course = scene.lights[static_cast<std::size_t>(hit.light)].course;
    } else {
        const Shape& shape = scene.shapes[hit.shape];
        const auto& corner = scene.triangles[shape.firstTriangle + hit.triangle];
        if (shape.deformation >= 0) {
            const Deformation& d = scene.deformations[static_cast<std::size_t>(shape.deformation)];
            const auto in = [&](std::uint32_t first, std::uint32_t steps) {
                const Between moment = blocksAt(shape, first, steps, time);
                const auto at = [&](std::size_t i) { return cornerAt(scene, corner[i], moment).position; };
                return interpolated(at(0), at(1), at(2), hit.u, hit.v);
            };
            own = in(0, d.steps);
            const std::uint32_t n = d.neighbourSteps;
            return n == 0 ? TracedPoint{own, own, own} : TracedPoint{own, in(d.steps, n), in(d.steps + n, n)};
        }
        held = own = interpolated(scene.vertices[corner[0]].position, scene.vertices[corner[1]].position,
                                  scene.vertices[corner[2]].position, hit.u, hit.v);
        course = shape.course;
        if (hit.instance >= 0) {
            const Instance& instance = scene.instances[static_cast<std::size_t>(hit.instance)];
            course = instance.course;
            own = instance.motion < 0
                      ? instance.toWorld.point(held)
                      : scene.motions[static_cast<std::size_t>(instance.motion)].at(time).point(held);
        }
    }
    if (course < 0) return {own, own, own};
    const Course& c = scene.courses[static_cast<std::size_t>(course)];
    return {own, c.before.at(time).point(held), c.after.at(time).point(held)};
}

Vec2 wayBetween(const View::Projection& from, const View::Projection& to) {
    const Vec2 d{to.x - from.x, to.y - from.y};
    const bool known = from.density > 0 && to.density > 0 && std::isfinite(d.x) && std::isfinite(d.y);
    return known ? d : Vec2{Moved::kUnknown, Moved::kUnknown};
}

}  // namespace

FrameMotion::FrameMotion(const Scene& scene, const Camera& camera, int width, int height)
    : scene_(scene),
      own_(camera, width, height),
      before_(inNeighbour(camera, &Course::before), width, height),
      after_(inNeighbour(camera, &Course::after), width, height),
      frozen_(!camera.motion.moves() && scene.motions.empty() &&
              std::ranges::none_of(scene.deformations, &Deformation::moves)) {}

Moved FrameMotion::of(const Ray& ray, const std::optional<Hit>& hit) const {
    const float time = frozen_ ? 0.5f : ray.time;
    if (!hit) {
        const auto seen = [&](const View& view) { return view.projectFar(ray.direction, time); };
        const View::Projection here = seen(own_);
        return {wayBetween(here, seen(before_)), wayBetween(here, seen(after_))};
    }
    const TracedPoint point = tracedPoint(scene_, ray, *hit, time);
    const View::Projection here = own_.project(point.own, kMiddleOfLens, time);
    return {wayBetween(here, before_.project(point.before, kMiddleOfLens, time)),
            wayBetween(here, after_.project(point.after, kMiddleOfLens, time))};
}

}  // namespace vlx::render
