#include "render/scene/camera.h"

#include "render/math/sampling.h"
#include "render/plan/effect_counters.h"

namespace vlx::render {

View::View(const Camera& camera, int width, int height)
    : toWorld_(camera.toWorld),
      width_(width),
      height_(height),
      tanHalf_(std::tan(0.5 * static_cast<double>(camera.verticalFov))),
      orthographicHeight_(camera.orthographicHeight),
      lensRadius_(camera.lensRadius),
      focusDistance_(camera.focusDistance) {
    if (camera.motion.moves()) {
        for (const Transform& place : camera.motion.places) frames_.push_back(frameAt(place));
    } else {
        frames_.push_back(frameAt(camera.toWorld));
    }
}

View::CameraFrame View::frameAt(const Transform& toWorld) const {
    const double half = parallel() ? 0.5 * static_cast<double>(orthographicHeight_) : tanHalf_;
    const auto pixel = static_cast<float>(2 * half / height_);
    CameraFrame f;
    f.origin = toWorld.point({0, 0, 0});
    f.axis = toWorld.vector({0, 0, -1});
    f.corner = toWorld.vector(
        {static_cast<float>(-half * width_ / height_), static_cast<float>(half), parallel() ? 0.f : -1.f});
    f.dx = toWorld.vector({pixel, 0, 0});
    f.dy = toWorld.vector({0, -pixel, 0});
    f.lensX = toWorld.vector({1, 0, 0}) * lensRadius_;
    f.lensY = toWorld.vector({0, 1, 0}) * lensRadius_;
    return f;
}

View::CameraFrame View::frameDuring(float time) const {
    if (frames_.size() == 1) return frames_.front();
    countEffect(Effect::CameraMotion);
    const float position = time * static_cast<float>(frames_.size() - 1);
    const auto first = std::min(static_cast<std::size_t>(position), frames_.size() - 2);
    const float t = position - static_cast<float>(first);
    const CameraFrame& a = frames_[first];
    const CameraFrame& b = frames_[first + 1];
    const auto mix = [t](const Vec3& p, const Vec3& q) { return p * (1 - t) + q * t; };
    return {mix(a.origin, b.origin), mix(a.corner, b.corner), mix(a.dx, b.dx),      mix(a.dy, b.dy),
            mix(a.axis, b.axis),     mix(a.lensX, b.lensX),   mix(a.lensY, b.lensY)};
}

Ray View::ray(float x, float y, Vec2 lens, float time) const {
    const auto through = [&](const CameraFrame& f) -> Ray {
        const Vec3 along = f.corner + f.dx * x + f.dy * y;
        if (lensRadius_ <= 0) {
            if (parallel()) return {f.origin + along, normalized(f.axis), time};
            return {f.origin, normalized(along), time};
        }
        countEffect(Effect::DepthOfField);
        const Vec2 d = toDisk(lens);
        const Vec3 offset = f.lensX * d.x + f.lensY * d.y;
        if (parallel())
            return {f.origin + along + offset, normalized(f.axis * focusDistance_ - offset), time};
        return {f.origin + offset, normalized(along * focusDistance_ - offset), time};
    };
    return frames_.size() == 1 ? through(frames_.front()) : through(frameDuring(time));
}

View::Projection View::project(const Vec3& point, Vec2 lens, float time) const {
    const CameraFrame f = frameDuring(time);
    Vec3 offset;
    float distance = 1;  // of the plane in focus; any, for a pinhole
    if (lensRadius_ > 0) {
        const Vec2 d = toDisk(lens);
        offset = f.lensX * d.x + f.lensY * d.y;
        distance = focusDistance_;
    }
    if (parallel()) return projectedAlong(f, offset, distance, point - f.origin);
    return projected(f, offset, distance, normalized(point - (f.origin + offset)));
}

View::Projection View::projectFar(const Vec3& direction, float time) const {
    const CameraFrame f = frameDuring(time);
    if (!parallel()) return projected(f, {}, 1, direction);
    Projection p;
    p.origin = f.origin;
    p.density = length(direction - normalized(f.axis)) < 1e-5f ? 1.f : 0.f;
    return p;
}

View::Projection View::projected(const CameraFrame& f, const Vec3& offset, float distance,
                                 const Vec3& direction) {
    Projection p;
    p.origin = f.origin + offset;
    // The place on the plane, corner + x dx + y dy seen from the lens, times s is the direction: Cramer's
    // rule.
    const Vec3 corner = f.corner * distance - offset, dx = f.dx * distance, dy = f.dy * distance;
    const Vec3 normal = cross(dx, dy);  // its length: a pixel's area
    const float facing = dot(direction, normal), ahead = dot(corner, normal);
    if (!(facing * ahead > 0)) return p;
    const float reach = ahead / facing;  // along the direction to the plane
    const Vec3 place = direction * reach - corner;
    const float area2 = lengthSquared(normal);
    p.x = dot(cross(place, dy), normal) / area2;
    p.y = dot(cross(dx, place), normal) / area2;
    p.density = reach * reach / std::abs(facing);
    return p;
}

View::Projection View::projectedAlong(const CameraFrame& f, const Vec3& offset, float distance,
                                      const Vec3& toPoint) {
    Projection p;
    const Vec3 along = f.axis * distance - offset;
    const Vec3 normal = cross(f.dx, f.dy);  // its length: a pixel's area
    const float facing = dot(along, normal);
    const float reach = dot(toPoint - offset, normal) / facing;
    if (!(reach > 0)) return p;
    const Vec3 start = toPoint - offset - along * reach;  // in the camera's plane
    const Vec3 place = start - f.corner;
    const float area2 = lengthSquared(normal);
    p.origin = f.origin + start + offset;
    p.x = dot(cross(place, f.dy), normal) / area2;
    p.y = dot(cross(f.dx, place), normal) / area2;
    p.density = length(along) / std::abs(facing);
    return p;
}

std::vector<float> View::worldToCamera() const {
    // The inverse of a rotation and translation. Row vectors: the matrix is the transpose of the usual one.
    const auto& m = toWorld_.m;
    std::vector<float> out(16, 0.f);
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) out[i * 4 + j] = static_cast<float>(m[i][j]);
        out[12 + i] = static_cast<float>(-(m[0][i] * m[0][3] + m[1][i] * m[1][3] + m[2][i] * m[2][3]));
    }
    out[15] = 1;
    return out;
}

std::vector<float> View::worldToNdc() const {
    // Camera space (x, y, z) to clip space (x / (tan aspect), y / tan, -z, -z), or half the height instead of
    // the tangent, and 1 instead of the last -z.
    const std::vector<float> toCamera = worldToCamera();
    const double half = parallel() ? 0.5 * static_cast<double>(orthographicHeight_) : tanHalf_;
    const double sx = height_ / (half * width_), sy = 1 / half;
    std::vector<float> out(16);
    for (std::size_t row = 0; row < 4; ++row) {
        out[row * 4 + 0] = static_cast<float>(toCamera[row * 4 + 0] * sx);
        out[row * 4 + 1] = static_cast<float>(toCamera[row * 4 + 1] * sy);
        out[row * 4 + 2] = -toCamera[row * 4 + 2];
        out[row * 4 + 3] = parallel() ? (row == 3 ? 1.f : 0.f) : -toCamera[row * 4 + 2];
    }
    return out;
}

}  // namespace vlx::render
