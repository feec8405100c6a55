#include "camera.h"

#include "sampling.h"

namespace vlx::render {

View::View(const Camera& camera, int width, int height)
    : toWorld_(camera.toWorld),
      width_(width),
      height_(height),
      tanHalf_(std::tan(0.5 * static_cast<double>(camera.verticalFov))),
      origin_(camera.toWorld.point({0, 0, 0})),
      lensX_(camera.toWorld.vector({1, 0, 0}) * camera.lensRadius),
      lensY_(camera.toWorld.vector({0, 1, 0}) * camera.lensRadius),
      lensRadius_(camera.lensRadius),
      focusDistance_(camera.focusDistance) {
    const auto pixel = static_cast<float>(2 * tanHalf_ / height_);
    dx_ = camera.toWorld.vector({pixel, 0, 0});
    dy_ = camera.toWorld.vector({0, -pixel, 0});
    corner_ = camera.toWorld.vector(
        {static_cast<float>(-tanHalf_ * width_ / height_), static_cast<float>(tanHalf_), -1});
}

Ray View::ray(float x, float y, Vec2 lens) const {
    const Vec3 along = corner_ + dx_ * x + dy_ * y;
    if (lensRadius_ <= 0) return {origin_, normalized(along)};
    const Vec2 d = toDisk(lens);
    const Vec3 offset = lensX_ * d.x + lensY_ * d.y;
    return {origin_ + offset, normalized(along * focusDistance_ - offset)};
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
    // Camera space (x, y, z) to clip space (x / (tan aspect), y / tan, -z, -z).
    const std::vector<float> toCamera = worldToCamera();
    const double sx = height_ / (tanHalf_ * width_), sy = 1 / tanHalf_;
    std::vector<float> out(16);
    for (std::size_t row = 0; row < 4; ++row) {
        out[row * 4 + 0] = static_cast<float>(toCamera[row * 4 + 0] * sx);
        out[row * 4 + 1] = static_cast<float>(toCamera[row * 4 + 1] * sy);
        out[row * 4 + 2] = -toCamera[row * 4 + 2];
        out[row * 4 + 3] = -toCamera[row * 4 + 2];
    }
    return out;
}

}  // namespace vlx::render
