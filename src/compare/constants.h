#pragma once

#include <limits>

namespace vlx {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
/// Added to what relative errors are divided by.
inline constexpr double kRelativeFloor = 0.01;

}  // namespace vlx
