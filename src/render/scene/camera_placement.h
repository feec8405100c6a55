#pragma once

#include "render/scene/camera.h"

namespace vlx::render {

/// Where to look from, and at what: what --camera-position, --look-at and --fov say.
struct Viewpoint {
    Vec3 position;
    Vec3 target;
    float verticalDegrees = 45;
};

/// A camera's place at `position`, looking at `target`, which must be elsewhere: y is up in the picture.
/// Where it looks straight down or up, that is -z or z: what y comes to as the camera tilts there from
/// looking along -z.
Transform lookingAt(const Vec3& position, const Vec3& target);

/// Turns a camera towards `target` wherever it is while the shutter is open and in the neighbouring frames.
/// False when that is where the target is, sometime: there it is not turned.
bool turnTowards(Camera& camera, const Vec3& target);

/// The share of the picture's height and width that a framed box stays clear of on each side.
inline constexpr double kFrameMargin = 0.025;
/// How near to the camera a framed box may come along the axis, in its diagonals: a rod that is seen end on
/// would touch it.
inline constexpr double kLeastDistance = 0.1;

/// The viewpoint nearest to a box, in a direction of three quarters, whose picture of the aspect `width` over
/// height holds the whole of it, kFrameMargin off the sides: from 45 degrees to the right of the front (z
/// towards x), 22.5 degrees up. At the distance two sides of the picture, opposite to each other, are
/// touched; the box has equal room on the two others. `target` is on the view's axis, as near to the box's
/// middle as that comes. The box must have an extent.
Viewpoint framed(const Vec3& low, const Vec3& high, double aspect, float verticalDegrees = 45);

}  // namespace vlx::render
