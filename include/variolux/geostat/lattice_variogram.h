#pragma once

#include "variolux/geostat/empirical_variogram.h"

namespace vlx {

/// width x height cells, `spacing` apart along both axes.
struct Lattice {
    Eigen::Index width = 0;
    Eigen::Index height = 0;
    double spacing = 1;
};

/// empiricalVariogram() of data in cells of a lattice, by Matheron's estimator and without what judges it
/// (standardError is NaN, nullError and nullCorrelation are empty, variance is 0). Datum i (row i of
/// `values`) lies in `cells[i]`, counted row by row, no two in the same; what is left out is as there.
///
/// All pairs of one offset have the same distance: their class is found once, and they are summed in whole
/// vectors. Cost: (width height)^2 / 2 pairs of cells, with data or without, at about 1 ns (3 channels).
EmpiricalVariogram latticeVariogram(const Lattice& lattice, const std::vector<Eigen::Index>& cells,
                                    const Eigen::Ref<const Eigen::MatrixXd>& values,
                                    const std::vector<double>& edges,
                                    const Eigen::Ref<const Eigen::VectorXd>& errorVariances);

}  // namespace vlx
