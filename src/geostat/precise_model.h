#pragma once

#include <boost/math/special_functions/bessel.hpp>
#include <boost/math/special_functions/gamma.hpp>
#include <boost/multiprecision/cpp_bin_float.hpp>
#include <boost/multiprecision/eigen.hpp>
#include <vector>

#include "variolux/geostat/variogram_model.h"

namespace vlx {

/// A number of that many decimal digits.
template <unsigned digits>
using PreciseReal = boost::multiprecision::number<boost::multiprecision::cpp_bin_float<digits>,
                                                  boost::multiprecision::et_off>;

/// A variogram model without its nugget, with the digits of Real; its parameters are taken as exact.
template <class Real>
class PreciseModel {
  public:
    explicit PreciseModel(const VariogramModel& model) : bounded_(model.bounded()) {
        for (const VariogramStructure& s : model.structures) {
            if (s.sill == 0) continue;
            structures_.push_back({s, Real(s.range) * Real(s.range), Real(0)});
            if (s.type == StructureType::Matern)
                structures_.back().factor =
                    pow(Real(2), 1 - Real(s.shape)) / boost::math::tgamma(Real(s.shape));
        }
    }

    bool bounded() const { return bounded_; }

    /// Of a squared distance.
    Real covariance(const Real& squared) const {
        Real sum = 0;
        for (const Structure& s : structures_) sum += s.given.sill * correlation(s, squared / s.squaredRange);
        return sum;
    }
    Real semivariance(const Real& squared) const {
        Real sum = 0;
        for (const Structure& s : structures_) {
            const Real u2 = squared / s.squaredRange;
            const bool linear = s.given.type == StructureType::Linear;
            sum += s.given.sill * (linear ? Real(sqrt(u2)) : Real(1 - correlation(s, u2)));
        }
        return sum;
    }

  private:
    struct Structure {
        VariogramStructure given;
        Real squaredRange;
        Real factor;  // Matern: 2^(1-nu) / Gamma(nu)
    };

    static Real correlation(const Structure& s, const Real& u2) {
        if (u2 == 0) return 1;
        switch (s.given.type) {
            case StructureType::Spherical: {
                const Real u = sqrt(u2);
                return u >= 1 ? Real(0) : Real((1 - u) * (1 - u) * (1 + u / 2));
            }
            case StructureType::Exponential:
                return decay(sqrt(u2));
            case StructureType::Gaussian:
                return decay(u2);
            case StructureType::Stable:
                return decay(pow(u2, Real(s.given.shape) / 2));
            case StructureType::Matern: {
                const Real u = sqrt(u2);
                if (s.given.shape == 0.5) return decay(u);
                if (s.given.shape == 1.5) return (1 + u) * decay(u);
                if (s.given.shape == 2.5) return (1 + u + u2 / 3) * decay(u);
                if (u > kBeyond) return 0;
                return s.factor * pow(u, Real(s.given.shape)) *
                       boost::math::cyl_bessel_k(Real(s.given.shape), u);
            }
            case StructureType::Linear:
                break;
        }
        return 0;
    }

    /// exp(-x) is below every number of digits here.
    static constexpr double kBeyond = 1e6;
    static Real decay(const Real& x) { return x > kBeyond ? Real(0) : Real(exp(-x)); }

    std::vector<Structure> structures_;
    bool bounded_;
};

}  // namespace vlx
