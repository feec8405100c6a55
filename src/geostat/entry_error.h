#pragma once

#include <algorithm>

#include "geostat/kriging_names.h"
#include "variolux/geostat/variogram_model.h"

/// How far the computed entries of a covariance matrix are from those of the model.
namespace vlx {

/// Of a covariance, relative to the sill: a few roundings of the squared distance and of the model.
inline constexpr double kEntryRounding = 4 * kEpsilon;

/// What transformed coordinates of size `size` add, in units of the sills: without a transform differences
/// are exact to rounding. |gamma(h + d) - gamma(h)| is at most gamma(d) where gamma is concave, sill d /
/// range for the smoother structures.
inline double placeError(const VariogramModel& model, double size) {
    const double rounding = 8 * kEpsilon * size;
    double error = 0;
    for (const VariogramStructure& s : model.structures)
        if (s.sill > 0)
            error +=
                s.sill * std::max(rounding / s.range, unitSemivariance(s.type, s.shape, rounding / s.range));
    return error;
}

}  // namespace vlx
