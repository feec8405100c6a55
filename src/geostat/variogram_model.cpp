#include "variolux/geostat/variogram_model.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <sstream>

namespace vlx {
namespace {

/// A unit structure and its derivatives at one u.
struct UnitValue {
    double gamma = 0;   ///< 1 - rho
    double rho = 1;     ///< to full relative accuracy where gamma is near 1
    double slope = 0;   ///< u d gamma / d u
    double dShape = 0;  ///< d gamma / d shape
};

/// The general Matern structure as a mixture of Gaussian structures. From the integral representation of
/// K_nu (DLMF 10.32.10),
///     rho(u) = 1/Gamma(nu) Int_0^inf s^(nu-1) e^(-s) e^(-u^2 / 4s) ds,
/// so that with s = e^x
///     gamma(u) = Int w(x) (1 - exp(-u^2/4 e^(-x))) dx / Int w(x) dx,   w(x) = exp(nu x - e^x).
/// Every term is positive: gamma is accurate relative to itself down to the smallest u and across integer nu,
/// where the usual series cancel. The trapezoidal rule converges exponentially (w is entire; the step below
/// leaves 1e-16), normalising by the same sum keeps gamma in [0, 1], and the left tail, where w is nearly
/// e^(nu x), is summed as geometric series. The derivative by nu is a covariance under the mixture.
UnitValue maternMixture(double nu, double u) {
    if (u == 0) return {};
    if (std::isnan(u)) return {u, u, u, u};
    if (u > 750) return {1, 0, 0, 0};
    const double step = std::min(0.2, 0.65 / std::sqrt(nu));
    const double logQuarter = 2 * (std::log(u) - std::log(2.0));
    const double peak = nu * std::log(nu) - nu;
    const double last = std::log(nu + 10 * std::sqrt(nu) + 50);
    double first = std::min(logQuarter - std::log(40.0), std::log(2e-3));
    // Left of `empty` the mixture has no weight, even relative to a small gamma.
    const double empty = nu > 1 ? std::log(nu) - 2 - 50 / (nu - 1) : -std::numeric_limits<double>::infinity();
    const bool tail = empty < first;
    first = std::max(first, empty);

    double weight = 0, gamma = 0, rho = 0, slope = 0, weightMoment = 0, gammaMoment = 0;
    double x = last;
    for (;; x -= step) {
        const double w = std::exp(nu * x - std::exp(x) - peak);
        const double r = std::exp(logQuarter - x);
        const double e = std::exp(-r);
        const double g = -std::expm1(-r);
        weight += w;
        gamma += w * g;
        rho += w * e;
        if (r < 700) slope += 2 * w * r * e;
        weightMoment += w * x;
        gammaMoment += w * g * x;
        if (x < first) break;
    }
    if (tail) {
        double factor = 1;  // (-1)^m / m!
        for (int m = 0; m < 7; factor /= -++m) {
            const double a = nu + m;
            const double geometric = factor * std::exp(a * x - peak) / std::expm1(a * step);
            const double moment = geometric * (x - step / -std::expm1(-a * step));
            weight += geometric;
            gamma += geometric;
            weightMoment += moment;
            gammaMoment += moment;
        }
    }
    gamma /= weight;
    return {std::min(gamma, 1.0), rho / weight, slope / weight,
            (gammaMoment - gamma * weightMoment) / weight};
}

/// e^u - 1 - u - ... - u^(terms-1)/(terms-1)!: the tail of the exponential series, positive terms only.
double exponentialTail(double u, int terms) {
    double term = 1;
    for (int k = 1; k <= terms; ++k) term *= u / k;
    double sum = 0;
    for (int k = terms; term > 1e-17 * sum && term > 0; term *= u / ++k) sum += term;
    return sum;
}

/// Matern of shape 1/2, 3/2, 5/2: rho = e^-u, (1+u) e^-u, (1+u+u^2/3) e^-u.
UnitValue maternHalfInteger(int twiceShape, double u) {
    const double e = std::exp(-u);
    double rho = e, gamma = -std::expm1(-u);
    if (twiceShape == 3) {
        rho = e == 0 ? 0 : (1 + u) * e;
        gamma = u < 1 ? e * exponentialTail(u, 2) : 1 - rho;
    } else if (twiceShape == 5) {
        rho = e == 0 ? 0 : (1 + u + u * u / 3) * e;
        gamma = u < 1 ? e * (u * u / 6 + exponentialTail(u, 3)) : 1 - rho;
    }
    return {gamma, rho, 0, 0};
}

UnitValue unitValue(StructureType type, double shape, double u) {
    UnitValue v;
    switch (type) {
        case StructureType::Spherical:
            v.gamma = u >= 1 ? 1 : u * (1.5 - 0.5 * u * u);
            v.rho = u >= 1 ? 0 : (1 - u) * (1 - u) * (1 + 0.5 * u);
            return v;
        case StructureType::Exponential:
            v.gamma = -std::expm1(-u);
            v.rho = std::exp(-u);
            return v;
        case StructureType::Gaussian:
            v.gamma = -std::expm1(-u * u);
            v.rho = std::exp(-u * u);
            return v;
        case StructureType::Stable: {
            const double p = std::pow(u, shape);
            v.gamma = -std::expm1(-p);
            v.rho = std::exp(-p);
            return v;
        }
        case StructureType::Matern:
            if (shape == 0.5) return maternHalfInteger(1, u);
            if (shape == 1.5) return maternHalfInteger(3, u);
            if (shape == 2.5) return maternHalfInteger(5, u);
            return maternMixture(shape, u);
        case StructureType::Linear:
            v.gamma = u;
            v.rho = -std::numeric_limits<double>::infinity();
            return v;
    }
    return v;
}

/// Value and derivatives; u > 0.
UnitValue unitDerivatives(StructureType type, double shape, double u) {
    if (type == StructureType::Matern) return maternMixture(shape, u);
    UnitValue v = unitValue(type, shape, u);
    switch (type) {
        case StructureType::Spherical:
            v.slope = u < 1 ? 1.5 * u * (1 - u) * (1 + u) : 0;
            break;
        case StructureType::Exponential:
            v.slope = v.rho > 0 ? u * v.rho : 0;
            break;
        case StructureType::Gaussian:
            v.slope = v.rho > 0 ? 2 * u * u * v.rho : 0;
            break;
        case StructureType::Stable: {
            const double p = std::pow(u, shape);
            v.slope = v.rho > 0 ? shape * p * v.rho : 0;
            v.dShape = v.rho > 0 && p > 0 ? std::log(u) * p * v.rho : 0;
            break;
        }
        case StructureType::Linear:
            v.slope = u;
            break;
        case StructureType::Matern:
            break;
    }
    return v;
}

std::string found(double value) {
    std::ostringstream text;
    text << ", found " << value;
    return text.str();
}

}  // namespace

std::optional<std::string> VariogramModel::validate() const {
    if (!(nugget >= 0) || !std::isfinite(nugget)) return "nugget must be >= 0 and finite" + found(nugget);
    for (std::size_t i = 0; i < structures.size(); ++i) {
        const VariogramStructure& s = structures[i];
        const std::string of = " of structure " + std::to_string(i + 1) + " must be ";
        if (!(s.sill >= 0) || !std::isfinite(s.sill)) return "sill" + of + ">= 0 and finite" + found(s.sill);
        if (!(s.range > 0) || !std::isfinite(s.range))
            return "range" + of + "positive and finite" + found(s.range);
        if (s.type == StructureType::Stable && !(s.shape > 0 && s.shape <= 2))
            return "shape (alpha)" + of + "in (0, 2]" + found(s.shape);
        if (s.type == StructureType::Matern && !(s.shape > 0 && std::isfinite(s.shape)))
            return "shape (nu)" + of + "positive and finite" + found(s.shape);
    }
    return std::nullopt;
}

double VariogramModel::sill() const {
    if (!bounded()) return std::numeric_limits<double>::infinity();
    double sum = nugget;
    for (const VariogramStructure& s : structures) sum += s.sill;
    return sum;
}

bool VariogramModel::bounded() const {
    return std::none_of(structures.begin(), structures.end(), [](const VariogramStructure& s) {
        return s.type == StructureType::Linear && s.sill > 0;
    });
}

double unitSemivariance(StructureType type, double shape, double u) {
    return unitValue(type, shape, u).gamma;
}

double semivariance(const VariogramModel& model, double h) {
    if (h == 0) return 0;
    double sum = model.nugget;
    for (const VariogramStructure& s : model.structures)
        if (s.sill > 0) sum += s.sill * unitSemivariance(s.type, s.shape, h / s.range);
    return sum;
}

double covariance(const VariogramModel& model, double h) {
    assert(model.bounded());
    double sum = h == 0 ? model.nugget : 0;
    for (const VariogramStructure& s : model.structures)
        if (s.sill > 0) sum += s.sill * (h == 0 ? 1 : unitValue(s.type, s.shape, h / s.range).rho);
    return sum;
}

Eigen::VectorXd semivarianceGradient(const VariogramModel& model, double h) {
    Eigen::VectorXd gradient =
        Eigen::VectorXd::Zero(1 + 3 * static_cast<Eigen::Index>(model.structures.size()));
    if (h == 0) return gradient;
    gradient[0] = 1;
    Eigen::Index at = 1;
    for (const VariogramStructure& s : model.structures) {
        const UnitValue v = unitDerivatives(s.type, s.shape, h / s.range);
        gradient[at] = v.gamma;
        gradient[at + 1] = -s.sill * v.slope / s.range;
        gradient[at + 2] = s.sill * v.dShape;
        at += 3;
    }
    return gradient;
}

Eigen::Matrix2d anisotropyTransform(const Anisotropy& anisotropy) {
    assert(anisotropy.ratio > 0);
    const double c = std::cos(anisotropy.angle), s = std::sin(anisotropy.angle);
    Eigen::Matrix2d transform;
    transform << c, s, -s / anisotropy.ratio, c / anisotropy.ratio;
    return transform;
}

}  // namespace vlx
