#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

/// Variogram models (Chiles and Delfiner, Geostatistics, 2nd ed., ch. 2; Wackernagel, Multivariate
/// Geostatistics).
///
/// Terms: the semivariance gamma(h) = 1/2 Var[Z(x) - Z(x + h)] of a random field Z at lag h; its *nugget*
/// (the jump at the origin, a property of the field), *partial sill* (a structure's variance), *sill* (nugget
/// + partial sills, the variance of Z where it is finite) and *range* (the structure's scale of distance).
/// Monte Carlo noise is never part of a model: it is a known measurement-error variance of each datum
/// (kriging.h).
namespace vlx {

/// The shape of one structure, as a function of u = h / range, h > 0; rho is its correlation, gamma = sill (1
/// - rho).
enum class StructureType {
    Spherical,    ///< rho = 1 - 1.5 u + 0.5 u^3 for u < 1, else 0: `range` is the true range
    Exponential,  ///< rho = exp(-u): practical range (95 % of the sill) 3 range
    Gaussian,     ///< rho = exp(-u^2): practical range 1.73 range; infinitely smooth, ill-conditioned without
                  ///< errors
    Stable,  ///< rho = exp(-u^shape), 0 < shape <= 2: METHOD.md's model, eq. (12); exponential at 1, Gaussian
             ///< at 2
    Matern,  ///< rho = 2^(1-shape)/Gamma(shape) u^shape K_shape(u), shape > 0 (smoothness)
    Linear,  ///< gamma = sill u, unbounded: an intrinsic field; `sill` is the semivariance at h = range
};

/// One structure of a nested model. Unit of sill: values squared; of range: coordinates.
struct VariogramStructure {
    StructureType type = StructureType::Exponential;
    double sill = 1;   ///< partial sill, >= 0
    double range = 1;  ///< > 0
    double shape = 1;  ///< alpha of Stable, nu of Matern; unused by the others

    bool operator==(const VariogramStructure&) const = default;
};

/// gamma(h) = nugget [h > 0] + sum of structures. A value type.
struct VariogramModel {
    double nugget = 0;  ///< of the field itself: seen by a target that is bitwise at a datum; >= 0
    std::vector<VariogramStructure> structures;

    bool operator==(const VariogramModel&) const = default;

    /// The broken constraint in words ("range of structure 1 must be positive and finite, found 0"), or
    /// nothing.
    std::optional<std::string> validate() const;

    /// nugget + partial sills; infinite when a structure is unbounded with a positive sill.
    double sill() const;
    bool bounded() const;
};

/// gamma(h) for h >= 0; gamma(0) = 0. Accurate relative to itself for small h (expm1, series), never sill
/// minus a rounded covariance. Infinite or NaN only for infinite or NaN h.
double semivariance(const VariogramModel& model, double h);

/// C(h) = sill - gamma(h), with C(0) = sill. Only for bounded models (asserted).
double covariance(const VariogramModel& model, double h);

/// d gamma(h) / d parameter, in the order nugget, then sill, range, shape of each structure (1 + 3 k values);
/// the derivative by an unused shape is 0. h >= 0.
Eigen::VectorXd semivarianceGradient(const VariogramModel& model, double h);

/// The unit structure 1 - rho(u) at u = h / range >= 0, for callers that fill matrices of one structure;
/// Linear gives u. `shape` as in VariogramStructure. Same accuracy as semivariance().
double unitSemivariance(StructureType type, double shape, double u);

/// Geometric anisotropy in the plane: coordinates are rotated so that `angle` (radians, counter-clockwise
/// from +x) becomes the first axis, then the second axis is stretched by 1 / ratio, so that a model with
/// range a along `angle` has range a * ratio across it. 0 < ratio.
struct Anisotropy {
    double angle = 0;
    double ratio = 1;
};

/// The 2 x 2 matrix T of that change of coordinates: the distance is |T (x - y)|. A composite distance (image
/// plane, features, colour) is the same idea with more columns: scale each coordinate, then use the Euclidean
/// distance.
Eigen::Matrix2d anisotropyTransform(const Anisotropy& anisotropy);

}  // namespace vlx
