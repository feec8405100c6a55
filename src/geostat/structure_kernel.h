#pragma once

#include "base/simd.h"
#include "variolux/geostat/variogram_model.h"

namespace vlx::kernels {

using namespace simd;

/// rho, or 1 - rho = gamma (not for Matern, where it would cancel), of a unit structure at squared distance
/// u2 in units of its range. halfShape: alpha / 2 of Stable; nu: Matern's, 1/2, 3/2 or 5/2.
template <class V>
[[gnu::always_inline]] inline V structureValue(StructureType type, V u2, V halfShape, double nu,
                                               bool semivariance) {
    switch (type) {
        case StructureType::Spherical: {
            const V u = minimum(squareRoot(u2), spread<V>(1.0));
            return semivariance ? u * (1.5 - 0.5 * u * u) : (1.0 - u) * (1.0 - u) * (1.0 + 0.5 * u);
        }
        case StructureType::Exponential: {
            const V u = squareRoot(u2);
            return semivariance ? decayComplement(u) : decay(u);
        }
        case StructureType::Gaussian:
            return semivariance ? decayComplement(u2) : decay(u2);
        case StructureType::Stable: {
            const V x = power(u2, halfShape);
            return semivariance ? decayComplement(x) : decay(x);
        }
        case StructureType::Matern: {
            const V u = squareRoot(u2);
            if (nu == 0.5) return decay(u);
            // exp(-u) is 0 beyond 708: the polynomial must not overflow there.
            const V bounded = minimum(u, spread<V>(1e3));
            if (nu == 1.5) return (1.0 + bounded) * decay(u);
            return (1.0 + bounded + bounded * bounded * (1.0 / 3.0)) * decay(u);
        }
        case StructureType::Linear:
            return squareRoot(u2);
    }
    return u2;
}

}  // namespace vlx::kernels
