#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "render/math/transform.h"
#include "render/math/vec.h"
#include "render/scene/motion.h"

namespace vlx::render {

/// A glTF camera: looks along its own -z, y up.
struct Camera {
    std::string name;
    Transform toWorld;  ///< rotation and translation; in the middle of the exposure, when it moves
    Motion motion;
    std::optional<Course> course;  ///< where it is elsewhere in the neighbouring frames
    float verticalFov = 0.8f;      ///< radians; of a perspective camera
    float orthographicHeight = 0;  ///< metres from the picture's top to its bottom; 0: a perspective camera
    float aspect = 0;              ///< width / height; 0: as the image
    float lensRadius = 0;          ///< metres; 0: pinhole
    float focusDistance = 0;       ///< along the axis; used when lensRadius > 0
    bool preferred = false;        ///< marked as the one to use (extras `active`)
    std::string unusable;          ///< why it cannot be rendered from; empty when it can
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
/// [i, i+1) x [j, j+1)). The vertical field of view (twice glTF's ymag) spans the image's height; pixels are
/// square. Rays of an orthographic camera start in the plane that it is in, or on a lens about their place
/// there: all points of the plane in focus are sharp.
class View {
  public:
    View(const Camera& camera, int width, int height);

    /// `lens` in [0, 1)^2: the point on the lens. `time` in [0, 1): while the shutter is open.
    Ray ray(float x, float y, Vec2 lens, float time = 0) const;

    /// A point of space as the camera sees it.
    struct Projection {
        float x = 0;  ///< raster position
        float y = 0;
        Vec3 origin;  ///< on the lens
        /// Pixels per steradian about the direction from `origin` or, of parallel rays, per area across it;
        /// 0: not in front of it.
        float density = 0;
    };
    /// The inverse of ray(): the raster position whose ray, from this point of the lens, goes through
    /// `point`.
    Projection project(const Vec3& point, Vec2 lens, float time = 0) const;
    /// Of what is at infinity in a direction of unit length, seen from the middle of the lens. An
    /// orthographic camera sees of it what lies along its axis, everywhere: at (0, 0).
    Projection projectFar(const Vec3& direction, float time = 0) const;

    bool hasLens() const { return lensRadius_ > 0; }
    /// Orthographic: rays through one point of the lens are parallel.
    bool parallel() const { return orthographicHeight_ > 0; }
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
        Vec3
            corner;  ///< raster (0, 0): from the origin to the plane at unit distance, or to the camera's own
        Vec3 dx, dy;
        Vec3 axis;
        Vec3 lensX, lensY;
    };
    CameraFrame frameAt(const Transform& toWorld) const;
    CameraFrame frameDuring(float time) const;
    /// From a place on the lens, `offset` from its middle: of the plane at `distance` along the axis.
    static Projection projected(const CameraFrame& frame, const Vec3& offset, float distance,
                                const Vec3& direction);
    /// The same of an orthographic camera, and of the point `toPoint` from its origin.
    static Projection projectedAlong(const CameraFrame& frame, const Vec3& offset, float distance,
                                     const Vec3& toPoint);

    std::vector<CameraFrame> frames_;  ///< at equal steps of time, or one
    float orthographicHeight_;
    float lensRadius_;
    float focusDistance_;
};

}  // namespace vlx::render
