#pragma once

namespace vlx {

/// The processes that wait for processors, averaged over a minute; NaN where it is not known.
double loadAverage();

}  // namespace vlx
