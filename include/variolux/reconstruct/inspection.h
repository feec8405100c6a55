#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/geostat/empirical_variogram.h"
#include "variolux/geostat/variogram_model.h"

namespace vlx {

/// How well each datum is predicted from the others of its kriging system.
struct CrossValidation {
    int data = 0;                ///< that can be predicted; none: what follows is 0
    double rmse = 0;             ///< root mean squared residual, summed over R, G, B
    double meanSquareScore = 0;  ///< mean of squared residual / its kriging variance: 1 if the model is right
};

/// Everything behind one region's estimate, to be looked at: what the report's variogram inspector shows. Any
/// method that works by regions can offer it. As JSON (field "inspection" of a region in vlx-krige's
/// --diagnostics file; numbers have five digits):
///
///     "neighbourhood": {"x", "y", "width", "height"}   pixels whose samples were used
///     "distance": "pixels"                             what the variogram's distance is, with its unit
///     "pairs": 7140                                    in the cloud (paper) or the classes (default)
///     "cloud": [[distance, semivariance], ...]         half squared differences less their noise: an even
///                                                      choice of the cloud; the default method has none
///     "classes": [{"distance", "semivariance", "standardError", "pairs"}, ...]
///     "model": null, or {"nugget", "structures": [{"type", "sill", "range", "shape"}, ...],
///                        "curve": [[distance, semivariance], ...]}
///     "crossValidation": null, or {"data", "rmse", "meanSquareScore"}
///     "fallbacks": ["...", ...]                        what did not go as planned, in words
///
/// Semivariances are summed over R, G, B, in squared radiance.
struct RegionInspection {
    Window neighbourhood;
    std::string distance;
    std::int64_t pairs = 0;
    std::vector<std::array<double, 2>> cloud;
    std::vector<VariogramBin> classes;
    VariogramModel model{.nugget = 0, .structures = {}};  ///< no structures: none was fitted
    CrossValidation crossValidation;                      ///< data = 0: there was none
    std::vector<std::string> fallbacks;
};

}  // namespace vlx
