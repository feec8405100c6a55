#pragma once

#include <Eigen/Core>
#include <vector>

#include "variolux/geostat/variogram_model.h"

/// The inner loops of kriging, written with vectors of eight doubles (or sixteen floats). Each is compiled
/// for SSE, AVX2 and AVX-512 and chosen at run time. Multiplications and additions are never contracted and
/// sums have one order, so results are bit-identical on all of them.
namespace vlx::kernels {

enum class InstructionSet { Base, Avx2, Avx512 };

/// The best one of this processor.
InstructionSet instructionSet();

/// A row count rounded up so that columns can be read in whole vectors and do not share cache sets.
Eigen::Index leadingDimension(Eigen::Index rows);

/// Cholesky factorisation in place of the leading n x n block of a column-major matrix (lower half), with a
/// leading dimension from leadingDimension(rows). Rows n .. rows - 1 are right-hand sides b' that are carried
/// along: they become (L^-1 b)'. The strict upper half is overwritten with anything. Rows beyond `rows` must
/// be finite. Returns the smallest squared pivot; not above zero (or NaN) if the matrix is not positive
/// definite.
double cholesky(double* a, Eigen::Index n, Eigen::Index rows, Eigen::Index leading,
                InstructionSet set = instructionSet());
float cholesky(float* a, Eigen::Index n, Eigen::Index rows, Eigen::Index leading,
               InstructionSet set = instructionSet());

/// Solves L y = b, or L' y = b if `upper`, for m right-hand sides, in place: each is a row of x, which is
/// column-major with `step`, a multiple of 16 and at least m, from column to column. L is the factor of
/// cholesky(); all rows of x must be finite.
void solveTriangle(const double* l, Eigen::Index n, Eigen::Index leading, bool upper, double* x,
                   Eigen::Index m, Eigen::Index step, InstructionSet set = instructionSet());

/// A variogram model without its nugget, prepared for whole columns of values.
class ModelColumns {
  public:
    ModelColumns() = default;
    explicit ModelColumns(const VariogramModel& model);

    /// gamma, or C = sill - gamma, between `point` and places [first, last): places are axis-major with
    /// `leading` doubles an axis, out[i] belongs to place i. Entries up to the next multiples of eight around
    /// the interval are also written.
    void semivariances(const double* places, Eigen::Index leading, Eigen::Index axes, const double* point,
                       Eigen::Index first, Eigen::Index last, double* out) const;
    void covariances(const double* places, Eigen::Index leading, Eigen::Index axes, const double* point,
                     Eigen::Index first, Eigen::Index last, double* out) const;

    /// The sum over the points of a block (one a row), times their weights, of the same values, to places
    /// [0, last): what their last coordinates, equal in all of them, add to distances is found once. Entries
    /// up to the next multiple of eight are also written.
    void ofBlock(const double* places, Eigen::Index leading, const Eigen::MatrixXd& points,
                 const double* weights, Eigen::Index last, bool semivariance, double* out) const;

    struct Columns;
    struct Structure {
        StructureType type;
        double sill;
        double inverseSquaredRange;
        double halfShape;  ///< alpha / 2 of Stable; nu of Matern
    };

  private:
    void evaluate(Columns columns) const;

    std::vector<Structure> structures_;
    VariogramModel model_;
    bool vectorised_ = false;         // else: one value at a time (Matern of any shape, extreme ranges)
    bool closedSemivariance_ = true;  // Matern's 1 - rho cancels at small lags
};

}  // namespace vlx::kernels
