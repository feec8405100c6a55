#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "variolux/base/window.h"
#include "variolux/dump/band.h"

namespace vlx {

/// The data of one region: means of the samples in square sub-pixel cells (METHOD.md section 6), n of them,
/// of c channels. Only cells with at least one usable sample are data.
struct RegionData {
    Window pixels;                   ///< the region
    int cellsPerPixel = 1;           ///< along each axis; 1 when samples have no positions
    Eigen::MatrixXd positions;       ///< n x 2: centres of the cells, raster pixels
    Eigen::MatrixXd means;           ///< n x c: arithmetic means
    Eigen::VectorXd counts;          ///< n: samples in each cell
    Eigen::MatrixXd errorVariances;  ///< n x c: of the means (below); 0 when unknown
    bool varianceKnown = false;      ///< false when no cell of a pixel or smaller holds two samples
    std::int64_t samples = 0;        ///< usable samples
    std::int64_t dropped = 0;        ///< samples with a non-finite R, G or B: left out

    int size() const { return static_cast<int>(counts.size()); }
    /// The index of the pixel of the region, row by row, that datum i lies in.
    int pixelOf(Eigen::Index i) const;
};

/// Which channels of a band hold what. Positions are optional (-1).
struct BandLayout {
    /// Channel indices of R, G, B and others to reconstruct with the same weights.
    std::vector<int> radiance;
    int x = -1;  ///< sample.x
    int y = -1;  ///< sample.y
};

/// Gathers the samples of the pixels `region`, which must lie within the band.
///
/// A sample belongs to the cell of its own pixel that its position falls in; positions outside the pixel (a
/// wide pixel filter) go to the nearest cell of the pixel, positions that are not finite to its centre. A
/// channel beyond the first three that is not finite counts as 0.
///
/// An error variance is that of one sample over the number of samples in the cell. One sample's is the mean
/// residual variance over the region (METHOD.md section 3): the pooled unbiased variance sum (z - mean of its
/// cell)^2 / sum (count - 1), over cells of 1, 1/2, 1/4 ... pixel. The finest size whose cells hold two
/// samples or more on average is taken, so that the image's own variation adds as little as possible to it.
/// An adaptive sampler puts its samples where the variance is: pixels of very different counts (a factor of
/// four) are pooled apart; those with one sample take the variance between them. Sums are formed about the
/// region's first sample: values far from zero cancel nothing.
RegionData gatherRegion(const SampleBand& band, const BandLayout& layout, const Window& region,
                        int cellsPerPixel);

}  // namespace vlx
