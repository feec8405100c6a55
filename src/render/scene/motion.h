#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include "render/math/transform.h"

namespace vlx::render {

/// When the shutter is open, in seconds of the scene's animations. Equal times freeze the picture.
struct Shutter {
    double open = 0;
    double close = 1.0 / 48;  ///< half of a film camera's 1/24 s
};

/// Places at equal steps of time, the first when the shutter opens, the last when it closes. Between two
/// of them matrices are interpolated linearly, as Embree does. Empty or a single place: nothing moves.
struct Motion {
    std::vector<Transform> places;
    std::string cause;  ///< the animation and the node it moves, for messages

    bool moves() const { return places.size() > 1; }
    /// `time`: 0 when the shutter opens, 1 when it closes. Only where something moves.
    Transform at(float time) const;
};

/// Follows `placeAt` (of a time in [0, 1]) in as few steps, a power of two up to 64, as keep the interpolated
/// matrices within 1e-4 of the scale of the motion from the true ones half way between steps. Nothing moves
/// where all places are equal.
Motion followed(const std::function<Transform(double)>& placeAt);

}  // namespace vlx::render
