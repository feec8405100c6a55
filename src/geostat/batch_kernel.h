#pragma once

#include <Eigen/Core>
#include <vector>

#include "geostat/kernels.h"

/// Kriging of several systems at once, one a vector lane. All lanes have the same shape; a lane's numbers
/// depend on nothing in the others, and operations have one order, so that results do not depend on how
/// systems are grouped, nor on the number of lanes.
namespace vlx::kernels {

/// Inputs, work space and outputs of one batch. Every array is interleaved: entry e of lane l is at [e *
/// lanes + l]. Entries of unused lanes and of padding rows must be set too (see kriging_batch.cpp).
struct Batch {
    Eigen::Index lanes = 0;
    Eigen::Index n = 0;        ///< data, a multiple of four (padding rows are inactive)
    Eigen::Index axes = 0;     ///< coordinates of the distance
    Eigen::Index drift = 0;    ///< p
    Eigen::Index columns = 0;  ///< c
    Eigen::Index targets = 0;  ///< m

    std::vector<StructureType> types;
    std::vector<double> sill, inverseSquaredRange, halfShape;  ///< [structure]; halfShape as in ModelColumns
    std::vector<double> fixedShape;  ///< [structure], one for all lanes: nu of Matern

    std::vector<double> places;    ///< [datum][axis]
    std::vector<double> active;    ///< [datum]: 1, or 0 for padding
    std::vector<double> diagonal;  ///< [datum]: nugget + error variance
    std::vector<double> special;   ///< [datum]: 1 where a target at zero distance needs the general solver
    std::vector<double> points;    ///< [target][axis]
    std::vector<double> f0;        ///< [target][drift column]
    /// Rows of n entries: the covariance matrix, then right-hand sides: drift columns, values, and c0 of the
    /// targets. The caller sets drift columns and values.
    std::vector<double> matrix;

    std::vector<double> estimate;  ///< [target][column]
    std::vector<double> variance;  ///< [target], not clamped
    std::vector<double> squares;   ///< [column]: |L^-1 z|^2
    std::vector<double>
        lowest;  ///< smallest pivot relative to its variance; below 0: needs the general solver
    std::vector<double> dependence;  ///< smallest norm of a drift column after orthogonalisation, relative

    /// Allocates for the shape; zero everywhere.
    void resize();
    double* row(Eigen::Index i) { return matrix.data() + i * n * lanes; }
    Eigen::Index driftRow() const { return n; }
    Eigen::Index valueRow() const { return n + drift; }
    Eigen::Index targetRow() const { return n + drift + columns; }
};

/// Lanes of this processor's vectors: 2, 4 or 8.
Eigen::Index batchLanes(InstructionSet set = instructionSet());

void solveBatch(Batch& batch);

}  // namespace vlx::kernels
