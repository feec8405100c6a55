#pragma once

#include <array>
#include <optional>

#include "render/math/vec.h"

namespace vlx::render {

/// Affine map of space, rows of [A | b], in double: products along deep node trees stay exact enough.
struct Transform {
    std::array<std::array<double, 4>, 3> m{{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

    Vec3 point(const Vec3& p) const { return apply(p, 1); }
    Vec3 vector(const Vec3& v) const { return apply(v, 0); }
    /// A normal (not normalised), |det A| A^-T n: by the cofactors of A, which also exist when A is singular.
    /// The front of a surface stays its front, also under reflection.
    Vec3 normal(const Vec3& n) const;
    double determinant() const;
    /// Nothing when A is singular.
    std::optional<Transform> inverse() const;

  private:
    Vec3 apply(const Vec3& v, double w) const {
        const auto row = [&](const std::array<double, 4>& r) {
            return static_cast<float>(r[0] * v.x + r[1] * v.y + r[2] * v.z + r[3] * w);
        };
        return {row(m[0]), row(m[1]), row(m[2])};
    }
};

/// First b, then a.
Transform operator*(const Transform& a, const Transform& b);

}  // namespace vlx::render
