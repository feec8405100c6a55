#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/math/transform.h"
#include "render/math/vec.h"
#include "render/scene/motion.h"

namespace vlx::render {

/// A glTF perspective camera: looks along its own -z, y up.
struct Camera {
    std::string name;
    Transform toWorld;  ///< rotation and translation; in the middle of the exposure, when it moves
    Motion motion;
    std::optional<Course> course;  ///< where it is elsewhere in the neighbouring frames
    float verticalFov = 0.8f;      ///< radians
    float aspect = 0;              ///< width / height; 0: as the image
    float lensRadius = 0;          ///< metres; 0: pinhole
    float focusDistance = 0;       ///< along the axis; used when lensRadius > 0
    bool preferred = false;        ///< marked as the one to use (extras `active`)
    std::string unusable;          ///< why it cannot be rendered from (orthographic, ...); empty when it can
};

/// One sample to take: a position on the image plane, and which numbers the path uses.
struct CameraSample {
    int column = 0;  ///< its pixel
    int row = 0;
    float x = 0;  ///< raster position inside the pixel
    float y = 0;
    std::uint64_t seed = 0;       ///< of the pixel's (replicate's) randomisation
    std::uint32_t index = 0;      ///< among the pixel's (replicate's) samples
    std::uint32_t replicate = 0;  ///< independent randomisation it belongs to
};

/// A camera with an image size: rays through raster positions (x right, y down, pixel (i, j) covers
/// [i, i+1) x [j, j+1)). The vertical field of view spans the image's height; pixels are square.
class View {
  public:
    View(const Camera& camera, int width, int height);

    /// `lens` in [0, 1)^2: the point on the lens. `time` in [0, 1): while the shutter is open.
    Ray ray(float x, float y, Vec2 lens, float time = 0) const;

    /// A point of space as the camera sees it.
    struct Projection {
        float x = 0;  ///< raster position
        float y = 0;
        Vec3 origin;        ///< on the lens
        float density = 0;  ///< pixels per steradian about the direction from `origin`; 0: not in front of it
    };
    /// The inverse of ray(): the raster position whose ray, from this point of the lens, goes through
    /// `point`.
    Projection project(const Vec3& point, Vec2 lens, float time = 0) const;
    /// Of what is at infinity in a direction of unit length, seen from the middle of the lens.
    Projection projectFar(const Vec3& direction, float time = 0) const;

    bool hasLens() const { return lensRadius_ > 0; }
    bool moves() const { return frames_.size() > 1; }

    /// OpenEXR's header attributes: 16 values, row vectors (p' = p M). NDC: x right, y up, both in [-1, 1].
    std::vector<float> worldToCamera() const;
    std::vector<float> worldToNdc() const;

  private:
    Transform toWorld_;
    double width_, height_;
    double tanHalf_;
    /// All that a ray is made of, at one time.
    struct CameraFrame {
        Vec3 origin;
        Vec3 corner;  ///< direction through raster (0, 0), at unit distance along the axis
        Vec3 dx, dy;
        Vec3 lensX, lensY;
    };
    CameraFrame frameAt(const Transform& toWorld) const;
    CameraFrame frameDuring(float time) const;
    /// From a place on the lens, `offset` from its middle: of the plane at `distance` along the axis.
    static Projection projected(const CameraFrame& frame, const Vec3& offset, float distance,
                                const Vec3& direction);

    std::vector<CameraFrame> frames_;  ///< at equal steps of time, or one
    float lensRadius_;
    float focusDistance_;
};

}  // namespace vlx::render
