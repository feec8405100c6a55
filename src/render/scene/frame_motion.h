#pragma once

#include <limits>
#include <optional>

#include "render/scene/accelerator.h"
#include "render/scene/camera.h"

namespace vlx::render {

/// How far, in raster pixels, from where it is seen a thing is seen in the frame before, and in the one
/// after. Not a number: there it is behind the camera.
struct Moved {
    static constexpr float kUnknown = std::numeric_limits<float>::quiet_NaN();
    Vec2 before{kUnknown, kUnknown};
    Vec2 after{kUnknown, kUnknown};
};

/// Where what a camera ray meets is seen in the neighbouring frames of a sequence, at the same moment of
/// their exposures. All is seen from the middle of the lens, in this frame too, wherever on it the ray
/// starts: what a still camera sees standing still has not moved, to the last bit. Refers to the scene.
class FrameMotion {
  public:
    FrameMotion(const Scene& scene, const Camera& camera, int width, int height);

    /// Without a hit: of what is at infinity in the ray's direction.
    Moved of(const Ray& ray, const std::optional<Hit>& hit) const;

  private:
    const Scene& scene_;
    View own_, before_, after_;
    bool frozen_;  ///< nothing moves in this frame's own exposure, and rays have no time
};

}  // namespace vlx::render
