#pragma once

#include <Eigen/Core>

#include "reconstruct/common/region.h"
#include "variolux/reconstruct/paper.h"
#include "variolux/reconstruct/reconstruction.h"

/// One region of the paper's method.
namespace vlx {

/// The estimates of one region.
struct RegionEstimate {
    Eigen::MatrixXd values;  ///< pixels x c, row by row from the region's top left
    Eigen::MatrixXd stddev;  ///< pixels x c: standard deviation of the error, as far as the data tell
    /// pixels x 3: sum of w_i^2 / n_i, w the data's weights and n their counts, over the data whose samples
    /// do not differ (within the rounding of half floats) or, where no pixel holds two, whose noise by the
    /// nugget is below unseenVariance(): what one sample's variance, which they do not tell, adds.
    Eigen::MatrixXd agreed;
    RegionDiagnostics diagnostics;
    RegionInspection inspection;  ///< only when asked for
};

/// Krige one region. The first three columns of `data.means` are R, G, B; they carry the variogram; further
/// columns are estimated with the same weights.
///
/// 1. Dissimilarity of two data (section 4): half the squared norm of their RGB difference, less the mean of
///    their error variances s^2/n: what noise adds is known and taken off, not fitted.
/// 2. A stable model gamma(h) = c0 + c (1 - exp(-(h/r)^alpha)) is fitted to it in classes of
///    distance on the image plane.
/// 3. Composite distance (section 6): h^2 = dx^2 + dy^2 + k^2 |dz|^2 with dz the difference of two RGB
///    estimates, each taken from the region's arithmetic mean m. A datum's estimate is its mean; a target's
///    is its pixel's arithmetic mean, drawn towards m by how much of it is noise: m + (pixel mean - m) S /
///    (S + e), with S the variance between the region's data less their errors, e the error variance of the
///    pixel mean. k makes one standard deviation of the region's data as long as one pixel, times the share
///    of their variance that is no noise, S / variance: noise alone does not make neighbours distant; a
///    singular value, many deviations away from all others, loses its weight.
/// 4. The system (11), in covariance form (the errors with a plus on the diagonal of the covariances), is
///    factorised once; a pixel's estimate is the mean over its cells of the kriged field (a block target).
///    The nugget is variation between cells that is no noise: a pixel contains that of its own cells.
///
/// Where no pixel holds two samples their errors are unknown: the fitted nugget is then taken for noise,
/// except with the whole image as region, whose samples count as exact (the paper's figure 1).
///
/// A region that cannot be kriged gets its mean; `diagnostics.outcome` says why. Pixels whose solution is
/// less accurate than geostat's tolerance are counted. Never throws for numerical reasons; every value
/// returned is finite. With `inspect`, `inspection` tells everything behind the estimate, which is not
/// changed by that.
RegionEstimate krigeRegion(const RegionData& data, const Paper& options, bool inspect = false);

}  // namespace vlx
