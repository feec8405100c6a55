#pragma once

namespace vlx {

/// Rows of a dump or picture that are held at once.
inline constexpr int kBandRows = 16;

}  // namespace vlx
