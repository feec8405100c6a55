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
    double frame = 0;         ///< time from each frame of a sequence to the next; 0: a single picture
};

/// Places at equal steps of time, the first when the shutter opens, the last when it closes. Between two
/// of them matrices are interpolated linearly, as Embree does. Empty or a single place: nothing moves.
struct Motion {
    std::vector<Transform> places;
    std::string cause;  ///< the animation and the node it moves, for messages

    bool moves() const { return places.size() > 1; }
    /// `time`: 0 when the shutter opens, 1 when it closes. Not of an empty one.
    Transform at(float time) const;
};

/// How something that the neighbouring frames have elsewhere moves while the shutter is open in those: by
/// what takes its points to the world there from where the scene holds them. Neither is empty.
struct Course {
    Motion before;
    Motion after;
};

/// Follows `placeAt` (of a time in [0, 1]) in as few steps, a power of two up to 64, as keep the interpolated
/// matrices within 1e-4 of the scale of the motion from the true ones half way between steps. Nothing moves
/// where all places are equal.
Motion followed(const std::function<Transform(double)>& placeAt);

/// Whether two motions are one but for rounding.
bool alike(const Motion& a, const Motion& b);

}  // namespace vlx::render
